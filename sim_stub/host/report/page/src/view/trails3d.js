// SPDX-License-Identifier: Apache-2.0
// Where base and feet have been until now, and what the camera looks at.
import { Group } from "three";
import { colours } from "../core/colours.js";
import { placed } from "../core/pose.js";
import { indexAt } from "../core/series.js";
import { line, segments } from "./shapes3d.js";

const MOST = 4000; // points of a trail; longer runs are thinned
const FAR_m = 0.9; // to which the frustum is drawn

function trailOf(series) {
  if (!series?.count) return null;
  const every = Math.max(1, Math.floor(series.count / MOST));
  const t_s = [],
    pairs = [];
  let last = null;
  for (let i = 0; i < series.count; i += every) {
    const p = [series.columns[0][i], series.columns[1][i], series.columns[2][i]];
    if (!Number.isFinite(p[0])) {
      last = null;
      continue;
    }
    if (last) {
      pairs.push([last, p]);
      t_s.push(series.t_s[i]);
    }
    last = p;
  }
  return pairs.length ? { t_s, pairs } : null;
}

export class Trails3d {
  constructor(run) {
    this.group = new Group();
    this.materials = {
      base: line(1.5),
      left: line(2.2),
      right: line(2.2),
      camera: line(1.2, { transparent: true, opacity: 0.8 }),
    };
    this.trails = [];
    for (const [name, series] of [
      ["base", run.base],
      ["left", run.sole("left")],
      ["right", run.sole("right")],
    ]) {
      const trail = trailOf(series);
      if (!trail) continue;
      trail.object = segments(trail.pairs, this.materials[name]);
      trail.object.frustumCulled = false;
      this.group.add(trail.object);
      this.trails.push(trail);
    }
    this.camera = run.camera;
    if (this.camera) {
      this.frustum = segments(this.rays({ p: [0, 0, 0], q: [0, 0, 0, 1] }), this.materials.camera);
      this.frustum.frustumCulled = false;
      this.group.add(this.frustum);
    }
  }

  repaint() {
    this.materials.base.color.set(colours.faint);
    this.materials.left.color.set(colours.left);
    this.materials.right.color.set(colours.right);
    this.materials.camera.color.set(colours.camera);
  }

  resize(width, height) {
    for (const material of Object.values(this.materials)) material.resolution.set(width, height);
  }

  rays(pose) {
    const { width_px, height_px, fx_px, fy_px, cx_px, cy_px } = this.camera;
    const corner = (u, v) => placed(pose, [((u - cx_px) / fx_px) * FAR_m, ((v - cy_px) / fy_px) * FAR_m, FAR_m]);
    const corners = [corner(0, 0), corner(width_px, 0), corner(width_px, height_px), corner(0, height_px)];
    return corners.flatMap((c, i) => [
      [pose.p, c],
      [c, corners[(i + 1) % 4]],
    ]);
  }

  show(t_s, now) {
    for (const trail of this.trails) {
      const count = indexAt(trail.t_s, t_s) + 1;
      trail.object.visible = count > 0;
      trail.object.geometry.instanceCount = count;
    }
    if (!this.frustum) return;
    this.frustum.visible = !!now.camera;
    if (now.camera) this.frustum.geometry.setPositions(this.rays(now.camera).flat(2));
  }
}
