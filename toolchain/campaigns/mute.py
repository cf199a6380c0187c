# SPDX-License-Identifier: Apache-2.0
"""What becomes of a climb when a drive, or a bus with its drives, falls silent for good."""
import concurrent.futures
import re
import subprocess

from campaigns.climbs import span
from campaigns.engine import ROOT, Page, Table, build, rows

PROGRAM, BUS = "build/release/tests/benchmarks/mute_drives", "firmware/buses/cubemars.toml"
# The program's columns: of the leg that stands, then of the one that swings: roll, yaw and pitch of the hip, knee, pitch and
# roll of the ankle; then the buses.
GROUPS = {"hip and knee that stand": range(0, 4), "ankle that stands": range(4, 6), "hip roll, hip yaw, ankle that swing": (6, 7, 10, 11),
          "hip pitch that swings": (8,), "knee that swings": (9,), "bus: hip that stands": (12,), "bus: knee and ankle that stand": (13,),
          "bus: hip that swings": (14,), "bus: knee and ankle that swing": (15,)}
LINE = re.compile(r"^\d+ \w+ +(both|air) +([\d.]+)((?: +(?:ok|foot|FELL|runs)[\d.]+)+)$", re.M)
CELL = re.compile(r"(ok|foot|FELL|runs)([\d.]+)")


def mute(engine, seeds):
    build("mute_drives")

    def run(which):
        gait, seed = which
        done = subprocess.run([ROOT / PROGRAM, ROOT / BUS, gait, "mujoco", str(seed)], capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"campaign: mute_drives {gait} {seed}: {done.stderr[-400:]}")
        print(f"mute: {gait}, seed {seed}: {done.stdout.splitlines()[-1]}", flush=True)
        moments = [(m[1], float(m[2]), CELL.findall(m[3])) for m in LINE.finditer(done.stdout)]
        counted = sum(c[0] == "ok" for m in moments for c in m[2]), sum(len(m[2]) for m in moments)
        if f"on both feet: {counted[0]} of {counted[1]}" != done.stdout.splitlines()[-1]:
            raise SystemExit(f"campaign: mute_drives {gait} {seed}: {counted} read of: {done.stdout.splitlines()[-1]}")
        return moments

    text = (f"`{PROGRAM} {BUS} ds|ss mujoco SEED` climbs two steps under physics, perception in the loop, and takes away for good each drive "
            f"and each bus at eight moments of each swing, {span(seeds)}. Such a drive neither hears nor speaks and holds its last "
            "command. Counted is how often the module came to `safe_stop` and the robot stands on both feet two seconds later.\n")
    for gait in ("ds", "ss"):
        with concurrent.futures.ThreadPoolExecutor(engine.jobs) as pool:
            moments = [m for climb in pool.map(run, [(gait, s) for s in seeds]) for m in climb]
        lines = []
        for where, share in sorted({m[:2] for m in moments}, key=lambda m: (m[0] == "air", m[1])):
            outcomes = [cells for *moment, cells in moments if tuple(moment) == (where, share)]

            def stands(columns):
                cells = [o[c] for o in outcomes for c in columns]
                return f"{sum(c[0] == 'ok' for c in cells)} of {len(cells)}"
            lines.append((f"{'in the air' if where == 'air' else 'both feet down'}, {100 * share:.0f} %",
                          *(stands(c) for c in GROUPS.values()), stands(range(16))))
        good = [float(s) for *_, cells in moments for outcome, s in cells if outcome == "ok"]
        text += (f"\n## Gait `{gait}`\n\n" + rows(("moment", *GROUPS, "all"), lines) +
                 f"\n\nIn sum {len(good)} of {sum(len(m[2]) for m in moments)}. Where it stands, `safe_stop` came within {max(good, default=0.0):.2f} s.\n")
    return Page(text, {})


TABLES = {"mute": Table("Drives and buses that fall silent", range(1, 2), mute, 4,
                        ("tests/benchmarks/mute_drives.cpp", "tests/support/bus_climb.hpp"))}
