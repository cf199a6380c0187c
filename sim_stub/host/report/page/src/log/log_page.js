// SPDX-License-Identifier: Apache-2.0
// The page of a replayed log: scores, and everything over time on one axis.
import { load } from "../core/blocks.js";
import { h, number } from "../core/dom.js";
import { Player } from "../core/player.js";
import { shortcuts } from "../core/shortcuts.js";
import { setPlayer } from "../plots/chart.js";
import { bandStrip, eventStrip } from "../plots/strips.js";
import { chartOf } from "./log_charts.js";
import { saidOf, scoresPanel, sourcePanel } from "./log_scores.js";

const GROUPS = [
  [
    "error",
    "Errors: estimate minus truth",
    "The band is 3 sigma as the estimator states it. Where there is LIO, it is as it came: its world is laid on the truth once, over its first second.",
  ],
  [
    "sigma",
    "How uncertain the estimator says it is",
    "3 sigma as it states them. Whether they are right is not known without truth.",
  ],
  ["value", "Values", null],
  [
    "innovation",
    "Innovations",
    "Of the newest update of each kind: squared, over their variances. 1 in the mean where noise is what it is thought to be.",
  ],
];

function strips(data, player) {
  const kinds = [...new Set(data.events.map((e) => e.kind))];
  const contacts = ["left", "right"].map((foot) =>
    bandStrip(`${foot} stands`, data.contacts[foot], { stands: foot, swings: "panel" }, player),
  );
  const told = kinds.map((kind) =>
    eventStrip(
      kind,
      data.events
        .filter((e) => e.kind === kind)
        .map((e) => ({
          ...e,
          say: `${e.count > 1 ? `${e.count} × ` : ""}${e.text ?? number(e.duration_s, 2, "s")} at ${number(e.t_s, 2)} s`,
        })),
      kind === "foot moves" ? "warn" : "bad",
      player,
    ),
  );
  return [...contacts, ...told].filter(Boolean);
}

function timeBar(player, help) {
  const slider = h("input", {
    type: "range",
    min: 0,
    max: player.duration_s,
    step: "any",
    value: 0,
    "aria-label": "Time",
    oninput: () => player.seek(slider.value),
  });
  const time = h("output.time", {}, "");
  player.listen((t_s) => {
    slider.value = t_s;
    time.textContent = number(t_s, 2, "s");
  });
  return h(
    "div.transport",
    {},
    time,
    h("div.track.plain", {}, slider),
    h("button", { type: "button", "aria-label": "Keys", onclick: () => help.showModal() }, "?"),
  );
}

export async function logPage(root, data) {
  await Promise.all(data.charts.map((chart) => load(chart.table)));
  const player = new Player(data.duration_s);
  setPlayer(player);
  const lanes = strips(data, player);
  player.listen((t_s) => lanes.forEach((lane) => lane.mark(t_s)));
  const groups = GROUPS.map(([name, title, note]) => [title, note, data.charts.filter((c) => c.group === name)])
    .filter(([, , charts]) => charts.length)
    .map(([title, note, charts]) =>
      h(
        "div.group",
        {},
        h("h3", {}, title),
        note ? h("p.note", {}, note) : null,
        charts.map((c) => chartOf(c).element),
      ),
    );
  const none = data.has_truth
    ? null
    : h(
        "p.missing",
        { id: "no-truth" },
        "The log has no truth: there are no errors and no scores, only what the estimator says of itself.",
      );
  const quiet =
    data.events.length || data.summary.lio.not_arrived
      ? null
      : h("p.note", {}, "Nothing was bridged, left out or refused.");
  const help = shortcuts(
    [
      [
        ["ArrowLeft", "ArrowRight"],
        "0.1 s back or on; with shift 1 s",
        (key, shift) => player.seek(player.t_s + (key === "ArrowLeft" ? -1 : 1) * (shift ? 1 : 0.1)),
      ],
      [["Home", "End"], "to the start or the end", (key) => player.seek(key === "Home" ? 0 : player.duration_s)],
    ],
    "Click into a curve to go to that moment; drag over it to zoom in, double-click to zoom out.",
  );
  root.replaceChildren(
    h(
      "header",
      {},
      h("div.title", {}, h("h1", {}, data.name), h("p.reason", {}, saidOf(data))),
      data.summary.warnings.map((w) => h("p.warning", {}, w)),
    ),
    h(
      "main",
      {},
      none,
      data.has_truth ? h("div.pair", {}, scoresPanel(data), sourcePanel(data)) : sourcePanel(data),
      h(
        "section.wide",
        { id: "time" },
        h("h2", {}, "Over time"),
        h(
          "p.note",
          {},
          "Click into a curve to go to that moment. Drag over it to zoom in, double-click to zoom out. Long curves are thinned so that every spike stays.",
        ),
        h(
          "div.group",
          {},
          h("h3", {}, "Contacts as the log states them, and what was refused"),
          lanes.map((lane) => lane.element),
          quiet,
        ),
        groups,
      ),
    ),
    timeBar(player, help),
    help,
  );
  return {
    duration_s: player.duration_s,
    charts: data.charts.length,
    seek: async (t_s) => {
      player.seek(t_s);
      player.flush();
    },
    state: () => ({ t_s: player.t_s }),
  };
}
