// SPDX-License-Identifier: Apache-2.0
// The curves of a run: what each chart shows, made of the run's series when it is first looked at.
import { h, isNumber } from "../core/dom.js";
import { FEET } from "../core/now.js";
import { tiltOf, yawOf } from "../core/pose.js";
import { indexAt } from "../core/series.js";
import { Chart } from "./chart.js";

const finite = (values, scale = 1) => Array.from(values, (v) => (Number.isFinite(v) ? v * scale : null));
const minus = (a, b, scale) => Array.from(a, (v, i) => (Number.isFinite(v - b[i]) ? (v - b[i]) * scale : null));

/** A series read at the times of another clock. */
function read(series, t_s, column) {
  return Array.from(t_s, (t) => series.at(t)[column]);
}

/** Fig. 4: base, lidar and fused pose against the truth, with 3 sigma; without truth against the fused pose. */
export function poseCharts(run) {
  const fused = run.series("base_fused"),
    odometry = run.series("base_odometry"),
    lio = run.series("lio"),
    sigma = run.series("sigma_fused");
  const truth = run.series("base_true") ?? fused;
  if (!fused || !truth) return [];
  const against = run.hasTruth ? "truth" : "the fused pose";
  return ["x", "y", "z"].map((name, c) => {
    const lines = [],
      columns = [];
    const add = (line, values) => {
      lines.push(line);
      columns.push(values);
    };
    const t = fused.t_s;
    const bands = [];
    const make = () => {
      const reference = truth.t_s === t ? truth.columns[c] : read(truth, t, c);
      const made = columns.map((of) => of(reference));
      const table = [Array.from(t), ...made];
      if (!lio?.count) return table;
      const off = minus(lio.columns[c], read(truth, lio.t_s, c), 1e3);
      const points = new Array(t.length).fill(null); // each at the sample before it
      off.forEach((v, i) => (points[Math.max(indexAt(t, lio.t_s[i]), 0)] = v));
      return [...table, points];
    };
    if (sigma) {
      add({ label: "+3σ", colour: "band3", width: 1 }, () => finite(sigma.columns[c], 3e3));
      add({ label: "−3σ", colour: "band3", width: 1 }, () => finite(sigma.columns[c], -3e3));
      bands.push({ series: [1, 2] });
    }
    if (odometry)
      add({ label: "odometry", colour: "odometry", dash: [6, 3] }, (reference) =>
        minus(odometry.columns[c], reference, 1e3),
      );
    if (run.hasTruth)
      add({ label: "fused", colour: "fused", width: 2 }, (reference) => minus(fused.columns[c], reference, 1e3));
    if (lio?.count) lines.push({ label: "lidar", colour: "lio", points: true });
    return new Chart({
      title: `Base ${name} against ${against}`,
      unit: "mm",
      digits: 1,
      lines,
      bands,
      data: make,
      height: 130,
    });
  });
}

/** The same as places. */
export function placeCharts(run) {
  const parts = [
    ["truth", "base_true", "ink", null],
    ["odometry", "base_odometry", "odometry", [6, 3]],
    ["fused", "base_fused", "fused", null],
  ]
    .map(([label, name, colour, dash]) => ({ label, colour, dash, series: run.series(name) }))
    .filter((p) => p.series);
  if (!parts.length) return [];
  return ["x", "y", "z"].map(
    (name, c) =>
      new Chart({
        title: `Base ${name}`,
        unit: "m",
        digits: 3,
        lines: parts,
        height: 130,
        data: () => [Array.from(parts[0].series.t_s), ...parts.map((p) => finite(p.series.columns[c]))],
      }),
  );
}

/** Fig. 7: the feet's desired and true path, and how far they are off it. */
export function footCharts(run) {
  const feet = FEET.map((foot) => ({
    foot,
    desired: run.series(`sole_desired_${foot}`),
    real: run.sole(foot),
    known: run.series(`sole_estimated_${foot}`),
  })).filter((f) => f.desired && f.real);
  if (!feet.length) return [];
  const t = feet[0].desired.t_s;
  const kind = run.hasTruth ? "true" : "estimated";
  const paths = [
    ["x", 0],
    ["z", 2],
  ].map(
    ([name, c]) =>
      new Chart({
        title: `Foot ${name}, desired and ${kind}`,
        unit: "m",
        digits: 3,
        height: 150,
        lines: feet.flatMap((f) => [
          { label: `${f.foot} desired`, colour: f.foot, dash: [5, 3], width: 1.2 },
          { label: `${f.foot} ${kind}`, colour: f.foot, width: 2 },
        ]),
        data: () => [Array.from(t), ...feet.flatMap((f) => [finite(f.desired.columns[c]), finite(f.real.columns[c])])],
      }),
  );
  const off = new Chart({
    title: `Foot off its desired path (desired − ${kind})`,
    unit: "mm",
    digits: 1,
    height: 170,
    limits: [{ at: 40, label: "40 mm, the paper's bound" }, { at: -40 }],
    range: (_, low, high) => [Math.min(-45, low ?? 0), Math.max(45, high ?? 0)],
    lines: feet.flatMap((f) => [
      { label: `${f.foot} x`, colour: f.foot, width: 1.8 },
      { label: `${f.foot} z`, colour: f.foot, width: 1.2, dash: [4, 3] },
    ]),
    data: () => [
      Array.from(t),
      ...feet.flatMap((f) => [0, 2].map((c) => minus(f.desired.columns[c], f.real.columns[c], 1e3))),
    ],
  });
  return [...paths, off];
}

/** What the searches offered over time. */
export function marginChart(run) {
  if (!run.searches.length) return null;
  const least = (feet, key) => {
    const values = (feet ?? [])
      .filter(Boolean)
      .map((f) => f[key])
      .filter(isNumber);
    return values.length ? 1e3 * Math.min(...values) : null;
  };
  return new Chart({
    title: "Margins of the footholds offered, the lesser of both feet",
    unit: "mm",
    digits: 1,
    height: 150,
    limits: [{ at: 0, label: "over the edge" }],
    range: (_, low, high) => [Math.min(-2, low ?? 0), Math.max(20, high ?? 0)],
    lines: [
      { label: "p* to the edge", colour: "pstar", width: 2 },
      { label: "p* toe to the riser", colour: "pstar", dash: [4, 3] },
      { label: "p** to the edge", colour: "pstarstar", width: 2 },
      { label: "p** toe to the riser", colour: "pstarstar", dash: [4, 3] },
    ],
    data: () => [
      run.searches.map((s) => s.t_s),
      ...[
        ["p_star", "clearance_m"],
        ["p_star", "toe_clearance_m"],
        ["p_star_star", "clearance_m"],
        ["p_star_star", "toe_clearance_m"],
      ].map(([name, key]) => run.searches.map((s) => least(s[name], key))),
    ],
  });
}

export function bodyCharts(run) {
  const out = [];
  const base = run.base;
  if (base?.count) {
    const rows = (read) =>
      Array.from(base.t_s, (_, i) => {
        const value = read([3, 4, 5, 6].map((c) => base.columns[c][i]));
        return Number.isFinite(value) ? value : null;
      });
    out.push(
      new Chart({
        title: "Lean and yaw of the torso",
        unit: "rad",
        digits: 3,
        height: 130,
        lines: [
          { label: "lean", colour: "ink", width: 1.8 },
          { label: "yaw", colour: "lio", dash: [4, 3] },
        ],
        data: () => [Array.from(base.t_s), rows(tiltOf), rows(yawOf)],
      }),
    );
  }
  const torque = run.series("torque_share"),
    joints = run.robot?.joints ?? [];
  if (torque) {
    const most = (side, part) =>
      joints.map((j, i) => (j.name.startsWith(side) && j.name.includes(part) ? i : -1)).filter((i) => i >= 0);
    const share = (columns) =>
      Array.from(torque.t_s, (_, i) => {
        const values = columns.map((c) => torque.columns[c][i]).filter(Number.isFinite);
        return values.length ? 100 * Math.max(...values) : null;
      });
    const kinds = [
      ["left knee", most("left", "knee"), "left", null],
      ["right knee", most("right", "knee"), "right", null],
      ["left ankle", most("left", "ankle"), "left", [4, 3]],
      ["right ankle", most("right", "ankle"), "right", [4, 3]],
    ].filter(([, columns]) => columns.length);
    out.push(
      new Chart({
        title: "Torque of the drives, share of what they have",
        unit: "%",
        digits: 0,
        height: 140,
        limits: [{ at: 100 }],
        range: (_, low, high) => [0, Math.max(105, high ?? 0)],
        lines: kinds.map(([label, , colour, dash]) => ({ label, colour, dash })),
        data: () => [Array.from(torque.t_s), ...kinds.map(([, columns]) => share(columns))],
      }),
    );
  }
  return out;
}

export function chartGroup(title, note, charts, missing) {
  const shown = charts.filter(Boolean);
  return h(
    "div.group",
    {},
    h("h3", {}, title),
    note ? h("p.note", {}, note) : null,
    shown.length ? shown.map((c) => c.element) : h("p.missing", {}, missing),
  );
}
