// SPDX-License-Identifier: Apache-2.0
// The keys, and the sheet that names them.
import { h } from "../core/dom.js";

const KEYS = [
  ["space", "play or pause"],
  ["← →", "0.1 s back or on; with shift 1 s"],
  [", .", "one sample of 10 ms back or on"],
  ["home end", "to the start or the end"],
  ["− +", "slower or faster"],
  ["1 2 3 4", "view: from beside, from the right, from above, through the robot's camera"],
  ["?", "this sheet"],
];

export function helpDialog() {
  const dialog = h(
    "dialog",
    { "aria-label": "Keys" },
    h("h2", {}, "Keys"),
    h(
      "dl",
      {},
      KEYS.flatMap(([key, what]) => [
        h(
          "dt",
          {},
          key.split(" ").map((k) => h("kbd", {}, k)),
        ),
        h("dd", {}, what),
      ]),
    ),
    h(
      "p.note",
      {},
      "Drag the scene to turn it, with the right button to move it; once you have clicked into it, the wheel brings you nearer. Click into a curve to go to that moment; drag over it to zoom in, double-click to zoom out.",
    ),
    h("form", { method: "dialog" }, h("button", {}, "Close")),
  );
  return dialog;
}

export function bindKeys(player, look, help) {
  const act = {
    " ": () => player.toggle(),
    ArrowLeft: (shift) => player.seek(player.t_s - (shift ? 1 : 0.1)),
    ArrowRight: (shift) => player.seek(player.t_s + (shift ? 1 : 0.1)),
    ",": () => player.seek(player.t_s - 0.01),
    ".": () => player.seek(player.t_s + 0.01),
    Home: () => player.seek(0),
    End: () => player.seek(player.duration_s),
    "-": () => player.faster(-1),
    "+": () => player.faster(1),
    "=": () => player.faster(1),
    "?": () => help.showModal(),
  };
  for (const view of [1, 2, 3, 4]) act[view] = () => look(view);
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || help.open) return;
    const within = event.target;
    if (
      within.tagName === "SELECT" ||
      (event.key === " " && within.tagName === "BUTTON") ||
      (event.key === " " && within.tagName === "SUMMARY")
    )
      return;
    const call = act[event.key];
    if (!call) return;
    event.preventDefault();
    call(event.shiftKey);
  });
}
