// SPDX-License-Identifier: Apache-2.0
// Where the feet are to go next: p* red, p** purple, and the target of the foot in the air.
import { Group } from "three";
import { colours } from "../core/colours.js";
import { FEET } from "../core/now.js";
import { aboutZ, soleCorners } from "../core/pose.js";
import { line, outline, put, segments, sheet, sheetMesh } from "./shapes3d.js";

export class Footholds3d {
  constructor(run) {
    this.run = run;
    this.group = new Group();
    this.fills = { p_star: sheet(0.75, 6), p_star_star: sheet(0.65, 6), target: sheet(0.9, 7) };
    this.edges = { p_star: line(2), p_star_star: line(2), target: line(3) };
    this.marks = {};
    const corners = soleCorners(run.robot?.sole?.contact_m ?? [0.17, -0.07, 0.048]);
    for (const name of Object.keys(this.fills)) {
      this.marks[name] = (name === "target" ? [null] : FEET).map(() => {
        const mark = new Group();
        mark.add(sheetMesh(corners, this.fills[name], 3), segments(outline(corners), this.edges[name]));
        this.group.add(mark);
        return mark;
      });
    }
  }

  repaint() {
    for (const parts of [this.fills, this.edges]) {
      parts.p_star.color.set(colours.pstar);
      parts.p_star_star.color.set(colours.pstarstar);
      parts.target.color.set(colours.pstar);
    }
    this.edges.target.color.set(colours.ink);
  }

  resize(width, height) {
    for (const material of Object.values(this.edges)) material.resolution.set(width, height);
  }

  show(t_s) {
    const search = this.run.newest("searches", t_s);
    for (const name of ["p_star", "p_star_star"]) {
      this.marks[name].forEach((mark, foot) => {
        const place = search?.[name]?.[foot];
        put(mark, place ? { p: place.position_m, q: aboutZ(place.yaw_rad) } : null);
      });
    }
    const target = this.run.swingAt(t_s)?.target_m;
    put(this.marks.target[0], target ? { p: target.slice(0, 3), q: aboutZ(target[3] ?? 0) } : null);
  }
}
