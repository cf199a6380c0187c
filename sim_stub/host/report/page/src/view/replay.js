// SPDX-License-Identifier: Apache-2.0
// The replay: in three dimensions where the browser can, else as a drawing from the side.
import { h } from "../core/dom.js";
import { Scene3d } from "./scene3d.js";
import { SideView } from "./sideview.js";

export function replayView(stage, run) {
  const host = h("div.canvas");
  stage.append(host);
  if (!run.base?.count) {
    host.append(h("p.missing", {}, run.missing("motion")));
    return { show() {}, look() {} };
  }
  const asked = new URLSearchParams(location.search).has("svg");
  if (!asked && hasWebGl()) {
    try {
      return new Scene3d(host, run);
    } catch {
      host.replaceChildren(); // it said that it has WebGL, and has not
    }
  }
  return new SideView(host, run, asked ? null : "This browser has no WebGL: the climb is drawn from the right.");
}

function hasWebGl() {
  const context = document.createElement("canvas").getContext("webgl2");
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return !!context;
}
