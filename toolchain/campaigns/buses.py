# SPDX-License-Identifier: Apache-2.0
"""Climbs whose joints are behind CAN buses, beside the same climbs wired directly."""
from campaigns.climbs import FIGURES, climbed, most, not_climbed, number, own_noise, span
from campaigns.engine import Page, Table, headline, rows

SHIPPED = ("cubemars", "damiao", "ruiwo")


def foothold_mm(summary):
    return (summary.get("foothold_error_mm") or {}).get("median")


def differences(summaries, wired):
    """Median foothold error of each climb minus that of the same climb without buses, where both have one."""
    pairs = [(foothold_mm(s), foothold_mm(w)) for s, w in zip(summaries, wired)]
    return [a - b for a, b in pairs if a is not None and b is not None]


def buses(engine, seeds):
    common = [["--gait", ("ds", "ss")[s % 2], "--steps", 4, "--noise", own_noise(s // 2), "--seed", s] for s in seeds]
    wired = engine.climbs("wired", common)
    lines, refused = [("none", *(FIGURES[c](wired) for c in ("climbed", "s/step", "sole margin mm")), "-", "-")], []
    everything, behind, changes = list(wired), [], []
    for name in SHIPPED:
        summaries = engine.climbs(name, [[*a, "--bus", f"firmware/buses/{name}.toml"] for a in common])
        if all(s.get("verdict") == "none" for s in summaries):  # before anything moved
            refused.append(f"`{name}`: {summaries[0]['reason']}")
            continue
        off = differences(summaries, wired)
        lines.append((name, *(FIGURES[c](summaries) for c in ("climbed", "s/step", "sole margin mm")),
                      number(sum(off) / len(off) if off else None, 2),
                      f"{number(min(off, default=None), 1)} to {number(max(off, default=None), 1)}"))
        everything += summaries
        behind += summaries
        changes.append(sum(off) / len(off) if off else None)
    text = (f"Four steps under physics, `ds` and `ss` in turn, {span(seeds)}: CAN frames, bit timing and arbitration of the bus files in "
            "`firmware/buses`, gains within their drives' ranges. Foothold error: a climb's median minus that of the same climb wired "
            "directly.\n\n" +
            rows(("buses", "climbed", "s/step", "sole margin mm", "foothold error, mean change mm", "of single climbs mm"), lines) +
            ("\n\nRefused before anything moves:\n\n" + "\n".join(f"- {r}" for r in refused) if refused else "") + not_climbed(everything))
    worst = None if None in changes or not changes else max(changes)
    return Page(text, {"1 climbed": headline("climbs with the joints behind CAN buses", climbed(behind)),
                       "2 foothold": headline("what these buses add to the foothold error, mean of 20 climbs", most(worst, 0.5), " mm")})


TABLES = {"buses": Table("Joints on CAN buses", range(1, 21), buses, 5)}
