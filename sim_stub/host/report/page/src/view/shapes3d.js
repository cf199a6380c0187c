// SPDX-License-Identifier: Apache-2.0
// What the parts of the scene are made of.
import {
  BoxGeometry,
  BufferGeometry,
  CapsuleGeometry,
  DoubleSide,
  Float32BufferAttribute,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  Quaternion,
  Vector3,
} from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";

export const solid = (options) => new MeshLambertMaterial(options);

/** A flat sheet of one colour that is seen through and lies just above what it lies on. */
export function sheet(opacity, layer) {
  return new MeshBasicMaterial({
    side: DoubleSide,
    transparent: opacity < 1,
    opacity,
    depthWrite: false,
    polygonOffset: true,
    polygonOffsetFactor: -layer,
    polygonOffsetUnits: -4 * layer,
  });
}

/** A sheet's mesh; those of a higher layer are painted over the others. */
export function sheetMesh(corners, material, layer) {
  const mesh = new Mesh(polygonGeometry(corners), material);
  mesh.renderOrder = layer;
  return mesh;
}

/** Lines so many pixels wide. */
export function line(width_px, options = {}) {
  return new LineMaterial({ linewidth: width_px, ...options });
}

/** Corners of a convex polygon as one mesh. */
function polygonGeometry(corners) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(corners.flat(), 3));
  const index = [];
  for (let i = 1; i + 1 < corners.length; ++i) index.push(0, i, i + 1);
  geometry.setIndex(index);
  return geometry;
}

/** Pairs of points: one line a pair. */
export function segments(pairs, material) {
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions(pairs.flat(2));
  return new LineSegments2(geometry, material);
}

export const outline = (corners) => corners.map((c, i) => [c, corners[(i + 1) % corners.length]]);

export function boxMesh(half, material) {
  return new Mesh(new BoxGeometry(2 * half[0], 2 * half[1], 2 * half[2]), material);
}

export function capsuleMesh(a, b, radius, material) {
  const from = new Vector3(...a),
    to = new Vector3(...b);
  const mesh = new Mesh(new CapsuleGeometry(radius, from.distanceTo(to), 6, 20), material);
  mesh.position.copy(from).add(to).multiplyScalar(0.5);
  mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), to.sub(from).normalize());
  return mesh;
}

export function put(object, pose) {
  object.visible = !!pose;
  if (!pose) return;
  object.position.set(...pose.p);
  object.quaternion.copy(new Quaternion(...pose.q));
}

export function empty(group) {
  for (const child of [...group.children]) {
    group.remove(child);
    child.geometry?.dispose();
  }
}
