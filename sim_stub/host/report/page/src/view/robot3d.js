// SPDX-License-Identifier: Apache-2.0
// The robot: its legs by the shapes that the module and the simulated camera have of them, and a sketch of the rest.
import { Group } from "three";
import { colours } from "../core/colours.js";
import { FEET } from "../core/now.js";
import { soleCorners } from "../core/pose.js";
import { boxMesh, capsuleMesh, line, outline, put, segments, solid } from "./shapes3d.js";

export class Robot3d {
  /** other: a second run's robot, seen through. */
  constructor(run, other = false) {
    this.other = other;
    this.group = new Group();
    const through = other ? { transparent: true, opacity: 0.4 } : {};
    this.legs = { left: solid(through), right: solid(through) };
    this.sketch = solid({ transparent: true, opacity: 0.42 });
    this.ghost = line(1.6, { transparent: true, opacity: 0.9 });
    this.links = [];
    this.feet = FEET.map(() => new Group());
    this.torso = new Group();
    this.ghosts = FEET.map(() =>
      segments(outline(soleCorners(run.robot?.sole?.contact_m ?? [0.17, -0.07, 0.048])), this.ghost),
    );
    this.group.add(...this.feet, this.torso, ...this.ghosts);
    for (const shape of run.robot?.shapes ?? []) this.add(run.robot, shape);
    this.addSketch(run.robot);
  }

  add(robot, shape) {
    const foot = shape.sole ?? (robot.joints[shape.joint]?.name.startsWith("right") ? "right" : "left");
    const material = this.legs[foot];
    let mesh;
    if (shape.type === "capsule") mesh = capsuleMesh(shape.a_m, shape.b_m, shape.radius_m, material);
    else {
      mesh = boxMesh(shape.half_m, material);
      put(mesh, { p: shape.centre_m, q: shape.q ?? [0, 0, 0, 1] });
    }
    if (shape.sole) this.feet[FEET.indexOf(shape.sole)].add(mesh);
    else if (shape.joint < 0) this.torso.add(mesh);
    else {
      this.links[shape.joint] ??= new Group();
      this.links[shape.joint].add(mesh);
      this.group.add(this.links[shape.joint]);
    }
  }

  /** Pelvis and torso have no shape in the module: thin ones, so that one sees where they are. */
  addSketch(robot) {
    const hips = FEET.map((foot) => robot?.joints.find((j) => j.name === `${foot}_hip_roll`)?.origin_m).filter(Boolean);
    if (hips.length < 2) {
      this.torso.add(boxMesh([0.06, 0.1, 0.05], this.sketch));
      return;
    }
    this.torso.add(
      capsuleMesh(hips[0], hips[1], 0.05, this.sketch),
      capsuleMesh([-0.015, 0, 0.06], [-0.02, 0, 0.3], 0.07, this.sketch),
    );
    this.torso.add(
      capsuleMesh([-0.02, 0.13, 0.36], [-0.02, -0.13, 0.36], 0.06, this.sketch),
      capsuleMesh([0, 0, 0.53], [0.005, 0, 0.57], 0.06, this.sketch),
    );
    for (const hip of hips) this.torso.add(capsuleMesh(hip, [hip[0], hip[1], hip[2] - 0.1287], 0.05, this.sketch));
  }

  repaint() {
    this.legs.left.color.set(this.other ? colours.runB : colours.robot);
    this.legs.right.color.set(this.other ? colours.runB : colours.robotdark);
    this.sketch.color.set(this.other ? colours.runB : colours.robot);
    this.ghost.color.set(colours.fused);
  }

  resize(width, height) {
    this.ghost.resolution.set(width, height);
  }

  show(t_s, now) {
    put(this.torso, now.base);
    this.links.forEach((group, j) => put(group, now.links[j] ?? null));
    this.feet.forEach((group, i) => put(group, now.soles[i]));
    this.ghosts.forEach((group, i) => put(group, this.other ? null : now.estimated[i]));
  }
}
