// SPDX-License-Identifier: Apache-2.0
// Strips on the run's whole time: states, phases, contacts, pushes, faults, and what each row of the schedule costs.
import { costs } from "../core/closest.js";
import { colours, faded, onTheme } from "../core/colours.js";
import { h, isNumber, moment, number, words } from "../core/dom.js";
import { bands } from "../panels/transport.js";
import { onZoom, part } from "./chart.js";

export const STATE_COLOUR = {
  walking_up: "lio",
  climbing: "map",
  stopping: "warn",
  safe_stop: "warn",
  fallen: "bad",
  on_top: "safe",
};
const PHASE_COLOUR = { double_support: "stairline", swing: "camera", finished: "safe", stopped: "warn" };

class Strip {
  /** paint(context, x(t_s), width, height) draws it; say(t_s) is what stands under the pointer. */
  constructor(label, player, height, paint, say, tail) {
    this.player = player;
    this.paint_ = paint;
    this.height = height;
    this.canvas = h("canvas", { height });
    this.cursor = h("i.cursor");
    this.said = h("output", {});
    this.element = h(
      "div.strip",
      {},
      h("span.name", {}, label),
      h("div.lane", {}, this.canvas, this.cursor),
      tail ?? h("span.tail", {}, this.said),
    );
    const timeAt = (e) => part()[0] + (e.offsetX / this.canvas.clientWidth) * (part()[1] - part()[0]);
    this.canvas.addEventListener("click", (e) => player.seek(timeAt(e)));
    this.canvas.addEventListener("pointermove", (e) => (this.canvas.title = say(timeAt(e)) ?? ""));
    this.say_ = say;
    this.near = false; // nothing is drawn before it is scrolled near
    new IntersectionObserver(
      (seen) => {
        this.near = seen.at(-1).isIntersecting;
        this.paint();
      },
      { rootMargin: "300px" },
    ).observe(this.canvas);
    new ResizeObserver(() => this.paint()).observe(this.canvas);
    onTheme(() => this.paint());
    onZoom(() => this.paint());
  }

  share(t_s) {
    const [from, to] = part();
    return (t_s - from) / Math.max(to - from, 1e-6);
  }

  paint() {
    const width = this.canvas.clientWidth;
    if (!width || !this.near) return;
    const ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    const context = this.canvas.getContext("2d", { willReadFrequently: true });
    context.scale(ratio, ratio);
    this.paint_(context, (t_s) => this.share(t_s) * width, width, this.height);
    this.mark(this.player.t_s);
  }

  mark(t_s) {
    if (!this.near) return;
    const share = this.share(t_s);
    this.cursor.hidden = share < 0 || share > 1;
    this.cursor.style.left = `${100 * share}%`;
    this.said.textContent = this.say_(t_s) ?? "";
  }
}

export function bandStrip(label, changes, colourOf, player, end_s = player.duration_s) {
  const list = bands(changes, end_s);
  const paint = (context, x, width, height) => {
    for (const [from, to, name] of list) {
      context.fillStyle = faded(colours[colourOf[name] ?? "stairline"], 0.75);
      context.fillRect(x(from), 0, Math.max(x(to) - x(from) - 0.5, 1), height);
    }
  };
  return new Strip(label, player, 16, paint, (t) => words(list.filter(([from]) => from <= t).at(-1)?.[2] ?? ""));
}

function contactStrip(run, player) {
  const contact = run.series("contact");
  if (!contact?.count) return null;
  const paint = (context, x, width, height) => {
    for (let px = 0; px < width; ++px) {
      const row = contact.at(part()[0] + (px / width) * (part()[1] - part()[0]));
      row.forEach((p, foot) => {
        if (!(p > 0.02)) return;
        context.fillStyle = faded(colours[foot ? "right" : "left"], Math.min(p, 1));
        context.fillRect(px, foot ? height / 2 + 0.5 : 0, 1, height / 2 - 0.5);
      });
    }
  };
  return new Strip("contact L, R", player, 18, paint, (t) =>
    contact
      .at(t)
      .map((p, i) => `${"LR"[i]} ${number(100 * p, 0)} %`)
      .join(", "),
  );
}

export function eventStrip(label, events, colour, player) {
  if (!events.length) return null;
  const paint = (context, x, width, height) => {
    context.fillStyle = faded(colours.stairline, 0.25);
    context.fillRect(0, height / 2 - 0.5, width, 1);
    for (const e of events) {
      context.fillStyle = colours[colour];
      context.fillRect(x(e.t_s) - 1, 0, Math.max(x(e.t_s + (e.duration_s ?? 0)) - x(e.t_s), 2), height);
    }
  };
  const near = (t) =>
    events.filter((e) => Math.abs(e.t_s - t) < Math.max((part()[1] - part()[0]) / 150, e.duration_s ?? 0));
  return new Strip(label, player, 16, paint, (t) =>
    near(t)
      .map((e) => e.say ?? `${words(e.name)}${e.count > 1 ? ` ×${e.count}` : ""} at ${number(e.t_s, 2)} s`)
      .join("; "),
  );
}

export function stateStrips(run, player) {
  const pushes = run.pushes.map((p) => ({
    ...p,
    say: `${number(p.force_n[0], 0)}, ${number(p.force_n[1], 0)}, ${number(p.force_n[2], 0)} N for ${number(p.duration_s * 1e3, 0)} ms at ${number(p.t_s, 2)} s`,
  }));
  const asked = run.operator.map(([t_s, name]) => ({ t_s, name }));
  return [
    run.states.length ? bandStrip("state", run.states, STATE_COLOUR, player) : null,
    run.phases.length ? bandStrip("gait", run.phases, PHASE_COLOUR, player) : null,
    contactStrip(run, player),
    eventStrip("operator", asked, "ink", player),
    eventStrip("pushes", pushes, "warn", player),
    eventStrip(
      "faults",
      run.events.filter((e) => e.kind === "fault"),
      "bad",
      player,
    ),
    eventStrip(
      "limits",
      run.events.filter((e) => e.kind === "limit"),
      "odometry",
      player,
    ),
  ].filter(Boolean);
}

/** One strip a row: the darker, the nearer to its budget. */
export function costStrips(run, player) {
  const cost = run.series("cost");
  if (!cost?.count) return [];
  return costs(run).map(({ row, most, share, t_s }, k) => {
    const column = cost.columns[k],
      budget = row.budget_instructions;
    const paint = (context, x, width, height) => {
      context.fillStyle = faded(colours.stairline, 0.15);
      context.fillRect(0, 0, width, height);
      const peak = new Float64Array(Math.ceil(width) + 1);
      for (let i = 0; i < cost.count; ++i) {
        const px = Math.floor(x(cost.t_s[i])),
          used = column[i] / budget;
        if (used > peak[px]) peak[px] = used;
      }
      peak.forEach((used, px) => {
        context.fillStyle = used > 1 ? colours.bad : faded(colours.fused, 0.85);
        const high = Math.min(used, 1) * height;
        context.fillRect(px, height - high, 1, high);
      });
    };
    const tail = h(
      "span.tail",
      {},
      isNumber(share)
        ? [
            h(share > 1 ? "b.bad" : "b", {}, number(100 * share, 0, "%")),
            ` of ${number(budget / 1e3, budget < 1e4 ? 1 : 0)} k `,
            moment(player, t_s),
          ]
        : isNumber(most)
          ? `${number(most / 1e3, 1)} k, no budget`
          : "not counted",
    );
    return new Strip(
      row.task,
      player,
      20,
      paint,
      (t) => {
        const value = cost.at(t)[k];
        return Number.isFinite(value) ? `${number(value / 1e3, 1)} k of ${number(budget / 1e3, 1)} k instructions` : "";
      },
      tail,
    );
  });
}
