// SPDX-License-Identifier: Apache-2.0
// Builds the page from the data in it, wires slider, keys and views to one moment, and opens where it should.
import { h } from "./core/dom.js";
import { failureOf } from "./core/failure.js";
import { robotAt } from "./core/now.js";
import { Player } from "./core/player.js";
import { parse } from "./core/run.js";
import { closestOfBoth, compareHeader, compareSection, differencesPanel } from "./panels/compare.js";
import { bindKeys, helpDialog } from "./panels/keys.js";
import { legend } from "./panels/legend.js";
import { MomentPanel } from "./panels/moment.js";
import { PicturePanel, Pictures } from "./panels/picture.js";
import { faultsPanel, memoryPanel, originPanel, parametersPanel, stepsPanel } from "./panels/tables.js";
import { TopView } from "./panels/topview.js";
import { Transport } from "./panels/transport.js";
import { closestPanel, header, paperPanel } from "./panels/verdict.js";
import { timeSection } from "./plots/section.js";
import { setPlayer } from "./plots/chart.js";
import { replayView } from "./view/replay.js";

const root = document.getElementById("page");

function say(sentence) {
  root.replaceChildren(h("header", {}, h("div.title", {}, h("h1", {}, "PolygMap"), h("p.reason", {}, sentence))));
}

/** The SECONDS of #t=SECONDS, or null. */
function asksForTime() {
  const asked = /[#&]t=([-+\d.eE]+)/.exec(location.hash)?.[1];
  return asked !== undefined && Number.isFinite(Number(asked)) ? asked : null;
}

/** Where to open: as the address says, else where it failed, else at the start. */
function openingTime(run) {
  if (asksForTime()) return Number(asksForTime());
  return run.failure?.t_s ?? 0;
}

function build(runs) {
  const [run, other] = runs;
  const player = new Player(Math.max(...runs.map((r) => r.duration_s)));
  const pictures = new Pictures(run);
  const picture = new PicturePanel(run, pictures),
    top = new TopView(run, pictures),
    words = new MomentPanel(run);
  const stage = h("section.panel.stage", { id: "stage", "aria-label": "Replay" });
  const view = replayView(stage, run, other);
  const help = helpDialog();
  const look = (n) => {
    if (!view.look) return; // a drawing has one view
    view.look(n);
    transport.look(n);
  };
  const transport = new Transport(run, player, view.look ? look : null, () => help.showModal());
  setPlayer(player);
  stage.append(legend(run, other));
  const replay = h("div.replay", {}, stage, h("div.column", {}, picture.element, top.element), words.element);
  const parts = other
    ? [differencesPanel(runs), replay, compareSection(runs, player), closestOfBoth(runs, player)]
    : [
        replay,
        closestPanel(run, player),
        stepsPanel(run, player),
        h("div.pair", {}, paperPanel(run), h("div", {}, faultsPanel(run, player))),
        timeSection(run, player),
        h("div.pair", {}, memoryPanel(run), originPanel(run)),
        parametersPanel(run),
      ];
  root.replaceChildren(
    other ? compareHeader(runs, player) : header(run, player),
    h("main", {}, parts),
    transport.element,
    help,
  );
  let settled = Promise.resolve();
  player.seek(openingTime(run));
  player.listen((t_s) => {
    transport.show(t_s);
    words.show(t_s);
    view.show(t_s);
    settled = Promise.all([picture.show(t_s), top.show(t_s)]);
  });
  bindKeys(player, look, help);
  window.addEventListener("hashchange", () => asksForTime() && player.seek(openingTime(run)));
  return { player, settled: () => settled };
}

function state(run, t_s) {
  const now = robotAt(run, t_s);
  return { t_s, base: now.base?.p ?? null, feet: now.soles.map((s) => s?.p ?? null) };
}

export async function climbPage() {
  let runs, page;
  try {
    runs = parse(document.getElementById("polygmap-data").textContent);
    if (!runs.length) return say("This report has no run in it.");
    runs = runs.slice(0, 2);
    await Promise.all(runs.map((run) => run.load()));
    for (const run of runs) run.failure = failureOf(run);
    page = build(runs);
  } catch (error) {
    return say(`This report cannot be read: ${error.message}.`);
  }
  window.polygmap = {
    duration_s: page.player.duration_s,
    /** Shows that moment; what it promises is kept when all of the page does. */
    seek: async (t_s) => {
      page.player.pause();
      page.player.seek(t_s);
      page.player.flush();
      await page.settled();
    },
    state: () => state(runs[0], page.player.t_s),
  };
  await page.settled();
  document.documentElement.dataset.ready = "yes";
}
