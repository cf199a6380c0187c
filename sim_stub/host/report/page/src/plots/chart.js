// SPDX-License-Identifier: Apache-2.0
// Curves over time that share one axis and one moment: click to go there, drag to zoom in, double-click to zoom out.
import uPlot from "uplot";
import { colours, onTheme } from "../core/colours.js";
import { h, number } from "../core/dom.js";

const all = new Set();
const zoomed = []; // who else shows a part of the run
let player = null;
let shown = null; // [from, to] in s; null: all of the run

export function setPlayer(p) {
  player = p;
  p.listen((t_s) => {
    for (const chart of all) chart.mark(t_s);
  });
}

/** What part of the run is shown: [from, to]. */
export const part = () => shown ?? [0, player.duration_s];

/** Calls back when the reader zooms. */
export function onZoom(call) {
  zoomed.push(call);
}

function zoom(range) {
  shown = range;
  for (const chart of all) chart.plot?.setScale("x", { min: part()[0], max: part()[1] });
  for (const call of zoomed) call();
}

const axis = (more) => ({
  stroke: () => colours.faint,
  grid: { stroke: () => colours.grid, width: 1 },
  ticks: { stroke: () => colours.grid, width: 1, size: 4 },
  font: "11px system-ui, sans-serif",
  ...more,
});

/**
 * {title, unit, digits, data: [t, ...ys] or what makes them, lines: [{label, colour (a role), dash, width, points}], bands: [{series: [a, b], colour}],
 * limits: [{at, label}], height}. Nothing is drawn before it is scrolled near.
 */
export class Chart {
  constructor(spec) {
    this.spec = spec;
    this.host = h("div.plot");
    this.legend = h(
      "div.legend",
      {},
      spec.lines.map((line) =>
        h(
          "button.small.entry",
          {
            type: "button",
            "aria-pressed": "true",
            title: "Show or hide",
            onclick: (e) => this.hide(line, e.currentTarget),
          },
          h("span.stroke", {
            style: `--c: var(--${line.colour}); ${line.dash ? "border-top-style: dashed" : ""}${line.points ? "; border-top-style: dotted" : ""}`,
          }),
          h("span", {}, line.label),
          h("output", {}),
        ),
      ),
    );
    this.element = h("figure.chart", {}, h("figcaption", {}, spec.title), h("div.row", {}, this.host, this.legend));
    this.outputs = [...this.legend.querySelectorAll("output")];
    all.add(this);
    onTheme(() => this.plot?.redraw(false));
    new IntersectionObserver(
      (seen, observer) => {
        if (!seen.some((s) => s.isIntersecting)) return;
        observer.disconnect();
        this.make();
      },
      { rootMargin: "300px" },
    ).observe(this.host);
  }

  make() {
    const { spec } = this;
    const series = [
      {},
      ...spec.lines.map((line) => ({
        label: line.label,
        stroke: () => colours[line.colour],
        width: line.width ?? 1.5,
        dash: line.dash,
        points: { show: !!line.points, size: 3, fill: () => colours[line.colour] },
        paths: line.points ? () => null : undefined,
        spanGaps: false,
      })),
    ];
    const options = {
      width: this.host.clientWidth || 600,
      height: spec.height ?? 150,
      legend: { show: false },
      scales: { x: { time: false, min: part()[0], max: part()[1] }, y: { range: spec.range } },
      series,
      bands: (spec.bands ?? []).map((b) => ({ series: b.series, fill: () => colours.band })),
      axes: [
        axis({ values: (_, ticks) => ticks.map((t) => `${t} s`), size: 26 }),
        axis({ label: spec.unit, labelSize: 16, labelFont: "11px system-ui, sans-serif", size: this.gutter() - 16 }),
      ],
      padding: [8, 1, 0, 0],
      cursor: { sync: { key: "polygmap" }, drag: { x: true, y: false, setScale: false }, points: { size: 6 } },
      hooks: {
        draw: [(plot) => this.over(plot)],
        setCursor: [(plot) => this.readOut(plot.cursor.idx)],
        setSelect: [(plot) => this.select(plot)],
      },
    };
    this.plot = unaccelerated(
      () => new uPlot(options, typeof spec.data === "function" ? (spec.data = spec.data()) : spec.data, this.host),
    );
    this.now = h("i.cursor");
    this.plot.over.append(this.now);
    new IntersectionObserver((seen) => {
      this.visible = seen.at(-1).isIntersecting;
      if (this.visible) this.mark(player.t_s);
    }).observe(this.host);
    this.plot.over.addEventListener("click", (e) => {
      if (this.dragged) this.dragged = false;
      else player.seek(this.plot.posToVal(e.offsetX, "x"));
    });
    this.plot.over.addEventListener("dblclick", () => zoom(null));
    new ResizeObserver(
      () => this.host.clientWidth && this.plot.setSize({ width: this.host.clientWidth, height: spec.height ?? 150 }),
    ).observe(this.host);
    this.mark(player.t_s);
  }

  /** Wide enough that curves and strips stand under each other. */
  gutter() {
    return this.host.clientWidth < 500 ? 66 : 100;
  }

  select(plot) {
    if (plot.select.width < 4) return;
    this.dragged = true;
    const range = [plot.posToVal(plot.select.left, "x"), plot.posToVal(plot.select.left + plot.select.width, "x")];
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    zoom(range);
  }

  hide(line, button) {
    const i = this.spec.lines.indexOf(line) + 1;
    const on = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", on);
    this.plot?.setSeries(i, { show: on });
  }

  /** The limits, drawn over the curves. */
  over(plot) {
    const { ctx, bbox } = plot;
    ctx.save();
    for (const limit of this.spec.limits ?? []) {
      const y = plot.valToPos(limit.at, "y", true);
      if (y < bbox.top || y > bbox.top + bbox.height) continue;
      ctx.strokeStyle = colours.bad;
      ctx.setLineDash([6, 4]);
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
      if (limit.label) {
        ctx.fillStyle = colours.bad;
        ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
        ctx.textAlign = "right";
        ctx.fillText(limit.label, bbox.left + bbox.width - 4, y - 4);
      }
    }
    ctx.restore();
    this.place();
  }

  /** The moment's line stands over the curves, so that they need not be drawn anew for it. */
  place() {
    if (!this.now) return;
    const share = ((this.t_s ?? 0) - part()[0]) / Math.max(part()[1] - part()[0], 1e-6);
    this.now.hidden = share < 0 || share > 1;
    this.now.style.left = `${100 * share}%`;
  }

  mark(t_s) {
    this.t_s = t_s;
    if (!this.plot || !this.visible) return;
    this.place();
    this.readOut(null);
  }

  /** The values under the pointer, else those of the moment. */
  readOut(idx) {
    const data = this.spec.data;
    if (typeof data === "function") return;
    const i = idx ?? closestIndex(data[0], this.t_s ?? 0);
    this.outputs.forEach((output, k) => {
      const value = data[k + 1]?.[i];
      output.textContent = value === null || value === undefined ? "" : number(value, this.spec.digits ?? 1);
    });
  }
}

/** Without the graphics card, where long dashed curves take many times as long to draw if that is software. */
function unaccelerated(make) {
  const own = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return own.call(this, kind, { ...options, willReadFrequently: true });
  };
  try {
    return make();
  } finally {
    HTMLCanvasElement.prototype.getContext = own;
  }
}

function closestIndex(t, at) {
  let low = 0,
    high = t.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (t[middle] <= at) low = middle;
    else high = middle;
  }
  return at - t[low] < t[high] - at ? low : high;
}
