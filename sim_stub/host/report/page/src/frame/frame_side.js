// SPDX-License-Identifier: Apache-2.0
// The same from the right, as a drawing: where the browser has no WebGL, and for who prefers it.
import { h, svg } from "../core/dom.js";
import { CASING, NOSING, NO_PLANE, colourOf } from "./kinds.js";

const MOST = 4000; // points

const path = (corners, close) =>
  corners.map(([x, , z], i) => `${i ? "L" : "M"}${x.toFixed(4)} ${(-z).toFixed(4)}`).join("") + (close ? "Z" : "");

export class FrameSide {
  constructor(host, frame, why) {
    this.frame = frame;
    const { ends } = frame.bounds();
    const from = [Math.min(ends[0][0], 0) - 0.1, -Math.max(ends[2][1], 0) - 0.15];
    const size = [Math.max(ends[0][1], 0.3) + 0.1 - from[0], -Math.min(ends[2][0], 0) + 0.1 - from[1]];
    this.text = Math.max(...size) / 40;
    this.cloud = svg("g", {}, this.dots());
    this.planes = frame.planes.map((plane) => this.planeGroup(plane));
    const far = frame.frustum(Math.min(0.4, size[0] / 4));
    const drawing = svg(
      "svg.side.frame3d",
      { role: "img", "aria-label": "The planes from the right", viewBox: [...from, ...size].join(" ") },
      this.cloud,
      this.planes,
      svg("g.camera", {}, svg("path", { d: path([far[0], [0, 0, 0], far[2]]) })),
    );
    host.append(drawing, h("p.note", {}, why));
  }

  dots() {
    const { places, planes } = this.frame.points;
    const every = Math.max(1, Math.ceil(planes.length / MOST));
    const of = {};
    for (let i = 0; i < planes.length; i += every) {
      const kind = this.frame.kindOf(planes[i]);
      const colour = kind ? colourOf(kind) : NO_PLANE;
      of[colour] = (of[colour] ?? "") + `M${places[3 * i].toFixed(3)} ${(-places[3 * i + 2]).toFixed(3)}h0`;
    }
    return Object.entries(of).map(([colour, d]) =>
      svg("path", { d, style: `stroke: ${colour}; stroke-width: 2; stroke-opacity: 0.5` }),
    );
  }

  planeGroup(plane) {
    const style = `stroke: ${colourOf(plane.kind)}; stroke-width: 3`;
    const label = { x: plane.middle[0], y: -plane.middle[2], "font-size": this.text, "data-id": plane.id };
    return svg(
      "g",
      {},
      plane.pieces.map((piece) => svg("path", { d: path(piece.corners, true), style })),
      plane.pieces
        .filter((piece) => piece.nosing)
        .flatMap(({ nosing }) => [
          svg("path", { d: path(nosing) + "h0.0001", style: `stroke: ${CASING}; stroke-width: 11` }),
          svg("path", { d: path(nosing) + "h0.0001", style: `stroke: ${NOSING}; stroke-width: 7` }),
        ]),
      svg("text.plane", label, `${plane.id}`),
    );
  }

  showPoints(on) {
    this.cloud.style.display = on ? "" : "none";
  }

  select(id) {
    this.frame.planes.forEach((plane, i) => {
      this.planes[i].style.display = id === null || plane.id === id ? "" : "none";
    });
  }
}
