#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the paper's page calls worse, that this comes first, and how it reads a report's series."""
import base64
import copy
import pathlib
import re
import sys
import unittest
import zlib

import numpy as np

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "toolchain"))
from campaigns.paper import page, series, trials  # noqa: E402

TRIALS = trials.paper_trials()
FIRST = TRIALS[0]  # 34 s, 10 steps, 21 Hz, 11.2 mm


def climb(seed=1, **figures):
    """A summary that is better than every trial of the paper."""
    summary = {"run": f"--seed {seed}", "verdict": "pass", "climb_time_s": 5.0, "plane_rate_hz": 29.9, "execution_error_mm": {"max": 3.0},
               "foothold_error_mm": {"max": 5.0}, "tracking_error_mm": {"x_max": 20.0, "z_max": 7.0}, "swing_clearance_mm_min": 6.0,
               "odometry_jitter_mm": {"lio": 10.0, "fused": 1.0}, "odometry_rmse_mm": {"lio": 20.0, "fused": 4.0},
               "odometry_drift_mm": {"base": 9.0, "fused": 5.0}}
    return {**copy.deepcopy(summary), **figures}


def blocks_of(summaries):
    rows = [(trial, "`--reality 1`", summaries) for trial in TRIALS]
    worse = trials.worse_than_the_paper(rows, {"`--reality 1`": [climb()]}, [climb()])
    told = {name: ("alt", "caption") for name in ("fig4", "fig5", "fig7")}
    return list(trials.blocks_of(rows, TRIALS, range(1, 26), worse, [climb()], {"`--reality 1`": [climb()]}, told, {name: "polygmap climb" for name in told}))


class Worse(unittest.TestCase):
    def worse(self, *summaries):
        return list(trials.worse_in(FIRST, "`--reality 0`", summaries))

    def test_better_climbs_are_not_listed(self):
        self.assertEqual(self.worse(climb(), climb(2)), [])
        self.assertEqual(self.worse(climb(climb_time_s=34.0, plane_rate_hz=21.0, execution_error_mm={"max": 11.2})), [])  # the same is no worse

    def test_each_figure_that_is_worse_is_listed_with_its_seed(self):
        for change, said in (({"climb_time_s": 34.1}, "T 34.1 s"), ({"plane_rate_hz": 20.9}, "planes 20.9 Hz"),
                             ({"execution_error_mm": {"max": 11.3}}, "e_m 11.3 mm"), ({"foothold_error_mm": {"max": 11.4}}, "true stairs")):
            sentences = self.worse(climb(), climb(), climb(7, **change))
            self.assertEqual(len(sentences), 1, change)
            self.assertIn(said, sentences[0])
            self.assertIn("seed 7", sentences[0])
            self.assertIn("Table I, trial 1", sentences[0])
            self.assertIn("(no worse)", sentences[0])
            self.assertIn("(worse, too)", self.worse(climb(7, **change))[0])

    def test_a_climb_that_failed_is_listed(self):
        sentences = self.worse(climb(), climb(2, verdict="fail"))
        self.assertEqual(len(sentences), 1)
        self.assertIn("1 of 2 climbs failed", sentences[0])

    def test_a_figure_that_no_climb_has_is_listed(self):
        self.assertIn("no climb has planes", self.worse(climb(plane_rate_hz=None))[0])

    def test_figures_4_and_7_are_judged(self):
        def judged(fused, tracked):
            return trials.worse_than_the_paper([], {"`--reality 1`": fused}, tracked)
        self.assertEqual(judged([climb()], [climb()]), [])
        drifts = climb(odometry_drift_mm={"base": 4.0, "fused": 5.0})
        self.assertRegex(judged([climb(), drifts], [climb()])[0], "drifts less than odometry.*`--reality 1` in 1 of 2")
        far = climb(3, tracking_error_mm={"x_max": 20.0, "z_max": 40.1})
        self.assertRegex(judged([climb()], [climb(), far])[0], r"Fig. 7.*40\.1 mm.*desired z.*seed 3")
        self.assertEqual(len(judged([climb()], [])), 2)  # unknown is not within


class Paper(unittest.TestCase):
    def test_what_is_worse_comes_first(self):
        text = page.markdown(blocks_of([climb(9, execution_error_mm={"max": 99.0})]), "paper")
        self.assertTrue(text.startswith("## Worse than the paper"))
        first = text.split("\n## ")[0]
        self.assertEqual(first.count("e_m 99.0 mm"), len(TRIALS))
        self.assertNotIn("Nothing", first)
        self.assertLess(text.index("no proof"), text.index("## Table I"))

    def test_a_climb_that_failed_is_told_with_its_command(self):
        text = page.markdown(blocks_of([climb(), climb(2, verdict="fail", reason="It fell.")]), "paper")
        self.assertIn("- `polygmap climb --seed 2`: It fell.", text.split("## Not climbed")[1])
        self.assertNotIn("Not climbed", page.markdown(blocks_of([climb()]), "paper"))

    def test_nothing_worse_is_said(self):
        text = page.markdown(blocks_of([climb()]), "paper")
        self.assertIn("- Nothing", text.split("\n## ")[0])

    def test_html_has_the_same_and_needs_nothing_beside_it(self):
        html = page.html("a < b", blocks_of([climb(9, execution_error_mm={"max": 99.0})]), {name: "<svg/>" for name in ("fig4", "fig5", "fig7")})
        self.assertIn("SPDX", html.splitlines()[1])
        self.assertLess(html.index("e_m 99.0 mm"), html.index("Table I: the paper"))
        self.assertEqual(html.count("src=\"data:image/svg+xml;base64,PHN2Zy8+\""), 3)
        self.assertIsNone(re.search(r'(src|href)="(?!data:)', html))
        self.assertIn("<h1>a &lt; b</h1>", html)
        for tag in ("table", "ul", "figure", "div"):
            self.assertEqual(html.count(f"<{tag}"), html.count(f"</{tag}>"), tag)

    def test_trials_are_the_papers(self):
        """Its own last lines: "max" of each column, and what physics says of them."""
        of = {table: [t for t in TRIALS if t.table == table] for table in ("I", "II")}
        for table, top in (("I", (35, 10, 29, 12.4)), ("II", (11.2, 6, 23, 33.4))):
            self.assertEqual(len(of[table]), 5)
            self.assertEqual(tuple(max(getattr(t, name) for t in of[table]) for name in ("t_s", "steps", "planes_hz", "e_m_mm")), top)
        physics = (ROOT / "toolchain/campaigns/climbs.py").read_text()
        for name, group in (("paper, simulated, DS, 5 trials", of["I"]), ("paper, real, DS, 2 trials", [t for t in of["II"] if t.gait == "DS"]),
                            ("paper, real, SS, 3 trials", [t for t in of["II"] if t.gait == "SS"])):
            told = re.search(rf'\("{name}", "(.*?)", "(.*?)", "(.*?)"\)', physics)
            for text, values in zip(told.groups(), ([t.t_s / t.steps for t in group], [t.e_m_mm for t in group], [t.planes_hz for t in group])):
                low, high = map(float, text.split("-"))
                self.assertAlmostEqual(low, min(values), delta=0.01)
                self.assertAlmostEqual(high, max(values), delta=0.01)

    def test_climbs_are_those_of_the_row(self):
        real = next(t for t in TRIALS if t.gait == "SS" and t.steps == 6)
        self.assertEqual(trials.arguments_of(real, 2, 1), ["--gait", "ss", "--steps", 6, "--noise", "correlated", "--seed", 2, "--reality", 1])
        self.assertNotIn("--reality", trials.arguments_of(FIRST, 1, 0))


class Series(unittest.TestCase):
    def test_a_block_is_read(self):
        raw = np.array([[1, 30000, -30000, -32768], [5, 5, 6, 7]], "<i2")  # 30000 to -30000 wraps around
        before = np.concatenate([np.zeros((2, 1), "<i2"), raw[:, :-1]], axis=1)
        block = {"type": "i16", "columns": 2, "count": 4, "scale": [0.1, 1.0], "offset": [2.0, 0.0], "delta": True, "zlib": True,
                 "data": base64.b64encode(zlib.compress((raw - before).astype("<i2").tobytes())).decode()}
        values = series.values_of(block)
        np.testing.assert_allclose(values[:3, 0], [2.1, 3002.0, -2998.0])
        self.assertTrue(np.isnan(values[3, 0]))
        np.testing.assert_allclose(values[:, 1], [5, 5, 6, 7])

    def test_centre_of_mass_follows_base_and_joints(self):
        def table(rows):
            rows = np.array(rows, "<f4")
            return {"type": "f32", "columns": rows.shape[1], "count": rows.shape[0], "data": base64.b64encode(rows.T.tobytes()).decode(), "clock": "motion"}
        joints = [{"name": f"{foot}_hip", "parent": -1, "origin_m": [0.0, y, 0.0], "axis": "y"} for foot, y in (("left", 0.1), ("right", -0.1))]
        quarter = np.sqrt(0.5)
        run = series.ReportRun({"summary": {}, "robot": {"joints": joints}, "clocks": {"motion": table([[0.0], [1.0]])}, "series": {
            "base_true": table([[1, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, quarter, quarter]]), "joints": table([[0, 0], [-np.pi / 2, 0]])}})
        masses = {"torso": [2.0, [0.0, 0.0, 1.0]], "leg": [[1.0, [0.0, 0.02, -0.5]]]}
        # Standing, both legs hang. Then the left one points ahead, and ahead is the world's y.
        np.testing.assert_allclose(run.centre_of_mass(masses), [[1, 0, 0.25], [1, 0.125, 0.375]], atol=1e-6)

    def test_thinned_is_near_and_keeps_the_peak(self):
        t = np.linspace(0, 10, 1001)
        y = np.exp(-((t - 4) / 0.05) ** 2)
        kept_t, kept = series.thinned(t, y, 0.01)
        self.assertLess(len(kept), 60)
        self.assertEqual(kept.max(), y.max())
        self.assertLessEqual(np.abs(np.interp(t, kept_t, kept) - y).max(), 0.01)

    def test_lidar_is_laid_on_the_truth(self):
        true = np.random.default_rng(1).normal(size=(50, 3))
        c, s = np.cos(1.2), np.sin(1.2)
        moved = true @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + (5.0, -2.0, 1.0)
        np.testing.assert_allclose(series.laid_on(true, moved), true, atol=1e-12)


if __name__ == "__main__":
    unittest.main()
