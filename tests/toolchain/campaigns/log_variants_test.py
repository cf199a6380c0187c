#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What each variant of a log does to it, and that it does nothing else."""
import math
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "toolchain"))
from campaigns import log_variants  # noqa: E402

ROWS, STEP_S = 301, 0.01
IMU = [*log_variants.GYRO, *log_variants.ACCEL]
FEET = [[f"{foot}_foot_{axis}_m" for axis in "xyz"] for foot in log_variants.FEET]
SOLES = [[f"{foot}_foot_q{part}" for part in "wxyz"] for foot in log_variants.FEET]
SPINS = [[f"{foot}_foot_w{axis}_radps" for axis in "xyz"] for foot in log_variants.FEET]
SWINGS = ((250, 290), (50, 100))  # rows
QUARTER_TURN = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # about z: the base's x axis is the world's y


def log_of_steps(attitude=(1.0, 0.0, 0.0, 0.0), soles=True):
    """3 s at 100 Hz. The left foot stands from the start to 2.5 s and again from 2.9 s on, the right one to 0.5 s and from 1 s."""
    log = {"t_s": [STEP_S * i for i in range(ROWS)]}
    for n, name in enumerate(IMU):
        log[name] = [n + 0.1 * i for i in range(ROWS)]  # goes up by 10 a second
    for part, value in zip("wxyz", attitude):
        log[f"truth_q{part}"] = [value] * ROWS
    for foot, y_m in enumerate((0.1, -0.1)):
        for name, value in zip(FEET[foot], (0.0, y_m, -0.8)):
            log[name] = [value] * ROWS
    if soles:
        for foot in range(2):
            for name, value in zip((*SOLES[foot], *SPINS[foot]), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)):
                log[name] = [value] * ROWS
    for foot, (lifts, lands) in zip(log_variants.FEET, SWINGS):
        log[f"{foot}_contact"] = [0.0 if lifts <= i < lands else 1.0 for i in range(ROWS)]
    return log


def log_of_a_whole_step(attitude=(1.0, 0.0, 0.0, 0.0)):
    """The right foot's is from 1 to 2.89 s, 1.945 s in its middle. The left one's, cut by the start, is nearer to the log's."""
    log = log_of_steps(attitude)
    log["right_contact"][290:] = [0.0] * (ROWS - 290)
    return log


class LogVariants(unittest.TestCase):
    def made(self, variant, changed, log=None):
        """The log so; no other column of it is touched."""
        log = log or log_of_steps()
        before = {name: list(values) for name, values in log.items()}
        out = log_variants.VARIANTS[variant](log)
        self.assertEqual(log, before)
        self.assertEqual(list(out), list(log))
        for name in log:
            if name in changed:
                self.assertNotEqual(out[name], log[name], name)
            else:
                self.assertEqual(out[name], log[name], name)
        return out

    def test_as_it_is(self):
        self.made("as it is", ())

    def test_thinned_keeps_every_nth_row(self):
        log = log_of_steps()
        for name, every, rows in (("every 2nd row", 2, 151), ("every 5th row", 5, 61)):
            out = log_variants.VARIANTS[name](log)
            self.assertEqual({len(values) for values in out.values()}, {rows})
            self.assertEqual(out["t_s"][3], log["t_s"][3 * every])
            self.assertEqual(out["accel_z_mps2"][:2], [log["accel_z_mps2"][0], log["accel_z_mps2"][every]])

    def test_begun_on_one_foot_in_the_second_half(self):
        log = log_of_steps()
        out = log_variants.VARIANTS["begun on one foot"](log)
        self.assertEqual(out["t_s"], log["t_s"][250:])  # the left foot lifts
        self.assertEqual({len(values) for values in out.values()}, {ROWS - 250})
        with self.assertRaisesRegex(ValueError, "stands alone"):
            log_variants.begun_on_one_foot({**log, "left_contact": log["right_contact"]})

    def test_imu_late_tells_what_was_so_much_earlier(self):
        out = self.made("IMU 10 ms late", IMU)
        for name, first in (("gyro_x_radps", 0.0), ("accel_z_mps2", 5.0)):
            self.assertEqual(out[name][0], first)  # nothing is known of before
            self.assertAlmostEqual(out[name][1], first, 9)
            self.assertAlmostEqual(out[name][200], first + 20.0 - 0.1, 9)
        half = log_variants.imu_late(log_of_steps(), 0.004)  # between two rows
        self.assertAlmostEqual(half["accel_z_mps2"][200], 5.0 + 20.0 - 0.04, 9)

    def test_truth_late_and_early_is_that_of_another_row(self):
        log = log_of_steps()
        log["truth_qx"] = [float(i) for i in range(ROWS)]
        for name, row in (("truth 10 ms late", 99.0), ("truth 10 ms early", 101.0)):
            self.assertEqual(self.made(name, ("truth_qx",), dict(log))["truth_qx"][100], row)

    def test_gyro_against_truth_is_the_angle_between_both(self):
        log = log_of_steps()
        for name, rate in zip(log_variants.GYRO, (0.0, 0.0, 0.2)):
            log[name] = [rate] * ROWS
        for part, value in zip("wz", (math.cos, math.sin)):
            log[f"truth_q{part}"] = [value(0.15 * t / 2) for t in log["t_s"]]  # 0.05 rad/s less
        apart = log_variants.gyro_against_truth(log, 0.5)
        self.assertEqual(len(apart), 6)
        for angle in apart:
            self.assertAlmostEqual(angle, 0.025, 6)

    def test_contacts_late_and_early(self):
        for name, rows in (("contacts 20 ms late", 2), ("contacts 20 ms early", -2)):
            out = self.made(name, ("left_contact", "right_contact"))
            for foot, (lifts, lands) in zip(log_variants.FEET, SWINGS):
                self.assertEqual(log_variants.stances(out, foot), [(0, lifts + rows), (lands + rows, ROWS)])

    def test_accel_scaled_by_a_hundredth(self):
        out = self.made("accelerometer 1 % high", log_variants.ACCEL)
        self.assertAlmostEqual(out["accel_x_mps2"][100], 13.0 * 1.01, 9)

    def test_imu_tilted_about_y(self):
        log = log_of_steps()
        for name, value in zip(IMU, (0.0, 0.0, 2.0, 0.0, 3.0, 10.0)):
            log[name] = [value] * ROWS
        out = self.made("IMU tilted 1 degree", ("gyro_x_radps", "gyro_z_radps", "accel_x_mps2", "accel_z_mps2"), log)
        sine, cosine = math.sin(math.pi / 180), math.cos(math.pi / 180)
        for name, value in zip(IMU, (2.0 * sine, 0.0, 2.0 * cosine, 10.0 * sine, 3.0, 10.0 * cosine)):
            self.assertAlmostEqual(out[name][7], value, 12, name)

    def test_foot_slips_in_the_middle_of_its_whole_stance(self):
        log = log_of_a_whole_step()
        out = self.made("a foot slips 60 mm in 0.2 s", ("right_foot_x_m",), log)
        for row, x_m in ((20, 0.0), (100, 0.0), (184, 0.0), (194, 0.0285), (205, 0.06), (289, 0.06), (290, 0.0)):
            self.assertAlmostEqual(out["right_foot_x_m"][row], x_m, 9, row)

    def test_foot_slips_along_the_bases_heading_over_level_ground(self):
        log = log_of_a_whole_step(QUARTER_TURN)
        self.assertAlmostEqual(self.made("a foot slips 60 mm in 0.2 s", ("right_foot_x_m",), log)["right_foot_x_m"][280], 0.06, 9)
        pitch_rad = 0.3  # about y: the base's x axis points downwards, and the ground does not
        log = log_of_a_whole_step((math.cos(pitch_rad / 2), 0.0, math.sin(pitch_rad / 2), 0.0))
        out = self.made("a foot slips 60 mm in 0.2 s", ("right_foot_x_m", "right_foot_z_m"), log)
        self.assertAlmostEqual(out["right_foot_x_m"][280], 0.06 * math.cos(pitch_rad), 9)
        self.assertAlmostEqual(out["right_foot_z_m"][280], -0.8 + 0.06 * math.sin(pitch_rad), 9)

    def test_sole_pivots_about_its_own_vertical(self):
        log = log_of_a_whole_step()
        tilt = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)  # about x: the sole's vertical is the base's -y
        for name, value in zip(SOLES[1], tilt):
            log[name] = [value] * ROWS
        out = self.made("a sole pivots 5 degrees in 0.2 s", (*SOLES[1], "right_foot_wy_radps"), log)
        half_rad = math.radians(2.5)
        for name, value in zip(SOLES[1], log_variants.product(tilt, (math.cos(half_rad), 0.0, 0.0, math.sin(half_rad)))):
            self.assertAlmostEqual(out[name][280], value, 12)
            self.assertAlmostEqual(out[name][180], log[name][180], 12)
        spinning = [i for i, rate in enumerate(out["right_foot_wy_radps"]) if abs(rate) > 1e-9]
        self.assertEqual(spinning, list(range(185, 205)))  # 0.2 s
        self.assertAlmostEqual(out["right_foot_wy_radps"][195], -math.radians(5) / 0.2, 9)
        self.assertAlmostEqual(sum(out["right_foot_wy_radps"]) * STEP_S, -math.radians(5), 9)

    def test_what_a_log_lacks_is_said(self):
        with self.assertRaisesRegex(ValueError, "no soles"):
            log_variants.sole_pivots(log_of_steps(soles=False))
        log = log_of_steps()
        for foot in log_variants.FEET:
            log[f"{foot}_contact"] = [float(i % 20 < 10) for i in range(ROWS)]  # 0.1 s at a time
        with self.assertRaisesRegex(ValueError, "stands long enough"):
            log_variants.foot_slips(log)

    def test_what_is_written_is_read(self):
        log = log_of_steps(QUARTER_TURN)
        with tempfile.TemporaryDirectory() as place:
            log_variants.write(f"{place}/log.csv", log)
            self.assertEqual(log_variants.read(f"{place}/log.csv"), log)

    def test_every_variant_is_tried_here(self):
        text = pathlib.Path(__file__).read_text()
        for name in log_variants.VARIANTS:
            self.assertIn(f'"{name}"', text)


if __name__ == "__main__":
    unittest.main()
