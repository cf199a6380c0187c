# SPDX-License-Identifier: Apache-2.0
"""What a climb's report.html knows of it over time (sim_stub/host/report/page/DATA.md), and what follows from the joints."""
import base64
import zlib

import numpy as np

TYPES = {"f32": "<f4", "i16": "<i2", "i32": "<i4", "u8": "u1"}
AXES = "xyz"


def values_of(block):
    """A block of numbers: a row for each sample, a column for each quantity; NaN where one is missing."""
    data = base64.b64decode(block["data"])
    raw = np.frombuffer(zlib.decompress(data) if block.get("zlib") else data, TYPES[block["type"]]).reshape(block["columns"], block["count"])
    if block.get("delta"):
        raw = np.cumsum(raw, axis=1, dtype=raw.dtype)  # wraps around, as the differences did
    missing = raw == np.iinfo(raw.dtype).min if block["type"] in ("i16", "i32") else np.isnan(raw)
    scale, offset = (np.broadcast_to(block.get(key, usual), block["columns"])[:, None] for key, usual in (("scale", 1.0), ("offset", 0.0)))
    return np.where(missing, np.nan, offset + scale * raw).T


class ReportRun:
    """One run of a report."""
    def __init__(self, data):
        self.data, self.summary = data, data["summary"]  # data: a run of the report's JSON

    def series(self, name):
        """(times in s, values: a row for each time)"""
        block = self.data["series"][name]
        return values_of(self.data["clocks"][block["clock"]])[:, 0], values_of(block)

    def joint_frames(self):
        """For each joint (rotations, places) in the base, at every time of the joints as measured."""
        _, angles = self.series("joints")
        frames = []
        for joint, angle in zip(self.data["robot"]["joints"], angles.T):
            R, p = frames[joint["parent"]] if joint["parent"] >= 0 else (np.broadcast_to(np.eye(3), (len(angle), 3, 3)), np.zeros((len(angle), 3)))
            frames.append((R @ turned(AXES.index(joint["axis"]), angle), p + R @ np.array(joint["origin_m"])))
        return frames

    def base(self):
        """(times, rotations, places) of the true base."""
        t_s, pose = self.series("base_true")
        return t_s, rotations(pose[:, 3:]), pose[:, :3]

    def centre_of_mass(self, masses):
        """In the true world: the torso's mass and the links' where the measured joints have them."""
        _, R_base, p_base = self.base()
        (torso_kg, torso_m), legs = masses["torso"], masses["leg"]
        moment, total = torso_kg * np.array(torso_m), torso_kg
        for n, (R, p) in enumerate(self.joint_frames()):
            kg, centre = legs[n % len(legs)]
            side = 1.0 if n < len(legs) else -1.0  # the right leg mirrors the left one
            moment = moment + kg * (p + R @ (np.array(centre) * (1.0, side, 1.0)))
            total += kg
        return p_base + np.einsum("nij,nj->ni", R_base, moment / total)


def turned(axis, angle):
    """Rotations about one of the axes."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((len(angle), 3, 3))
    R[:, axis, axis] = 1.0
    R[:, i, i] = R[:, j, j] = np.cos(angle)
    R[:, j, i] = np.sin(angle)
    R[:, i, j] = -R[:, j, i]
    return R


def rotations(q):
    """Of quaternions x, y, z, w."""
    x, y, z, w = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                     2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1).reshape(-1, 3, 3)


def thinned(t, y, tolerance):
    """The fewest points between which straight lines are nowhere off the curve by more than the tolerance."""
    t, y = (np.asarray(v)[np.isfinite(y)] for v in (t, y))
    if not len(t):
        return t, y
    keep = np.zeros(len(t), bool)
    keep[[0, -1]] = True
    spans = [(0, len(t) - 1)]
    while spans:
        a, b = spans.pop()
        if b - a < 2:
            continue
        off = np.abs(y[a:b + 1] - np.interp(t[a:b + 1], [t[a], t[b]], [y[a], y[b]]))
        far = a + int(off.argmax())
        if off.max() > tolerance:
            keep[far] = True
            spans += [(a, far), (far, b)]
    return t[keep], y[keep]


def path_of(points, tolerance=0.002):
    """Points of a curve in space, thinned in each of its coordinates."""
    n = np.arange(len(points), dtype=float)
    kept = sorted({int(i) for column in points.T for i in thinned(n, column, tolerance)[0]})
    return points[kept]


def rms(values):
    return float(np.sqrt(np.nanmean(np.square(values))))


def laid_on(true, placed):
    """The places of lidar odometry, whose world is its own, by the heading and offset that fit the truth best over all of them."""
    a, b = (places[:, :2] - places[:, :2].mean(axis=0) for places in (placed, true))
    yaw = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    turned = placed @ turn.T
    return turned + (true - turned).mean(axis=0)
