// SPDX-License-Identifier: Apache-2.0
// Everything over time, on one axis.
import { h } from "../core/dom.js";
import { bodyCharts, chartGroup, footCharts, marginChart, placeCharts, poseCharts } from "./curves.js";
import { costStrips, stateStrips } from "./strips.js";

export function timeSection(run, player) {
  const strips = stateStrips(run, player),
    rows = costStrips(run, player);
  player.listen((t_s) => {
    for (const strip of [...strips, ...rows]) strip.mark(t_s);
  });
  const places = h("details", {}, h("summary", {}, "The same as places"));
  places.addEventListener(
    "toggle",
    () => places.open && places.children.length === 1 && places.append(...placeCharts(run).map((c) => c.element)),
  );
  const pose = chartGroup(
    "How well it knows where it is (the paper's Fig. 4)",
    run.hasTruth
      ? "Each world is laid on the true one once, at the start; the band is 3 sigma as the module states it."
      : run.missing("truth"),
    poseCharts(run),
    run.missing("motion"),
  );
  pose.append(places);
  return h(
    "section.wide",
    { id: "time" },
    h("h2", {}, "Over time"),
    h("p.note", {}, "Click into a curve to go to that moment. Drag over it to zoom in, double-click to zoom out."),
    h(
      "div.group",
      {},
      h("h3", {}, "States, contacts, pushes, faults"),
      strips.length ? strips.map((s) => s.element) : h("p.missing", {}, "The file has no states."),
    ),
    pose,
    chartGroup("How well the feet follow (the paper's Fig. 7)", null, footCharts(run), "The file has no desired feet."),
    chartGroup("Margins of the footholds", null, [marginChart(run)], run.missing("searches")),
    chartGroup("The body", null, bodyCharts(run), run.missing("motion")),
    h(
      "div.group",
      { id: "cost" },
      h("h3", {}, "Cost of each row of the schedule against its budget, instructions a cycle"),
      h("p.note", {}, "The full height of a strip is the row's budget. Counted as work, the same on every machine."),
      rows.length ? rows.map((s) => s.element) : h("p.missing", {}, run.missing("cost")),
    ),
  );
}
