// SPDX-License-Identifier: Apache-2.0
// The replay from the right, as a drawing: where the browser has no WebGL, and for who prefers it.
import { h, svg } from "../core/dom.js";
import { FEET, robotAt } from "../core/now.js";
import { aboutZ, placed, poseOf } from "../core/pose.js";
import { indexAt } from "../core/series.js";
import { points } from "./points.js";

const WIDTH_m = 2.6; // shown at once
const MOST = 600; // points of a trail

const path = (corners, close) =>
  corners.map(([x, , z], i) => `${i ? "L" : "M"}${x.toFixed(4)} ${(-z).toFixed(4)}`).join("") + (close ? "Z" : "");

export class SideView {
  constructor(host, run, why) {
    this.run = run;
    this.drawing = svg("svg.side", {
      role: "img",
      "aria-label": "The climb from the right",
      preserveAspectRatio: "xMidYMid slice",
    });
    this.groups = {};
    for (const name of ["floor", "stairs", "map", "safe", "trails", "footholds", "legs", "camera"]) {
      this.groups[name] = svg(`g.${name}`);
      this.drawing.append(this.groups[name]);
    }
    host.append(this.drawing);
    if (why) host.append(h("p.note", {}, why));
    this.groups.floor.append(svg("line", { x1: -20, x2: 20, y1: 0, y2: 0 }));
    for (const box of run.stairs?.boxes ?? [])
      this.groups.stairs.append(svg("path", { d: path(this.boxFront(box), true) }));
    this.trails = FEET.concat("base")
      .map((name) => this.trailOf(name))
      .filter(Boolean);
    new ResizeObserver(() => this.t_s !== undefined && this.show(this.t_s)).observe(host);
  }

  boxFront(box) {
    const pose = poseOf(box.pose),
      [a, , c] = box.half_m;
    return [
      [-a, 0, -c],
      [a, 0, -c],
      [a, 0, c],
      [-a, 0, c],
    ].map((v) => placed(pose, v));
  }

  trailOf(name) {
    const series = name === "base" ? this.run.base : this.run.sole(name);
    if (!series?.count) return null;
    const every = Math.max(1, Math.floor(series.count / MOST));
    const places = [],
      t_s = [];
    for (let i = 0; i < series.count; i += every) {
      const row = series.row(i);
      if (!Number.isFinite(row[0])) continue;
      places.push(row.slice(0, 3));
      t_s.push(series.t_s[i]);
    }
    const element = svg(`path.trail.${name}`);
    this.groups.trails.append(element);
    return { element, places, t_s };
  }

  show(t_s) {
    this.t_s = t_s;
    const run = this.run,
      now = robotAt(run, t_s);
    const middle = now.base?.p ?? [0, 0, 0.8];
    const ratio = this.drawing.clientHeight / Math.max(this.drawing.clientWidth, 1) || 0.6;
    const height = Math.max(WIDTH_m * ratio, 1.9),
      width = Math.max(WIDTH_m, height / ratio);
    this.drawing.setAttribute(
      "viewBox",
      `${middle[0] - width * 0.45} ${-(middle[2] + height * 0.42)} ${width} ${height}`,
    );
    for (const trail of this.trails) {
      const count = indexAt(trail.t_s, t_s) + 1;
      trail.element.setAttribute("d", count > 1 ? path(trail.places.slice(0, count)) : "");
    }
    this.groups.map.replaceChildren(...run.polygonsAt(t_s).flatMap((p) => this.polygon(p)));
    const search = run.newest("searches", t_s);
    this.groups.safe.replaceChildren(
      ...(search?.safe ?? []).map((region) => svg("path", { d: path(points(region.vertices), true) })),
    );
    this.groups.footholds.replaceChildren(...this.footholds(search, t_s));
    this.groups.legs.replaceChildren(...this.legs(now));
    this.groups.camera.replaceChildren(...this.frustum(now));
  }

  polygon(p) {
    const out = [svg(`path.${p.kind}`, { d: path(points(p.vertices), true) })];
    if (p.nosing) {
      const [a] = points(p.nosing);
      out.push(svg("circle.nosing", { cx: a[0], cy: -a[2], r: 0.012 }));
    }
    return out;
  }

  footholds(search, t_s) {
    const sole = this.run.robot?.sole?.contact_m ?? [0.17, -0.07, 0.048];
    const mark = (p, yaw, name) =>
      svg(`path.${name}`, {
        d: path(
          [
            [sole[1], 0, 0.004],
            [sole[0], 0, 0.004],
          ].map((v) => placed({ p, q: aboutZ(yaw) }, v)),
        ),
      });
    const out = [];
    for (const [name, css] of [
      ["p_star_star", "pstarstar"],
      ["p_star", "pstar"],
    ]) {
      for (const place of search?.[name] ?? []) if (place) out.push(mark(place.position_m, place.yaw_rad, css));
    }
    const target = this.run.swingAt(t_s)?.target_m;
    if (target) out.push(mark(target.slice(0, 3), target[3] ?? 0, "target"));
    return out;
  }

  legs(now) {
    const out = [];
    for (const shape of this.run.robot?.shapes ?? []) {
      const right = (shape.sole ?? this.run.robot.joints[shape.joint]?.name ?? "").startsWith("right");
      const pose = shape.sole
        ? now.soles[FEET.indexOf(shape.sole)]
        : (now.links[shape.joint] ?? (shape.joint < 0 ? now.base : null));
      if (!pose) continue;
      const css = right ? "right" : "left";
      let element;
      if (shape.type === "capsule")
        element = svg(`path.limb.${css}`, {
          d: path([shape.a_m, shape.b_m].map((v) => placed(pose, v))),
          "stroke-width": 2 * shape.radius_m,
        });
      else
        element = svg(`path.foot.${css}`, {
          d: path(
            this.boxFront({ pose: [...shape.centre_m, 0, 0, 0, 1], half_m: shape.half_m }).map((v) => placed(pose, v)),
            true,
          ),
        });
      if (right) out.push(element);
      else out.unshift(element); // the left leg is behind
    }
    if (now.base)
      out.unshift(
        svg("path.limb.sketch", {
          d: path(
            [
              [0, 0, -0.05],
              [-0.01, 0, 0.34],
            ].map((v) => placed(now.base, v)),
          ),
          "stroke-width": 0.15,
        }),
      );
    return out;
  }

  frustum(now) {
    const camera = this.run.camera;
    if (!camera || !now.camera) return [];
    const ray = (v) => placed(now.camera, [0, ((v - camera.cy_px) / camera.fy_px) * 0.9, 0.9]);
    return [svg("path", { d: path([ray(0), now.camera.p, ray(camera.height_px)]) })];
  }
}
