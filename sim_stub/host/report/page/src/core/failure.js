// SPDX-License-Identifier: Apache-2.0
// When and why a climb failed: as the file says, or else as states and steps tell.
import { isNumber } from "./dom.js";

const ENDS = ["fallen", "safe_stop", "stopping"];

/** {t_s, sentence, stop_text} of a run that did not pass, else null. */
export function failureOf(run) {
  if (run.verdict === null || run.verdict === "pass")
    return run.json.ending && run.verdict === null ? run.json.ending : null;
  const sentence = run.json.ending?.sentence ?? run.summary.reason ?? "It failed; the file does not say why.";
  if (isNumber(run.json.ending?.t_s)) return { ...run.json.ending, sentence };
  for (const name of ENDS) {
    const change = run.states.find(([, state]) => state === name);
    if (change) return { t_s: change[0], sentence };
  }
  const over = run.steps.filter((s) => s.sole_margin_mm < 0 || s.swing_clearance_mm < 0)[0];
  if (over) return { t_s: over.touch_down_s ?? over.latch_s, sentence };
  return { t_s: run.duration_s, sentence };
}

function pushed(p) {
  const [x, y] = p.force_n;
  const where = Math.abs(x) > Math.abs(y) ? (x > 0 ? "ahead" : "back") : y > 0 ? "to the left" : "to the right";
  const force = Math.hypot(...p.force_n);
  return `pushed ${where} by ${force.toFixed(0)} N for ${p.duration_s} s, ${(force * p.duration_s).toFixed(0)} N s`;
}

/** What happened in the seconds before, the newest last: [[t_s, text]]. */
export function before(run, t_s, seconds = 4) {
  const within = (t) => t >= t_s - seconds && t <= t_s + 0.5;
  const out = [];
  for (const [t, state] of run.states) if (within(t)) out.push([t, `state ${state.replace(/_/g, " ")}`]);
  for (const e of run.events)
    if (within(e.t_s)) out.push([e.t_s, `${e.kind} ${e.name.replace(/_/g, " ")}${e.text ? `: ${e.text}` : ""}`]);
  for (const p of run.pushes)
    if (within(p.t_s)) out.push([p.t_s, pushed(p)]);
  for (const s of run.steps) {
    if (within(s.latch_s))
      out.push([s.latch_s, `${s.foot} foot lifts off for ${s.step ? `step ${s.step}` : "the floor"}`]);
    if (isNumber(s.touch_down_s) && within(s.touch_down_s)) out.push([s.touch_down_s, `${s.foot} foot lands`]);
  }
  let last = null;
  for (const search of run.searches) {
    if (search.stop !== last && within(search.t_s) && search.stop && search.stop !== "none")
      out.push([search.t_s, `no foothold: ${search.stop_text ?? search.stop.replace(/_/g, " ")}`]);
    last = search.stop;
  }
  return out.sort((a, b) => a[0] - b[0]);
}
