// SPDX-License-Identifier: Apache-2.0
// The head of the page: did it climb, why not, how near was it to failing, and how it stands beside the paper.
import { closest } from "../core/closest.js";
import { h, isNumber, moment, number, seconds, table } from "../core/dom.js";
import { before } from "../core/failure.js";
import { kTableI, kTableII } from "./paper.js";

const WORDS = { pass: "Passed", fail: "Failed", interrupted: "Interrupted" };

function facts(run) {
  const s = run.summary,
    a = s?.arguments;
  if (!s) return [];
  const noise = s.reality?.scale ? `reality ${s.reality.scale}` : null;
  return [
    a?.world ? `world ${a.world}` : `${s.steps_total} steps${a?.rise_m ? ` of ${number(a.rise_m, 2)} × ${number(a.tread_m, 2)} m` : ""}`,
    s.gait && `gait ${s.gait}`,
    s.plant && `plant ${s.plant}`,
    noise,
    isNumber(s.seed) && `seed ${s.seed}`,
    isNumber(run.json.clock_t0_s) && `0 s here is ${number(run.json.clock_t0_s, 3)} s of its clock`,
  ].filter(Boolean);
}

export const chip = (verdict) => h(`span.chip.${verdict ?? "unknown"}`, {}, WORDS[verdict] ?? "Not judged");

export function header(run, player) {
  const title = h(
    "div.title",
    {},
    h("h1", {}, "PolygMap"),
    chip(run.verdict),
    h("p.reason", {}, run.failure?.sentence ?? run.summary?.reason ?? run.missing("summary")),
  );
  const element = h(
    "header",
    {},
    title,
    h("div.facts", {}, h("p", {}, [run.name, seconds(run.duration_s), ...facts(run)].join(" · ")), contents()),
  );
  if (run.json.damage) element.append(h("div.failure", {}, h("p", {}, `This file is damaged: ${run.json.damage}`)));
  if (run.failure) element.append(failureBox(run, player));
  return element;
}

const PARTS = [
  ["closest", "closest to going wrong"],
  ["steps", "steps"],
  ["paper", "beside the paper"],
  ["time", "over time"],
  ["cost", "cost"],
  ["memory", "memory"],
  ["parameters", "parameters"],
];

function contents() {
  return h(
    "nav.contents",
    { "aria-label": "Parts of the page" },
    PARTS.map(([id, text]) =>
      h(
        "button",
        { type: "button", onclick: () => document.getElementById(id)?.scrollIntoView({ behavior: "smooth" }) },
        text,
      ),
    ),
  );
}

function failureBox(run, player) {
  const { t_s } = run.failure;
  const events = before(run, t_s).slice(-7);
  return h(
    "div.failure",
    { id: "failure" },
    h(
      "p",
      {},
      run.verdict === null ? "The page opens where the recording ends: " : "The page opens at the moment it failed: ",
      moment(player, t_s),
      run.failure.stop_text ? `. The module's reason: ${run.failure.stop_text}.` : "",
    ),
    events.length
      ? h(
          "ol",
          {},
          events.map(([at, text]) => h("li", {}, moment(player, at), " ", text)),
        )
      : null,
  );
}

export function closestPanel(run, player) {
  const rows = closest(run).map((e) => {
    const used = Math.max(0, Math.min(e.used, 1));
    const level = e.used >= 1 ? "bad" : e.used >= 0.8 ? "warn" : "good";
    return h(
      "tr",
      {},
      h("td", {}, e.what),
      h("td.n.strong", {}, e.value),
      h(
        "td",
        {},
        h(
          `span.meter.${level}`,
          { role: "img", "aria-label": `${number(100 * e.used, 0)} % used` },
          h("span", { style: `width:${(100 * used).toFixed(1)}%` }),
        ),
      ),
      h("td.n", {}, number(100 * e.used, 0, "%")),
      h("td.limit", {}, e.limit),
      h("td", {}, e.where),
      h("td", {}, moment(player, e.t_s)),
    );
  });
  return h(
    "section.wide",
    { id: "closest" },
    h("h2", {}, "What was closest to going wrong"),
    rows.length
      ? table(
          [
            "what",
            { text: "worst", class: "n" },
            "reserve used",
            { text: "", class: "n" },
            "it ends at",
            "where",
            "when",
          ],
          rows,
          { label: "What was closest to going wrong", class: "closest" },
        )
      : h("p.missing", {}, "The file has nothing that this could be told from."),
  );
}

export function paperPanel(run) {
  const s = run.summary;
  const heads = [
    "trial",
    "gait",
    { text: "T, s", class: "n" },
    { text: "steps", class: "n" },
    { text: "s per step", class: "n" },
    { text: "planes, Hz", class: "n" },
    { text: "e_m, mm", class: "n", title: "Foothold as planned against as executed, worst of the climb" },
  ];
  const row = (name, gait, t, steps, hz, e, css) =>
    h(
      "tr",
      { class: css },
      h("td", {}, name),
      h("td", {}, gait),
      h("td.n", {}, number(t, 1)),
      h("td.n", {}, isNumber(steps) ? String(steps) : "–"),
      h("td.n", {}, number(isNumber(t) && steps ? t / steps : null, 2)),
      h("td.n", {}, number(hz, isNumber(hz) && hz % 1 ? 1 : 0)),
      h("td.n", {}, number(e, 1)),
    );
  const own = s
    ? row(
        "this run",
        (s.gait ?? "").toUpperCase(),
        s.climb_time_s,
        s.steps_climbed,
        s.plane_rate_hz,
        s.execution_error_mm?.max,
        "own",
      )
    : null;
  const part = (title) => h("tr.part", {}, h("th", { colspan: heads.length }, title));
  const all = [
    own,
    part("Table I: Gazebo simulation"),
    ...kTableI.map((r) => row(...r)),
    part("Table II: real stairs"),
    ...kTableII.map((r) => row(...r)),
  ].filter(Boolean);
  const truth = isNumber(s?.foothold_error_mm?.max)
    ? `e_m is what the paper reports: the foothold as planned against as executed, by the robot's own estimate. Against the true stairs this run's footholds were off by up to ${number(s.foothold_error_mm.max, 1)} mm.`
    : "e_m is the foothold as planned against as executed, by the robot's own estimate.";
  return h(
    "section",
    { id: "paper" },
    h("h2", {}, "Beside the paper"),
    s ? null : h("p.missing", {}, run.missing("summary")),
    table(heads, all, { label: "This run beside the paper's tables", class: "paper" }),
    h("p.note", {}, truth),
  );
}
