// SPDX-License-Identifier: Apache-2.0
// What the run says in rows: steps, faults, memory, parameters, versions.
import { h, isNumber, moment, number, table, words } from "../core/dom.js";

const n = (text, title) => ({ text, class: "n", title });

export function stepsPanel(run, player) {
  const section = (...content) =>
    h("section.wide", { id: "steps" }, h("h2", {}, "Where it stepped, and why there"), ...content);
  if (!run.steps.length) return section(h("p.missing", {}, run.missing("steps")));
  const heads = [
    n("#"),
    "foot",
    "onto",
    "lifts",
    "lands",
    "chosen because",
    n("to edge, mm", "The sole as planned to the mapped polygon's edge"),
    n("e_m, mm", "Planned against executed, by its own estimate"),
    n("along, mm", "Planned distance to the mapped nosing against the true one"),
    n("across, mm"),
    n("true margin, mm", "Sole to the true tread's edge; negative: over it"),
    n("in the air, mm", "Least distance of the foot to the stairs"),
    n("map age, ms"),
  ];
  const rows = run.steps.map((s) =>
    h("tr", { class: s.touch_down_s === null ? "aborted" : null }, [
      h("td.n", {}, s.sequence),
      h("td", {}, h(`span.key.${s.foot}`), s.foot),
      h("td", {}, s.onto_tread ? (s.step ? `step ${s.step}` : "tread") : "floor"),
      h("td", {}, moment(player, s.latch_s)),
      h("td", {}, isNumber(s.touch_down_s) ? moment(player, s.touch_down_s) : "put back"),
      h("td.because", {}, because(s)),
      value(s.clearance_mm),
      value(s.execution_error_mm),
      value(s.along_error_mm),
      value(s.across_error_mm),
      value(s.sole_margin_mm, true),
      value(s.swing_clearance_mm, true),
      value(s.map_age_at_latch_ms, false, 0),
    ]),
  );
  return section(table(heads, rows, { label: "Steps", class: "steps" }));
}

function because(s) {
  if (s.why) return s.why;
  if (!s.onto_tread) return "walks up to the stairs";
  const polygon = isNumber(s.polygon_id) ? `polygon ${s.polygon_id}` : "its polygon";
  return `nearest mapped tread above it: ${polygon}${isNumber(s.target_m?.[2]) ? `, ${number(s.target_m[2], 2)} m up` : ""}`;
}

function value(v, judged = false, digits = 1) {
  return h(judged && v < 0 ? "td.n.bad" : "td.n", {}, number(v, digits));
}

export function faultsPanel(run, player) {
  const sums = new Map();
  for (const e of run.events) {
    const key = `${e.kind} ${e.name}`;
    const sum = sums.get(key) ?? { ...e, count: 0 };
    sum.count += e.count ?? 1;
    sums.set(key, sum);
  }
  for (const [name, count] of Object.entries(run.summary?.faults ?? {})) {
    if (![...sums.values()].some((e) => e.name === name)) sums.set(name, { name, kind: "", count, t_s: null });
  }
  const rows = [...sums.values()].map((e) => [
    e.kind,
    words(e.name),
    String(e.count),
    moment(player, e.t_s),
    e.text ?? "",
  ]);
  return h(
    "section",
    { id: "faults" },
    h("h2", {}, "Faults and limits"),
    rows.length
      ? table(["kind", "name", n("how often"), "first at", "what it says"], rows, { label: "Faults and limits" })
      : h("p.note", {}, "None was raised."),
  );
}

export function memoryPanel(run) {
  const section = (...content) => h("section", { id: "memory" }, h("h2", {}, "Memory by module"), ...content);
  if (!run.memory.length) return section(h("p.missing", {}, run.missing("memory")));
  const total = run.memory.reduce((sum, [, bytes]) => sum + bytes, 0),
    most = Math.max(...run.memory.map(([, bytes]) => bytes));
  const rows = [...run.memory]
    .sort((a, b) => b[1] - a[1])
    .map(([name, bytes]) => [
      words(name),
      number(bytes / 1024, 1),
      h("span.meter.plain", {}, h("span", { style: `width:${((100 * bytes) / most).toFixed(1)}%` })),
    ]);
  return section(
    table(["module", n("KiB"), ""], rows, { label: "Memory by module" }),
    h("p.note", {}, `${number(total / 1048576, 2)} MiB in all, static, stacks included.`),
  );
}

export function parametersPanel(run) {
  const params = run.json.params;
  const section = (...content) =>
    h("section.wide", { id: "parameters" }, h("h2", {}, "Parameters that differ from their default"), ...content);
  if (!params) return section(h("p.missing", {}, run.missing("params")));
  const rows = (params.differing ?? []).map((p) => [
    h("code", {}, p.name),
    String(p.value),
    String(p.default ?? "–"),
    p.unit ?? "",
    p.text ?? "",
  ]);
  return section(
    rows.length
      ? table(["name", n("value"), n("default"), "unit", "meaning"], rows, { label: "Parameters that differ" })
      : h("p.note", {}, "None: every parameter has its default."),
    params.hash ? h("p.note", {}, "Hash of all parameters: ", h("code", {}, params.hash)) : null,
  );
}

export function originPanel(run) {
  const versions = Object.entries(run.json.versions ?? {});
  const command = run.json.arguments?.length
    ? h("pre", {}, run.json.arguments.join(" "))
    : h("p.missing", {}, "The file does not say how the run was started.");
  return h(
    "section",
    { id: "origin" },
    h("h2", {}, "Versions and arguments"),
    command,
    versions.length
      ? table(["what", "version"], versions, { label: "Versions" })
      : h("p.missing", {}, run.missing("versions")),
    realityTable(run),
  );
}

function realityTable(run) {
  const drawn = Object.entries(run.summary?.reality ?? {}).filter(([name]) => name !== "scale");
  if (!drawn.length) return null;
  return h(
    "details",
    {},
    h("summary", {}, `How this robot differs from its data sheet (${drawn.length} figures)`),
    table(
      ["what", n("value")],
      drawn.map(([name, v]) => [h("code", {}, name), String(v)]),
      { label: "Reality" },
    ),
  );
}
