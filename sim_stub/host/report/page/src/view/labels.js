// SPDX-License-Identifier: Apache-2.0
// Names over the scene: the next footholds, and where the foot in the air lands.
import { Vector3 } from "three";
import { h, number } from "../core/dom.js";
import { pushAt } from "./push3d.js";

export class Labels {
  constructor(host, run) {
    this.run = run;
    this.host = host;
    this.tags = Object.fromEntries(
      [
        ["p_star", "p*"],
        ["p_star_star", "p**"],
        ["target", ""],
        ["push", ""],
      ].map(([name, text]) => [name, h(`span.tag.${name}`, {}, text)]),
    );
    host.append(...Object.values(this.tags));
  }

  place(eye, t_s) {
    const search = this.run.newest("searches", t_s),
      swing = this.run.swingAt(t_s);
    const middle = (feet) => {
      const places = (feet ?? []).filter(Boolean).map((f) => f.position_m);
      return places.length ? [0, 1, 2].map((k) => places.reduce((sum, p) => sum + p[k], 0) / places.length) : null;
    };
    const lands = swing?.touch_down_s === null ? "was to land" : "lands";
    this.tags.target.textContent = swing ? `${swing.foot} foot ${lands} here` : "";
    const push = pushAt(this.run, t_s);
    this.tags.push.textContent = push ? `pushed by ${number(Math.hypot(...push.force_n), 0)} N` : "";
    this.put(this.tags.push, push ? (this.run.base?.poseAt(t_s)?.p ?? null) : null, eye);
    this.put(this.tags.p_star, middle(search?.p_star), eye);
    this.put(this.tags.p_star_star, middle(search?.p_star_star), eye);
    this.put(this.tags.target, swing?.target_m?.slice(0, 3) ?? null, eye);
  }

  put(tag, place, eye) {
    const at = place ? new Vector3(...place).project(eye) : null;
    const seen = at && Math.abs(at.x) < 0.98 && Math.abs(at.y) < 0.98 && at.z < 1;
    tag.hidden = !seen;
    if (seen)
      tag.style.transform = `translate(${((at.x + 1) / 2) * this.host.clientWidth}px, ${((1 - at.y) / 2) * this.host.clientHeight}px) translate(-50%, ${tag === this.tags.target ? "90%" : "-190%"})`;
  }
}
