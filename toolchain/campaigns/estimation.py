# SPDX-License-Identifier: Apache-2.0
"""Tables of state estimation on logs."""
import json
import os
import pathlib
import subprocess
import tempfile

from campaigns.engine import ROOT, Page, Table, rows

LOGS = {"cassie/cassie_walk_open.csv": "Cassie, simulated walk, 5 s", "icub/walk.csv": "iCub, real walk, Vicon, 12 s",
        "icub/gazebo_0_35.csv": "iCub3 in Gazebo, 35 s"}


def logs(engine, _):
    place = pathlib.Path(os.environ.get("POLYGMAP_SHARED_DATA", ROOT.parent / "shared/data"))
    if not any((place / name).exists() for name in LOGS):
        return None
    lines = []
    for name, what in LOGS.items():
        if not (place / name).exists():
            lines.append((what, "-", "-", "-", "-", "is not there"))
            continue
        with tempfile.TemporaryDirectory() as out:
            done = subprocess.run([engine.tool, "estimate", place / name, "--json", f"{out}/scores.json"], capture_output=True, text=True)
            if done.returncode:
                lines.append((what, "-", "-", "-", "-", done.stderr.strip()))
                continue
            s = json.loads(pathlib.Path(out, "scores.json").read_text())
        s = s.get("score", s)
        lines.append((what, f"{s['position_rmse_mm']:.1f}", f"{s['velocity_rmse_mmps']:.1f}", f"{s['drift_percent']:.2f}",
                      f"{s['nees_in_bounds_percent']:.0f}", ""))
    return Page("`polygmap estimate LOG.csv`, scored against the log's truth. The logs are third-party data (../shared/data).\n\n" +
                rows(("log", "position RMSE mm", "velocity RMSE mm/s", "drift % of the way", "rows within the 95 % bounds %", ""), lines),
                {})


TABLES = {"logs": Table("State estimation on logs", (0,), logs, 1)}
