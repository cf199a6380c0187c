// SPDX-License-Identifier: Apache-2.0
// A chart as the data have it (DATA.md, "A log").
import { unpack } from "../core/blocks.js";
import { Chart } from "../plots/chart.js";

// How each kind of curve looks.
const LOOKS = {
  high: { colour: "band3", width: 1 },
  low: { colour: "band3", width: 1 },
  estimate: { colour: "fused", width: 1.5 },
  truth: { colour: "truth", width: 2.5 },
  odometry: { colour: "odometry", dash: [6, 3] },
  lio: { colour: "pstarstar", points: true },
  first: { colour: "fused" },
  second: { colour: "odometry" },
  third: { colour: "pstarstar" },
};

export function chartOf(json) {
  const at = (look) => json.lines.findIndex((line) => line.look === look) + 1;
  return new Chart({
    title: json.title,
    unit: json.unit,
    digits: json.digits,
    lines: json.lines.map((line) => ({ ...(LOOKS[line.look] ?? LOOKS.first), label: line.label })),
    bands: at("high") && at("low") ? [{ series: [at("high"), at("low")] }] : [],
    data: () => {
      const [t_s, ...columns] = unpack(json.table);
      return [Array.from(t_s), ...columns.map((c) => Array.from(c, (v) => (Number.isFinite(v) ? v : null)))];
    },
    height: json.group === "error" ? 150 : 120,
  });
}
