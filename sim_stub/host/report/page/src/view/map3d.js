// SPDX-License-Identifier: Apache-2.0
// What the module remembers: its polygons, their nosings, the squares that something lies on, and the safe regions.
import { Group } from "three";
import { colours } from "../core/colours.js";
import { points } from "./points.js";
import { boxMesh, empty, line, outline, segments, sheet, sheetMesh, solid } from "./shapes3d.js";

const KEPT = 300; // versions of polygons whose meshes are kept

export class Map3d {
  constructor(run) {
    this.run = run;
    this.group = new Group();
    this.polygons = new Group();
    this.safe = new Group();
    this.occupied = new Group();
    this.group.add(this.polygons, this.safe, this.occupied);
    this.tread = sheet(0.5, 2);
    this.riser = sheet(0.38, 2);
    this.safeFill = sheet(0.55, 4);
    this.edge = line(1.5);
    this.unknown = line(1.2, { transparent: true, opacity: 0.45, dashed: true, dashSize: 0.02, gapSize: 0.02 });
    this.nosing = line(3.5);
    this.safeEdge = line(1.5);
    this.thing = solid({});
    this.made = new Map();
  }

  repaint() {
    this.tread.color.set(colours.map);
    this.riser.color.set(colours.riser);
    this.edge.color.set(colours.map);
    this.unknown.color.set(colours.map);
    this.nosing.color.set(colours.nosing);
    this.safeFill.color.set(colours.safe);
    this.safeEdge.color.set(colours.safe);
    this.thing.color.set(colours.warn);
  }

  resize(width, height) {
    for (const material of [this.edge, this.unknown, this.nosing, this.safeEdge])
      material.resolution.set(width, height);
  }

  show(t_s) {
    const shown = new Set(this.run.polygonsAt(t_s));
    for (const [version, object] of this.made) object.visible = shown.has(version);
    for (const version of shown) if (!this.made.has(version)) this.make(version);
    if (this.made.size > KEPT) this.forget(shown);
    this.showSafe(this.run.newest("searches", t_s));
    this.showOccupied(this.run.occupiedAt(t_s));
  }

  make(version) {
    const corners = points(version.vertices);
    const object = new Group();
    object.add(sheetMesh(corners, version.kind === "riser" ? this.riser : this.tread, 1));
    const edges = outline(corners);
    const known = edges.filter((_, i) => version.observed?.[i] !== 0),
      open = edges.filter((_, i) => version.observed?.[i] === 0);
    if (known.length) object.add(segments(known, this.edge));
    if (open.length) {
      const dashed = segments(open, this.unknown);
      dashed.computeLineDistances();
      object.add(dashed);
    }
    if (version.nosing) object.add(segments([points(version.nosing)], this.nosing));
    this.made.set(version, object);
    this.polygons.add(object);
  }

  forget(shown) {
    for (const [version, object] of this.made) {
      if (shown.has(version)) continue;
      empty(object);
      this.polygons.remove(object);
      this.made.delete(version);
      if (this.made.size <= KEPT / 2) return;
    }
  }

  showSafe(search) {
    if (search === this.search) return;
    this.search = search;
    empty(this.safe);
    for (const region of search?.safe ?? []) {
      const corners = points(region.vertices);
      if (corners.length < 3) continue;
      this.safe.add(sheetMesh(corners, this.safeFill, 2), segments(outline(corners), this.safeEdge));
    }
  }

  showOccupied(cells) {
    if (cells === this.cells) return;
    this.cells = cells;
    empty(this.occupied);
    for (const [x, y, ground, height] of cells) {
      const box = boxMesh([0.01, 0.01, Math.max(height, 0.004) / 2], this.thing);
      box.position.set(x, y, ground + height / 2);
      this.occupied.add(box);
    }
  }
}
