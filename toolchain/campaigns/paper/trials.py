# SPDX-License-Identifier: Apache-2.0
"""The paper's Tables I and II and its Figs 4, 5 and 7, ours beside them. Where ours is worse, that comes first."""
import collections
import dataclasses
import hashlib
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

from campaigns.climbs import grouped, number, own_noise, span, worst, worst_climb
from campaigns.engine import ROOT, Figure, Page, Table, headline, told
from campaigns.paper import page

PAPER = "sim_stub/host/report/page/src/panels/paper.js"  # the report's page shows the same rows
FIGURES = "docs/measured/paper"
DATA = re.compile(r'<script type="application/json" id="polygmap-data">(.*?)</script>', re.S)
TRACKING_MM = 40  # what the paper's Fig. 7 stays within
NOSING_M = 0.025  # of the stairs with a protruding edge; the paper does not say how far


@dataclasses.dataclass(frozen=True)
class Trial:
    """A row of the paper's tables."""
    table: str
    scene: str
    gait: str  # "–" where the paper does not say it
    t_s: float
    steps: int
    planes_hz: float
    e_m_mm: float

    def name(self):
        return f"Table {self.table}, trial {self.scene}" if self.table == "I" else f"Table II, {self.scene} {self.gait}, {self.steps} steps, {self.t_s:g} s"


def paper_trials(root=ROOT):
    """Every row of both tables, as the report's page has them."""
    text = (root / PAPER).read_text()
    trials = []
    for table in ("I", "II"):
        rows = re.search(rf"kTable{table} = (\[.*?\n\]);", text, re.S)[1]
        trials += [Trial(table, *row) for row in json.loads(re.sub(r",(\s*\])", r"\1", rows))]
    return trials


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A column of the paper's tables and what a climb has beside it."""
    name: str
    unit: str
    of_paper: str  # a field of Trial
    path: tuple    # into summary.json
    worst: object  # max where less is better
    digits: int = 1

    def is_worse(self, ours, paper):
        return ours is None or (ours > paper if self.worst is max else ours < paper)

    def ours(self, summaries):
        """(median, worst, its seed) over the climbs that have it."""
        values = [v for s in summaries if (v := worst([s], *self.path)) is not None]
        return (statistics.median(values), *worst_climb(summaries, *self.path, best=self.worst)) if values else (None, None, None)

    def cell(self, summaries):
        median, least, seed = self.ours(summaries)
        return "-" if median is None else f"{number(median, self.digits)}; {number(least, self.digits)} ({seed})"


T = Quantity("T", "s", "t_s", ("climb_time_s",), max)
PLANES = Quantity("planes", "Hz", "planes_hz", ("plane_rate_hz",), min)
E_M = Quantity("e_m", "mm", "e_m_mm", ("execution_error_mm", "max"), max)
TRUE = Quantity("the foothold's error against the true stairs (beside the paper's e_m)", "mm", "e_m_mm", ("foothold_error_mm", "max"), max)
QUANTITIES = (T, PLANES, E_M, TRUE)


def passed(summary):
    return summary.get("verdict") == "pass"


def worse_in(trial, which, summaries):
    """A sentence for each figure in which the worst of our climbs is worse than the paper's trial, or is not known."""
    name = f"{trial.name()}, ours with {which}"
    if failed := sum(not passed(s) for s in summaries):
        yield f"**{name}: {failed} of {len(summaries)} climbs failed**; the paper's trial climbed."
    for quantity in QUANTITIES:
        paper = getattr(trial, quantity.of_paper)
        median, least, seed = quantity.ours(summaries)
        if median is None:
            yield f"**{name}: no climb has {quantity.name}**; the paper has {paper:g} {quantity.unit}."
        elif quantity.is_worse(least, paper):
            too = "worse, too" if quantity.is_worse(median, paper) else "no worse"
            yield (f"**{name}: {quantity.name} {number(least, quantity.digits)} {quantity.unit}** in the worst of {len(summaries)} climbs (seed {seed}), "
                   f"{number(median, quantity.digits)} in the median ({too}); the paper has {paper:g}.")


FUSION = (  # what the paper says of its Fig. 4: (its words, what is to be less, than what)
    ("the fused pose is smoother than lidar odometry", ("odometry_jitter_mm", "fused"), ("odometry_jitter_mm", "lio"), "jitter, 1 to 5 Hz"),
    ("the fused pose is as accurate as lidar odometry", ("odometry_rmse_mm", "fused"), ("odometry_rmse_mm", "lio"), "RMS error"),
    ("the fused pose drifts less than odometry", ("odometry_drift_mm", "fused"), ("odometry_drift_mm", "base"), "drift at the end"))


def fusion(summaries):
    """For each of the paper's sentences on Fig. 4: (sentence, what, climbs in which it holds, climbs, worst of both)."""
    for said, ours, other, what in FUSION:
        pairs = [(worst([s], *ours), worst([s], *other)) for s in summaries]
        pairs = [(a, b) for a, b in pairs if a is not None and b is not None]
        yield said, what, sum(a <= b for a, b in pairs), len(summaries), max((a for a, _ in pairs), default=None), max((b for _, b in pairs), default=None)


def worse_than_the_paper(groups, fused, tracked):
    """groups: [(trial, which reality, summaries)]; fused: {which reality: the climbs of Fig. 4}; tracked: those of Fig. 7's row."""
    sentences = [sentence for group in groups for sentence in worse_in(*group)]
    for which, summaries in fused.items():
        sentences += [f"**Fig. 4: {said}, says the paper; ours with {which} in {holds} of {count} climbs** ({what}: at most {number(ours)} mm, the other's "
                      f"{number(other)} mm)." for said, what, holds, count, ours, other in fusion(summaries) if holds < count]
    for axis in "xz":
        most, seed = worst_climb(tracked, "tracking_error_mm", f"{axis}_max")
        if most is None or most > TRACKING_MM:
            sentences.append(f"**Fig. 7: a foot is {number(most)} mm off its desired {axis}** (seed {seed}); the paper stays within {TRACKING_MM} mm.")
    return sentences


def arguments_of(trial, seed, reality):
    """Of the same climb. The paper does not say Table I's gait; at 3.4 s a step it is taken to be `ds`."""
    gait = "ss" if trial.gait == "SS" else "ds"
    told = ["--gait", gait, "--steps", trial.steps, "--noise", own_noise(seed), "--seed", seed]
    return [*told, "--reality", reality] if reality else told  # as `physics` runs them without


def table_of(trials, groups):
    """The paper's line of each trial, and ours below it."""
    lines = []
    for trial in trials:
        scene = trial.scene if trial.table == "I" else f"{trial.scene} {trial.gait}"
        lines.append((f"**{scene}, {trial.steps} steps: paper**", f"1 of 1{', see below' if trial.scene == 'outdoor' else ''}",
                      f"{trial.t_s:g}", f"{trial.planes_hz:g}", f"{trial.e_m_mm:g}", "not said"))
        for of, which, summaries in groups:
            if of == trial:
                lines.append((f"ours, {which}", f"{sum(map(passed, summaries))} of {len(summaries)}",
                              *(q.cell(summaries) for q in QUANTITIES)))
    ours = collections.defaultdict(list)
    for of, which, summaries in groups:
        ours[which] += summaries if of in trials else []
    lines.append(("**worst of all: paper**", f"{len(trials)} of {len(trials)}", f"{max(t.t_s for t in trials):g}",
                  f"{min(t.planes_hz for t in trials):g}", f"{max(t.e_m_mm for t in trials):g}", "not said"))
    for which, summaries in ours.items():
        if summaries:
            lines.append((f"ours, {which}", f"{sum(map(passed, summaries))} of {len(summaries)}",
                          *(f"{number(q.ours(summaries)[1], q.digits)} ({q.ours(summaries)[2]})" for q in QUANTITIES)))
    return ("table", ("trial", "climbed", "T, s", "planes, Hz", "e_m, mm", "true foothold error, mm"), lines)


def install():
    """Debian's matplotlib, which nothing else needs."""
    words = ["bash", "-c", 'source toolchain/packages.sh && source toolchain/lib.sh && ensure_packages "${kPackagesFigures[@]}"', "campaign"]
    if subprocess.run(words, cwd=ROOT, stdout=sys.stderr).returncode:
        raise SystemExit("campaign: paper: its figures cannot be drawn without python3-matplotlib")


def recorded(engine, arguments):
    """The report's run of one climb (sim_stub/host/report/page/DATA.md), without its pictures and map; kept as the engine keeps summaries."""
    arguments = told(arguments)
    kept = engine.kept / (hashlib.sha256("\0".join(["report", *arguments]).encode()).hexdigest()[:24] + ".json")
    if kept.exists():
        return json.loads(kept.read_text())
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([engine.tool, "climb", *arguments, "--out", out], capture_output=True, start_new_session=True)
        report = pathlib.Path(out, "report.html")
        found = DATA.search(report.read_text()) if report.exists() else None
    if found is None:
        raise SystemExit(f"campaign: paper: polygmap climb {' '.join(arguments)} wrote no report")
    run = json.loads(found[1])["runs"][0]
    for key in ("pictures", "map", "searches"):
        run.pop(key, None)
    partial = kept.with_suffix(".part")
    partial.write_text(json.dumps(run))
    partial.rename(kept)
    return run


def masses_of(tool):
    """As the module's parameters have them: [kg, centre] of the torso and of a leg's six links."""
    listed = json.loads(subprocess.run([tool, "params", "list", "--json"], check=True, capture_output=True, text=True).stdout)
    values = {p["name"]: p["value"] for p in listed["params"]}
    links = ("hip_roll", "hip_yaw", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")

    def link(name):
        return [values[f"robot.masses.{name}.mass_kg"], values[f"robot.masses.{name}.centre_m"]]
    return {"torso": link("torso"), "leg": [link(f"leg.{name}") for name in links]}


def drawn(engine, climbs):
    """({file: SVG}, {figure: (alt, caption)}) of one climb each, by the Debian package's own Python, whichever Python this is."""
    install()
    asked = {"runs": {name: recorded(engine, arguments) for name, arguments in climbs.items()}, "masses": masses_of(engine.tool), "bound_mm": TRACKING_MM}
    done = subprocess.run(["/usr/bin/python3", ROOT / "toolchain/campaigns/paper/figures.py"], input=json.dumps(asked), stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise SystemExit("campaign: paper: its figures were not drawn")
    drawings = json.loads(done.stdout)
    return {f"{FIGURES}/{name}.svg": d["svg"] for name, d in drawings.items()}, {name: (d["alt"], d["caption"]) for name, d in drawings.items()}


NOT_SHOWN = (
    "**A real robot.** Table II and Figs 6 to 8 of the paper are a robot on real stairs. No robot has run this module: all that stands here beside "
    "them is a simulation. A simulated climb beside a real one is no proof that the real one would succeed.",
    "**Rates of a real computer.** The paper's planes are counted on an Orin NX, as it climbs. Ours are pictures of a simulated 30 Hz camera on "
    "a simulated schedule, counted where every surface was found; no board has run it.",
    "**Real sensors.** The paper's camera, lidar, floor and light are real, outdoors too. Ours are drawn from a model (`--reality 1`).",
    "**Lidar odometry.** The paper's is computed from a real lidar's points. Ours is a simulated pose with noise, drift, jumps and outages.",
    "**Arms.** Fig. 5 of the paper has the hands' trajectories. The simulated robot's arms are part of its torso.",
    "**Photographs and RViz views** (Figs 6 and 8): there is nothing to photograph.")
OTHERWISE = (
    "**T**: the paper's is from the start of the climb to a stable stance. Ours is `climb_time_s`, from the first lift-off onto the stairs until the module "
    "says that it stands on top with both feet. Where the paper's start is exactly, it does not say.",
    "**planes**: the paper's is how often planes are detected. Ours is `plane_rate_hz`, of 30 pictures a second those in which every surface well in view was "
    "found and none was invented: more is asked of a picture, and 30 is the most there can be.",
    "**e_m**: \"the maximum footstep error from detection to execution\". Ours is `execution_error_mm.max`: target as frozen at lift-off against the "
    "sole at touch-down, both as the robot itself estimates them. How the paper knows where the foot came to stand, it does not say; if by something "
    "better than the robot's own estimate, the last column is the one to compare: `foothold_error_mm.max`, against the true stairs.",
    "**One trial beside five climbs**: a row of the paper is one trial. Ours is the median, then the worst of five with its seed in brackets, and the worst is what is "
    "compared. The paper tells that long outdoor climbs fail at times, not how often, and its tables list none that failed.",
    "**Stairs**: the paper's indoor stairs are 0.13 x 0.28 m; of the others it says nothing. All of ours are 0.13 x 0.28 m, the outdoor rows', too, each step off by up to 5 mm.",
    "**Table I's gait** is not said; ours is `ds`, both feet on every tread.")


def blocks_of(groups, trials, seeds, worse, edge, fused, figures_told, commands):
    """The page, first of all what is worse."""
    of_table = {t: [trial for trial in trials if trial.table == t] for t in ("I", "II")}
    yield from (("h2", "Worse than the paper"),
                ("p", "Computed from the figures below: where the worst of our climbs is worse than the paper's trial."),
                ("ul", worse or ["Nothing: in none of the rows and figures below."]),
                ("h2", "Shown in the paper, not here"), ("ul", NOT_SHOWN))
    yield from (("h2", "Table I: the paper in Gazebo, ours in MuJoCo"),
                ("p", f"Ours: {span(seeds)}, a fifth of them for each trial, odd ones with white noise of the depth, even ones with correlated. "
                      "The paper's simulation is of \"ideal conditions\": beside it stands the data sheet (`--reality 0`), and below that the same "
                      "climbs with everything drawn as on a real robot (`--reality 1`). "
                      "Median; worst (its seed)."),
                table_of(of_table["I"], groups),
                ("h2", "Table II: the paper's real robot, ours a simulation"),
                ("p", "**Ours is a simulation here, too**, with everything drawn as on a real robot (`--reality 1`); the paper's is a real robot. "
                      "A simulated climb beside a real one is no proof. Median; worst (its seed)."),
                table_of(of_table["II"], groups),
                ("p", "In one of the two outdoor trials, on stairs with a protruding edge, a toe of the paper's robot hit the edge in the end (its Fig. 8). "
                      "Ours climbed "
                      f"{sum(map(passed, edge))} of {len(edge)} with an edge of {1000 * NOSING_M:.0f} mm (`ss`, 5 steps, `--reality 1`); a swinging foot "
                      f"came within {number(worst(edge, 'swing_clearance_mm_min', best=min))} mm of the stairs at the nearest."))
    yield from (("h2", "Fig. 4: odometry, lidar odometry and the fused pose"), ("figure", "fig4", *figures_told["fig4"], commands["fig4"]),
                ("p", "The paper gives no numbers of this figure. What it says of it, in our climbs of ten steps:"),
                ("table", ("the paper says", "measured as", "ours", "holds in", "fused at most, mm", "the other at most, mm"),
                 [(said, what, which, f"{holds} of {count}", number(ours), number(other))
                  for which, summaries in fused.items() for said, what, holds, count, ours, other in fusion(summaries)]),
                ("h2", "Fig. 5: snapshots of trial 1"), ("figure", "fig5", *figures_told["fig5"], commands["fig5"]),
                ("h2", "Fig. 7: trajectories and how the feet follow"), ("figure", "fig7", *figures_told["fig7"], commands["fig7"]),
                ("h2", "Measured otherwise than in the paper"), ("ul", OTHERWISE))
    if failed := [s for s in [*(s for _, _, group in groups for s in group), *edge] if not passed(s)]:
        yield from (("h2", "Not climbed"), ("ul", [f"`polygmap climb {s['run']}`: {s.get('reason', '')}" for s in failed]))


def paper(engine, seeds):
    trials = paper_trials()
    groups = {}
    per_table = len(trials) // 2
    for reality, tables in ((0, ("I",)), (1, ("I", "II"))):
        for table in tables:
            for row, trial in enumerate(t for t in trials if t.table == table):
                groups[trial, f"`--reality {reality}`"] = [arguments_of(trial, s, reality) for s in seeds[row::per_table]]
    with_edge = next(t for t in reversed(trials) if t.table == "II")
    groups["edge"] = [[*arguments_of(with_edge, s, 1), "--nosing", NOSING_M] for s in seeds[:5]]
    summaries = grouped(engine, "paper", groups)
    edge = summaries.pop("edge")
    rows = [(trial, which, s) for (trial, which), s in summaries.items()]
    first, first_real = trials[0], next(t for t in trials if t.table == "II")
    fused = {which: [s for trial, of, group in rows if trial.table == "I" and trial.steps == first.steps and of == which for s in group]
             for which in ("`--reality 0`", "`--reality 1`")}
    tracked = [s for trial, _, group in rows if trial.table == "II" and trial.gait == "DS" for s in group]
    # The first seed of its row each, whichever that is: none is chosen by its looks.
    climbs = {"fig4": arguments_of(first, seeds[0], 1), "fig5": arguments_of(first, seeds[0], 0), "fig7": arguments_of(first_real, seeds[0], 1)}
    svgs, figures_told = drawn(engine, climbs)
    worse = worse_than_the_paper(rows, fused, tracked)
    blocks = list(blocks_of(rows, trials, seeds, worse, edge, fused, figures_told,
                            {name: "polygmap climb " + " ".join(told(a)) for name, a in climbs.items()}))
    good = [trial for trial, which, group in rows if which == ("`--reality 0`" if trial.table == "I" else "`--reality 1`")
            and all(map(passed, group)) and not any(q.is_worse(q.ours(group)[1], getattr(trial, q.of_paper)) for q in (T, PLANES, E_M))]
    html = page.html("PolygMap-RT beside the paper", blocks, {name: svgs[f"{FIGURES}/{name}.svg"] for name in climbs})
    return Page(page.markdown(blocks, "paper"),
                {"1 rows": headline(
                    "rows of the paper's Tables I (Gazebo; ours by the data sheet, `--reality 0`) and II (a real robot; ours is simulated, `--reality 1`) in which the worst of five climbs "
                    "is as good in time, planes and e_m", Figure(len(good), f"{len(good)} of {len(trials)}"))},
                {**svgs, "docs/measured/paper.html": html})


TABLES = {"paper": Table("The paper's tables and figures, ours beside them", range(1, 26), paper, 15,
                         ("toolchain/campaigns/paper", "toolchain/campaigns/climbs.py", PAPER))}
