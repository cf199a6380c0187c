// SPDX-License-Identifier: Apache-2.0
// From above, to scale: the heights that the picture shows (highest of each square of 20 mm), the map over them, the
// safe regions, and where the feet stand and are to go.
import { colours, faded, onTheme } from "../core/colours.js";
import { h, number } from "../core/dom.js";
import { robotAt } from "../core/now.js";
import { aboutZ, placed, soleCorners } from "../core/pose.js";
import { points } from "../view/points.js";
import { heightColour } from "./ramp.js";

const CELL_m = 0.02;
const SPAN_m = 1.5; // shown from left to right
const BEHIND_m = 0.3;

export class TopView {
  constructor(run, pictures) {
    this.run = run;
    this.pictures = pictures;
    this.canvas = h("canvas", { role: "img", "aria-label": "Heights, map and footholds from above" });
    this.said = h("p.said");
    this.element = h(
      "section.panel.top",
      { id: "top" },
      h("h2", {}, "Heights from above"),
      h("div.frame", {}, this.canvas),
      this.said,
    );
    this.off = !run.base && !run.polygons.length;
    if (this.off)
      this.element.replaceChildren(h("h2", {}, "Heights from above"), h("p.missing", {}, run.missing("map")));
    this.canvas.addEventListener("pointermove", (e) => this.readOut(e));
    this.canvas.addEventListener("pointerleave", () => this.describe());
    onTheme(() => this.paint());
  }

  async show(t_s) {
    if (this.off) return;
    this.t_s = t_s;
    this.now = robotAt(this.run, t_s);
    const picture = this.run.camera ? this.run.newest("pictures", t_s) : null;
    if (picture !== this.picture) {
      this.picture = picture;
      const pixels = picture ? await this.pictures.get(picture) : null;
      const raster = pixels ? this.rasterOf(picture, pixels) : null;
      if (picture !== this.picture) return;
      this.raster = raster;
    }
    this.paint();
    this.describe();
  }

  /** Highest point of each square, by the robot's pose at the exposure: number of the square -> [x, y, z]. */
  rasterOf(picture, pixels) {
    const pose = robotAt(this.run, picture.t_s).camera;
    if (!pose) return null;
    const { width_px, height_px, fx_px, fy_px, cx_px, cy_px } = this.run.camera;
    const cells = new Map();
    for (let v = 0; v < pixels.height; ++v) {
      for (let u = 0; u < pixels.width; ++u) {
        const depth = pixels.depth_m[v * pixels.width + u];
        if (!Number.isFinite(depth)) continue;
        const x = (((u + 0.5) * width_px) / pixels.width - 0.5 - cx_px) / fx_px,
          y = (((v + 0.5) * height_px) / pixels.height - 0.5 - cy_px) / fy_px;
        const p = placed(pose, [x * depth, y * depth, depth]);
        const key = Math.round(p[0] / CELL_m) * 4096 + Math.round(p[1] / CELL_m);
        if (!(cells.get(key)?.[2] > p[2]))
          cells.set(key, [Math.round(p[0] / CELL_m) * CELL_m, Math.round(p[1] / CELL_m) * CELL_m, p[2]]);
      }
    }
    return cells;
  }

  paint() {
    if (!this.now) return;
    const canvas = this.canvas;
    canvas.width = 640;
    canvas.height = 520;
    const context = canvas.getContext("2d", { willReadFrequently: true });
    const middle = this.now.base?.p ?? [0, 0, 0];
    const scale = canvas.width / SPAN_m;
    this.x0 = middle[0] - BEHIND_m;
    this.scale = scale;
    const at = ([x, y]) => [canvas.width / 2 - y * scale, canvas.height - (x - this.x0) * scale];
    context.fillStyle = colours.panel;
    context.fillRect(0, 0, canvas.width, canvas.height);
    this.lowest = Math.min(...[this.now.soles[0], this.now.soles[1]].map((s) => s?.p[2] ?? 0));
    this.paintRaster(context, at, scale);
    const shape = (corners, fill, stroke, width) => {
      context.beginPath();
      corners.forEach((c, i) => (i ? context.lineTo(...at(c)) : context.moveTo(...at(c))));
      context.closePath();
      if (fill) {
        context.fillStyle = fill;
        context.fill();
      }
      context.lineWidth = width;
      context.strokeStyle = stroke;
      context.stroke();
    };
    for (const p of this.run.polygonsAt(this.t_s))
      if (p.kind !== "riser") shape(points(p.vertices), this.raster ? null : faded(colours.map, 0.3), colours.map, 3);
    for (const p of this.run.polygonsAt(this.t_s)) if (p.nosing) shape(points(p.nosing), null, colours.nosing, 5);
    const search = this.run.newest("searches", this.t_s);
    for (const region of search?.safe ?? [])
      shape(points(region.vertices), faded(colours.safe, 0.35), colours.safe, 2.5);
    this.paintFeet(context, at, shape, search);
    this.paintScale(context, canvas);
  }

  paintRaster(context, at, scale) {
    if (!this.raster) return;
    const size = CELL_m * scale + 0.6;
    for (const [x, y, z] of this.raster.values()) {
      const [u, v] = at([x + CELL_m / 2, y + CELL_m / 2]);
      if (v < -size || v > 520) continue;
      const [r, g, b] = heightColour((z - this.lowest + 0.15) / 0.7);
      context.fillStyle = `rgb(${r},${g},${b})`;
      context.fillRect(u, v, size, size);
    }
  }

  paintFeet(context, at, shape, search) {
    const sole = soleCorners(this.run.robot?.sole?.contact_m ?? [0.17, -0.07, 0.048]);
    const label = (text, p, colour) => {
      context.font = "600 22px system-ui, sans-serif";
      context.textAlign = "center";
      context.textBaseline = "middle";
      context.lineWidth = 5;
      context.strokeStyle = faded("#000000", 0.7);
      context.strokeText(text, ...at(p));
      context.fillStyle = colour;
      context.fillText(text, ...at(p));
    };
    for (const [name, colour, text] of [
      ["p_star_star", colours.pstarstar, "p**"],
      ["p_star", colours.pstar, "p*"],
    ]) {
      for (const place of search?.[name] ?? []) {
        if (!place) continue;
        const pose = { p: place.position_m, q: aboutZ(place.yaw_rad) };
        shape(
          sole.map((c) => placed(pose, c)),
          faded(colour, 0.55),
          colour,
          4,
        );
        label(text, placed(pose, [0.05, 0, 0]), "#fff");
      }
    }
    this.now.soles.forEach((pose, i) => {
      if (!pose) return;
      const colour = i ? colours.right : colours.left;
      shape(
        sole.map((c) => placed(pose, c)),
        faded(colour, 0.75),
        colours.ink,
        2.5,
      );
      label(i ? "R" : "L", placed(pose, [0.05, 0, 0]), "#fff");
    });
  }

  paintScale(context, canvas) {
    context.fillStyle = colours.panel;
    context.fillRect(canvas.width - 152, canvas.height - 40, 152, 40);
    context.fillStyle = colours.ink;
    context.fillRect(canvas.width - 140, canvas.height - 12, 0.25 * this.scale, 4);
    context.font = "20px system-ui, sans-serif";
    context.textAlign = "left";
    context.fillText("0.25 m", canvas.width - 140, canvas.height - 26);
  }

  describe() {
    const heights = this.raster
      ? `squares of 20 mm: heights in the picture, dark low, bright high`
      : "no picture, so no heights: the map alone";
    this.said.textContent = `Up the stairs is up; ${heights}`;
  }

  readOut(event) {
    const box = this.canvas.getBoundingClientRect();
    const y = (this.canvas.width / 2 - ((event.clientX - box.left) / box.width) * this.canvas.width) / this.scale;
    const x = this.x0 + (this.canvas.height * (1 - (event.clientY - box.top) / box.height)) / this.scale;
    const z = this.raster?.get(Math.round(x / CELL_m) * 4096 + Math.round(y / CELL_m))?.[2];
    this.said.textContent = `x ${number(x, 2)} m, y ${number(y, 2)} m: ${z === undefined ? "no height measured" : `height ${number(z, 3)} m`}`;
  }
}
