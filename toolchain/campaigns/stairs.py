# SPDX-License-Identifier: Apache-2.0
"""Worlds of every kind, drawn by the seed: stairs both ways, spirals, ramps, stones, the way to them, and traps."""
import collections
import dataclasses
import re
import statistics

from campaigns.climbs import grouped, number, own_noise, ratio, span, worst_climb
from campaigns.engine import Figure, Page, Table, headline, rows

GAITS = ("ds", "ss")


@dataclasses.dataclass(frozen=True)
class Bars:
    """What is asked of a kind; None: nothing is."""
    foothold_mm: tuple  # median, max
    margin_mm: float | None = None
    pace_s: tuple = (None, None)  # ds, ss
    torque: float | None = None
    gaits: tuple = GAITS


DS = GAITS[:1]
KINDS = {
    "up": Bars((4, 9), 5, (2.6, 1.4), 0.98),
    "up-high": Bars((4, 9), 4, (2.8, 1.7), 1),
    "up-nosing": Bars((5, 9), 5, (2.6, 1.5)),
    "up-open": Bars((5, 9), 5, (2.6, 1.5)),
    "up-back": Bars((5, 10), 4, gaits=DS),
    "down": Bars((5, 10), 4, (3.0, 1.8), 0.98),
    "down-high": Bars((5, 10), 4, (3.4, None), 1, DS),
    "down-open": Bars((5, 9), 5, (2.6, 1.5)),
    "spiral-up": Bars((5, 10), 3, (2.8, 1.6)),
    "spiral-down": Bars((5, 10), 3, (2.8, 1.6)),
    "landing": Bars((4, 9), 5),
    "curb-up": Bars((4, 8), 6, gaits=DS),
    "curb-down": Bars((4, 8), 6, gaits=DS),
    "ramp-up": Bars((6, 12), gaits=DS),
    "ramp-down": Bars((6, 12), gaits=DS),
    "stones": Bars((5, 10), 4, gaits=DS),
    "approach": Bars((4, 9), gaits=DS),
    "trap": Bars((None, None), gaits=DS),
}
# The arguments of what is no kind of the tool's: up, and back down the same flight.
WORLDS = {"up-back": ("--kind", "up", "--back")}
# Traps that nobody can go through or round, and words of what is true there. In all other worlds a stop is a miss, whatever
# it says: the way to the goal is free.
STOPS = {
    "a missing tread": ("too high to step on", "no surface to step on", "could not do the next step"),
    "a stool": ("level ground", "something stood"),
    "a table edge": ("level ground", "no surface to step on"),
    "stairs of glass": ("level ground", "no depth", "no surface to step on"),
    "a pane of glass": ("level ground", "no depth", "no surface to step on"),
}
HAS_A_GOAL = "a missing tread"  # of these; where another one has a goal, a way leads round it


def drawn(summary):
    """What the seed drew, without its kind and seed: "a hole of 1 x 2 m."."""
    return (summary.get("arguments") or {}).get("drawn", "").partition(": ")[2]


def trap_of(summary):
    """Without its measures: "a hole"."""
    return re.match(r"\D*?(?=( of| before)? \d|[,.]|$)", drawn(summary))[0]


def stop_of(summary):
    """Why a run that ended by itself, standing, did not go on; "" of any other."""
    if summary.get("fell") or summary.get("ended_by") != "module":
        return ""
    return summary.get("stop_sentence") or "ended by itself, without a reason"


def in_a_solid(summary):
    """A foot or the body."""
    values = [summary.get(key) for key in ("swing_clearance_mm_min", "body_clearance_mm_min")]
    return any(v is not None and v <= 0 for v in values)


def unsafe(summary):
    return bool(summary.get("fell") or (summary.get("overhang_mm_max") or 0) > 0 or in_a_solid(summary) or summary.get("stood_on_wrongly"))


def is_known_true(summary):
    """It stopped where nobody could go on, and said what is so there."""
    sentence, what = stop_of(summary), drawn(summary)
    trap = next((name for name in STOPS if what.startswith(name)), None)
    if trap is None or (summary.get("goal_reached") is not None and trap != HAS_A_GOAL):
        return False
    return any(words in sentence for words in STOPS[trap])


def arrived(summary):
    """It is where it was to go, whatever else happened; a world without a goal is passed."""
    goal = summary.get("goal_reached")
    return summary.get("verdict") == "pass" if goal is None else bool(goal)


def of_gait(summaries, gait):
    return [s for s in summaries if f"--gait {gait}" in s["run"]]


def median(summaries):
    values = [v for s in summaries if (v := (s.get("foothold_error_mm") or {}).get("median")) is not None]
    return statistics.median(values) if values else None


@dataclasses.dataclass
class Cell:
    """A figure of a kind beside what is asked; digits as it is shown."""
    name: str
    value: float | None
    asked: float | None
    digits: int = 1
    least: bool = False
    seed: str | None = None

    def missed(self):
        if self.value is None or self.asked is None:
            return False
        return self.value < self.asked if self.least else self.value > self.asked

    def text(self):
        shown = number(self.value, self.digits)
        if self.asked is None:
            return shown
        return f"{'**' * self.missed()}{shown}{'**' * self.missed()} ({'>=' if self.least else '<='} {self.asked:g})"

    def sentence(self):
        of = f", seed {self.seed}" if self.seed else ""
        return f"{self.name} {number(self.value, self.digits)}, asked {'at least' if self.least else 'at most'} {self.asked:g}{of}"


def cells_of(kind, bars, summaries):
    """The row of a kind: column -> Cell."""
    def worst_cell(name, asked, path, best=max, digits=1, group=summaries):
        value, seed = worst_climb(group, *path, best=best)
        return Cell(name, value, asked, digits, best is min, seed)

    done = sum(arrived(s) or is_known_true(s) for s in summaries) if kind == "trap" else sum(map(arrived, summaries))
    name = "at the goal or stopped with a true sentence" if kind == "trap" else "at the goal"
    return {
        "at the goal": Cell(name, done, len(summaries), 0, True),
        "falls": Cell("falls", sum(bool(s.get("fell")) for s in summaries), 0, 0),
        "overhang mm": worst_cell("overhang mm", 0, ("overhang_mm_max",)),
        "stood wrongly": Cell("runs with a foot on what is not to be stood on", sum(bool(s.get("stood_on_wrongly")) for s in summaries), 0, 0),
        "in a solid": Cell("runs with foot or body in a solid", sum(map(in_a_solid, summaries)), 0, 0),
        "foothold mm, median": Cell("foothold error mm, median", median(summaries), bars.foothold_mm[0]),
        "max": worst_cell("foothold error mm, worst", bars.foothold_mm[1], ("foothold_error_mm", "max")),
        "body mm": worst_cell("body to a solid mm", None, ("body_clearance_mm_min",), min),
        "margin mm": worst_cell("sole margin mm", bars.margin_mm, ("sole_margin_mm_min",), min),
        **{f"s/step {gait}": worst_cell(f"seconds a step, {gait}", bars.pace_s[i], ("seconds_per_step",), digits=2,
                                        group=of_gait(summaries, gait)) for i, gait in enumerate(GAITS)},
        "torque": Cell("torque over the drive's", ratio(summaries, "torque_peak_ratio"), bars.torque, 2),
    }


def missed(table):
    lines = [f"- {kind}: {cell.sentence()}" for kind, cells in table.items() for cell in cells.values() if cell.missed()]
    return "\n".join(lines) if lines else "Nothing is missed."


def endings(groups):
    """Each sentence of a kind that did not arrive, how often, and the first seed."""
    lines = []
    for kind, summaries in groups.items():
        said = collections.defaultdict(list)
        for s in summaries:
            if arrived(s) and not unsafe(s):
                continue
            what = "fell" if s.get("fell") else stop_of(s) or f"ended by the {s.get('ended_by', 'tool')}: {s.get('reason', '')}"
            truth = "" if kind != "trap" else "true" if is_known_true(s) else "not known to be true"
            said[(trap_of(s) if kind == "trap" else "", what, truth)].append(s)
        for (trap, what, truth), those in sorted(said.items(), key=lambda item: -len(item[1])):
            lines.append((kind + (f": {trap}" if trap else ""), len(those), what, truth or "the way was free", f"`polygmap climb {those[0]['run']}`"))
    return rows(("kind", "runs", "how it ended", "is that so", "the first of them"), lines) if lines else "None."


def unsafe_runs(groups):
    bad = [s for summaries in groups.values() for s in summaries if unsafe(s)]
    return "\n".join(f"- `polygmap climb {s['run']}`: {s.get('reason', '')}" for s in bad) if bad else "None."


def runs_of(seeds):
    return {kind: [[*WORLDS.get(kind, ("--kind", kind)), "--gait", gait, "--noise", own_noise(s), "--seed", s, "--reality", 1] for gait in bars.gaits for s in seeds]
            for kind, bars in KINDS.items()}


def page_of(groups, seeds):
    table = {kind: cells_of(kind, KINDS[kind], summaries) for kind, summaries in groups.items()}
    columns = list(next(iter(table.values())))
    everything = [s for summaries in groups.values() for s in summaries]
    text = (f"Worlds drawn by the seed ({span(seeds)}) of every kind (`polygmap climb --kind KIND --seed S`, see "
            "[kinds](../reference/cli.md#polygmap-climb)), under physics with perception in the loop, `--reality 1`, even seeds with correlated "
            f"noise, `ds` and `ss` where a kind has steps.\n\n## What is missed\n\n{missed(table)}\n\n"
            "## Figures\n\nThe worst of each kind's runs, the median over them; in brackets what is asked. Seconds a step are from surface to surface. "
            "Asked, too, and not measured here: seconds for a turn on a landing, how flat a sole is on a ramp, the stand-off after an approach and how "
            "near the body comes to furniture alone, how soon it stops at a trap, pushes.\n\n" +
            rows(("kind", "runs", *columns), [(kind, len(groups[kind]), *(c.text() for c in cells.values())) for kind, cells in table.items()]) +
            f"\n\n## Falls, soles over an edge, feet where they must not stand, feet or bodies in a solid\n\n{unsafe_runs(groups)}\n\n"
            "## Where it did not arrive\n\nThe module's own sentence. Whether it is true is known of traps alone: all other worlds can be gone "
            f"through, so none of them is a reason to stop.\n\n{endings(groups)}")
    bad, there = sum(map(unsafe, everything)), sum(arrived(s) or is_known_true(s) for s in everything)
    return Page(text, {
        "1 arrived": headline("stairs, ramps, stones and traps of every kind, drawn: at the goal, or stopped where one must",
                              Figure(there, f"{there} of {len(everything)}")),
        "2 unsafe": headline("falls, soles over an edge or where they must not stand, feet or bodies in a solid among them", Figure(bad, f"{bad} of {len(everything)}", "most", 0))})


def stairs(engine, seeds):
    return page_of(grouped(engine, "stairs", runs_of(seeds)), seeds)


TABLES = {"stairs": Table("Any stairs, both ways, and the way to them", range(1, 13), stairs, 180, ("toolchain/campaigns/climbs.py",))}
