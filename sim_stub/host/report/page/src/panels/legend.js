// SPDX-License-Identifier: Apache-2.0
// What the colours of the replay mean.
import { h } from "../core/dom.js";

export function legend(run, other) {
  const entries = [
    run.stairs ? ["stair", "true stairs", "The stairs as they are: the robot does not know them."] : null,
    run.polygons.length
      ? ["map", "mapped tread", "Polygons that the robot made of its pictures; dashed where it has not seen the end."]
      : null,
    run.polygons.length ? ["nosing", "nosing", "The tread's front edge, as the robot measured it."] : null,
    run.searches.length
      ? ["safe", "safe region", "Where the middle of a sole may be so that all of it lies on the tread."]
      : null,
    run.searches.length ? ["pstar", "next foothold p*", "Where the feet go next."] : null,
    run.searches.length ? ["pstarstar", "the one after, p**", "Where they go after that."] : null,
    run.base ? ["left", "left foot's path", ""] : null,
    run.base ? ["right", "right foot's path", ""] : null,
    run.camera ? ["camera", "camera's view", ""] : null,
    run.hasTruth ? ["fused", "sole as estimated", "Outline of where the robot believes its soles to be."] : null,
    other ? ["runB", `${other.name}'s robot`, "The second run at the same time."] : null,
  ].filter(Boolean);
  return h(
    "ul.legend3d",
    {},
    entries.map(([role, label, title]) => h("li", { title }, h(`span.key.${role}`), label)),
  );
}
