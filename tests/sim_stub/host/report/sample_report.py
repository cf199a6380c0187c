#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""sample_report [--page TEMPLATE] [--list] VARIANT OUT: the data of a made-up climb, or a report page with them, as
sim_stub/host/report/page/DATA.md has it. Variants: --list."""
import argparse
import base64
import io
import json
import math
import pathlib
import sys
import zlib

import numpy as np
from PIL import Image

import sample_climb as climb

HERE = pathlib.Path(__file__).resolve().parent
TEMPLATE = HERE.parents[3] / "sim_stub/host/report/page/bundle/report.html.in"
NEAR, FAR = 0.2, 3.0
JOINT_NAMES = ["hip_roll", "hip_yaw", "hip_pitch", "knee", "ankle_pitch", "ankle_roll"]
TASKS = [("sense", "control", 120, 11000), ("estimate", "control", 150, 72000), ("gait", "control", 120, 65000),
         ("command", "control", 200, 7000), ("health", "control", 10, 1300), ("intake", "perception", 40, 14000),
         ("surfaces", "perception", 840, 700000), ("map", "perception", 96, 80000), ("footholds", "perception", 180, 150000)]
TYPES = {"f32": np.float32, "i16": np.int16, "i32": np.int32, "u8": np.uint8}


def block(values, kind="f32", scale=None, delta=False, packed=True):
    """A table of numbers, column after column."""
    table = np.atleast_2d(np.asarray(values, dtype=float).T) if np.ndim(values) == 1 else np.asarray(values, dtype=float).T
    out = {"type": kind, "columns": table.shape[0], "count": table.shape[1]}
    if kind in ("i16", "i32"):
        missing = {"i16": -32768, "i32": -2147483648}[kind]
        offset = np.array([np.round(np.nanmean(c), 3) if np.isfinite(c).any() else 0.0 for c in table])
        raw = np.where(np.isfinite(table), np.round((np.nan_to_num(table) - offset[:, None]) / scale), missing)
        assert np.abs(np.where(raw == missing, 0, raw)).max(initial=0) < -missing, "beyond the type's range"
        out |= {"scale": scale, "offset": offset.tolist()}
        raw = raw.astype(np.int64)
        if delta:
            raw = np.diff(raw, axis=1, prepend=0)
            out["delta"] = True
        raw = raw.astype({"i16": np.uint16, "i32": np.uint32}[kind])
    else:
        raw = table.astype(TYPES[kind])
    data = raw.tobytes()
    if packed:
        data = zlib.compress(data, 9)
        out["zlib"] = True
    return out | {"data": base64.b64encode(data).decode()}


def lengths(values):
    return block(values, "i16", 1e-4, delta=True)


def poses(values):
    table = block(values, "i16", 1e-4, delta=True)
    # Positions by tenths of a millimetre, quaternions by 1/32767.
    q = np.asarray(values, dtype=float)
    raw = np.empty(q.T.shape)
    offset = np.zeros(7)
    for c in range(7):
        column = q[:, c]
        offset[c] = np.round(np.nanmean(column), 3) if c < 3 and np.isfinite(column).any() else 0.0
        unit = 1e-4 if c < 3 else 1 / 32767
        raw[c] = np.where(np.isfinite(column), np.round((np.nan_to_num(column) - offset[c]) / unit), -32768)
    data = np.diff(raw.astype(np.int64), axis=1, prepend=0).astype(np.uint16).tobytes()
    return table | {"scale": [1e-4] * 3 + [1 / 32767] * 4, "offset": offset.tolist(),
                    "data": base64.b64encode(zlib.compress(data, 9)).decode()}


def r(values, digits=4):
    return [round(float(v), digits) for v in np.ravel(values)]


def png(depth):
    grey = np.where(depth > 0, np.clip(1 + np.round(254 * (depth - NEAR) / (FAR - NEAR)), 1, 255), 0).astype(np.uint8)
    out = io.BytesIO()
    Image.fromarray(grey).save(out, "PNG", optimize=True)
    return base64.b64encode(out.getvalue()).decode()


def camera_at(motion, t):
    i = motion.at(t)
    return motion.base[i, :3] + motion.base_R[i] @ climb.CAMERA_P, motion.base_R[i] @ climb.BASE_R_CAMERA


def pictures(stairs, motion, rng, hz=5.0):
    out = []
    for t in np.arange(0.0, motion.t[-1], 1 / hz):
        p, R = camera_at(motion, t)
        surfaces = []
        for kind, step, corners in climb.rectangles(stairs):
            seen = climb.clipped_to_view(corners, p, R)
            if len(seen) >= 3 and climb.area(seen) > 0.004:
                surface = {"kind": kind, "vertices": r(seen), "invalid_fraction": round(0.01 + 0.01 * rng.random(), 3), "polygon_id": 2 * step + (kind == "riser")}
                if kind == "tread" and step:
                    front = [R.T @ (np.array(c) - p) for c in (corners[0], corners[3])]
                    cut = climb.clipped_to_view([front[0] @ R.T + p, front[1] @ R.T + p], p, R)
                    if len(cut) >= 2:
                        surface["nosing"] = r(cut[:2])
                surfaces.append(surface)
        out.append({"t_s": round(float(t), 3), "png": png(climb.depth_picture(stairs, p, R, rng=rng)),
                    "invalid_fraction": round(0.02 + 0.01 * rng.random(), 3), "surfaces": surfaces})
    return out


def mapped(stairs, motion, rng, every_s=0.6):
    """Versions of polygons: each grows with what has been seen of it, and is forgotten when it lies behind."""
    polygons, open_version, grown = [], {}, {}
    for t in np.arange(0.1, motion.t[-1], every_s):
        p, R = camera_at(motion, t)
        for kind, step, corners in climb.rectangles(stairs):
            key = 2 * step + (kind == "riser")
            seen = climb.clipped_to_view(corners, p, R)
            if len(seen) >= 3 and climb.area(seen) > 0.006:
                world = np.array([R @ v + p for v in seen])
                lo, hi = world.min(axis=0), world.max(axis=0)
                if key in grown:
                    lo, hi = np.minimum(lo, grown[key][0]), np.maximum(hi, grown[key][1])
                    changed = np.abs(np.concatenate([lo - grown[key][0], hi - grown[key][1]])).max() > 0.004
                else:
                    changed = True
                grown[key] = (lo, hi)
                if not changed:
                    continue
                off = rng.normal(0, 0.0012, 3)
                lo, hi = lo + off, hi + off
                if key in open_version:
                    open_version[key]["to_s"] = round(float(t), 3)
                version = {"id": key, "kind": kind, "from_s": round(float(t), 3), "sigma_m": round(0.0015 + 0.001 * rng.random(), 4),
                           "observed": [1, 0, 1, 0] if kind == "tread" else [1, 1, 1, 0]}
                if kind == "tread":
                    z = float(np.mean([lo[2], hi[2]]))
                    version["vertices"] = r([[lo[0], lo[1], z], [hi[0], lo[1], z], [hi[0], hi[1], z], [lo[0], hi[1], z]])
                    version["observed"] = [0, int(bool(step)), 0, int(bool(step))]
                    if step:
                        version["nosing"] = r([[lo[0], hi[1], z], [lo[0], lo[1], z]])
                else:
                    x = float(np.mean([lo[0], hi[0]]))
                    version["vertices"] = r([[x, lo[1], lo[2]], [x, lo[1], hi[2]], [x, hi[1], hi[2]], [x, hi[1], lo[2]]])
                open_version[key] = version
                polygons.append(version)
            elif key in open_version and grown[key][1][0] < p[0] - 0.9:
                open_version.pop(key)["to_s"] = round(float(t), 3)
    return polygons


def foothold(stairs, step, foot, rng, now):
    nosing, back, height = stairs.treads()[step - 1]
    x = nosing + 0.0915 + rng.normal(0, 0.0008)
    clearance = min(x + climb.HEEL - nosing, back - x - climb.TOE) - 0.002
    return {"position_m": r([x, (0.1, -0.1)[foot], height]), "yaw_rad": round(rng.normal(0, 0.004), 4), "clearance_m": round(clearance, 4),
            "toe_clearance_m": round(back - x - 0.179, 4) if step < stairs.steps else None, "nosing_distance_m": round(x - nosing, 4),
            "side_room_m": r([0.45, 0.31] if foot == 0 else [0.31, 0.45]), "polygon_id": 2 * step, "last_seen_s": round(now - 0.11, 3)}


def searches(stairs, motion, rng, hz=5.0, blocked_from=None):
    out = []
    for t in np.arange(0.6, motion.t[-1], 1 / hz):
        i = motion.at(t)
        height = min(motion.soles[0][i, 2], motion.soles[1][i, 2])
        standing = max(0, int(round(height / stairs.rise)))
        search = {"t_s": round(float(t), 3), "map_stamp_s": round(float(t) - 0.1, 3), "stop": "none"}
        if standing < stairs.steps:
            search |= {"measured_rise_m": round(stairs.rise + rng.normal(0, 0.001), 4), "measured_tread_m": round(stairs.tread + rng.normal(0, 0.002), 4)}
        if blocked_from is not None and t > blocked_from:
            search |= {"stop": "edge_uncertain", "stop_text": "it knew the edges of the next tread too vaguely"}
        elif standing >= stairs.steps:
            search |= {"stop": "top", "stop_text": "it took the tread it stood on for the highest"}
        for name, ahead in (("p_star", 1), ("p_star_star", 2)):
            if standing + ahead <= stairs.steps and search["stop"] == "none":
                search[name] = [foothold(stairs, standing + ahead, f, rng, float(t)) for f in (0, 1)]
        safe = []
        for step in range(standing + 1, min(standing + 2, stairs.steps) + 1):
            nosing, back, z = stairs.treads()[step - 1]
            x0, x1 = nosing - climb.HEEL + 0.004, min(back - climb.TOE - 0.004, nosing + 0.5)
            if x1 > x0:
                safe.append({"polygon_id": 2 * step, "vertices": r([[x0, -0.45, z], [x1, -0.45, z], [x1, 0.45, z], [x0, 0.45, z]])})
        search["safe"] = safe
        out.append(search)
    return out


def steps_of(stairs, motion, rng):
    out = []
    for n, s in enumerate(motion.swings, 1):
        i = motion.at(s.land + 0.1)
        landed = motion.soles[s.foot][i, :3]
        target = s.end + np.array([rng.normal(0, 0.002), rng.normal(0, 0.002), rng.normal(0, 0.001)])
        step = {"sequence": n, "foot": "left" if s.foot == 0 else "right", "onto_tread": s.step > 0, "step": s.step, "latch_s": round(s.lift, 3),
                "touch_down_s": None if s.aborted else round(s.land, 3), "target_m": r([*target, 0.004]), "executed_m": r([*(target + rng.normal(0, 0.0015, 3)), 0.003]),
                "landed_m": r([*landed, 0.003]), "execution_error_mm": round(2 + 1.5 * rng.random(), 2)}
        if s.step:
            nosing, back, _ = stairs.treads()[s.step - 1]
            margin = min(landed[0] + climb.HEEL - nosing, back - landed[0] - climb.TOE) * 1e3 + rng.normal(0, 2)
            step |= {"polygon_id": 2 * s.step, "clearance_mm": round(16 + rng.normal(0, 1), 1), "toe_clearance_mm": round(9 + rng.normal(0, 1), 1),
                     "along_error_mm": round(rng.normal(0, 2), 2), "across_error_mm": round(rng.normal(0, 2), 2), "sole_margin_mm": round(margin, 2),
                     "swing_clearance_mm": round(14 + 5 * rng.random(), 2), "map_age_at_latch_ms": 110.4, "target_last_seen_ms": round(102 + 50 * rng.random(), 1)}
        out.append(step)
    return out


def robot():
    joints = []
    for leg, side in (("left", 1), ("right", -1)):
        mirror = np.array([1, side, 1])
        origins = [climb.HIP * mirror, np.zeros(3), climb.HIP_PITCH * mirror, np.array([0, 0, -climb.THIGH]), np.array([0, 0, -climb.SHANK]), np.zeros(3)]
        axes = ["x", "z", "y", "y", "y", "x"]
        first = len(joints)
        for j, name in enumerate(JOINT_NAMES):
            joints.append({"name": f"{leg}_{name}", "parent": -1 if j == 0 else first + j - 1, "origin_m": r(origins[j]), "axis": axes[j]})
    shapes = []
    for first, foot in ((0, "left"), (6, "right")):
        shapes += [{"joint": first + 2, "type": "capsule", "a_m": [0, 0, 0], "b_m": [0, 0, -climb.THIGH], "radius_m": 0.07},
                   {"joint": first + 3, "type": "capsule", "a_m": [0, 0, 0], "b_m": [0, 0, -climb.SHANK], "radius_m": 0.055},
                   {"sole": foot, "type": "box", "centre_m": [0.049, 0, 0.035], "half_m": [0.13, 0.048, 0.035]}]
    return {"joints": joints, "shapes": shapes,
            "sole": {"contact_m": [climb.TOE, climb.HEEL, climb.HALF_WIDTH], "collision_m": [0.179, -0.081, 0.048],
                     "joint": {"left": 5, "right": 11}, "origin_m": [0, 0, -climb.ANKLE]}}


def drifting(motion, rng):
    """Odometry, fused pose and lidar poses that are off the truth as such things are."""
    t = motion.t
    way = motion.base[:, 0] - motion.base[0, 0]
    odom, fused = motion.base.copy(), motion.base.copy()
    odom[:, :3] += np.stack([-0.006 * way + 0.002 * np.sin(0.4 * t), 0.004 * way + 0.002 * np.sin(0.23 * t), 0.005 * way], axis=1)
    fused[:, :3] += np.stack([0.004 * np.sin(0.31 * t), 0.003 * np.sin(0.17 * t + 1), 0.0035 * np.sin(0.21 * t + 2)], axis=1)
    sigma = np.stack([0.0025 + 0.0004 * way, 0.0025 + 0.0003 * way, 0.0018 + 0.0003 * way, 0.001 + 0.0002 * way, 0.0008 + 0 * way], axis=1)
    at = np.arange(0.3, t[-1], 0.1)
    lio = np.stack([np.interp(at, t, motion.base[:, c]) for c in range(3)], axis=1) + rng.normal(0, [0.006, 0.009, 0.006], (len(at), 3))
    return odom, fused, sigma, at, lio


def series_of(motion, rng, truth=True):
    odom, fused, sigma, lio_t, lio = drifting(motion, rng)
    n = len(motion.t)
    at_cost = np.arange(0.0, motion.t[-1], 0.02)
    busy = (at_cost % (1 / 30.0)) < 0.02
    share = np.stack([0.62 + 0.1 * rng.random(len(at_cost)) if k < 5 else np.where(busy, 0.5 + 0.45 * rng.random(len(at_cost)), 0.0) for k in range(9)], axis=1)
    cost = share * np.array([task[3] for task in TASKS])
    ratio = 0.15 + 0.1 * np.abs(np.sin(motion.t))[:, None] * np.ones(12)
    for s in motion.swings:
        knee = (9, 3)[s.foot]
        ratio[:, knee] += (0.5 if s.step else 0.2) * np.exp(-((motion.t - s.lift - 0.2) / 0.25) ** 2)
    contact = np.ones((n, 2))
    for s in motion.swings:
        contact[(motion.t > s.lift) & (motion.t < s.land), s.foot] = 0.02
    clocks = {"motion": block(np.round(motion.t * 1000), "i32", 1.0, delta=True), "lio": block(np.round(lio_t * 1000), "i32", 1.0, delta=True),
              "cost": block(np.round(at_cost * 1000), "i32", 1.0, delta=True)}
    for clock in clocks.values():  # milliseconds to seconds
        clock["scale"], clock["offset"] = 0.001, [v * 0.001 for v in clock["offset"]]
    out = {"base_fused": ("motion", poses(fused)), "base_odometry": ("motion", poses(odom)), "sigma_fused": ("motion", block(sigma, "i16", 1e-5, delta=True)),
           "joints": ("motion", block(motion.joints, "i16", 1e-4, delta=True)), "contact": ("motion", block(np.round(contact * 100), "u8")),
           "torque_share": ("motion", block(ratio, "i16", 1e-3, delta=True)), "lio": ("lio", lengths(lio)), "cost": ("cost", block(cost, "f32"))}
    out["contact"][1]["scale"] = 0.01
    for foot, name in enumerate(("left", "right")):
        true = motion.soles[foot]
        seen = true.copy()
        seen[:, :3] += (fused - motion.base)[:, :3]
        desired = seen.copy()
        moving = np.gradient(true[:, :3], motion.t, axis=0)
        desired[:, :3] += 0.016 * moving + rng.normal(0, 0.0004, (n, 3))
        out |= {f"sole_estimated_{name}": ("motion", poses(seen)), f"sole_desired_{name}": ("motion", poses(desired))}
        if truth:
            out[f"sole_true_{name}"] = ("motion", poses(true))
    if truth:
        out["base_true"] = ("motion", poses(motion.base))
    return clocks, {name: {"clock": clock} | table for name, (clock, table) in out.items()}


def summary_of(stairs, motion, steps, change):
    summary = json.loads((HERE / "sample_summary.json").read_text())
    onto = [s for s in steps if s["onto_tread"] and s["touch_down_s"] is not None]
    margins = [s["sole_margin_mm"] for s in onto] or [None]
    climbed = len(onto) // 2
    summary |= {"steps_total": stairs.steps, "steps_climbed": climbed, "climb_time_s": 2.4 * climbed if climbed else None, "seconds_per_step": 2.4 if climbed else None,
                "sole_margin_mm_min": margins[0] and min(margins), "footsteps": [], "verdict": "pass", "fell": False, "reality": {"scale": 1.0},
                "execution_error_mm": {"median": 2.6, "max": 3.4}, "plane_rate_hz": 28.96}
    summary["reason"] = f"Climbed {climbed} of {stairs.steps} steps in {2.4 * climbed:.1f} s (2.40 s per step)." if climbed else "It climbed no step."
    return summary | change


def made_up_run(name="sample.mcap", steps=4, seed=7, truth=True, with_pictures=True, rate_hz=100.0, picture_hz=5.0, **kinds):
    rng = np.random.default_rng(seed)
    stairs = climb.Stairs(steps)
    motion = climb.move(stairs, rate_hz, cut_s=kinds.get("cut_s"), fall_from=kinds.get("fall_from"), duration=kinds.get("duration"))
    steps_done = steps_of(stairs, motion, rng)
    clocks, series = series_of(motion, rng, truth)
    first = next((s for s in motion.swings if s.step), None)
    end = float(motion.t[-1])
    states = [[0.0, "arming"], [0.1, "walking_up"]] + ([[round(first.lift, 3), "climbing"]] if first else [])
    phases = [[0.0, "standing"]]
    for s in motion.swings:
        phases += [[round(s.lift - 0.42, 3), "double_support"], [round(s.lift, 3), "swing"]]
    phases.append([round(motion.swings[-1].land, 3), "finished"])
    run = {"name": name, "duration_s": end, "world": "true" if truth else "module", "clock_t0_s": 1.026, "missing": {}, "clocks": clocks, "series": series,
           "states": states, "phases": phases, "events": [{"t_s": 0.2, "kind": "fault", "number": 14, "name": "lio_rejected", "count": 1},
                                                          {"t_s": 3.9, "kind": "limit", "number": 104, "name": "planes_full", "count": 4}],
           "pushes": [], "operator": [], "robot": robot(), "steps": steps_done,
           "map": {"polygons": mapped(stairs, motion, rng), "occupied": []}, "searches": searches(stairs, motion, rng, blocked_from=kinds.get("cut_s")),
           "schedule": [{"task": n, "lane": lane, "budget_us": us, "budget_instructions": i} for n, lane, us, i in TASKS],
           "versions": {"polygmap": "0.9.0", "git": "bc7467d1", "compiler": "g++ 12.2.0", "recording": "1"},
           "arguments": ["polygmap", "climb", "--steps", str(steps), "--seed", str(seed), "--reality", "1"],
           "params": {"hash": "8262fb07490165d0", "differing": [{"name": "planner.max_map_age_ns", "value": "400000000", "default": "500000000", "unit": "ns",
                                                                "text": "A map older than this is not stepped on."}]}}
    run["camera"] = {"width_px": climb.WIDTH, "height_px": climb.HEIGHT, "fx_px": climb.FX, "fy_px": climb.FY, "cx_px": climb.CX, "cy_px": climb.CY,
                     "base_T_camera": r([*climb.CAMERA_P, *climb.quaternion(climb.BASE_R_CAMERA)], 6), "near_m": NEAR, "far_m": FAR, "range_m": [0.2, 4.0]}
    if with_pictures:
        run["pictures"] = pictures(stairs, motion, rng, picture_hz)
    else:
        run["missing"]["pictures"] = "This recording was made without pictures."
    if truth:
        boxes = [{"step": k + 1, "pose": r([(n + b) / 2, 0, h / 2, 0, 0, 0, 1]), "half_m": r([(b - n) / 2, stairs.half_width, h / 2])} for k, (n, b, h) in enumerate(stairs.treads())]
        treads = [{"step": k + 1, "nosing_x_m": n, "back_x_m": b, "height_m": round(h, 4)} for k, (n, b, h) in enumerate(stairs.treads())]
        run["stairs"] = {"boxes": boxes, "treads": treads, "half_width_m": stairs.half_width}
        run["summary"] = summary_of(stairs, motion, steps_done, {})
    else:
        run["missing"]["truth"] = "A robot's own recording has no truth: stairs, true poses and true margins are not known."
        for step in steps_done:
            for key in ("landed_m", "along_error_mm", "across_error_mm", "sole_margin_mm", "swing_clearance_mm"):
                step.pop(key, None)
    if truth and kinds.get("cut_s"):
        at = kinds["cut_s"]
        reason = f"The module stopped after {run['summary']['steps_climbed']} of {steps} steps: it knew the edges of the next tread too vaguely."
        run["summary"] |= {"verdict": "fail", "reason": reason, "ended_by": "module"}
        run["ending"] = {"t_s": at + 0.4, "sentence": reason, "stop": "edge_uncertain", "stop_text": "it knew the edges of the next tread too vaguely"}
        run["states"] += [[at, "stopping"], [at + 0.4, "safe_stop"]]
        run["phases"][-1] = [at, "stopped"]
        run["events"].append({"t_s": at + 0.4, "kind": "fault", "number": 18, "name": "gait_stopped", "count": 1, "text": "The gait stopped in double support, not on top."})
    elif truth and kinds.get("fall_from"):
        at = kinds["fall_from"]
        reason = f"The robot fell after {run['summary']['steps_climbed']} of {steps} steps: the torso leans by 0.47 rad."
        run["summary"] |= {"verdict": "fail", "reason": reason, "fell": True, "ended_by": "fall"}
        run["pushes"] = [{"t_s": at - 0.1, "duration_s": 0.1, "force_n": [-420.0, 0.0, 0.0]}]
        run["states"].append([at + 0.72, "fallen"])
        run["events"].append({"t_s": at + 0.72, "kind": "fault", "number": 22, "name": "fallen", "count": 1})
    else:
        run["states"].append([round(motion.swings[-1].land + 0.6, 3), "on_top"])
    run["memory"] = [[k, v] for k, v in json.loads((HERE / "sample_summary.json").read_text())["static_memory"].items()]
    return run, motion


def gaps(run, motion):
    """Some samples are no numbers, as where a sensor fell silent."""
    hole = motion.base.copy()
    hole[300:420] = np.nan
    run["series"]["base_true"] |= poses(hole)
    run["series"]["sigma_fused"] |= block(np.full((len(motion.t), 5), np.nan), "i16", 1e-5, delta=True)
    return run


VARIANTS = {
    "full": lambda: [made_up_run()[0]],
    "ten": lambda: [made_up_run(steps=10)[0]],
    "no_truth": lambda: [made_up_run(truth=False)[0]],
    "no_pictures": lambda: [made_up_run(with_pictures=False)[0]],
    "stopped": lambda: [made_up_run(cut_s=8.6)[0]],
    "fallen": lambda: [made_up_run(fall_from=9.3)[0]],
    "long": lambda: [made_up_run(steps=4, rate_hz=20.0, picture_hz=0.5, duration=1000.0)[0]],
    "gaps": lambda: [gaps(*made_up_run())],
    "bare": lambda: [{"name": "bare.mcap", "duration_s": 3.0}],
    "empty": lambda: [],
    "two": lambda: [made_up_run("before.mcap")[0], made_up_run("after.mcap", seed=11, cut_s=8.6)[0]],
}


def data_of(variant):
    return {"format": "polygmap-report", "version": 1, "runs": VARIANTS[variant]()}


def text_of(data):
    """JSON that may stand in a page: no '<' in it, and nothing that is no number."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def page_of(template, data):
    head, tail = template.split("@POLYGMAP_DATA@")
    return head + text_of(data) + tail


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", nargs="?", const=str(TEMPLATE), help="write a page: the template with the data in it")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("variant", nargs="?", choices=VARIANTS)
    parser.add_argument("out", nargs="?")
    arguments = parser.parse_args()
    if arguments.list:
        print(*VARIANTS)
        return 0
    if not arguments.out:
        parser.error("a variant and a file to write are missing")
    data = data_of(arguments.variant)
    text = page_of(pathlib.Path(arguments.page).read_text(), data) if arguments.page else text_of(data)
    pathlib.Path(arguments.out).write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
