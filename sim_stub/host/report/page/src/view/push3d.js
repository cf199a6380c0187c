// SPDX-License-Identifier: Apache-2.0
// A push as an arrow that ends at the base, for as long as it lasts and a moment longer.
import { Group } from "three";
import { colours } from "../core/colours.js";
import { line, put, segments } from "./shapes3d.js";

const SHOWN_s = 0.3; // at least
const LENGTH_m = 0.45;

export function pushAt(run, t_s) {
  return run.pushes.find((p) => p.t_s <= t_s && t_s <= p.t_s + Math.max(p.duration_s, SHOWN_s)) ?? null;
}

export class Push3d {
  constructor(run) {
    this.run = run;
    this.group = new Group();
    this.material = line(5);
    this.arrows = new Map();
  }

  repaint() {
    this.material.color.set(colours.warn);
  }

  resize(width, height) {
    this.material.resolution.set(width, height);
  }

  show(t_s, now) {
    const push = pushAt(this.run, t_s);
    for (const arrow of this.arrows.values()) arrow.visible = false;
    if (!push || !now.base) return;
    if (!this.arrows.has(push)) this.arrows.set(push, this.make(push.force_n));
    put(this.arrows.get(push), { p: now.base.p, q: [0, 0, 0, 1] });
  }

  make(force_n) {
    const size = Math.hypot(...force_n) || 1;
    const [x, y, z] = force_n.map((f) => f / size);
    const from = [-x * LENGTH_m, -y * LENGTH_m, -z * LENGTH_m];
    const barb = (side) => [-x * 0.1 - y * side, -y * 0.1 + x * side, -z * 0.1];
    const tip = [0, 0, 0];
    const arrow = segments(
      [
        [from, tip],
        [barb(0.05), tip],
        [barb(-0.05), tip],
      ],
      this.material,
    );
    this.group.add(arrow);
    return arrow;
  }
}
