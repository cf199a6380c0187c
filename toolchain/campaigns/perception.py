# SPDX-License-Identifier: Apache-2.0
"""Tables of plane extraction, on generated frames with truth and on public ones."""
import re
import subprocess

from campaigns.engine import ROOT, Page, Table, rows

SHOWN = ("precision", "recall_treads", "recall_risers", "over_segmentation", "under_segmentation", "tread_angle_p95", "tread_offset_p95",
         "nosing_line_p95", "beyond_nosing_line_max", "columns_2px_beyond_max")


def planes(engine, seeds):
    done = subprocess.run([ROOT / "toolchain/checks/perceive", engine.tool, *map(str, seeds)], capture_output=True, text=True)
    if "sets and" not in done.stdout:
        return None
    sets = [(m[1], dict(p.split("=") for p in m[2].split())) for m in re.finditer(r"^-- (\w+ \w+) seed \d+: (.*)$", done.stdout, re.M)]
    names = sorted({n for n, _ in sets})
    shown = [f for f in (*SHOWN, "foreign_share") if f in sets[0][1]]
    least = ("precision", "recall_treads", "recall_risers")

    def worst(name, figure):
        values = [float(f[figure]) for n, f in sets if n == name and figure in f]
        return f"{(min if figure in least else max)(values):.3g}" if values else "-"

    missed = re.findall(r"^perceive: (.* error: .*)$", done.stdout, re.M)
    real = re.findall(r"^-- (\w+): (\d+ of \d+) planes, (\d+) detections$", done.stdout, re.M)
    text = (f"Sixteen scenes for each camera, noise and seed ({', '.join(map(str, seeds))}); worst seed of each. Angles in degrees, offsets and "
            "lines in mm.\n\n" + rows(("figure", *names), [(f, *(worst(n, f) for n in names)) for f in shown]) +
            "\n\nPublic frames against reference labels, which are no truth:\n\n" + rows(("frame", "planes found", "detections"), real) +
            ("\n\nMissed:\n\n" + "\n".join(f"- {m}" for m in missed) if missed else "\n\nNo bar is missed."))
    return Page(text, {"1 planes": ("treads and risers found in generated frames, least",
                                    f"{min(float(f['recall_treads']) for _, f in sets):.2f}; {min(float(f['recall_risers']) for _, f in sets):.2f}",
                                    "0.99; 0.97")})


TABLES = {"planes": Table("Planes in single frames", (20260101, 1, 2, 3, 4, 5), planes, 6)}
