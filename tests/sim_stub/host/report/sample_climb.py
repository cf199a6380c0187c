# SPDX-License-Identifier: Apache-2.0
"""A climb made up from smooth curves: what the report's page is tried on without a robot, a simulation or a recording.
Its kinematics are exact (soles, base and joint angles fit each other), its errors are plausible, its physics are none.
Frames and units are those of sim_stub/host/report/page/DATA.md."""
import dataclasses
import math

import numpy as np

HIP, HIP_PITCH = np.array([-0.0025, 0.087, -0.066]), np.array([0.0005, -0.001, -0.1287])
THIGH, SHANK, ANKLE = 0.284, 0.346, 0.0645
TOE, HEEL, HALF_WIDTH = 0.17084, -0.073164, 0.04773
CAMERA_P, CAMERA_PITCH = np.array([0.14915, 0.0, -0.00702]), 1.047
FX, FY, CX, CY, WIDTH, HEIGHT = 366.7, 366.8, 322.7, 242.3, 640, 480
LEFT, RIGHT = 0, 1


def rotation(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array({"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
                     "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis], dtype=float)


def quaternion(R):
    """x y z w, w >= 0."""
    w = math.sqrt(max(0.0, 1 + R[0, 0] + R[1, 1] + R[2, 2])) / 2
    if w > 1e-3:
        q = np.array([(R[2, 1] - R[1, 2]) / (4 * w), (R[0, 2] - R[2, 0]) / (4 * w), (R[1, 0] - R[0, 1]) / (4 * w), w])
    else:
        values, vectors = np.linalg.eigh(R + R.T)
        q = np.append(vectors[:, -1], 0.0)
    return q / np.linalg.norm(q)


BASE_R_CAMERA = rotation("y", CAMERA_PITCH) @ np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], dtype=float)


@dataclasses.dataclass
class Stairs:
    steps: int
    rise: float = 0.13
    tread: float = 0.28
    half_width: float = 0.6
    landing: float = 1.0

    def treads(self):
        """(nosing x, back x, height) of every step."""
        return [(k * self.tread, (k + 1) * self.tread if k + 1 < self.steps else k * self.tread + self.landing,
                 (k + 1) * self.rise) for k in range(self.steps)]


@dataclasses.dataclass
class Swing:
    foot: int
    lift: float
    land: float
    start: np.ndarray
    end: np.ndarray
    step: int  # 0: the floor, 1: the first tread
    aborted: bool = False


def smooth(u):
    u = np.clip(u, 0.0, 1.0)
    return u * u * u * (10 - 15 * u + 6 * u * u)


def planned_swings(stairs, lead_in):
    feet = [np.array([-0.62, 0.1, 0.0]), np.array([-0.62, -0.1, 0.0])]
    swings, t = [], lead_in
    places = [(RIGHT, -0.42, 0.0, 0), (LEFT, -0.23, 0.0, 0), (RIGHT, -0.23, 0.0, 0)]
    for k, (nosing, _, height) in enumerate(stairs.treads()):
        lead = RIGHT if k % 2 == 0 else LEFT
        places += [(lead, nosing + 0.0915, height, k + 1), (1 - lead, nosing + 0.0915, height, k + 1)]
    for n, (foot, x, z, step) in enumerate(places):
        swing_s = 0.78 if step else 0.62
        end = np.array([x + 0.0012 * math.sin(2.1 * n), (0.1, -0.1)[foot] + 0.002 * math.cos(1.3 * n), z])
        swings.append(Swing(foot, t + 0.42, t + 0.42 + swing_s, feet[foot].copy(), end, step))
        feet[foot] = end
        t += 0.42 + swing_s
    return swings, t + 2.0


def sole_positions(swings, t):
    """Positions of both soles at the times t: arrays of (count, 3)."""
    out = []
    for foot in (LEFT, RIGHT):
        mine = [s for s in swings if s.foot == foot]
        p = np.tile(mine[0].start, (len(t), 1))
        for s in mine:
            u = (t - s.lift) / (s.land - s.lift)
            during = (u > 0) & (u < 1)
            rise = s.end[2] - s.start[2]
            way = np.where(u < 0.5, smooth(u / 0.62), smooth(u / 0.86)) if rise > 0.02 else smooth(u)
            way = smooth((u - 0.12) / 0.8) if rise > 0.02 else way
            if s.aborted:
                way = np.minimum(way, 0.35) * (1 - smooth((u - 0.5) / 0.5))
            top = max(rise, 0) + (0.075 if s.step else 0.05)
            up = np.where(u < 0.55, top * smooth(u / 0.45), rise + (top - rise) * (1 - smooth((u - 0.55) / 0.45)))
            if s.aborted:
                up = 0.06 * np.sin(np.pi * np.clip(u, 0, 1)) ** 2
            p[during] = s.start + np.outer(way, s.end - s.start)[during]
            p[during, 2] = s.start[2] + up[during]
            p[u >= 1] = s.start if s.aborted else s.end
        out.append(p)
    return out


def base_positions(swings, soles, t):
    """Over the middle of the feet, swaying over the standing one; no higher than the lower leg can reach."""
    x = 0.5 * (soles[0][:, 0] + soles[1][:, 0]) + 0.03
    y = np.zeros(len(t))
    z = np.minimum(soles[0][:, 2], soles[1][:, 2])
    settled_z = z.copy()
    for s in swings:
        side = -0.075 if s.foot == LEFT else 0.075
        y += side * (smooth((t - s.lift + 0.45) / 0.42) - smooth((t - s.land) / 0.4))
    for s in swings:
        if s.step and s.end[2] > s.start[2]:
            settled_z += 0.02 * np.exp(-((t - s.land) / 0.25) ** 2)
    kernel = np.hanning(71)
    def smoothed(v):
        return np.convolve(np.pad(v, 35, mode="edge"), kernel / kernel.sum(), mode="valid")
    return np.stack([smoothed(x), y, smoothed(settled_z) + 0.765], axis=1)


def leg_angles(foot, base_p, base_R, sole_p, sole_R):
    """solve_leg of algorithms/robot/leg_kinematics.cpp."""
    mirror = np.array([1, 1 if foot == LEFT else -1, 1])
    hip, pitch = HIP * mirror, HIP_PITCH * mirror
    R = base_R.T @ sole_R
    ankle = base_R.T @ (sole_p - base_p) + R @ np.array([0, 0, ANKLE])
    seen = R.T @ (hip - ankle)
    radius = max(math.hypot(seen[1], seen[2]), 1e-6)
    offset = min(max(-pitch[1] / radius, -1), 1)
    depth = math.sqrt(max(1 - offset * offset, 0))
    cos_roll, sin_roll = (offset * seen[1] + depth * seen[2]) / radius, (depth * seen[1] - offset * seen[2]) / radius
    side = R[:, 1] * cos_roll - R[:, 2] * sin_roll
    sin_yaw = min(max(-side[0], -1), 1)
    cos_yaw = max(math.sqrt(max(1 - sin_yaw**2, 0)), 1e-9)
    pitch_sum = math.atan2(R[0, 1] * sin_roll + R[0, 2] * cos_roll, R[0, 0])
    down = np.array([0, -side[2] / cos_yaw, side[1] / cos_yaw])
    ahead = np.cross(side, down)
    leg = ankle - hip
    lx, lz = ahead @ leg - pitch[0], down @ leg - pitch[2]
    cos_knee = min(max((lx * lx + lz * lz - THIGH**2 - SHANK**2) / (2 * THIGH * SHANK), -1), 1)
    sin_knee = math.sqrt(1 - cos_knee**2)
    knee = math.atan2(sin_knee, cos_knee)
    bent, straight = SHANK * sin_knee, THIGH + SHANK * cos_knee
    hip_pitch = math.atan2(bent * lz - straight * lx, -bent * lx - straight * lz)
    return [math.atan2(side[2], side[1]), math.atan2(sin_yaw, cos_yaw), hip_pitch, knee,
            pitch_sum - hip_pitch - knee, math.atan2(sin_roll, cos_roll)]


@dataclasses.dataclass
class Motion:
    t: np.ndarray
    base: np.ndarray        # (count, 7): position, quaternion
    soles: list             # of both feet (count, 7)
    joints: np.ndarray      # (count, 12)
    swings: list
    base_R: list

    def at(self, t):
        return int(min(max(np.searchsorted(self.t, t), 0), len(self.t) - 1))


def move(stairs, rate_hz=100.0, lead_in=2.2, cut_s=None, fall_from=None, duration=None):
    """The climb's truth. cut_s: it stops there on both feet; fall_from: it topples backwards from then on."""
    swings, end = planned_swings(stairs, lead_in)
    if cut_s is not None:
        swings = [s for s in swings if s.lift < cut_s]
        end = cut_s + 2.0
    if fall_from is not None:
        swings = [s for s in swings if s.lift < fall_from]
        end = fall_from + 1.0
    end = end if duration is None else max(end, duration)
    t = np.round(np.arange(0.0, end, 1.0 / rate_hz), 6)
    soles = sole_positions(swings, t)
    base = base_positions(swings, soles, t)
    base += 0.0015 * np.stack([np.sin(9 * t), np.cos(7.3 * t), np.sin(11 * t)], axis=1)
    base_R, poses, joints = [], [], []
    level = np.array([0.0, 0.0, 0.0, 1.0])
    for i, now in enumerate(t):
        pitch = 0.02 + 0.012 * math.sin(2.7 * now)
        if fall_from is not None and now > fall_from:
            lean = 0.9 * (now - fall_from) ** 2
            pitch -= lean
            base[i] += np.array([-0.7 * math.sin(lean), 0, 0.7 * (math.cos(lean) - 1)])
        R = rotation("z", 0.01 * math.sin(0.9 * now)) @ rotation("y", pitch) @ rotation("x", 0.01 * math.sin(3.1 * now))
        base_R.append(R)
        poses.append(np.concatenate([base[i], quaternion(R)]))
        joints.append(leg_angles(LEFT, base[i], R, soles[LEFT][i], np.eye(3)) +
                      leg_angles(RIGHT, base[i], R, soles[RIGHT][i], np.eye(3)))
    sole_poses = [np.hstack([p, np.tile(level, (len(t), 1))]) for p in soles]
    return Motion(t, np.array(poses), sole_poses, np.array(joints), swings, base_R)


def rectangles(stairs):
    """Every level and upright face as (kind, step, four corners), floor first."""
    w = stairs.half_width
    yield "tread", 0, [(-1.4, -w - 0.6, 0), (0, -w - 0.6, 0), (0, w + 0.6, 0), (-1.4, w + 0.6, 0)]
    for k, (nosing, back, height) in enumerate(stairs.treads()):
        yield "riser", k + 1, [(nosing, -w, height - stairs.rise), (nosing, -w, height), (nosing, w, height), (nosing, w, height - stairs.rise)]
        yield "tread", k + 1, [(nosing, -w, height), (back, -w, height), (back, w, height), (nosing, w, height)]


def clipped_to_view(corners, p, R, shrink_px=4.0):
    """Corners in the camera frame, cut to what the picture shows and to 2.2 m; nothing where it is out of view."""
    points = [R.T @ (np.array(c, dtype=float) - p) for c in corners]
    m = shrink_px
    planes = [(np.array([FX, 0, CX - m]), 0.0), (np.array([-FX, 0, WIDTH - m - CX]), 0.0), (np.array([0, FY, CY - m]), 0.0),
              (np.array([0, -FY, HEIGHT - m - CY]), 0.0), (np.array([0, 0, 1.0]), 0.2), (np.array([0, 0, -1.0]), -2.2)]
    for n, least in planes:
        kept = []
        for a, b in zip(points, points[1:] + points[:1]):
            da, db = n @ a - least, n @ b - least
            if da >= 0:
                kept.append(a)
            if (da < 0) != (db < 0):
                kept.append(a + (b - a) * da / (da - db))
        points = kept
        if not points:
            return []
    return points


def area(points):
    total = np.zeros(3)
    for a, b in zip(points[1:], points[2:]):
        total += np.cross(a - points[0], b - points[0])
    return np.linalg.norm(total) / 2


def depth_picture(stairs, p, R, width=160, height=120, rng=None):
    """Metres along the optical axis, 0 where there is none."""
    u, v = np.meshgrid((np.arange(width) + 0.5) * WIDTH / width - 0.5, (np.arange(height) + 0.5) * HEIGHT / height - 0.5)
    rays = np.stack([(u - CX) / FX, (v - CY) / FY, np.ones_like(u)], axis=-1) @ R.T
    best = np.full(u.shape, np.inf)
    for kind, _, corners in rectangles(stairs):
        c = np.array(corners, dtype=float)
        lo, hi = c.min(axis=0), c.max(axis=0)
        axis = 2 if kind == "tread" else 0
        with np.errstate(divide="ignore", invalid="ignore"):
            z = (lo[axis] - p[axis]) / rays[..., axis]
            hit = p + z[..., None] * rays
            inside = np.ones(u.shape, dtype=bool)
            for other in range(3):
                if other != axis:
                    inside &= (hit[..., other] >= lo[other] - 1e-9) & (hit[..., other] <= hi[other] + 1e-9)
        best = np.where(inside & (z > 0.15) & (z < best), z, best)
    depth = np.where(np.isfinite(best), best, 0.0)
    if rng is not None:
        depth = np.where(depth > 0, depth + rng.normal(0, 1, depth.shape) * (0.001 + 0.0015 * depth), 0)
        depth[rng.random(depth.shape) < 0.004] = 0
    return depth
