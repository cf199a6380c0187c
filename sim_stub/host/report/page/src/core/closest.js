// SPDX-License-Identifier: Apache-2.0
// What came closest to going wrong: for each thing that can, its worst moment, and how much of its reserve that took.
import { isNumber, number, words } from "./dom.js";
import { FEET } from "./now.js";
import { tiltOf } from "./pose.js";

// Where the file names no limit of its own (DATA.md, "limits").
const LIMITS = { lean_rad: 0.45, tracking_m: 0.04, ample_clearance_mm: 20, map_age_ms: 500 };

function worst(series, measure) {
  let best = null;
  if (!series) return best;
  for (let i = 0; i < series.count; ++i) {
    const value = measure(i);
    if (Number.isFinite(value) && (!best || value > best.value)) best = { value, t_s: series.t_s[i], i };
  }
  return best;
}

const leastStep = (run, key) => run.steps.filter((s) => isNumber(s[key])).sort((a, b) => a[key] - b[key])[0];
const mostStep = (run, keys) => {
  const size = (s) => Math.max(...keys.map((k) => Math.abs(s[k] ?? NaN)).filter(Number.isFinite), -1);
  return run.steps
    .map((s) => ({ step: s, value: size(s) }))
    .filter((e) => e.value >= 0)
    .sort((a, b) => b.value - a.value)[0];
};
const nameOf = (s) => `${s.foot} foot${s.step ? `, step ${s.step}` : ""}`;

/** Half of what a tread leaves to a sole, mm. */
function slackOf(run) {
  const [toe, heel] = run.robot?.sole?.contact_m ?? [0.17084, -0.073164];
  const treads = (run.stairs?.treads ?? []).slice(0, -1).map((t) => t.back_x_m - t.nosing_x_m);
  const tread = treads.length ? Math.min(...treads) : run.summary?.arguments?.tread_m;
  return tread ? 500 * (tread - (toe - heel)) : null;
}

/** [{what, value, limit, used, t_s, where}], the worst first; used is 1 where nothing is left. */
export function closest(run) {
  const out = [];
  const limits = { ...LIMITS, ...run.json.limits };
  const add = (what, value, limit, used, t_s, where = "") =>
    isNumber(used) && out.push({ what, value, limit, used, t_s, where });
  const slack = slackOf(run);

  const margin = leastStep(run, "sole_margin_mm");
  if (margin && slack)
    add(
      "Sole to the edge of its tread",
      number(margin.sole_margin_mm, 1, "mm"),
      `0 mm; in the middle ${number(slack, 1)} mm`,
      1 - margin.sole_margin_mm / slack,
      margin.touch_down_s,
      nameOf(margin),
    );
  const clear = leastStep(run, "swing_clearance_mm");
  if (clear)
    add(
      "Foot in the air to the stairs",
      number(clear.swing_clearance_mm, 1, "mm"),
      `0 mm; ${limits.ample_clearance_mm} mm is ample`,
      1 - clear.swing_clearance_mm / limits.ample_clearance_mm,
      clear.touch_down_s,
      nameOf(clear),
    );
  else if (isNumber(run.summary?.swing_clearance_mm_min))
    add(
      "Foot in the air to the stairs",
      number(run.summary.swing_clearance_mm_min, 1, "mm"),
      `0 mm; ${limits.ample_clearance_mm} mm is ample`,
      1 - run.summary.swing_clearance_mm_min / limits.ample_clearance_mm,
      null,
    );
  const off = mostStep(run, ["along_error_mm", "across_error_mm"]);
  if (off && slack)
    add(
      "Foothold chosen against true",
      number(off.value, 1, "mm"),
      `${number(slack, 1)} mm is all the tread leaves`,
      off.value / slack,
      off.step.latch_s,
      nameOf(off.step),
    );
  const execution = mostStep(run, ["execution_error_mm"]);
  if (execution && slack)
    add(
      "Foothold chosen against landed",
      number(execution.value, 1, "mm"),
      `${number(slack, 1)} mm is all the tread leaves`,
      execution.value / slack,
      execution.step.touch_down_s,
      nameOf(execution.step),
    );
  const old = mostStep(run, ["map_age_at_latch_ms"]);
  if (old)
    add(
      "Age of the map at lift-off",
      number(old.value, 0, "ms"),
      `${limits.map_age_ms} ms`,
      old.value / limits.map_age_ms,
      old.step.latch_s,
      nameOf(old.step),
    );

  const base = run.base;
  const lean = worst(base, (i) => tiltOf([3, 4, 5, 6].map((c) => base.columns[c][i])));
  if (lean)
    add(
      "Lean of the torso",
      number(lean.value, 3, "rad"),
      `${limits.lean_rad} rad counts as fallen`,
      lean.value / limits.lean_rad,
      lean.t_s,
    );
  addPoseError(run, add);
  addTracking(run, add, limits.tracking_m);
  addLoads(run, add);
  addCost(run, add);
  return out.sort((a, b) => b.used - a.used);
}

function addPoseError(run, add) {
  const truth = run.series("base_true"),
    fused = run.series("base_fused"),
    sigma = run.series("sigma_fused");
  if (!truth || !fused || !sigma || truth.count !== fused.count) return;
  const error = (i) => [0, 1, 2].map((c) => Math.abs(fused.columns[c][i] - truth.columns[c][i]));
  const ratio = worst(fused, (i) => Math.max(...error(i).map((e, c) => e / (3 * sigma.columns[c][i]))));
  if (ratio)
    add(
      "Fused pose against truth",
      number(1e3 * Math.hypot(...error(ratio.i)), 1, "mm"),
      "3 sigma, as the module states",
      ratio.value,
      ratio.t_s,
    );
}

function addTracking(run, add, limit_m) {
  let most = null;
  for (const foot of FEET) {
    const desired = run.series(`sole_desired_${foot}`),
      real = run.series(`sole_estimated_${foot}`);
    if (!desired || !real || desired.count !== real.count) continue;
    const here = worst(desired, (i) =>
      Math.max(
        Math.abs(desired.columns[0][i] - real.columns[0][i]),
        Math.abs(desired.columns[2][i] - real.columns[2][i]),
      ),
    );
    if (here && (!most || here.value > most.value)) most = { ...here, foot };
  }
  if (most)
    add(
      "Foot off its desired path",
      number(most.value * 1e3, 1, "mm"),
      `${limit_m * 1e3} mm, the paper's bound`,
      most.value / limit_m,
      most.t_s,
      `${most.foot} foot`,
    );
}

function addLoads(run, add) {
  const torque = run.series("torque_share");
  if (torque) {
    const most = worst(torque, (i) => Math.max(...torque.columns.map((c) => c[i]).filter(Number.isFinite)));
    const joint = most ? torque.columns.findIndex((c) => c[most.i] === most.value) : -1;
    if (most)
      add(
        "Torque of a drive",
        number(100 * most.value, 0, "%"),
        "100 % of what it has",
        most.value,
        most.t_s,
        words(run.robot?.joints?.[joint]?.name ?? ""),
      );
  } else {
    addPeak(run, add, "torque_peak_ratio", "Torque of a drive");
  }
  addPeak(run, add, "joint_speed_peak_ratio", "Speed of a drive");
  const zmp = run.summary?.zmp_margin_mm_min;
  const half_mm = 1e3 * (run.robot?.sole?.contact_m?.[2] ?? 0.0477);
  if (isNumber(zmp))
    add(
      "Centre of pressure to the sole's edge",
      number(zmp, 1, "mm"),
      `0 mm; in the middle ${number(half_mm, 0)} mm`,
      1 - zmp / half_mm,
      run.json.limits?.zmp_at_s ?? null,
    );
}

function addPeak(run, add, key, what) {
  const peaks = Object.entries(run.summary?.[key] ?? {})
    .filter(([, v]) => isNumber(v))
    .sort((a, b) => b[1] - a[1])[0];
  if (peaks) add(what, number(100 * peaks[1], 0, "%"), "100 % of what it has", peaks[1], null, words(peaks[0]));
}

/** For each row of the schedule its dearest bin: [{row, most, share, t_s}]. */
export function costs(run) {
  const cost = run.series("cost");
  return run.schedule.map((row, k) => {
    const column = cost?.columns[k];
    const most = column ? worst(cost, (i) => column[i]) : null;
    return {
      row,
      most: most?.value ?? null,
      t_s: most?.t_s ?? null,
      share: most && row.budget_instructions ? most.value / row.budget_instructions : null,
    };
  });
}

function addCost(run, add) {
  const dearest = costs(run)
    .filter((c) => isNumber(c.share) && !c.row.resumable) // who is resumed uses all that it is given
    .sort((a, b) => b.share - a.share)[0];
  if (dearest)
    add(
      "Dearest row of the schedule",
      number(100 * dearest.share, 0, "%"),
      "100 % of its budget",
      dearest.share,
      dearest.t_s,
      dearest.row.task,
    );
}
