# SPDX-License-Identifier: Apache-2.0
"""Climbs by robots, sensors, stairs and pictures that are not as the data sheet says: all at once, and each alone."""
import math
import os
import random
import statistics

from campaigns.climbs import grouped, most, not_climbed, number, outcomes, own_noise, seeded, span, touches, worst
from campaigns.engine import ROOT, Figure, Page, Table, headline, rows

GAITS = ("ds", "ss")
ALONE = range(1, 6)  # seeds of each item alone
OTHER_GAINS = range(1, 11)  # a robot that was taken over at gains which are not the data sheet's


def with_gains(name, most):
    return ["--set", f"plant.kp_most_nmprad=[{most}]", "--params", f"toolchain/campaigns/gains/{name}.toml"]


def of(*items):
    return [word for item in items for word in ("--set", item)]


SENSED = ("--contacts", "sensed")
ITEMS = {
    "nothing": [],
    "foot forces with noise of 20 N": [*SENSED, *of("sensors.foot_force_noise_n=20")],
    "foot forces off by +60 and -60 N": [*SENSED, *of("sensors.foot_force_offset_n=[60, -60]")],
    "gains of 250 Nm/rad at most": with_gains("soft", "250, 250, 250, 250, 250, 250"),
    "a KUAVO's own gains": with_gains("kuavo", "220, 100, 224, 224, 58, 58"),
    "toe 8 mm longer": of("sensors.toe_m=0.008"),
    "toe 8 mm shorter": of("sensors.toe_m=-0.008"),
    "edges 3 pixels fatter": of("camera.edge_fattening_px=3"),
    "lidar odometry drifts by 20 mm/s": of("sensors.lio_drift_mps=[0.02, 0, 0]"),
    "lidar odometry turns by 20 mrad/s": of("sensors.lio_drift_radps=0.02"),
    "lidar odometry never heard": of("sensors.lio_outage_s=1000", "sensors.lio_outage_from_s=0"),
    "lidar odometry silent from 12 s on": of("sensors.lio_outage_s=1000", "sensors.lio_outage_from_s=12"),
    "lidar odometry silent from 17 s on": of("sensors.lio_outage_s=1000", "sensors.lio_outage_from_s=17"),
    "lidar mounted 1 degree and 20 mm off": of("sensors.lio_mount_rad=0.0175", "sensors.lio_mount_m=0.02"),
    "lidar odometry jumps by 300 mm": of("sensors.lio_jump_m=[0.3, 0.3, 0.1]", "sensors.lio_jump_s=12"),
    "treads turned by up to 2 degrees": of("stairs.tread_yaw_rad=0.035"),
    "treads sloped by up to 2 degrees": of("stairs.tread_slope_rad=0.035"),
    "rises off by up to 10 mm": of("stairs.rise_error_m=0.01"),
    "nosings worn to 5 mm": of("stairs.worn_nosing_m=0.005"),
    "play of 0.5 degrees": of("plant.backlash_rad=0.0087"),
    "encoder steps of 0.1 degrees, speeds by difference": of("sensors.encoder_step_rad=0.00175", "sensors.rates_by_difference=true"),
    "torque 20 % low": of("plant.torque_scale=0.8"),
    "torque 20 % low, foot forces sensed": [*SENSED, *of("plant.torque_scale=0.8")],
    "legs 10 % heavier": of("plant.leg_mass_scale=1.1"),
    "ground of 40 ms": of("plant.ground_s=0.04"),
    "IMU pitched by 2 degrees": of("sensors.imu_turned_rad=[0, 0.035, 0]"),
    "IMU rolled by 2 degrees": of("sensors.imu_turned_rad=[0.035, 0, 0]"),
    "commands 8 ms late": of("plant.command_delay_s=0.008"),
    "torque lags by 10 ms": of("plant.torque_lag_s=0.01"),
    "armature four times as large": of("plant.armature_kgm2=0.2"),
    "friction of 0.2": of("plant.friction=0.2"),
    "40 % of the pictures lost": of("camera.drop_share=0.4"),
    "pictures 100 ms late, in disorder": of("camera.latency_s=0.07", "camera.jitter_s=0.05", "camera.reorder_share=0.2"),
    "treads half dark, a third shiny": of("camera.dark_share=0.5", "camera.shiny_share=0.3"),
    "strips of 30 mm along the nosings": of("camera.nosing_strip_m=0.03"),
    "strips of 50 mm along the nosings": of("camera.nosing_strip_m=0.05"),
    "a cube of 40 mm on the second tread": ["--obstacle", "0.42,0.1,0.28,0.04,0.04,0.04"],
}


FOOTHOLDS_SHOWN = ("toe", "edges", "lidar odometry")  # of items that begin so README has the worst


def seeds_of(what):
    return OTHER_GAINS if "gains" in what else ALONE


def stairs_of(seed):
    """Stairs within what is climbed, the same for ever."""
    rng = random.Random(seed)
    return ["--rise", round(rng.uniform(0.10, 0.17), 3), "--tread", round(rng.uniform(0.28, 0.35), 3)]


def drawn(seeds, scale):
    return {f"`--reality {scale}`, `{gait}`": [
        ["--gait", gait, "--steps", 10, *stairs_of(s), "--noise", own_noise(s), "--seed", s, "--reality", scale] for s in seeds]
        for gait in GAITS}


def figures(groups):
    def line(summaries):
        return (seeded(summaries, "foothold_error_mm", "max"), seeded(summaries, "swing_clearance_mm_min", best=min),
                seeded(summaries, "seconds_per_step", digits=2))
    return rows(("", "foothold mm", "clearance mm", "s/step"), [(name, *line(s)) for name, s in groups.items()])


def reality(engine, seeds):
    os.chdir(ROOT)  # the gains' files are named from there
    once = grouped(engine, "reality 1", drawn(seeds, 1))
    twice = grouped(engine, "reality 2", drawn(seeds[:(len(seeds) + 1) // 2], 2))  # half of the seeds: 100 climbs
    alone = grouped(engine, "reality, alone", {f"{what}, `{gait}`": [
        ["--gait", gait, "--steps", 4, "--noise", own_noise(s), "--seed", s, *arguments] for s in seeds_of(what)]
        for what, arguments in ITEMS.items() for gait in GAITS})
    drawn_all = {**once, **twice}
    text = ("Under physics, perception in the loop, even seeds with correlated noise. What is drawn and from which range is in the "
            "[reference](../reference/reality.md).\n\n"
            f"## Everything drawn\n\nTen steps, rises of 0.10 to 0.17 m, treads of 0.28 to 0.35 m by the seed: {span(seeds)}, of which `--reality 2` has the first half.\n\n" +
            outcomes("climbs", drawn_all) + "\n\n" + figures(drawn_all) +
            f"\n\n## Each alone\n\nFour steps of 0.13 x 0.28 m, {span(ALONE)} ({span(OTHER_GAINS)} with other gains), everything else as the data sheet says.\n\n" +
            outcomes("what differs", alone) + "\n\n" + figures(alone) +
            not_climbed([s for g in (*drawn_all.values(), *alone.values()) for s in g]))
    first, second, each = ([s for g in groups.values() for s in g] for groups in (once, twice, alone))

    def counted(summaries, passed, at="", asked=None):
        count = sum(bool(passed(s)) for s in summaries)
        return Figure(count, f"{count} of {len(summaries)}", at, asked)

    def climbed(summary):
        return summary.get("verdict") == "pass"

    def unsafe(summary):
        return summary.get("fell") or touches(summary)

    shown = [s for what, group in alone.items() if what.startswith(FOOTHOLDS_SHOWN) for s in group]
    medians = [m for s in first if (m := (s.get("foothold_error_mm") or {}).get("median")) is not None]

    far = worst(shown, "foothold_error_mm", "max")
    foothold = [most(statistics.median(medians) if medians else None, 4), most(worst(first, "foothold_error_mm", "max"), 10)]
    return Page(text, {
        "1 climbed": headline("climbs with everything drawn as on a real robot, `--reality 1`",
                              counted(first, climbed, "least", math.ceil(0.98 * len(first)))),
        "2 falls": headline("falls, soles over an edge and feet in the stairs among them", counted(first, unsafe, "most", 0)),
        "2 foothold": headline("foothold error of them, median; worst", foothold, " mm"),
        "3 twice": headline("climbs with everything twice as bad, `--reality 2`; falls among them",
                            [counted(second, climbed, "least", math.ceil(0.85 * len(second))),
                             counted(second, lambda s: s.get("fell"), "most", 0)]),
        "5 alone": headline("falls, soles over an edge and feet in the stairs with each of these alone; worst foothold error with a wrong "
                            "toe, edge or lidar odometry",
                            [counted(each, unsafe, "most", 0), Figure(far, number(far, 1, " mm"), "most", 10)])})


TABLES = {"reality": Table("Robots, stairs and pictures that are not as the data sheet says", range(101, 201), reality, 50,
                           ("toolchain/campaigns/climbs.py", "toolchain/campaigns/gains"))}
