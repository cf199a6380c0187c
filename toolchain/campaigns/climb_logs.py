# SPDX-License-Identifier: Apache-2.0
"""Climbs as logs for `polygmap estimate`: what the sensors said, and a lidar odometry of several kinds."""
import bisect
import concurrent.futures
import json
import math
import pathlib
import subprocess
import tempfile

from campaigns import log_variants
from campaigns.climbs import own_noise
from campaigns.engine import rows

CLIMBS = {f"`{gait}`, seed {seed}": ["--gait", gait, "--steps", 10, "--seed", seed, "--noise", own_noise(seed), "--reality", 1]
          for gait in ("ds", "ss") for seed in range(217, 221)}  # constants were chosen on 201 to 216
STEADY = {"sensors.lio_position_m": 0.01, "sensors.lio_sigma_scale": 1, "sensors.lio_delay_s": 0.1, "sensors.lio_stamp_s": 0,
          "sensors.lio_drift_mps": [0, 0, 0], "sensors.lio_drift_radps": 0, "sensors.lio_walk_mprs": 0, "sensors.lio_mount_rad": 0,
          "sensors.lio_mount_m": 0, "sensors.lio_jump_m": [0, 0, 0], "sensors.lio_outage_s": 0}
NOISY, TURNED, DRAWN = "lidar odometry with noise of 10 mm, 100 ms late", "the same, mounted 1 degree off in heading", "as drawn: it drifts and jumps"
LIDARS = {NOISY: STEADY, TURNED: {**STEADY, "sensors.lio_turned_rad": [0, 0, 0.0175]}, DRAWN: {}}
TRUE_PLACE = [f"truth_p{axis}_m" for axis in "xyz"]
FIGURES = {"velocity mm/s": ("velocity_rmse_mmps", 1), "tilt deg": ("tilt_rmse_deg", 3),
           "a planted foot moves mm": ("planted_foot_mm", 1), "rows within the 95 % bounds %": ("nees_in_bounds_percent", 0)}


def raw_rmse_mm(log, lio):
    """Of the poses themselves: their world is tied to the truth's by the heading and place of the first twenty."""
    log, lio = log_variants.read(log), log_variants.read(lio)
    times, places = log["t_s"], log_variants.rows_of(log, TRUE_PLACE)
    attitudes = log_variants.rows_of(log, log_variants.TRUE_ATTITUDE)
    at = [min(bisect.bisect_left(times, t), len(times) - 1) for t in lio["stamp_s"]]
    measured = log_variants.rows_of(lio, ["px_m", "py_m", "pz_m"])
    turned = log_variants.rows_of(lio, ["qw", "qx", "qy", "qz"])
    tied = range(min(20, len(at)))
    apart = [log_variants.yaw_of(attitudes[at[i]]) - log_variants.yaw_of(turned[i]) for i in tied]
    yaw = math.atan2(sum(map(math.sin, apart)), sum(map(math.cos, apart)))
    c, s = math.cos(yaw), math.sin(yaw)
    off = [[c * x - s * y - places[i][0], s * x + c * y - places[i][1], z - places[i][2]] for (x, y, z), i in zip(measured, at)]
    mean = [sum(off[i][axis] for i in tied) / len(tied) for axis in range(3)]
    return 1e3 * math.sqrt(sum(math.dist(o, mean) ** 2 for o in off) / len(off))


def scores(engine, climb, items):
    """(without, with lidar odometry), or a sentence with which there are none. The second has raw_rmse_mm, too."""
    sets = [word for name, value in items.items() for word in ("--set", f"{name}={value}")]
    with tempfile.TemporaryDirectory() as out:
        told = [str(a) for a in (*climb, *sets, "--save-inputs", "--record", "none", "--out", out)]
        done = subprocess.run([engine.tool, "climb", *told], capture_output=True, text=True, start_new_session=True)
        log, lio = (pathlib.Path(out, "inputs", name) for name in ("log.csv", "lio.csv"))
        if not log.exists():
            return (done.stderr or done.stdout).strip()[-300:]
        found = []
        for more in ([], ["--lio", lio]):
            done = subprocess.run([engine.tool, "estimate", log, *more, "--json", f"{out}/scores.json"], capture_output=True, text=True)
            if done.returncode:
                return done.stderr.strip().removeprefix("polygmap: ")
            found.append(json.loads(pathlib.Path(out, "scores.json").read_text()))
        found[1]["raw_rmse_mm"] = raw_rmse_mm(log, lio)
    return tuple(found)


def measured(engine):
    """{(climb, lidar): what scores() found}."""
    asked = [(climb, lidar) for climb in CLIMBS for lidar in LIDARS]
    with concurrent.futures.ThreadPoolExecutor(engine.jobs) as pool:
        return dict(zip(asked, pool.map(lambda a: scores(engine, CLIMBS[a[0]], LIDARS[a[1]]), asked)))


def table(found):
    """A line for each climb. All but the place are of the run with the first lidar odometry."""
    def both(scored, key, digits):
        return " / ".join("-" if s[key] is None else f"{s[key]:.{digits}f}" for s in scored)
    lines = []
    for climb in CLIMBS:
        first, *_ = (found[climb, lidar] for lidar in LIDARS)
        if isinstance(first, str):
            lines.append((climb, first))
            continue
        places = ["-" if isinstance(s, str) else f"{s[1]['position_rmse_mm']:.1f} ({s[1]['odometry_position_rmse_mm']:.1f}, {s[1]['raw_rmse_mm']:.1f})"
                  for s in (found[climb, lidar] for lidar in LIDARS)]
        lines.append((climb, *(both(first, *figure) for figure in FIGURES.values()), *places))
    return rows(("climb", *FIGURES, *(f"position RMSE mm, {lidar}" for lidar in LIDARS)), lines)


def each(found, lidar, value):
    """value(without, with) of each climb; None of one that was not scored."""
    return [None if isinstance(s, str) else value(*s) for (_, kind), s in found.items() if kind == lidar]
