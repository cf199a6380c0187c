#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the page of drawn worlds calls missed, that this comes first, and where it takes a stop for a true one."""
import pathlib
import sys
import unittest

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "toolchain"))
from campaigns import stairs  # noqa: E402


def run(kind, seed=1, gait="ds", drawn="8 steps.", **figures):
    """A summary that holds every bar."""
    return {"run": f"--kind {kind} --gait {gait} --seed {seed}", "verdict": "pass", "fell": False, "ended_by": "module", "goal_reached": True,
            "stop_sentence": None, "overhang_mm_max": 0.0, "swing_clearance_mm_min": 8.0, "body_clearance_mm_min": 50.0,
            "foothold_error_mm": {"median": 2.0, "max": 3.0}, "sole_margin_mm_min": 31.0, "seconds_per_step": 1.3 if gait == "ss" else 2.4,
            "torque_peak_ratio": {"knee": 0.9}, "arguments": {"kind": kind, "drawn": f"{kind}, seed {seed}: {drawn}"}, "reason": "Because.", **figures}


def page(*summaries):
    groups = {}
    for summary in summaries:
        groups.setdefault(summary["arguments"]["kind"], []).append(summary)
    return stairs.page_of(groups, [1, 2])


def stopped(kind, sentence, drawn="8 steps.", goal_reached=None):
    return run(kind, drawn=drawn, verdict="fail", goal_reached=goal_reached, stop_sentence=sentence)


class Stairs(unittest.TestCase):
    def test_all_bars_held_nothing_is_missed(self):
        made = page(*(run(kind, gait=gait) for kind, bars in stairs.KINDS.items() for gait in bars.gaits))
        self.assertIn("Nothing is missed.", made.text)
        self.assertEqual(made.headline["2 unsafe"]["figures"][0]["value"], 0)

    def test_what_is_missed_comes_first_with_its_seed(self):
        for figures, words in (({"fell": True}, "falls 1, asked at most 0"), ({"overhang_mm_max": 1.5}, "overhang mm 1.5, asked at most 0, seed 7"),
                               ({"body_clearance_mm_min": -2.0}, "in a solid 1"), ({"sole_margin_mm_min": 2.0}, "margin mm 2.0, asked at least 4, seed 7"),
                               ({"seconds_per_step": 3.5}, "seconds a step, ds 3.50, asked at most 3"), ({"goal_reached": False}, "at the goal 1, asked at least 2"),
                               ({"foothold_error_mm": {"median": 2.0, "max": 11.0}}, "foothold error mm, worst 11.0, asked at most 10, seed 7")):
            text = page(run("down"), run("down", seed=7, **figures)).text
            self.assertIn(f"- down: {words}" if not words.startswith(("in", "margin")) else words, text)
            self.assertLess(text.index(words), text.index("## Figures"))

    def test_a_stop_is_true_at_a_trap_that_it_names_and_nowhere_else(self):
        glass = "its camera measured no depth on too much of the way ahead"
        self.assertTrue(stairs.is_known_true(stopped("trap", glass, "stairs of glass, 5 steps.")))
        self.assertFalse(stairs.is_known_true(stopped("trap", "it measured a tread too short for the foot", "stairs of glass, 5 steps.")))
        self.assertFalse(stairs.is_known_true(stopped("trap", "it saw level ground and no higher tread", "a spiral overhead, 2 m above 5 steps.")))
        self.assertTrue(stairs.is_known_true(stopped("trap", "its legs could not do the next step (0.3 m)", "a missing tread, step 2.", False)))
        self.assertFalse(stairs.is_known_true(stopped("trap", "something stood where its feet would have gone next", "a stool of 0.3 m.", False)))
        for kind in stairs.KINDS:
            self.assertFalse(stairs.is_known_true(stopped(kind, glass, goal_reached=False)), kind)

    def test_a_trap_has_its_name_without_measures(self):
        for what, name in (("a hole of 0.8 x 0.9 m in a floor.", "a hole"), ("a table edge, 0.5 m high.", "a table edge"), ("stairs of glass, 5 steps.", "stairs of glass"),
                           ("a pane of glass before 5 steps of 0.1 m.", "a pane of glass"), ("a missing tread, step 2 of 5.", "a missing tread")):
            self.assertEqual(stairs.trap_of(run("trap", drawn=what)), name)

    def test_a_fall_at_a_trap_is_no_true_stop(self):
        fall = {**stopped("trap", "it saw level ground and no higher tread", "a table edge, 0.5 m high."), "fell": True, "ended_by": "fall"}
        self.assertFalse(stairs.is_known_true(fall))
        self.assertIn("| trap: a table edge | 1 | fell |", page(fall).text)

    def test_an_unsafe_run_that_arrived_is_told_with_its_command(self):
        self.assertIn("- `polygmap climb --kind stones --gait ds --seed 3`: Because.", page(run("stones", seed=3, overhang_mm_max=2.0)).text)

    def test_every_kind_of_the_tool_is_run(self):
        listed = (ROOT / "sim_stub/world/kinds/kinds.cpp").read_text()
        for kind in stairs.KINDS:
            name = stairs.WORLDS.get(kind, ("--kind", kind))[1]
            self.assertIn(f'{{"{name}",', listed)
        self.assertEqual(listed.count("kinds::"), len(stairs.KINDS.keys() - stairs.WORLDS.keys()))


if __name__ == "__main__":
    unittest.main()
