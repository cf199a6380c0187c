#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""figures.py <ASKED >DRAWN: the paper's Figs 4, 5 and 7 of one simulated climb each, as SVG; the same bytes for the same climb.

ASKED is {"runs": {"fig4", "fig5", "fig7"}, "masses", "bound_mm"}, DRAWN is {figure: {"svg", "alt", "caption"}}. A program of
its own, since matplotlib is the Debian package's, and python3 may be another."""
import io
import json
import pathlib
import re
import sys

import matplotlib
import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402
from matplotlib.patches import Polygon, Rectangle  # noqa: E402
from campaigns.paper.series import ReportRun, laid_on, path_of, rms, rotations, thinned  # noqa: E402

matplotlib.rcParams.update({
    "svg.hashsalt": "polygmap", "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 9, "axes.titlesize": 9, "axes.labelsize": 9,
    "legend.fontsize": 8, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e3e6ea", "grid.linewidth": 0.6,
    "axes.edgecolor": "#8a929c", "lines.linewidth": 1.2, "legend.frameon": False, "figure.constrained_layout.use": True})
INK, BLUE, ORANGE, GREEN, RED = "#1c2026", "#1f6fb4", "#d9780f", "#2b8a4b", "#b3261e"
FEET = {"left": BLUE, "right": ORANGE}
WIDTH_IN = 5.4
MM = 1e3


def svg_of(figure):
    """Without a date, with two digits behind the point: a hundredth of a point is seen by nobody."""
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    pyplot.close(figure)
    text = re.sub(r"(\d\.\d\d)\d+", r"\1", out.getvalue())
    return re.sub(r"[ \t]+$", "", text, flags=re.M)


def climb_begins_s(run):
    return next(t for t, state in run.data["states"] if state == "climbing")


def fusion(run):
    """Places and errors of odometry, lidar odometry and the fused pose along x, y and z; (SVG, (alt, caption))."""
    t, true = run.series("base_true")
    poses = {"odometry": run.series("base_odometry")[1], "fused": run.series("base_fused")[1]}
    looks = {"lidar": (GREEN, "-", 0.6, "lidar (odom_lidar)"), "odometry": (BLUE, "--", 1.2, "odometry (odom_base)"), "fused": (RED, "-", 1.2, "fused (odom_fused)")}
    lidar_t, lidar = run.series("lio")
    known = lidar_t >= t[np.isfinite(poses["fused"][:, 0])][0]  # before it knows its pose, the module lays nothing anywhere
    lidar_t, lidar = lidar_t[known], lidar[known]
    lidar_true = np.stack([np.interp(lidar_t, t, true[:, c]) for c in range(3)], axis=1)
    lidar = laid_on(lidar_true, lidar)
    curves = {"lidar": (lidar_t, lidar, lidar - lidar_true), **{name: (t, pose, pose[:, :3] - true[:, :3]) for name, pose in poses.items()}}
    figure, axes = pyplot.subplots(6, 1, figsize=(WIDTH_IN, 9.6), sharex=True, gridspec_kw={"height_ratios": [1, 1.15] * 3})
    told = []
    for c, axis_name in enumerate("xyz"):
        place, off = axes[2 * c], axes[2 * c + 1]
        near = np.ptp(true[:, c]) / 400
        for name, (at, places, error) in curves.items():
            colour, dash, width, label = looks[name]
            place.plot(*thinned(at, places[:, c], near), dash, color=colour, linewidth=width, label=label)
            off.plot(*thinned(at, MM * error[:, c], 0.3), dash, color=colour, linewidth=width)
        place.plot(*thinned(t, true[:, c], near), ":", color=INK, linewidth=1, label="truth")
        place.set_ylabel(f"{axis_name}, m")
        off.set_ylabel(f"error in {axis_name}, mm")
        told.append(", ".join(f"{name} {MM * rms(error[:, c]):.1f}" for name, (_, _, error) in curves.items()))
        off.set_title(f"RMS, mm: {told[-1]}", loc="right", pad=2)
    axes[-1].set_xlabel("time, s")
    figure.suptitle(" ")  # room for the legend
    figure.legend(*axes[0].get_legend_handles_labels(), loc="upper center", ncol=2, handlelength=1.6)
    return svg_of(figure), (
        "Base position along x, y and z by odometry, lidar odometry and the fused pose, with the truth, and their errors",
        f"A climb of {run.summary['steps_total']} steps. RMS error against the true pose, mm: " + "; ".join(f"{n}: {line}" for n, line in zip("xyz", told)) +
        ". Odometry and fused pose are laid on the truth once, at the start; lidar odometry by the heading and offset that fit the whole climb best, which flatters it.")


def draw_stairs(axis, run):
    treads = run.data["stairs"]["treads"]
    for tread in treads:
        axis.add_patch(Rectangle((tread["nosing_x_m"], 0), tread["back_x_m"] - tread["nosing_x_m"], tread["height_m"],
                                 facecolor="#dfe3e8", edgecolor="#9aa3ad", linewidth=0.6))
    axis.plot([-3, treads[0]["nosing_x_m"]], [0, 0], color="#9aa3ad", linewidth=0.8)


def snapshots(run, masses):
    """The climb from the side, the robot at seven moments, and from above; paths of centre of mass and feet."""
    t, R, p = run.base()
    com = run.centre_of_mass(masses)
    soles = {foot: run.series(f"sole_true_{foot}")[1] for foot in FEET}
    sole = run.data["robot"]["sole"]
    toe, heel, half = sole["contact_m"]
    frames = run.joint_frames()
    world = [p + np.einsum("nij,nj->ni", R, joint[1]) for joint in frames]
    x_m, z_m, y_m = (p[:, 0].min() - 0.35, p[:, 0].max() + 0.45), (-0.1, p[:, 2].max() + 0.95), (-0.35, 0.35)
    per_m = 0.85 * WIDTH_IN / np.ptp(x_m)  # one scale for both views
    heights = [per_m * np.ptp(z_m), per_m * np.ptp(y_m)]
    tall = sum(heights) + 0.75
    figure = pyplot.figure(figsize=(WIDTH_IN, tall), constrained_layout=False)
    side = figure.add_axes((0.13, (heights[1] + 0.6) / tall, 0.85, heights[0] / tall))
    top = figure.add_axes((0.13, 0.45 / tall, 0.85, heights[1] / tall))
    draw_stairs(side, run)
    end = min(run.data["duration_s"], t[-1])
    moments = [int(np.argmax(p[:, 0] >= x)) for x in np.linspace(p[0, 0] + 0.01, p[:, 0].max() - 0.005, 7)]
    for shade, i in zip(np.linspace(0.35, 0.9, len(moments)), moments):
        torso = p[i] + R[i] @ np.array([0.0, 0.0, 0.52])
        side.plot([p[i, 0], torso[0]], [p[i, 2], torso[2]], color=INK, alpha=shade, linewidth=7, solid_capstyle="round")
        head = p[i] + R[i] @ np.array([0.0, 0.0, 0.69])
        side.plot([head[0]], [head[2]], "o", color=INK, alpha=shade, markersize=8, markeredgewidth=0)
        for n, (foot, colour) in enumerate(FEET.items()):
            leg = np.array([p[i], *(world[6 * n + k][i] for k in (2, 3, 4))])
            side.plot(leg[:, 0], leg[:, 2], color=colour, alpha=shade, linewidth=2.4, solid_capstyle="round")
            turn = rotations(soles[foot][i:i + 1, 3:])[0]
            corners = np.array([soles[foot][i, :3] + turn @ np.array(c) for c in ((toe, 0, 0), (heel, 0, 0), (heel, 0, 0.05), (0, 0, 0.0645), (toe, 0, 0.02))])
            side.add_patch(Polygon(corners[:, [0, 2]], closed=True, facecolor=colour, alpha=shade, linewidth=0))
        side.annotate(f"{t[i]:.0f} s", (head[0], head[2] + 0.09), ha="center", fontsize=7, color="#454c55")
    for axis, up in ((side, 2), (top, 1)):
        path = path_of(com[:, [0, up]])
        axis.plot(path[:, 0], path[:, 1], color=RED, label="centre of mass")
        for foot, colour in FEET.items():
            path = path_of(soles[foot][:, [0, up]])
            axis.plot(path[:, 0], path[:, 1], color=colour, linewidth=0.9, label=f"{foot} foot")
        axis.set_xlim(x_m)
    for step in run.data["steps"]:
        if "landed_m" not in step:
            continue
        x, y, _, yaw = step["landed_m"]
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        corners = np.array([[toe, half], [toe, -half], [heel, -half], [heel, half]]) @ turn.T + (x, y)
        top.add_patch(Polygon(corners, closed=True, facecolor="none", edgecolor=FEET[step["foot"]], linewidth=0.8))
    for tread in run.data["stairs"]["treads"]:
        top.axvline(tread["nosing_x_m"], color="#9aa3ad", linewidth=0.7)
    side.set_ylim(z_m)
    side.tick_params(labelbottom=False)
    top.set_ylim(y_m)
    top.set_yticks((-0.2, 0, 0.2))
    side.set_ylabel("z, m")
    top.set_ylabel("y, m")
    top.set_xlabel("x, m")
    side.legend(loc="upper left")
    return svg_of(figure), (
        "Side view of the simulated robot at seven moments of a climb, with the paths of its centre of mass and feet, and the same paths and the footsteps from above",
        f"A climb of {run.summary['steps_total']} steps, {end:.0f} s with the walk to the stairs. Feet are true; the centre of mass is that of the "
        "module's masses at the measured joints. Torso and head are only drawn so; there are no arms to draw.")


def tracking(run, bound_mm):
    """Paths of base and feet in space, and each foot's desired and true x and z with the error."""
    t, _, base = run.base()
    since = climb_begins_s(run) - 1.0
    shown = t >= since
    figure = pyplot.figure(figsize=(WIDTH_IN, 11.5))
    grid = figure.add_gridspec(5, 1, height_ratios=[2.6, 1, 1, 1, 1])
    space = figure.add_subplot(grid[0], projection="3d")
    path = path_of(base[shown])
    space.plot(*path.T, color=RED, label="base")
    axes = [figure.add_subplot(grid[1])]
    axes += [figure.add_subplot(grid[n], sharex=axes[0]) for n in (2, 3, 4)]
    most = {}
    for foot, colour in FEET.items():
        _, true = run.series(f"sole_true_{foot}")
        _, desired = run.series(f"sole_desired_{foot}")
        path = path_of(true[shown][:, :3])
        space.plot(*path.T, color=colour, label=f"{foot} foot")
        for n, (c, name) in enumerate(((0, "x"), (2, "z"))):
            axes[n].plot(*thinned(t[shown], desired[shown][:, c], 0.002), "--", color=colour, linewidth=1.6, label=f"{foot}, desired")
            axes[n].plot(*thinned(t[shown], true[shown][:, c], 0.002), "-", color=colour, linewidth=0.9, label=f"{foot}, true")
            error = MM * (desired[:, c] - true[:, c])
            most[name] = max(most.get(name, 0.0), float(np.nanmax(np.abs(error[shown]))))
            axes[2 + n].plot(*thinned(t[shown], error[shown], 0.3), color=colour, linewidth=0.9, label=foot)
    for n, name in enumerate("xz"):
        axes[n].set_ylabel(f"{name}, m")
        axes[2 + n].set_ylabel(f"error in {name}, mm")
        axes[2 + n].set_ylim(-1.2 * bound_mm, 1.2 * bound_mm)
        for at in (-bound_mm, bound_mm):
            axes[2 + n].axhline(at, color=INK, linestyle=":", linewidth=0.9)
        axes[2 + n].set_title(f"at most {most[name]:.1f} mm; dotted: the paper's {bound_mm} mm", loc="right", pad=2)
    axes[0].legend(loc="upper left", ncol=2)
    axes[-1].set_xlabel("time, s")
    for axis, name in zip((space.xaxis, space.yaxis, space.zaxis), "xyz"):
        axis.set_label_text(f"{name}, m")
        axis.set_pane_color((1, 1, 1, 0))
    for tread in run.data["stairs"]["treads"]:
        corners = [(x, y, tread["height_m"]) for x, y in ((tread["nosing_x_m"], -0.3), (min(tread["back_x_m"], path[-1, 0] + 0.4), -0.3),
                                                           (min(tread["back_x_m"], path[-1, 0] + 0.4), 0.3), (tread["nosing_x_m"], 0.3), (tread["nosing_x_m"], -0.3))]
        space.plot(*np.array(corners).T, color="#b6bdc6", linewidth=0.7)
    space.set_box_aspect([np.ptp(limits) for limits in (space.get_xlim(), space.get_ylim(), space.get_zlim())])
    space.set_yticks((-0.3, 0, 0.3))
    space.view_init(elev=18, azim=-62)
    space.legend(loc="upper left")
    summary = run.summary["tracking_error_mm"]
    return svg_of(figure), (
        "Paths of base and feet in space; desired and true x and z of each foot over time, with their errors and the paper's bound of 40 mm",
        f"A climb of {run.summary['steps_total']} steps, from a second before it begins. A foot is off its desired path by at most "
        f"{most['x']:.1f} mm in x and {most['z']:.1f} mm in z, "
        f"by the true pose of base and foot; `summary.json`, which measures relative to the standing foot, has {summary['x_max']:.1f} and {summary['z_max']:.1f} mm.")


def main():
    asked = json.load(sys.stdin)
    runs = {name: ReportRun(run) for name, run in asked["runs"].items()}
    drawings = {"fig4": fusion(runs["fig4"]), "fig5": snapshots(runs["fig5"], asked["masses"]), "fig7": tracking(runs["fig7"], asked["bound_mm"])}
    json.dump({name: {"svg": svg, "alt": alt, "caption": caption} for name, (svg, (alt, caption)) in drawings.items()}, sys.stdout)


if __name__ == "__main__":
    main()
