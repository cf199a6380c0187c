// SPDX-License-Identifier: Apache-2.0
// The bar at the foot of the page: play, time, slider with the run's moments, speed and views.
import { h, seconds, svg, words } from "../core/dom.js";
import { SPEEDS } from "../core/player.js";

const GROUPS = {
  off: "rest",
  arming: "rest",
  standing: "rest",
  walking_up: "walk",
  climbing: "climb",
  holding: "rest",
  stopping: "stop",
  safe_stop: "stop",
  on_top: "top",
  fallen: "fall",
};

/** Bands of a list of changes as [from, to, name]. */
export function bands(changes, end_s) {
  return changes.map(([from, name], i) => [from, changes[i + 1]?.[0] ?? end_s, name]);
}

export class Transport {
  constructor(run, player, look, help) {
    this.run = run;
    this.player = player;
    this.play = h(
      "button.play",
      { type: "button", title: "Play or pause (space)", "aria-label": "Play", onclick: () => player.toggle() },
      "▶",
    );
    this.time = h("output.time", {}, "0.00 s");
    this.slider = h("input", {
      type: "range",
      min: 0,
      max: player.duration_s,
      step: "any",
      value: 0,
      "aria-label": "Time",
      oninput: () => {
        player.pause();
        player.seek(this.slider.value);
      },
    });
    this.speed = h(
      "select",
      { "aria-label": "Speed", title: "Speed (- and +)", onchange: () => player.setSpeed(Number(this.speed.value)) },
      SPEEDS.map((s) => h("option", { value: s, selected: s === 1 }, `${s}×`)),
    );
    this.views = ["3D", "side", "top", "camera"].map((name, i) =>
      h(
        "button.small",
        {
          type: "button",
          title: `View ${i + 1} (key ${i + 1})`,
          "aria-pressed": String(i === 0),
          onclick: () => look(i + 1),
        },
        name,
      ),
    );
    this.element = h(
      "div.transport",
      { role: "toolbar", "aria-label": "Replay" },
      this.play,
      this.time,
      h("div.track", {}, this.marks(), this.slider),
      this.speed,
      look ? h("div.views", { role: "group", "aria-label": "View" }, this.views) : null,
      h("button.small.help", { type: "button", title: "Keys (?)", "aria-label": "Keys", onclick: help }, "?"),
    );
  }

  marks() {
    const { run } = this,
      end = Math.max(this.player.duration_s, 1e-6);
    const x = (t_s) => `${(100 * t_s) / end}%`;
    const drawing = svg("svg.marks", { "aria-hidden": "true" });
    for (const [from, to, name] of bands(run.states, end)) {
      drawing.append(
        svg(
          `rect.state.${GROUPS[name] ?? "rest"}`,
          { x: x(from), width: x(Math.max(to - from, 0)), y: 9, height: 6 },
          svg("title", {}, words(name)),
        ),
      );
    }
    for (const step of run.steps) {
      if (!step.onto_tread) continue;
      drawing.append(svg(`line.step.${step.foot}`, { x1: x(step.latch_s), x2: x(step.latch_s), y1: 0, y2: 9 }));
    }
    for (const event of run.events.filter((e) => e.kind === "fault"))
      drawing.append(svg("line.fault", { x1: x(event.t_s), x2: x(event.t_s), y1: 15, y2: 24 }));
    for (const push of run.pushes)
      drawing.append(svg("rect.push", { x: x(push.t_s), width: x(push.duration_s), y: 15, height: 9 }));
    if (run.failure)
      drawing.append(svg("line.failure", { x1: x(run.failure.t_s), x2: x(run.failure.t_s), y1: 0, y2: 24 }));
    return drawing;
  }

  look(view) {
    this.views.forEach((button, i) => button.setAttribute("aria-pressed", i + 1 === view));
  }

  show(t_s) {
    const { player } = this;
    this.play.textContent = player.playing ? "❚❚" : "▶";
    this.play.setAttribute("aria-label", player.playing ? "Pause" : "Play");
    this.time.textContent = seconds(t_s);
    if (document.activeElement !== this.slider || Number(this.slider.value) !== t_s) this.slider.value = t_s;
    this.speed.value = player.speed;
  }
}
