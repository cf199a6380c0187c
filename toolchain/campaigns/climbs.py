# SPDX-License-Identifier: Apache-2.0
"""Tables of whole climbs, all with perception in the loop."""
import collections
import random

from campaigns.engine import Figure, Page, Table, headline, rows

NOISES = ("white", "correlated")


def own_noise(seed):
    """Odd seeds have white noise, even ones correlated."""
    return NOISES[(seed + 1) % 2]


def worst_climb(summaries, *path, best=max):
    """(worst of a figure over the climbs that have it, that climb's seed), (None, None) where none has it."""
    values = []
    for summary in summaries:
        s = summary
        for key in path:
            s = s.get(key) if isinstance(s, dict) else None
        if s is not None:
            values.append((s, seed_of(summary)))
    return best(values, key=lambda v: v[0]) if values else (None, None)


def worst(summaries, *path, best=max):
    return worst_climb(summaries, *path, best=best)[0]


def seed_of(summary):
    words = summary["run"].split()
    return words[words.index("--seed") + 1] if "--seed" in words else "1"


def number(value, digits=1, unit=""):
    return "-" if value is None else f"{value:.{digits}f}{unit}"


def seeded(summaries, *path, best=max, digits=1):
    """The worst of a figure, in brackets the seed of its climb."""
    value, seed = worst_climb(summaries, *path, best=best)
    return "-" if value is None else f"{number(value, digits)} ({seed})"


def ratio(summaries, what):
    values = [v for s in summaries for v in (s.get(what) or {}).values()]
    return max(values) if values else None


FIGURES = {  # column: function of the summaries
    "climbed": lambda s: f"{sum(x.get('verdict') == 'pass' for x in s)} of {len(s)}",
    "s/step": lambda s: f"{number(worst(s, 'seconds_per_step', best=min), 2)}-{number(worst(s, 'seconds_per_step'), 2)}",
    "foothold mm, median; max": lambda s: f"{seeded(s, 'foothold_error_mm', 'median')}; {seeded(s, 'foothold_error_mm', 'max')}",
    "execution mm": lambda s: seeded(s, "execution_error_mm", "max"),
    "tracking x; z mm": lambda s: f"{number(worst(s, 'tracking_error_mm', 'x_max'))}; {number(worst(s, 'tracking_error_mm', 'z_max'))}",
    "CoM mm": lambda s: number(worst(s, "com_tracking_mm_max")),
    "sole margin mm": lambda s: seeded(s, "sole_margin_mm_min", best=min),
    "clearance mm": lambda s: seeded(s, "swing_clearance_mm_min", best=min),
    "torque; speed": lambda s: f"{number(ratio(s, 'torque_peak_ratio'), 2)}; {number(ratio(s, 'joint_speed_peak_ratio'), 2)}",
    "planes Hz": lambda s: seeded(s, "plane_rate_hz", best=min),
    "map age ms": lambda s: number(worst(s, "map_age_at_latch_ms", "max"), 0),
}
SHORT = ("climbed", "s/step", "foothold mm, median; max", "execution mm", "sole margin mm", "clearance mm", "planes Hz")


def figures(groups, columns=tuple(FIGURES)):
    """A table with a line for each group of climbs, worst figure of each."""
    return (rows(("climbs", *columns), [(name, *(FIGURES[c](summaries) for c in columns)) for name, summaries in groups.items()]) +
            "\n\nIn brackets the seed of the climb that a figure is of.")


def climbed(summaries):
    """Of README's table: all are to."""
    passed = sum(s.get("verdict") == "pass" for s in summaries)
    return Figure(passed, FIGURES["climbed"](summaries), "least", len(summaries), "all")


def least(value, asked=None, asked_text=None):
    return Figure(value, number(value), "least" if asked is not None else "", asked, asked_text)


def most(value, asked=None, asked_text=None):
    return Figure(value, number(value), "most" if asked is not None else "", asked, asked_text)


def pace(summaries, asked):
    return Figure(worst(summaries, "seconds_per_step"), FIGURES["s/step"](summaries), "most", asked)


def not_climbed(summaries):
    """Every climb that did not pass, with its own sentence and how to run it again."""
    bad = [s for s in summaries if s.get("verdict") != "pass"]
    if not bad:
        return ""
    return "\n\nNot climbed:\n\n" + "\n".join(f"- `polygmap climb {s['run']}`: {s.get('reason', '')}" for s in bad)


def outcomes(what, groups):
    """A table of how each group's climbs ended."""
    def line(summaries):
        fell = sum(bool(s.get("fell")) for s in summaries)
        climbed = sum(s.get("verdict") == "pass" for s in summaries)
        stopped = sum(s.get("ended_by") == "module" and s["steps_climbed"] < s["steps_total"] for s in summaries)
        over = sum(map(stands_over, summaries))
        rest = len(summaries) - climbed - stopped - fell
        return len(summaries), climbed, stopped, fell, rest, over, FIGURES["sole margin mm"](summaries)

    return rows((what, "climbs", "climbed", "stopped on both feet", "fell", "failed otherwise", "a sole over an edge", "least margin mm"),
                [(name, *line(s)) for name, s in groups.items()])


def stands_over(summary):
    """A sole stood over its tread's edge, or nobody knows."""
    margin = summary.get("sole_margin_mm_min")
    return margin < 0 if margin is not None else summary.get("steps_climbed", 1) > 0


def in_the_stairs(summary):
    """A foot touched the stairs as it swung, or nobody knows."""
    clearance = summary.get("swing_clearance_mm_min")
    return clearance <= 0 if clearance is not None else summary.get("steps_climbed", 1) > 0


def touches(summary):
    return stands_over(summary) or in_the_stairs(summary)


def grouped(engine, what, named):
    """named: {group: [arguments]} -> {group: summaries}, one run of the engine."""
    flat = [(group, a) for group, all_arguments in named.items() for a in all_arguments]
    groups = collections.defaultdict(list)
    for (group, _), summary in zip(flat, engine.climbs(what, [a for _, a in flat])):
        groups[group].append(summary)
    return dict(groups)


def falls(summaries):
    return f"{sum(bool(s.get('fell')) for s in summaries)} of {len(summaries)}"


def span(seeds):
    return f"seeds {min(seeds)}-{max(seeds)}" if len(seeds) > 1 else f"seed {min(seeds)}"


def physics(engine, seeds):
    named = {}
    for gait, steps in (("ds", 10), ("ds", 4), ("ss", 10)):
        for noise in NOISES:
            named[f"{gait}, {steps} steps, {noise}"] = [
                ["--gait", gait, "--steps", steps, "--noise", noise, "--seed", s] for s in seeds if gait == "ds" or s <= 10]
    groups = grouped(engine, "physics", named)
    everything = [s for g in groups.values() for s in g]
    ds = [s for name, g in groups.items() if name.startswith("ds") for s in g]
    ss = [s for name, g in groups.items() if name.startswith("ss") for s in g]
    text = (f"Stairs of 0.13 x 0.28 m under physics (`polygmap climb --gait G --steps N --noise K --seed S`), {span(seeds)}, `ss` up to 10; "
            "worst figure of each line's climbs.\n\n" + figures(groups) + not_climbed(everything) +
            "\n\nBeside the paper's trials (its Tables I and II; it has no figure of the other columns):\n\n" +
            rows(("", "s/step", "e_m mm", "planes Hz"), [
                ("paper, simulated, DS, 5 trials", "3.4-3.75", "10.3-12.4", "20-29"),
                ("this, simulated, `ds`", *(FIGURES[c](ds) for c in ("s/step", "execution mm", "planes Hz"))),
                ("paper, real, DS, 2 trials", "2.4-2.55", "11.4-12.1", "20-21"),
                ("paper, real, SS, 3 trials", "1.87-1.96", "22.2-33.4", "20-23"),
                ("this, simulated, `ss`", *(FIGURES[c](ss) for c in ("s/step", "execution mm", "planes Hz")))]))
    return Page(text, {
        "1 climbed": headline("stairs of 0.13 x 0.28 m climbed under physics, both gaits and noises", climbed(everything)),
        "2 pace ds": headline("seconds a step on them, both feet on every tread", pace(ds, 2.7)),
        "2 pace ss": headline("seconds a step on them, one foot on every tread", pace(ss, 1.6)),
        "3 foothold": headline("foothold error on them, worst", most(worst(everything, "foothold_error_mm", "max"), 12), " mm"),
        "3 foothold median": headline("foothold error on them, worst median", most(worst(everything, "foothold_error_mm", "median"), 5), " mm", False),
        "4 margin": headline("sole to its tread's edge on them, least", least(worst(everything, "sole_margin_mm_min", best=min), 0), " mm"),
        "4 swing": headline("swinging foot to the stairs, least", least(worst(everything, "swing_clearance_mm_min", best=min), 0), " mm", False),
        "5 planes": headline("pictures a second with every surface found, of 30, least on them; 20 to 29 in the paper",
                             least(worst(everything, "plane_rate_hz", best=min), 20))},
        {"docs/images/climb.svg": engine.picture(["--seed", 1])})


def kinematic(engine, seeds):
    rises = (0.13, 0.10, 0.17, 0.15, 0.12)
    groups = grouped(engine, "kinematic", {f"{n} noise": [
        ["--plant", "kinematic", "--seed", s, "--rise", rises[s % 5], "--noise", n] for s in seeds if own_noise(s) == n] for n in NOISES})
    everything = [s for g in groups.values() for s in g]
    return Page(f"Ten steps on the kinematic plant, rises of 0.10 to 0.17 m by the seed, {span(seeds)}.\n\n" +
                figures({**groups, "all": everything}) + not_climbed(everything), {})


def drawn(seed):
    """A climb drawn at random, the same for ever."""
    rng = random.Random(seed)
    return ["--rise", round(rng.uniform(0.10, 0.17), 3), "--tread", round(rng.uniform(0.28, 0.35), 3), "--steps", rng.randint(4, 10),
            "--gait", rng.choice(("ds", "ss")), "--noise", rng.choice(NOISES), "--seed", seed]


def at_random(engine, seeds):
    summaries = engine.climbs("random", [drawn(s) for s in seeds])
    groups = {g: [s for s in summaries if f"--gait {g}" in s["run"]] for g in ("ds", "ss")}
    return Page(f"Rises of 0.10 to 0.17 m, treads of 0.28 to 0.35 m, 4 to 10 steps, gait and noise drawn by the seed ({span(seeds)}), "
                "under physics.\n\n" + figures(groups) + not_climbed(summaries),
                {"1 climbed": headline("climbs drawn at random", climbed(summaries))})


def treads(engine, seeds):
    named = collections.defaultdict(list)
    for seed in seeds:
        for rise in (0.10, 0.12, 0.15, 0.17):
            for tread in (0.28, 0.31, 0.35):
                named[f"tread {tread:.2f} m"].append(["--rise", rise, "--tread", tread, "--steps", 6, "--seed", seed, "--noise", own_noise(seed)])
            named["tread 0.27 m, built evenly"].append(
                ["--rise", rise, "--tread", 0.27, "--jitter", 0, "--steps", 6, "--seed", seed, "--noise", own_noise(seed)])
    groups = grouped(engine, "treads", named)
    return Page(f"Rises of 0.10, 0.12, 0.15 and 0.17 m, six steps, `ds`, {span(seeds)}, under physics.\n\n" + figures(groups) +
                not_climbed([s for g in groups.values() for s in g]), {})


def nosing(engine, seeds):
    named = {}
    for depth in (0.01, 0.02, 0.025, 0.03, 0.04):
        for plant in ("mujoco", "kinematic"):
            for noise in NOISES:
                named[f"{1000 * depth:.0f} mm, {plant}, {noise}"] = [
                    ["--steps", 4, "--nosing", depth, "--plant", plant, "--noise", noise, "--seed", s] for s in seeds]
    groups = grouped(engine, "nosing", named)
    everything = [s for g in groups.values() for s in g]
    return Page(f"Treads that overhang their risers, the paper's failure (its Fig. 8), {span(seeds)}. A frame counts where every "
                "surface well in view was found and none was invented.\n\n" + figures(groups, SHORT) + not_climbed(everything),
                {"1 rate": headline("plane rate (every surface well in view found, none invented), least, under nosings of 10 to 40 mm, of 30 Hz",
                                    least(worst(everything, "plane_rate_hz", best=min), 28), " Hz", False)})


def odometry(engine, seeds):
    """The paper's Fig. 4 and the honesty of the covariance, under physics."""
    lines, everything, failed = [], [], []
    for name, group in (("seeds on which the drift constant was set", [s for s in seeds if s <= 20]), ("others", [s for s in seeds if s > 20])):
        asked = engine.climbs("odometry", [["--seed", s] for s in group])
        failed += [s for s in asked if s.get("verdict") != "pass"]
        summaries = [s for s in asked if s.get("odometry_drift_mm")]
        everything += summaries

        def of(*path, best=max, digits=1):
            return number(worst(summaries, *path, best=best), digits)

        def mean(*path, digits=2):
            values = [v for s in summaries if (v := s[path[0]][path[1]]) is not None]
            return number(sum(values) / len(values), digits) if values else "-"

        lines.append((name, f"{len(summaries)} of {len(asked)}", of("odometry_jitter_mm", "lio"), of("odometry_jitter_mm", "fused", digits=2),
                      of("odometry_drift_mm", "base"), of("odometry_drift_mm", "fused"), mean("odometry_nees", "mean"),
                      mean("odometry_nees", "in_bounds")))
    return Page("Ten steps under physics, from the first lift-off on; worst climb of each line, NEES the mean over its climbs. Jitter: 1 to 5 Hz, "
                "LIO as held between arrivals. NEES: squared error of the fused position over its variance, 3 is honest.\n\n" +
                rows(("climbs", "scored", "LIO jitter mm", "fused jitter mm", "odometry drift mm", "fused drift mm", "NEES", "ticks in 95 % bounds"),
                     lines) + not_climbed(failed), {"1 drift": headline(
                         "drift after ten stairs, fused with lidar odometry", most(worst(everything, "odometry_drift_mm", "fused")), " mm")})


def pushes(engine, seeds):
    """Eight moments of the second stair of four, four directions. The unpushed climb says when that stair is taken."""
    named, unpushed_failed = collections.defaultdict(list), []
    for gait in ("ds", "ss"):
        common = [["--reality", 1, "--gait", gait, "--steps", 4, "--noise", own_noise(s), "--seed", s] for s in seeds]
        for arguments, summary in zip(common, engine.climbs(f"pushes, {gait} unpushed", common)):
            if summary.get("verdict") != "pass":
                unpushed_failed.append(summary)
                continue
            step_s = summary["seconds_per_step"]
            begin_s = summary["ended_at_s"] - summary["climb_time_s"] + step_s
            for k in range(8):
                for axis, impulse in (("x", 10), ("x", -10), ("y", 10), ("y", -10)):
                    named[f"{gait}, {'forward back left right'.split()[2 * (axis == 'y') + (impulse < 0)]}"].append(
                        [*arguments, "--push", f"{begin_s + k * step_s / 8:.3f},{axis},{impulse}"])
    groups = grouped(engine, "pushes", named)
    everything = [s for g in groups.values() for s in g]

    text = ("10 N s on the torso at eight moments of the second of four stairs, perception in the loop, robot, sensors and stairs drawn as on "
            f"a real robot (`--reality 1`), {span(seeds)}, under physics.\n\n" +
            outcomes("pushed", groups) + not_climbed(unpushed_failed + everything))
    over, inside = sum(map(stands_over, everything)), sum(map(in_the_stairs, everything))
    return Page(text, {
        "1 falls": headline("falls by a push of 10 N s on the stairs, `--reality 1`",
                            Figure(sum(bool(s.get("fell")) for s in everything), falls(everything), "most", 0)),
        "2 over": headline("soles over an edge by such a push", Figure(over, f"{over} of {len(everything)}", "most", 0)),
        # Nobody asks that none is: what is held is that it gets no worse than 2.5 %.
        "3 inside": headline("feet that touch the stairs in the swing by such a push",
                             Figure(inside, f"{inside} of {len(everything)}", "most", 16))})


BODIES = {
    "as believed": [],
    "torso 10 % lighter": ["--mass-scale", 0.9],
    "torso 20 % heavier": ["--mass-scale", 1.2],
    "its centre 15 mm behind": ["--torso-offset-x", -0.015],
    "its centre 30 mm ahead": ["--torso-offset-x", 0.030],
    "friction 0.4 instead of 0.8": ["--friction", 0.4],
}


def bodies(engine, seeds):
    """Another body or ground than the module believes."""
    groups = grouped(engine, "bodies", {f"{gait}, {body}": [
        ["--gait", gait, "--steps", 4, "--noise", own_noise(s), *arguments, "--seed", s] for s in seeds]
        for gait in ("ds", "ss") for body, arguments in BODIES.items()})
    everything = [s for g in groups.values() for s in g]
    return Page(f"Four steps under physics with a body or a ground that the module does not know of, perception in the loop, {span(seeds)}.\n\n" +
                figures(groups, ("climbed", "s/step", "CoM mm", "foothold mm, median; max", "sole margin mm", "clearance mm", "torque; speed")) +
                not_climbed(everything),
                {})


def balusters(engine, seeds):
    """Posts along both edges, beside the stairs and on the treads, as close together as one tread and as half of one."""
    groups = grouped(engine, "balusters", {f"{1000 * spacing:.0f} mm apart, {place}, stairs {width} m wide": [
        ["--steps", 4, "--balusters", spacing, "--baluster-inset", inset, "--width", width, "--noise", own_noise(s), "--seed", s]
        for s in seeds]
        for width in (1.2, 0.9) for place, inset in (("beside the treads", -0.06), ("20 mm inside their ends", 0.02)) for spacing in (0.28, 0.14)})
    everything = [s for g in groups.values() for s in g]
    return Page(f"Four steps under physics with posts of 40 mm along both edges, {span(seeds)}. A climb passes, or stops on both feet and says "
                "why.\n\n" + outcomes("posts", groups) + not_climbed(everything),
                {})


TABLES = {
    "physics": Table("Climbs under physics, beside the paper's tables", range(1, 13), physics, 5),
    "random": Table("Climbs drawn at random", range(200, 260), at_random, 4),
    "treads": Table("Other stairs", range(1, 3), treads, 2),
    "kinematic": Table("Climbs on the kinematic plant", range(1, 51), kinematic, 2),
    "nosing": Table("Overhanging nosings", range(1, 13), nosing, 4),
    "odometry": Table("Odometry, lidar odometry and the fused pose (the paper's Fig. 4)", (*range(1, 13), *range(101, 109)), odometry, 2),
    "pushes": Table("Pushes on the stairs", range(1, 11), pushes, 35),
    "bodies": Table("Other bodies and grounds than believed", range(1, 4), bodies, 2),
    "balusters": Table("Stairs between balusters", range(1, 4), balusters, 2),
}
