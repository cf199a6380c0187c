// SPDX-License-Identifier: Apache-2.0
// The true stairs, where the file has them, and the floor.
import { BoxGeometry, EdgesGeometry, Group, LineBasicMaterial, LineSegments, Mesh, PlaneGeometry } from "three";
import { colours } from "../core/colours.js";
import { poseOf } from "../core/pose.js";
import { put, solid } from "./shapes3d.js";

export class Stairs3d {
  constructor(run) {
    this.group = new Group();
    // Some millimetres farther from the eye than it is, so that what was mapped a little too low is not hidden in it.
    const behind = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1200 };
    this.stone = solid(behind);
    this.thing = solid(behind);
    this.floor = solid({ ...behind, polygonOffsetUnits: 1500 });
    this.edge = new LineBasicMaterial();
    if (!run.stairs) return;
    const last = run.stairs.treads?.at(-1);
    const floor = new Mesh(new PlaneGeometry(3.4 + (last?.back_x_m ?? 1), 3.2), this.floor);
    floor.position.set(((last?.back_x_m ?? 1) - 1.4) / 2, 0, 0);
    this.group.add(floor);
    for (const box of run.stairs.boxes ?? []) {
      const geometry = new BoxGeometry(...box.half_m.map((c) => 2 * c));
      const mesh = new Mesh(geometry, box.step === -2 ? this.thing : this.stone);
      mesh.add(new LineSegments(new EdgesGeometry(geometry), this.edge));
      put(mesh, poseOf(box.pose));
      this.group.add(mesh);
    }
  }

  repaint() {
    this.stone.color.set(colours.stair);
    this.thing.color.set(colours.stairline);
    this.floor.color.set(colours.floor ?? colours.page);
    this.edge.color.set(colours.stairline);
  }

  show() {}
}
