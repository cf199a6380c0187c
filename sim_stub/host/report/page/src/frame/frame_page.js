// SPDX-License-Identifier: Apache-2.0
// The page of one depth picture.
import { h, words } from "../core/dom.js";
import { shortcuts } from "../core/shortcuts.js";
import { Frame } from "./frame.js";
import { planesPanel, sourcePanel } from "./frame_figures.js";
import { FrameScene } from "./frame_scene.js";
import { FrameSide } from "./frame_side.js";
import { KINDS, NOSING, NO_PLANE } from "./kinds.js";

const VIEWS = ["beside", "right", "above", "camera"];

function frameView(host, frame) {
  const asked = new URLSearchParams(location.search).has("svg");
  const canvas = h("canvas");
  const context = asked ? null : canvas.getContext("webgl2", { antialias: true, powerPreference: "low-power" });
  const why = asked ? "Drawn from the right." : "This browser has no WebGL: the planes are drawn from the right.";
  if (!context) return new FrameSide(host, frame, why);
  host.append(canvas);
  return new FrameScene(host, canvas, context, frame);
}

function saidOf(frame) {
  const counts = Object.keys(KINDS)
    .map((kind) => [frame.planes.filter((p) => p.kind === kind).length, kind])
    .filter(([count]) => count > 0)
    .map(([count, kind]) => `${count} ${words(kind)}`);
  const nosings = frame.planes.filter((p) => p.nosing).length;
  const many = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;
  return frame.planes.length
    ? `${many(frame.planes.length, "plane")} (${counts.join(", ")}), ${many(nosings, "nosing")}`
    : "No plane was found in this picture";
}

function legend(frame) {
  const key = (colour, said, css = "") => h("li", {}, h(`i.key${css}`, { style: `--k: ${colour}` }), said);
  return h(
    "ul.legend3d",
    {},
    Object.entries(KINDS)
      .filter(([name]) => (name === "unknown") === (frame.json.up_source === "assumed"))
      .map(([, kind]) => key(kind.colour, kind.said)),
    key(NOSING, "nosing", ".nosing"),
    key(NO_PLANE, "no plane"),
    h("li", {}, h("i.key.camera"), "camera"),
  );
}

export async function framePage(root, data) {
  const frame = new Frame(data);
  await frame.load();
  const host = h("div.canvas");
  const views = h("div.views");
  const stage = h(
    "section.panel.stage.look",
    { id: "stage", "aria-label": "Planes in three dimensions" },
    host,
    views,
    legend(frame),
  );
  const picture = h(
    "section.panel.picture",
    { id: "picture" },
    h("h2", {}, "Picture"),
    h("img.depth", {
      src: `data:image/png;base64,${data.picture}`,
      alt: "The depth picture with each plane's id and kind",
    }),
  );
  root.replaceChildren(
    h(
      "header",
      {},
      h("div.title", {}, h("h1", {}, data.name), h("p.reason", {}, `${saidOf(frame)}.`)),
      data.warnings.map((w) => h("p.warning", {}, w)),
    ),
    h("main", {}, h("div.look", {}, stage, h("div.column.single", {}, picture, sourcePanel(frame)))),
  );
  const view = frameView(host, frame);
  root.querySelector("main").append(planesPanel(frame, (id) => view.select(id)));
  let seen = true;
  const dots = h("button.small", { type: "button", "aria-pressed": "true", onclick: () => toggle() }, "points");
  const toggle = () => {
    seen = !seen;
    dots.setAttribute("aria-pressed", seen);
    view.showPoints(seen);
  };
  const look = view.look
    ? (n) => {
        view.look(n);
        buttons.forEach((b, i) => b.setAttribute("aria-pressed", i + 1 === n));
      }
    : null;
  const buttons = look
    ? VIEWS.map((name, i) =>
        h("button.small", { type: "button", "aria-pressed": String(i === 0), onclick: () => look(i + 1) }, name),
      )
    : [];
  const keys = [[["p"], "points on or off", toggle]];
  if (look)
    keys.unshift([
      ["1", "2", "3", "4"],
      "view: beside, from the right, from above, through the camera",
      (key) => look(Number(key)),
    ]);
  const help = shortcuts(
    keys,
    "Drag the scene to turn it, with the right button to move it; once you have clicked into it, the wheel brings you nearer.",
  );
  views.append(
    ...buttons,
    dots,
    h("button.small", { type: "button", "aria-label": "Keys", onclick: () => help.showModal() }, "?"),
  );
  root.append(help);
  return {
    planes: frame.planes.map((p) => ({ id: p.id, kind: p.kind, middle: p.middle })),
    points: frame.points.planes.length,
    ground: frame.ground,
  };
}
