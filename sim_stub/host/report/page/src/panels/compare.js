// SPDX-License-Identifier: Apache-2.0
// Two runs beside each other: what differs comes first, then the curves of both on one axis.
import { closest } from "../core/closest.js";
import { differences } from "../core/differences.js";
import { h, isNumber, moment, number, table } from "../core/dom.js";
import { FEET } from "../core/now.js";
import { tiltOf } from "../core/pose.js";
import { Chart } from "../plots/chart.js";
import { STATE_COLOUR, bandStrip } from "../plots/strips.js";
import { chip } from "./verdict.js";

export function compareHeader(runs, player) {
  const line = (run, name) =>
    h(
      "div.title",
      {},
      h(`span.key.run${name}`),
      h("b", {}, `${name}  ${run.name}`),
      chip(run.verdict),
      h("span.reason", {}, run.failure?.sentence ?? run.summary?.reason ?? run.missing("summary")),
      run.failure ? moment(player, run.failure.t_s) : null,
    );
  return h("header", {}, h("div.title", {}, h("h1", {}, "PolygMap: two runs")), line(runs[0], "A"), line(runs[1], "B"));
}

const shown = (value) =>
  value === undefined || value === null
    ? "–"
    : isNumber(value)
      ? String(Math.round(value * 1e4) / 1e4).replace("-", "−")
      : String(value);

function rows(list) {
  return list.map(({ name, a, b }) =>
    h(
      "tr",
      {},
      h("td", {}, h("code", {}, name)),
      ...[a, b].map((v) => h(isNumber(v) ? "td.n" : "td.text", {}, shown(v))),
      h("td.n", {}, isNumber(a) && isNumber(b) ? `${b > a ? "+" : ""}${shown(b - a)}` : ""),
    ),
  );
}

export function differencesPanel(runs) {
  const found = differences(...runs);
  const heads = ["", { text: "A", class: "n" }, { text: "B", class: "n" }, { text: "B − A", class: "n" }];
  const part = (title, list) =>
    list.length
      ? [h("h3", {}, title), table(heads, rows(list), { label: title, class: "differ" })]
      : [h("h3", {}, title), h("p.note", {}, "No difference.")];
  const first = found.figures.filter((f) => found.isDecisive(f.name)),
    others = found.figures.filter((f) => !found.isDecisive(f.name));
  return h(
    "section.wide",
    { id: "differences" },
    h("h2", {}, "What differs"),
    h(
      "div.pair",
      {},
      h("div", {}, part("Figures of the verdict", first)),
      h(
        "div",
        {},
        part("How they were started", found.started),
        part("Parameters", found.parameters),
        found.versions.length ? part("Versions", found.versions) : null,
      ),
    ),
    others.length
      ? h(
          "details",
          {},
          h("summary", {}, `${others.length} other figures differ`),
          table(heads, rows(others), { label: "Other figures" }),
        )
      : null,
  );
}

/** One quantity of both runs over time. make(run) gives {t_s, values} or null. */
function both(runs, spec, make) {
  const made = runs.map(make);
  if (!made.some(Boolean)) return null;
  const longest = made.filter(Boolean).sort((a, b) => b.t_s.at(-1) - a.t_s.at(-1))[0].t_s;
  const on = (one) => {
    if (!one) return longest.map(() => null);
    let i = 0;
    return longest.map((t) => {
      while (i + 1 < one.t_s.length && one.t_s[i + 1] <= t) ++i;
      return t > one.t_s.at(-1) + 0.05 || t < one.t_s[0] - 0.05 ? null : one.values[i];
    });
  };
  return new Chart({
    ...spec,
    lines: [
      { label: "A", colour: "runA", width: 2 },
      { label: "B", colour: "runB", width: 2, dash: [7, 3] },
    ],
    data: () => [longest, on(made[0]), on(made[1])],
  });
}

const over = (series, value) =>
  series?.count
    ? {
        t_s: Array.from(series.t_s),
        values: Array.from(series.t_s, (_, i) => {
          const v = value(i);
          return Number.isFinite(v) ? v : null;
        }),
      }
    : null;

export function compareSection(runs, player) {
  const strips = runs
    .map((run, i) =>
      run.states.length ? bandStrip(`state of ${"AB"[i]}`, run.states, STATE_COLOUR, player, run.duration_s) : null,
    )
    .filter(Boolean);
  player.listen((t_s) => {
    for (const strip of strips) strip.mark(t_s);
  });
  const pose = (c, name) =>
    both(runs, { title: `Fused base ${name} against truth`, unit: "mm", height: 120 }, (run) => {
      const truth = run.series("base_true"),
        fused = run.series("base_fused");
      return truth && fused && truth.count === fused.count
        ? over(fused, (i) => 1e3 * (fused.columns[c][i] - truth.columns[c][i]))
        : null;
    });
  const charts = [
    both(runs, { title: "Way of the base up the stairs, x", unit: "m", digits: 3, height: 130 }, (run) =>
      over(run.base, (i) => run.base.columns[0][i]),
    ),
    both(runs, { title: "Height of the base, z", unit: "m", digits: 3, height: 130 }, (run) =>
      over(run.base, (i) => run.base.columns[2][i]),
    ),
    pose(0, "x"),
    pose(1, "y"),
    pose(2, "z"),
    both(
      runs,
      {
        title: "Foot off its desired path, the farther of both, x and z",
        unit: "mm",
        height: 130,
        limits: [{ at: 40, label: "40 mm, the paper's bound" }],
      },
      (run) => {
        const feet = FEET.map((f) => [run.series(`sole_desired_${f}`), run.sole(f)]).filter(
          ([d, r]) => d && r && d.count === r.count,
        );
        return feet.length
          ? over(
              feet[0][0],
              (i) =>
                1e3 *
                Math.max(...feet.flatMap(([d, r]) => [0, 2].map((c) => Math.abs(d.columns[c][i] - r.columns[c][i])))),
            )
          : null;
      },
    ),
    both(
      runs,
      { title: "p* to its polygon's edge, the lesser foot", unit: "mm", height: 130, limits: [{ at: 0 }] },
      (run) =>
        run.searches.length
          ? {
              t_s: run.searches.map((s) => s.t_s),
              values: run.searches.map((s) => {
                const values = (s.p_star ?? []).filter(Boolean).map((f) => 1e3 * f.clearance_m);
                return values.length ? Math.min(...values) : null;
              }),
            }
          : null,
    ),
    both(runs, { title: "Lean of the torso", unit: "rad", digits: 3, height: 120 }, (run) =>
      over(run.base, (i) => tiltOf([3, 4, 5, 6].map((c) => run.base.columns[c][i]))),
    ),
    both(
      runs,
      { title: "Torque of the drives, the largest share", unit: "%", digits: 0, height: 120, limits: [{ at: 100 }] },
      (run) => {
        const torque = run.series("torque_share");
        return over(torque, (i) => 100 * Math.max(...torque.columns.map((c) => c[i]).filter(Number.isFinite)));
      },
    ),
    both(
      runs,
      { title: "Dearest row of the schedule", unit: "% of its budget", digits: 0, height: 120, limits: [{ at: 100 }] },
      (run) => {
        const cost = run.series("cost");
        return over(
          cost,
          (i) =>
            100 *
            Math.max(
              ...cost.columns.map((c, k) => c[i] / run.schedule[k]?.budget_instructions).filter(Number.isFinite),
            ),
        );
      },
    ),
  ].filter(Boolean);
  return h(
    "section.wide",
    { id: "overlaid" },
    h("h2", {}, "Both over time"),
    h("p.note", {}, "Each run's time counts from its first frame."),
    strips.map((s) => s.element),
    charts.map((c) => c.element),
  );
}

export function closestOfBoth(runs, player) {
  const lists = runs.map((run) => new Map(closest(run).map((e) => [e.what, e])));
  const names = [...new Set(lists.flatMap((list) => [...list.keys()]))].sort(
    (x, y) => Math.max(...lists.map((l) => l.get(y)?.used ?? 0)) - Math.max(...lists.map((l) => l.get(x)?.used ?? 0)),
  );
  const cells = (e) => [
    h("td.n.strong", {}, e?.value ?? "–"),
    h("td.n", {}, e ? number(100 * e.used, 0, "%") : ""),
    h("td", {}, e?.where ?? "", " ", e ? moment(player, e.t_s) : ""),
  ];
  const heads = [
    "what",
    { text: "A", class: "n" },
    { text: "used", class: "n" },
    "where, when",
    { text: "B", class: "n" },
    { text: "used", class: "n" },
    "where, when",
  ];
  return h(
    "section.wide",
    { id: "closest" },
    h("h2", {}, "What was closest to going wrong"),
    table(
      heads,
      names.map((name) => h("tr", {}, h("td", {}, name), ...lists.flatMap((list) => cells(list.get(name))))),
      { label: "What was closest to going wrong", class: "closest" },
    ),
  );
}
