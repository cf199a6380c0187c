// SPDX-License-Identifier: Apache-2.0
// The depth picture of the moment with what the module found in it: labelled planes and their nosings.
import { colours, faded } from "../core/colours.js";
import { h, number, seconds } from "../core/dom.js";
import { points } from "../view/points.js";
import { depthColour } from "./ramp.js";

const KEPT = 60; // decoded pictures

/** Pixels of a picture: {width, height, depth_m: Float32Array, NaN where there is none}; decoded once. */
export class Pictures {
  constructor(run) {
    this.run = run;
    this.decoded = new Map();
  }

  async get(picture) {
    if (!this.decoded.has(picture)) {
      this.decoded.set(
        picture,
        this.decode(picture).catch(() => null),
      ); // null: it cannot be read
      if (this.decoded.size > KEPT) this.decoded.delete(this.decoded.keys().next().value);
    }
    return this.decoded.get(picture);
  }

  async decode(picture) {
    const image = new Image();
    image.src = `data:image/png;base64,${picture.png}`;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    const grey = context.getImageData(0, 0, image.width, image.height).data;
    const { near_m, far_m } = this.run.camera;
    const depth_m = new Float32Array(image.width * image.height);
    for (let i = 0; i < depth_m.length; ++i)
      depth_m[i] = grey[4 * i] ? near_m + ((grey[4 * i] - 1) / 254) * (far_m - near_m) : NaN;
    return { width: image.width, height: image.height, depth_m };
  }
}

export class PicturePanel {
  constructor(run, pictures) {
    this.run = run;
    this.pictures = pictures;
    this.withPlanes = true;
    this.said = h("p.said", { "aria-live": "off" });
    this.canvas = h("canvas", { role: "img", "aria-label": "Depth picture" });
    this.toggle = h("button.small", { type: "button", "aria-pressed": "true", onclick: () => this.flip() }, "planes");
    this.element = h(
      "section.panel.picture",
      { id: "picture" },
      h("h2", {}, "Depth picture", this.toggle),
      h("div.frame", {}, this.canvas),
      this.said,
    );
    if (!run.pictures.length || !run.camera) {
      this.element.replaceChildren(h("h2", {}, "Depth picture"), h("p.missing", {}, run.missing("pictures")));
      this.off = true;
      return;
    }
    this.canvas.addEventListener("pointermove", (e) => this.readOut(e));
    this.canvas.addEventListener("pointerleave", () => this.describe());
  }

  flip() {
    this.withPlanes = !this.withPlanes;
    this.toggle.setAttribute("aria-pressed", this.withPlanes);
    this.paint();
  }

  async show(t_s) {
    if (this.off) return;
    const picture = this.run.newest("pictures", t_s) ?? this.run.pictures[0];
    if (picture === this.picture) return;
    this.picture = picture;
    const pixels = await this.pictures.get(picture);
    if (picture !== this.picture) return; // another was asked for meanwhile
    if (!pixels) {
      this.said.textContent = `The picture of ${seconds(picture.t_s)} cannot be read.`;
      return;
    }
    this.pixels = pixels;
    this.image = this.coloured(pixels);
    this.paint();
    this.describe();
  }

  coloured(pixels) {
    const canvas = new OffscreenCanvas(pixels.width, pixels.height);
    const context = canvas.getContext("2d", { willReadFrequently: true });
    const image = context.createImageData(pixels.width, pixels.height);
    const sorted = pixels.depth_m.filter(Number.isFinite).sort();
    this.range_m = [sorted[Math.floor(0.01 * sorted.length)] ?? 0, sorted[Math.floor(0.99 * sorted.length)] ?? 1];
    const [near_m, far_m] = this.range_m;
    for (let i = 0; i < pixels.depth_m.length; ++i) {
      const [r, g, b] = depthColour((pixels.depth_m[i] - near_m) / Math.max(far_m - near_m, 0.05));
      image.data.set([r, g, b, 255], 4 * i);
    }
    context.putImageData(image, 0, 0);
    return canvas;
  }

  paint() {
    if (!this.image) return;
    const camera = this.run.camera;
    this.canvas.width = 640;
    this.canvas.height = Math.round((640 * camera.height_px) / camera.width_px);
    const context = this.canvas.getContext("2d", { willReadFrequently: true });
    context.imageSmoothingEnabled = false;
    context.drawImage(this.image, 0, 0, this.canvas.width, this.canvas.height);
    if (this.withPlanes)
      for (const surface of this.picture.surfaces ?? [])
        this.paintSurface(context, surface, this.canvas.width / camera.width_px);
  }

  paintSurface(context, surface, scale) {
    const { fx_px, fy_px, cx_px, cy_px } = this.run.camera;
    const pixel = ([x, y, z]) => [((x / z) * fx_px + cx_px + 0.5) * scale, ((y / z) * fy_px + cy_px + 0.5) * scale];
    const corners = points(surface.vertices).map(pixel);
    const colour = { tread: colours.map, riser: colours.riser }[surface.kind] ?? colours.faint;
    context.beginPath();
    corners.forEach(([u, v], i) => (i ? context.lineTo(u, v) : context.moveTo(u, v)));
    context.closePath();
    context.fillStyle = faded(colour, 0.3);
    context.fill();
    context.lineWidth = 3;
    context.strokeStyle = colour;
    context.stroke();
    if (surface.nosing) {
      const [a, b] = points(surface.nosing).map(pixel);
      context.beginPath();
      context.moveTo(...a);
      context.lineTo(...b);
      context.lineWidth = 7;
      context.strokeStyle = colours.nosing;
      context.stroke();
    }
    const middle = [0, 1].map((k) => corners.reduce((sum, c) => sum + c[k], 0) / corners.length);
    const high = Math.max(...corners.map((c) => c[1])) - Math.min(...corners.map((c) => c[1]));
    if (high < 26) return;
    const label = surface.polygon_id === undefined ? surface.kind : `${surface.kind} ${surface.polygon_id}`;
    context.font = "600 24px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineWidth = 5;
    context.strokeStyle = "rgba(0, 0, 0, 0.75)";
    context.strokeText(label, ...middle);
    context.fillStyle = "#fff";
    context.fillText(label, ...middle);
  }

  describe() {
    if (!this.picture) return;
    const surfaces = this.picture.surfaces ?? [];
    const none = this.picture.invalid_fraction;
    const holes = none === undefined ? "" : `; ${number(none * 100, 0)} % without depth`;
    this.said.textContent = `${seconds(this.picture.t_s)}: ${surfaces.length} surfaces. Bright is ${number(this.range_m[0], 1)} m, dark ${number(this.range_m[1], 1)} m away${holes}`;
  }

  readOut(event) {
    if (!this.pixels) return;
    const box = this.canvas.getBoundingClientRect();
    const u = Math.floor(((event.clientX - box.left) / box.width) * this.pixels.width);
    const v = Math.floor(((event.clientY - box.top) / box.height) * this.pixels.height);
    const depth = this.pixels.depth_m[v * this.pixels.width + u];
    this.said.textContent = Number.isFinite(depth)
      ? `Depth here: ${number(depth, 2)} m along the optical axis`
      : "No depth here";
  }
}
