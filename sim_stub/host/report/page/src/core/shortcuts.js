// SPDX-License-Identifier: Apache-2.0
// Keys of a page, and the sheet that names them: [[key, what, call], ...]; a key with several has its name first.
import { h } from "./dom.js";

const NAMES = { ArrowLeft: "←", ArrowRight: "→" };

export function shortcuts(list, note) {
  const dialog = h(
    "dialog",
    { "aria-label": "Keys" },
    h("h2", {}, "Keys"),
    h(
      "dl",
      {},
      [...list, [["?"], "this sheet"]].flatMap(([keys, what]) => [
        h(
          "dt",
          {},
          keys.map((k) => h("kbd", {}, NAMES[k] ?? k)),
        ),
        h("dd", {}, what),
      ]),
    ),
    h("p.note", {}, note),
    h("form", { method: "dialog" }, h("button", {}, "Close")),
  );
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || dialog.open) return;
    if (event.key === "?") dialog.showModal();
    const call = list.find(([keys]) => keys.includes(event.key))?.[2];
    if (!call) return;
    event.preventDefault();
    call(event.key, event.shiftKey);
  });
  return dialog;
}
