// SPDX-License-Identifier: Apache-2.0
// Points, polygons, nosings and the camera in three dimensions, drawn when something has changed.
import {
  BufferGeometry,
  Color,
  Float32BufferAttribute,
  Group,
  PerspectiveCamera,
  Points,
  PointsMaterial,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { colours, onTheme } from "../core/colours.js";
import { h } from "../core/dom.js";
import { line, outline, segments, sheet, sheetMesh } from "../view/shapes3d.js";
import { CASING, NOSING, NO_PLANE, colourOf } from "./kinds.js";

// From where each view looks, in reaches of the points from their middle.
const VIEWS = { 1: [-1.8, -1.8, 1.5], 2: [0, -3, 0.05], 3: [-0.001, 0, 3] };

export class FrameScene {
  constructor(host, canvas, context, frame) {
    this.frame = frame;
    this.host = host;
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.scene = new Scene();
    this.eye = new PerspectiveCamera(38, 1, 0.02, 100);
    this.eye.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.eye, canvas);
    this.controls.addEventListener("change", () => this.draw());
    // The wheel moves the page until the scene is taken hold of.
    this.controls.enableZoom = false;
    canvas.addEventListener("pointerdown", () => (this.controls.enableZoom = true));
    canvas.addEventListener("pointerleave", (e) => {
      if (e.pointerType === "mouse" && !e.buttons) this.controls.enableZoom = false;
    });
    this.wide = []; // materials whose width is in pixels
    this.cloud = this.pointCloud();
    this.planes = frame.planes.map((plane) => this.planeGroup(plane));
    const own = this.pen(1.5, colours.camera);
    this.frustum = own;
    const far = frame.frustum(Math.min(0.3, frame.bounds().reach / 5));
    this.scene.add(this.cloud, ...this.planes, segments([...outline(far), ...far.map((c) => [[0, 0, 0], c])], own));
    this.tags = frame.planes.flatMap(({ id, pieces }) =>
      pieces.map(({ middle }) => {
        const element = h("span.tag.plane", { style: `background: ${CASING}`, "data-id": id }, `${id}`);
        return { element, id, middle };
      }),
    );
    host.append(...this.tags.map((tag) => tag.element));
    onTheme(() => this.repaint());
    new ResizeObserver(() => this.resize()).observe(host);
    this.repaint();
    this.look(1);
  }

  pen(width_px, colour) {
    const material = line(width_px, { color: new Color(colour) });
    this.wide.push(material);
    return material;
  }

  pointCloud() {
    const { places, planes } = this.frame.points;
    const shades = planes.flatMap((id) => {
      const kind = this.frame.kindOf(id);
      const c = new Color(kind ? colourOf(kind) : NO_PLANE);
      return [c.r, c.g, c.b];
    });
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(places, 3));
    geometry.setAttribute("color", new Float32BufferAttribute(shades, 3));
    return new Points(geometry, new PointsMaterial({ size: 1.5, sizeAttenuation: false, vertexColors: true }));
  }

  planeGroup(plane) {
    const group = new Group();
    const colour = colourOf(plane.kind);
    const fill = sheet(0.4, 1);
    fill.color.set(colour);
    for (const piece of plane.pieces) {
      group.add(sheetMesh(piece.corners, fill, 1));
      group.add(segments(outline(piece.corners), this.pen(2, colour)));
      if (!piece.nosing) continue;
      const edge = segments([piece.nosing], this.pen(7, CASING)),
        core = segments([piece.nosing], this.pen(4, NOSING));
      edge.renderOrder = 3;
      core.renderOrder = 4;
      for (const { material } of [edge, core]) {
        material.transparent = true; // so that it is painted after the sheets
        material.depthTest = false;
      }
      group.add(edge, core);
    }
    return group;
  }

  repaint() {
    this.renderer.setClearColor(colours.stage, 1);
    this.frustum.color.set(colours.camera);
    this.draw();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.eye.aspect = width / height;
    this.eye.updateProjectionMatrix();
    for (const material of this.wide) material.resolution.set(width, height);
    this.look(this.view);
  }

  /** 1: beside and behind, 2: from the right, 3: from above, 4: through the camera. */
  look(view) {
    this.view = view;
    const { middle, reach } = this.frame.bounds();
    const through = view === 4;
    const { height_px, fy_px } = this.frame.camera;
    this.eye.fov = through ? (2 * Math.atan(height_px / 2 / fy_px) * 180) / Math.PI : 38;
    this.eye.updateProjectionMatrix();
    const wide = Math.max(1, 1 / this.eye.aspect);
    const ahead = this.frame.level([0, 0, 1]);
    this.eye.position.set(...(through ? [0, 0, 0] : middle.map((c, k) => c + VIEWS[view][k] * reach * wide)));
    this.controls.target.set(...(through ? ahead.map((c) => c * reach) : middle));
    this.controls.update();
    this.draw();
  }

  showPoints(on) {
    this.cloud.visible = on;
    this.draw();
  }

  /** One plane alone, or all of them with null. */
  select(id) {
    this.frame.planes.forEach((plane, i) => (this.planes[i].visible = id === null || plane.id === id));
    for (const tag of this.tags) tag.away = id !== null && tag.id !== id;
    this.draw();
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.renderer.render(this.scene, this.eye);
      for (const tag of this.tags) this.put(tag);
    });
  }

  put({ element, middle, away }) {
    const at = new Vector3(...middle).project(this.eye);
    element.hidden = away || Math.abs(at.x) > 0.98 || Math.abs(at.y) > 0.98 || at.z > 1;
    const x = ((at.x + 1) / 2) * this.host.clientWidth,
      y = ((1 - at.y) / 2) * this.host.clientHeight;
    element.style.transform = `translate(${x}px, ${y}px) translate(-50%, -50%)`;
  }
}
