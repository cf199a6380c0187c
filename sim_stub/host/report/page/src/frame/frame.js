// SPDX-License-Identifier: Apache-2.0
// One depth picture (DATA.md, "A frame") in level axes: the camera at the origin, x ahead, y left, z up.
import { load, unpack } from "../core/blocks.js";
import { points } from "../view/points.js";

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (v) => v.map((c) => c / (Math.hypot(...v) || 1));

/** Camera axes ahead, left and up; a camera that looks straight up or down has the picture's own up ahead. */
function levelAxes(up) {
  const z = unit(up);
  const flat = (v) => v.map((c, k) => c - dot(v, z) * z[k]);
  const ahead = Math.abs(z[2]) > 0.999 ? [0, -Math.sign(z[2]) || -1, 0] : [0, 0, 1];
  const x = unit(flat(ahead));
  return [x, cross(z, x), z];
}

export class Frame {
  constructor(json) {
    this.json = json;
    this.camera = json.camera;
    this.axes = levelAxes(json.up);
    this.planes = json.planes.map((plane) => this.plane(plane));
    const levels = this.planes.filter((p) => p.kind === "tread").map((p) => p.middle[2]);
    this.ground = levels.length ? Math.min(...levels) : null;
  }

  /** From the camera's axes (x right, y down, z ahead). */
  level(v) {
    return this.axes.map((axis) => dot(axis, v));
  }

  plane(json) {
    const pieces = json.pieces.map((piece) => {
      const corners = points(piece.vertices).map((p) => this.level(p));
      const nosing = piece.nosing ? points(piece.nosing).map((p) => this.level(p)) : null;
      const middle = [0, 1, 2].map((k) => corners.reduce((sum, p) => sum + p[k], 0) / corners.length);
      return { ...piece, corners, nosing, middle };
    });
    const { middle } = pieces[0];
    return { ...json, normal: this.level(json.normal), pieces, middle, nosing: pieces.find((p) => p.nosing)?.nosing };
  }

  /** Fetches the points: {places: Float32Array of x, y, z, planes: id of each}. */
  async load() {
    const { stride, columns, depth_and_plane: block } = this.json.points;
    const { fx_px, fy_px, cx_px, cy_px } = this.camera;
    await load(block);
    const [depth, plane] = unpack(block);
    const places = [],
      planes = [];
    depth.forEach((z, i) => {
      if (!Number.isFinite(z)) return;
      const u = (i % columns) * stride,
        v = Math.floor(i / columns) * stride;
      places.push(...this.level([((u - cx_px) / fx_px) * z, ((v - cy_px) / fy_px) * z, z]));
      planes.push(plane[i]);
    });
    this.points = { places: Float32Array.from(places), planes };
  }

  kindOf(id) {
    return this.planes[id - 1]?.kind ?? null;
  }

  /** Corners of the picture so far ahead. */
  frustum(z) {
    const { width_px, height_px, fx_px, fy_px, cx_px, cy_px } = this.camera;
    return [
      [0, 0],
      [width_px, 0],
      [width_px, height_px],
      [0, height_px],
    ].map(([u, v]) => this.level([((u - cx_px) / fx_px) * z, ((v - cy_px) / fy_px) * z, z]));
  }

  /** What is looked at: the middle of nine tenths of all points, and how far they reach. */
  bounds() {
    const { places } = this.points;
    const of = (k) => {
      const values = [];
      for (let i = k; i < places.length; i += 3) values.push(places[i]);
      values.sort((a, b) => a - b);
      const at = (share) => values[Math.floor(share * (values.length - 1))] ?? 0;
      return [at(0.05), at(0.95)];
    };
    const ends = [0, 1, 2].map(of);
    return {
      middle: ends.map(([a, b]) => (a + b) / 2),
      reach: Math.max(0.3, Math.hypot(...ends.map(([a, b]) => b - a)) / 2),
      ends,
    };
  }
}
