# SPDX-License-Identifier: Apache-2.0
"""Tables of instructions and memory."""
import re
import subprocess

from campaigns.engine import ROOT, Figure, Page, Table, build, headline, rows

WANTED = {"whole_frame": 3_650_000, "footholds": 1_200_000, "gait_swing_tick": 20_000, "gait_shift_tick": 20_000}


def cost(engine, _):
    records = {"instructions.txt": ("perception_instructions", "estimation_instructions", "gait_instructions", "mailbox_instructions"),
               "reference_instructions.txt": ("reference_instructions",)}
    build(*(p for programs in records.values() for p in programs))
    counted = "".join(subprocess.run([ROOT / "toolchain/checks/instructions", "--recorded", ROOT / "tests/benchmarks" / record,
                                      *(ROOT / "build/release/tests/benchmarks" / p for p in programs)],
                                     capture_output=True, text=True).stdout for record, programs in records.items())
    stages = {m[1]: int(m[2].replace(",", "")) for m in re.finditer(r"^\s*(?:instructions: \w+: )?(\w+) ([\d,]+)(?:,|$)", counted, re.M)}
    if missing := {"paper_route", *WANTED} - set(stages):
        raise SystemExit(f"campaign: not counted: {', '.join(sorted(missing))}")
    summary = engine.climb(["--steps", 1])
    memory, total = summary["static_memory"], summary["static_memory_bytes"]
    stacks = memory.get("stacks", 0)
    text = ("Instructions (callgrind, x86-64 with AVX2) of one run of each stage: perception per frame, estimation and gait per tick.\n\n" +
            rows(("stage", "instructions", "at most"), [(s, f"{n:,}", f"{WANTED[s]:,}" if s in WANTED else "") for s, n in sorted(stages.items())]) +
            "\n\nStatic memory, bytes:\n\n" + rows(("stage", "bytes"), [*memory.items(), ("all", total), ("all but the stacks", total - stacks)]))
    frame, search = stages["whole_frame"], stages["footholds"]
    tick = max(stages["gait_swing_tick"], stages["gait_shift_tick"])
    return Page(text, {
        "1 frame": headline("instructions for a picture", Figure(frame, f"{frame / 1e6:.2f} M", "most", WANTED["whole_frame"], "3.65 M")),
        "2 search": headline("instructions of a foothold search", Figure(search, f"{search / 1e6:.2f} M", "most", WANTED["footholds"], "1.2 M"), "", False),
        "3 tick": headline("instructions of a gait tick", Figure(tick, f"{tick / 1e3:.1f} k", "most", WANTED["gait_swing_tick"], "20 k"), "", False),
        "4 memory": headline("memory without stacks", Figure(total - stacks, f"{(total - stacks) / 1e6:.2f} MB", "most", 2_000_000, "2.0 MB")),
        "5 heap": headline("heap calls in a climb", Figure(summary["heap_calls"], str(summary["heap_calls"]), "most", 0), "", False)})


TABLES = {"cost": Table("Instructions and memory", (0,), cost, 2,
                        ("tests/benchmarks", "tests/reference", "tests/support", "tests/CMakeLists.txt", "toolchain/checks/instructions"))}
