// SPDX-License-Identifier: Apache-2.0
// The replay in three dimensions, drawn when something has changed and not otherwise. World: x up the stairs, y left, z up.
import { DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { colours, onTheme } from "../core/colours.js";
import { robotAt } from "../core/now.js";
import { turn } from "../core/pose.js";
import { Footholds3d } from "./footholds3d.js";
import { Labels } from "./labels.js";
import { Map3d } from "./map3d.js";
import { Push3d } from "./push3d.js";
import { Robot3d } from "./robot3d.js";
import { Stairs3d } from "./stairs3d.js";
import { Trails3d } from "./trails3d.js";

// From where each view looks, relative to the base.
const VIEWS = {
  1: { from: [-0.85, -2.15, 0.95], at: [0.22, 0, -0.38] },
  2: { from: [0.2, -3.0, -0.15], at: [0.2, 0, -0.25] },
  3: { from: [0.299, 0, 2.4], at: [0.3, 0, 0] },
};

export class Scene3d {
  /** other: a second run, whose robot is drawn beside the first. */
  constructor(host, canvas, context, run, other) {
    this.run = run;
    this.host = host;
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.scene = new Scene();
    this.eye = new PerspectiveCamera(38, 1, 0.05, 60);
    this.eye.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.eye, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    this.controls.addEventListener("start", () => this.leaveCamera());
    // The wheel moves the page until the scene is taken hold of.
    this.controls.enableZoom = false;
    canvas.addEventListener("pointerdown", () => (this.controls.enableZoom = true));
    canvas.addEventListener(
      "pointerleave",
      (e) => e.pointerType === "mouse" && !e.buttons && (this.controls.enableZoom = false),
    );
    this.sky = new HemisphereLight(0xffffff, 0x9aa4ad, 2.2);
    this.sky.position.set(0, 0, 1);
    const sun = new DirectionalLight(0xffffff, 1.5);
    sun.position.set(-1.5, -3, 5);
    this.scene.add(this.sky, sun);
    this.labels = new Labels(host, run);
    this.parts = [Stairs3d, Map3d, Footholds3d, Trails3d, Robot3d, Push3d].map((Part) => new Part(run));
    this.other = other ? { run: other, robot: new Robot3d(other, true) } : null;
    if (this.other) this.parts.push(this.other.robot);
    for (const part of this.parts) this.scene.add(part.group);
    this.followed = null;
    this.throughCamera = false;
    this.view = 1;
    onTheme(() => this.repaint());
    new ResizeObserver(() => this.resize()).observe(host);
    this.repaint();
  }

  repaint() {
    this.scene.background = null;
    this.renderer.setClearColor(colours.stage ?? colours.panel, 1);
    for (const part of this.parts) part.repaint();
    if (this.t_s !== undefined) this.show(this.t_s);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.eye.aspect = width / height;
    this.eye.updateProjectionMatrix();
    for (const part of this.parts) part.resize?.(width, height);
    if (this.followed) this.draw();
  }

  /** 1: beside and behind, 2: from the right, 3: from above, 4: through the robot's camera. */
  look(view) {
    this.view = view;
    this.throughCamera = view === 4;
    this.eye.fov = this.throughCamera ? this.cameraAngle() : 38;
    this.eye.updateProjectionMatrix();
    if (!this.throughCamera && this.followed) this.aim(VIEWS[view]);
    if (this.t_s !== undefined) this.show(this.t_s);
  }

  /** From the robot's camera on the reader turns about what it looked at. */
  leaveCamera() {
    if (!this.throughCamera) return;
    this.throughCamera = false;
    const ahead = this.eye.getWorldDirection(new Vector3());
    this.controls.target.copy(this.eye.position).addScaledVector(ahead, 0.9);
  }

  cameraAngle() {
    const camera = this.run.camera;
    return camera ? (2 * Math.atan(camera.height_px / 2 / camera.fy_px) * 180) / Math.PI : 60;
  }

  aim({ from, at }) {
    const wide = Math.max(1, 1.15 / Math.max(this.eye.aspect, 0.3));
    this.controls.target.set(...this.followed.map((c, k) => c + at[k]));
    this.eye.position.set(...this.followed.map((c, k) => c + at[k] + (from[k] - at[k]) * wide));
    this.controls.update();
  }

  show(t_s) {
    this.t_s = t_s;
    const now = robotAt(this.run, t_s);
    for (const part of this.parts) part.show(t_s, part === this.other?.robot ? robotAt(this.other.run, t_s) : now);
    this.follow(now);
    this.draw();
  }

  /** The eye moves along with the base, and not with its sway. */
  follow(now) {
    if (!now.base) {
      if (!this.followed) {
        this.followed = [0, 0, 0.8];
        this.aim(VIEWS[1]);
      }
      return;
    }
    if (this.throughCamera && now.camera) {
      this.followed = [now.base.p[0], 0, now.base.p[2]];
      this.eye.position.set(...now.camera.p);
      this.eye.up.set(...turn(now.camera.q, [0, -1, 0]));
      this.eye.lookAt(new Vector3(...now.camera.p.map((c, k) => c + turn(now.camera.q, [0, 0, 1])[k])));
      this.eye.up.set(0, 0, 1);
      return;
    }
    const to = [now.base.p[0], 0, now.base.p[2]];
    const first = !this.followed;
    if (!first) {
      const move = new Vector3(...to.map((c, k) => c - this.followed[k]));
      this.eye.position.add(move);
      this.controls.target.add(move);
    }
    this.followed = to;
    if (first) this.aim(VIEWS[this.view]);
    else this.controls.update();
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => this.drawNow());
  }

  drawNow() {
    this.waiting = false;
    this.renderer.render(this.scene, this.eye);
    this.labels.place(this.eye, this.t_s);
  }
}
