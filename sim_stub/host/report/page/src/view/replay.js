// SPDX-License-Identifier: Apache-2.0
// The replay: in three dimensions where the browser can, else as a drawing from the side.
import { h } from "../core/dom.js";
import { Scene3d } from "./scene3d.js";
import { SideView } from "./sideview.js";

export function replayView(stage, run, other) {
  const host = h("div.canvas");
  stage.append(host);
  if (!run.base?.count) {
    host.append(h("p.missing", {}, run.missing("motion")));
    return { show() {} };
  }
  const asked = new URLSearchParams(location.search).has("svg");
  const canvas = h("canvas");
  const context = asked ? null : canvas.getContext("webgl2", { antialias: true, powerPreference: "low-power" });
  if (!context)
    return new SideView(host, run, asked ? null : "This browser has no WebGL: the climb is drawn from the right.");
  host.append(canvas);
  return new Scene3d(host, canvas, context, run, other);
}
