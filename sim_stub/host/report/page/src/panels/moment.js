// SPDX-License-Identifier: Apache-2.0
// The moment in words: what the robot sees, what it does, why there, and by what margins.
import { h, isNumber, mm, number, seconds, words } from "../core/dom.js";

export const STATES = {
  off: "Its drives have no gains; it waits to be armed.",
  arming: "It waits until every drive and sensor has answered.",
  standing: "It balances, and waits to be started.",
  walking_up: "It looks for stairs, and steps on the floor.",
  climbing: "It climbs.",
  holding: "It was paused: a foot in the air comes down, then it stands.",
  stopping: "It has to stop: a foot in the air comes down first.",
  safe_stop: "It has stopped on two feet, and holds.",
  on_top: "It has ended the climb, and holds.",
  fallen: "It fell: the joints are damped.",
  handing_over: "It hands the robot over to another controller.",
  released: "Another controller has the robot.",
};

function counted(list) {
  const count = new Map();
  for (const name of list) count.set(name, (count.get(name) ?? 0) + 1);
  return [...count]
    .map(([name, n]) => (n === 1 ? `1 ${name}` : `${n} ${name === "other" ? "other surfaces" : `${name}s`}`))
    .join(", ");
}

export function sees(run, t_s) {
  const out = [];
  const picture = run.newest("pictures", t_s);
  if (picture) {
    const found = counted((picture.surfaces ?? []).map((s) => s.kind));
    out.push(found ? `The picture shows ${found}.` : "The picture shows no surface that it knows.");
  }
  const polygons = run.polygonsAt(t_s);
  const treads = polygons.filter((p) => p.kind === "tread").map((p) => p.vertices[2]);
  if (polygons.length)
    out.push(
      `The map holds ${counted(polygons.map((p) => p.kind))}${treads.length ? `, the highest tread at ${number(Math.max(...treads), 2)} m` : ""}.`,
    );
  else if (run.polygons.length) out.push("The map is empty.");
  const occupied = run.occupiedAt(t_s).length;
  if (occupied) out.push(`Something lies on ${occupied} squares of 20 mm.`);
  return out.length ? out : [run.missing(run.polygons.length ? "pictures" : "map")];
}

export function does(run, t_s) {
  const state = run.stateAt(t_s),
    phase = run.phaseAt(t_s);
  const out = [];
  if (state) out.push(STATES[state] ?? `State ${words(state)}.`);
  const swing = run.swingAt(t_s);
  if (swing)
    out.push(
      `The ${swing.foot} foot is in the air, to ${placeOf(swing)}${swing.touch_down_s ? `; it lands at ${seconds(swing.touch_down_s)}` : "; it is put back where it stood"}.`,
    );
  else if (phase === "double_support") out.push("Both feet stand; the weight moves over the next standing foot.");
  else if (phase && state !== "fallen") out.push("Both feet stand.");
  const push = run.pushes.find((p) => p.t_s <= t_s && t_s <= p.t_s + p.duration_s);
  if (push) out.push(`It is pushed by ${number(Math.hypot(...push.force_n), 0)} N.`);
  return out.length ? out : ["The file does not say."];
}

export function placeOf(step) {
  if (!step.onto_tread) return "the floor";
  return `${isNumber(step.step) && step.step > 0 ? `step ${step.step}` : "a tread"}${step.target_m ? ` (${number(step.target_m[2], 2)} m up)` : ""}`;
}

function chosenBecause(step) {
  const toe = isNumber(step.toe_clearance_mm)
    ? ` and its toe ${number(step.toe_clearance_mm, 1)} mm from the riser`
    : "";
  const on = isNumber(step.polygon_id) ? ` on polygon ${step.polygon_id}` : "";
  return `The ${step.foot} foot's place was frozen at lift-off${on}: it keeps ${number(step.clearance_mm, 1)} mm from the edge${toe}.`;
}

export function why(run, t_s) {
  const search = run.newest("searches", t_s);
  const swing = run.swingAt(t_s);
  const chosen = swing && isNumber(swing.clearance_mm) ? [chosenBecause(swing)] : [];
  if (!search) return [...chosen, run.searches.length ? "No search has ended yet." : run.missing("searches")];
  const out = chosen;
  if (search.stop && search.stop !== "none")
    out.push(
      `${search.stop === "top" ? "It sees no further step" : "It does not step on"}: ${search.stop_text ?? words(search.stop)}.`,
    );
  if (isNumber(search.measured_rise_m)) {
    const deep = search.measured_tread_m ? `, ${number(search.measured_tread_m, 3)} m deep` : "";
    out.push(`Next up: a tread ${number(search.measured_rise_m, 3)} m higher${deep}, as it measured.`);
  }
  const feet = (search.p_star ?? []).filter(Boolean);
  if (feet.length) {
    const least = Math.min(...feet.map((f) => f.clearance_m));
    const id = feet[0].polygon_id;
    out.push(
      `p* is on the nearest tread above it${id === undefined ? "" : ` (polygon ${id})`}: a sole there keeps ${mm(least)} from the polygon's edge.`,
    );
  }
  return out;
}

export class MomentPanel {
  constructor(run) {
    this.run = run;
    this.lists = { sees: h("div"), does: h("div"), why: h("div") };
    this.margins = h("div.margins");
    this.element = h(
      "section.panel.words",
      { id: "words" },
      h("h2", {}, "What it sees"),
      this.lists.sees,
      h("h2", {}, "What it does"),
      this.lists.does,
      h("h2", {}, "Where next, and why there"),
      this.lists.why,
      this.margins,
    );
  }

  show(t_s) {
    this.say("sees", sees(this.run, t_s));
    this.say("does", does(this.run, t_s));
    this.say("why", why(this.run, t_s));
    this.showMargins(this.run.newest("searches", t_s));
  }

  say(name, sentences) {
    const text = sentences.join(" ");
    if (this.lists[name].textContent !== text) this.lists[name].textContent = text;
  }

  showMargins(search) {
    if (search === this.search) return;
    this.search = search;
    const columns = [
      ["p*", "pstar", search?.p_star],
      ["p**", "pstarstar", search?.p_star_star],
    ].filter(([, , feet]) => feet?.some(Boolean));
    if (!columns.length) {
      this.margins.replaceChildren();
      return;
    }
    const rows = [
      ["to the polygon's edge", (f) => f.clearance_m],
      ["toe box to the riser", (f) => f.toe_clearance_m],
      ["behind the nosing", (f) => f.nosing_distance_m],
      ["room to the left", (f) => f.side_room_m?.[0]],
      ["room to the right", (f) => f.side_room_m?.[1]],
    ];
    const head = h(
      "tr",
      {},
      h("th", {}, "mm"),
      columns.flatMap(([name, css]) =>
        ["L", "R"].map((side) => h(`th.n`, {}, h(`span.key.${css}`), `${name} ${side}`)),
      ),
    );
    const value = (foot, read) => {
      const v = foot ? read(foot) : null;
      return h(isNumber(v) && v < 0 ? "td.n.bad" : "td.n", {}, isNumber(v) ? number(v * 1e3, 0) : "–");
    };
    this.margins.replaceChildren(
      h(
        "table",
        {},
        h("thead", {}, head),
        h(
          "tbody",
          {},
          rows.map(([label, read]) =>
            h(
              "tr",
              {},
              h("th", { scope: "row" }, label),
              columns.flatMap(([, , feet]) => [0, 1].map((i) => value(feet[i], read))),
            ),
          ),
        ),
      ),
    );
  }
}
