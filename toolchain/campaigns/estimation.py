# SPDX-License-Identifier: Apache-2.0
"""The table of state estimation on logs: the module's, invariant-ekf's beside it, and logs that are not as they should be."""
import hashlib
import json
import math
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import tempfile

from campaigns import climb_logs, log_variants
from campaigns.engine import ROOT, Page, Table, code_hash, rows

LOGS = {"cassie/cassie_walk_open.csv": "Cassie, simulated walk, 5 s", "icub/walk.csv": "iCub, real walk, Vicon, 12 s",
        "icub/gazebo_0_35.csv": "iCub3 in Gazebo, 35 s"}
FIGURES = {"position RMSE mm": ("position_rmse_mm", 1), "velocity RMSE mm/s": ("velocity_rmse_mmps", 1), "tilt deg": ("tilt_rmse_deg", 2),
           "yaw deg": ("yaw_rmse_deg", 2), "drift % of the way": ("drift_percent", 2), "a planted foot moves mm": ("planted_foot_mm", 1),
           "rows within the 95 % bounds %": ("nees_in_bounds_percent", 0), "mean NEES, 6 is honest": ("nees_mean", 1)}

PEER = "https://github.com/RossHartley/invariant-ekf"
PEER_HEADER, PEER_SOURCES = "include/InEKF.h", ("src/*.cpp", "include/*.h")
REPLAY = "toolchain/campaigns/peers/inekf_replay.cpp"
REPLAY_NEEDS = ("sim_stub/host/estimate/csv_table.cpp", "sim_stub/host/estimate/estimate_log.cpp",  # compiled with it
                "sim_stub/host/estimate/estimate_report.cpp", "sim_stub/host/estimate/estimate_score.cpp",
                "sim_stub/host/output_file.cpp", "firmware/config/file_error.cpp")
# The authors' for Cassie (matlab_example/example_code/RIEKF_InitFcn.m of their Contact-Aided-Invariant-EKF). They compute the feet's
# noise from the encoders'; 8 mm is our choice.
CASSIE_NOISE = ("gyro=0.002", "accel=0.04", "gyro_bias=0.001", "accel_bias=0.001", "contact=0.05", "foot=0.008")
COMPARED = tuple(FIGURES)[:-1]  # where rows are left out: all but the mean NEES
# What is run for each row, in callgrind's names.
OURS_RUNS, PEER_RUNS = r"polygmap::Estimator::(?:add_\w+|tick)", r"inekf::InEKF::(?:Propagate|setContacts|CorrectKinematics)"


def lack_of_peer(path):
    """A sentence, or nothing where invariant-ekf's sources are at path."""
    return "" if (path / PEER_HEADER).is_file() else f"{path} has no sources of invariant-ekf ({PEER_HEADER}): clone {PEER}"


def compiled_peer(path):
    """The program, compiled once for the same sources."""
    sources = sorted(p for pattern in PEER_SOURCES for p in path.glob(pattern))
    key = hashlib.sha256(code_hash(ROOT, (REPLAY,)).encode() + b"".join(p.read_bytes() for p in sources)).hexdigest()[:16]
    program = ROOT / f"build/campaign/inekf_replay-{key}"
    if not program.exists():
        partial = program.with_suffix(".part")
        print("estimation: compiling the peer, which may take some minutes", flush=True)
        done = subprocess.run(["g++", "-std=c++20", "-O2", "-DNDEBUG", "-I", ROOT, "-isystem", path / "include", "-isystem",
                               "/usr/include/eigen3", "-o", partial, *(ROOT / s for s in (REPLAY, *REPLAY_NEEDS)),
                               *(p for p in sources if p.suffix == ".cpp")], capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"campaign: {REPLAY}: not built with {path}: {done.stderr[-800:]}")
        partial.rename(program)
    return program


def commit_of(path):
    done = subprocess.run(["git", "-C", path, "rev-parse", "--short=10", "HEAD"], capture_output=True, text=True)
    return f"commit {done.stdout.strip()}" if (path / ".git").exists() and not done.returncode else "of unknown commit"


def logs_found():
    """What it is -> its path."""
    shared = pathlib.Path(os.environ.get("POLYGMAP_SHARED_DATA", ROOT.parent / "shared/data"))
    found = {what: shared / name for name, what in LOGS.items()}
    if "POLYGMAP_LOGS" in os.environ:
        found |= {path.stem: path for path in sorted(pathlib.Path(os.environ["POLYGMAP_LOGS"]).glob("*.csv"))}
    return {what: path for what, path in found.items() if path.exists()}


def scores(command, log):
    """What the program scored the log with, or the sentence with which it did not."""
    with tempfile.TemporaryDirectory() as out:
        done = subprocess.run([*command, log, "--json", f"{out}/scores.json"], capture_output=True, text=True)
        if done.returncode:
            return done.stderr.strip().removeprefix("polygmap: ")
        found = json.loads(pathlib.Path(out, "scores.json").read_text())
    return found if "position_rmse_mm" in found else "It has no truth to be scored against."


def instructions(command, log, runs):
    """Of all that matches runs, in thousands a row."""
    with tempfile.TemporaryDirectory() as out:
        subprocess.run(["valgrind", "--tool=callgrind", "--quiet", f"--callgrind-out-file={out}/counted", *command, log], check=True,
                       capture_output=True)
        listed = subprocess.run(["callgrind_annotate", "--inclusive=yes", "--threshold=100", "--auto=no", f"{out}/counted"],
                                capture_output=True, text=True, check=True).stdout
    total = sum(int(n.replace(",", "")) for n in re.findall(rf"^\s*([\d,]+) .*:{runs}\(", listed, re.M))
    return f"{total / 1e3 / (len(log.read_text().splitlines()) - 1):.0f} k"


def side_by_side(filters, logs):
    """(a line for each log and filter, a sentence for each that was not scored)."""
    lines, unscored = [], []
    for what, path in logs.items():
        for name, command in filters.items():
            s = scores(command, path)
            if isinstance(s, str):
                unscored.append(f"{what}, {name}: {s}")
                break  # the others would say the same
            lines.append((what, name, *("-" if s[key] is None else f"{s[key]:.{digits}f}" for key, digits in FIGURES.values())))
    return lines, unscored


def varied(command, logs):
    """{(log, variant): its scores, or the sentence with which it has none}."""
    found = {}
    for what, path in logs.items():
        log = log_variants.read(path)
        for name, variant in log_variants.VARIANTS.items():
            with tempfile.TemporaryDirectory() as place:
                try:
                    log_variants.write(f"{place}/log.csv", variant(log))
                    s = scores(command, f"{place}/log.csv")
                except ValueError as reason:
                    s = str(reason)
            found[what, name] = s.replace(f"{place}/", "") if isinstance(s, str) else s
    return found


def disturbed(found, logs):
    """(a line for each log with the position's error on each of its variants, a sentence for each that was not scored)."""
    lines = [(what, *("-" if isinstance(s, str) else f"{s['position_rmse_mm']:.1f}" for s in (found[what, v] for v in log_variants.VARIANTS)))
             for what in logs]
    return lines, [f"{what}, {name}: {s}" for (what, name), s in found.items() if isinstance(s, str)]


def by_filter(found_of, logs, variants, figures):
    """A line for each log and filter: its figures, of one variant after the other."""
    def cell(of_variants, key, digits):
        return " / ".join("-" if isinstance(s, str) or s[key] is None else f"{s[key]:.{digits}f}" for s in of_variants)
    lines = []
    for what in logs:
        for name, found in found_of.items():
            of_variants = [found[what, variant] for variant in variants]
            lines.append((what, name, *(cell(of_variants, *FIGURES[figure]) for figure in figures)))
    return lines


CASSIE, WALK, GAZEBO = LOGS.values()
CHANGED_ROWS = log_variants.THINNED[1:]
DISTURBED = ("a foot slips 60 mm in 0.2 s", "a sole pivots 5 degrees in 0.2 s", "contacts 20 ms early", "contacts 20 ms late", "IMU 10 ms late",
             "accelerometer 1 % high")


def bound_text(least, most):
    if most == math.inf:
        return f">= {least:g}"
    return f"<= {most:g}" if least in (0, -math.inf) else f"{least:g} to {most:g}"


def asked(found, climbed):
    """A line for each figure that the estimator is held to: what, asked, measured, whether it holds."""
    own = {what: found[what, "as it is"] for what in LOGS.values() if (what, "as it is") in found}
    if len(own) < len(LOGS):
        return []
    lines = []

    def line(what, bounds, values, digits=1):
        """bounds: (least, most) for each value."""
        holds = all(value is not None and least <= value <= most for value, (least, most) in zip(values, bounds))
        said = [bound_text(*bound) for bound in bounds]
        lines.append((what, "; ".join(said[:1] if len(set(said)) == 1 else said), "; ".join("-" if v is None else f"{v:.{digits}f}" for v in values), "yes" if holds else "**no**"))

    def figures(what, *keys):
        return [own[what][key] for key in keys]

    def up_to(*bounds):
        return [(0, bound) for bound in bounds]
    line(f"{WALK}: position mm, drift %, tilt deg", up_to(13, 3, 0.62), figures(WALK, "position_rmse_mm", "drift_percent", "tilt_rmse_deg"), 2)
    line(f"{GAZEBO}: position mm, drift %", up_to(45, 1.2), figures(GAZEBO, "position_rmse_mm", "drift_percent"), 2)
    line(f"{CASSIE}: position mm, velocity mm/s", up_to(5, 8.5), figures(CASSIE, "position_rmse_mm", "velocity_rmse_mmps"))
    planted = [s["planted_foot_mm"] for s in own.values() if s["planted_foot_mm"] is not None]
    planted += climb_logs.each(climbed, climb_logs.NOISY, lambda alone, _: alone["planted_foot_mm"])
    line("a planted foot moves, mm: logs, then climbs", up_to(*[5] * len(planted)), planted)
    for what in own:
        line(f"{what}: rows within the bounds %, mean NEES", [(85, math.inf), (3, 10)], figures(what, "nees_in_bounds_percent", "nees_mean"))
    for what in own:
        for variant in CHANGED_ROWS:
            s = found[what, variant]
            known = [figure for figure in COMPARED if own[what][FIGURES[figure][0]]]
            changes = [None if isinstance(s, str) else 100 * (s[key] / own[what][key] - 1) for key, _ in map(FIGURES.get, known)]
            line(f"{what}, {variant}: change in % of {', '.join(figure.split(' RMSE')[0].split(' %')[0] for figure in known)}",
                 [(-15, 15)] * len(changes), changes, 0)
    for what in own:
        worse = [found[what, v]["position_rmse_mm"] - own[what]["position_rmse_mm"]
                 for v in DISTURBED if not isinstance(found[what, v], str)]  # a log without soles has no pivot; it is told above
        line(f"{what}: slip, pivot, contacts, IMU late, scale: position worse by mm, worst", up_to(3), [max(worse, default=None)])
    for name, key, lidar, bound in (("velocity mm/s", "velocity_rmse_mmps", climb_logs.NOISY, 12), ("tilt deg", "tilt_rmse_deg", climb_logs.NOISY, 0.12),
                                    ("position mm", "position_rmse_mm", climb_logs.NOISY, 6), ("position mm", "position_rmse_mm", climb_logs.TURNED, 8)):
        values = climb_logs.each(climbed, lidar, lambda _, fused, key=key: fused[key])
        line(f"climbs, {lidar}: {name}", up_to(*[bound] * len(values)), values, 2 if key == "tilt_rmse_deg" else 1)
    for lidar in climb_logs.LIDARS:
        for other, key in (("the odometry's", "odometry_position_rmse_mm"), ("the raw lidar poses'", "raw_rmse_mm")):
            shares = climb_logs.each(climbed, lidar, lambda _, fused, key=key: 100 * (fused["position_rmse_mm"] / fused[key] - 1))
            line(f"climbs, {lidar}: fused position worse than {other} by %", [(-math.inf, 10)] * len(shares), shares, 0)
    return lines


def gyro_against_truth(path):
    """(median, worst) over half seconds."""
    log = log_variants.read(path)
    apart_mrad = [1e3 * angle for angle in log_variants.gyro_against_truth(log, 0.5)]
    return statistics.median(apart_mrad), max(apart_mrad)


def counted(ours, peer, logs):
    """A sentence, of the shortest log, where there is a valgrind."""
    if not logs or not shutil.which("valgrind"):
        return ""
    what, path = min(logs.items(), key=lambda log: log[1].stat().st_size)
    others = f", invariant-ekf {instructions([peer], path, PEER_RUNS)}" if peer else ""
    return f"\n\nInstructions a row (callgrind; {what}): ours {instructions(ours, path, OURS_RUNS)}{others}."


def list_of(sentences):
    return "\n\nNot scored:\n\n" + "\n".join(f"- {s}" for s in sentences) if sentences else ""


def estimation(engine, _):
    logs = logs_found()
    if not logs:
        return None
    ours = [engine.tool, "estimate"]
    peer = compiled_peer(engine.peer) if engine.peer else None
    filters = {"ours": ours}
    if peer:
        filters |= {"invariant-ekf, its example's noise": [peer], "the same, gyro bias of the first 0.25 s": [peer, "still=0.25"],
                    "invariant-ekf, its authors' noise for Cassie": [peer, *CASSIE_NOISE]}
        beside = (f"[invariant-ekf]({PEER}) ({commit_of(engine.peer)}) has the same rows, first pose and scores; its feet are points, a "
                  "contact of 0.5 stands, and its biases begin at 0, where ours begin as a standstill at the start tells; once its gyro bias begins as the mean of the log's first 0.25 s. Its example's noise is "
                  "untouched: gyro 0.01, accelerometer 0.1, contacts 0.01, feet 3 mm. Its authors' for Cassie: 0.002, 0.04, 0.05; they compute the "
                  "feet's noise from the encoders', and we chose 8 mm for it.")
    else:
        beside = f"`toolchain/campaign estimation --peer PATH` adds invariant-ekf's rows, where PATH is a clone of {PEER}."
    lines, unscored = side_by_side(filters, logs)
    scored = {what: path for what, path in logs.items() if (what, "ours") in {line[:2] for line in lines}}
    variants = {name: varied(command, scored) for name, command in filters.items()}
    worse, unscored_variants = disturbed(variants["ours"], scored)
    climbed = climb_logs.measured(engine)
    return Page(
        "`polygmap estimate LOG.csv`, scored against the log's truth. The logs are third-party data (../shared/data, and what lies in the folder "
        f"`$POLYGMAP_LOGS`). {beside}\n\n" + rows(("log", "filter", *FIGURES), lines) + list_of(unscored) + counted(ours, peer, scored) +
        "\n\n## Logs that are not as they should be\n\nPosition RMSE, mm, of ours on the same logs made otherwise (`toolchain/campaigns/log_variants.py`). "
        "What slips or pivots is the foot that stands nearest to the log's middle.\n\n" +
        rows(("log", *log_variants.VARIANTS), worse) + list_of(unscored_variants) +
        "\n\nFewer rows, every one / every 2nd / every 5th of them:\n\n" + rows(("log", "filter", *COMPARED), by_filter(variants, scored, log_variants.THINNED, COMPARED)) +
        "\n\nBegun on one foot, in the middle of the log: the start is what the truth says there, and biases are unknown:\n\n" +
        rows(("log", "filter", *FIGURES), by_filter(variants, scored, ["begun on one foot"], FIGURES)) +
        "\n\nThe turn that the gyro feels in half a second, against the truth's: how far they are apart, median / worst. Steady, it is the gyro's bias; "
        "what comes and goes no filter can know.\n\n" +
        rows(("log", "mrad"), [(what, "{:.0f} / {:.0f}".format(*gyro_against_truth(path))) for what, path in scored.items()]) +
        "\n\n## Climbs\n\nUnder physics with everything drawn (`--reality 1`), ten steps; only the lidar odometry is as the column says. "
        "Velocity, tilt, planted foot and bounds: without / with the first of them. In brackets: the odometry's position alone, and the raw lidar poses'. "
        "All are by `polygmap estimate` from what the sensors said.\n\n" +
        climb_logs.table(climbed) + "\n\n## What is asked\n\nWhy a figure is missed is in [estimation](../estimation.md#what-is-asked-and-missed).\n\n" +
        rows(("figure", "asked", "measured", "holds"), asked(variants["ours"], climbed)), {})


TABLES = {"estimation": Table("State estimation on logs", (0,), estimation, 10,
                              ("toolchain/campaigns/climb_logs.py", "toolchain/campaigns/log_variants.py", REPLAY))}
