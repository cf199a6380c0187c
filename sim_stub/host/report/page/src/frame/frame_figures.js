// SPDX-License-Identifier: Apache-2.0
// The figures of a frame: its planes one by one, and what they were found with.
import { h, mm, number, table } from "../core/dom.js";
import { colourOf } from "./kinds.js";
import { cross, dot } from "./frame.js";

const degrees = (rad) => (rad * 180) / Math.PI;

/** Along the horizontal of the plane (a tread's nosing), and across it. */
function sizeOf(plane) {
  const across = plane.nosing
    ? plane.nosing[1].map((c, k) => c - plane.nosing[0][k])
    : Math.hypot(plane.normal[0], plane.normal[1]) > 0.2
      ? [-plane.normal[1], plane.normal[0], 0]
      : [0, 1, 0];
  const length = Math.hypot(...across) || 1;
  const u = across.map((c) => c / length);
  const extent = (axis) => {
    const along = plane.pieces.flatMap((piece) => piece.corners.map((p) => dot(axis, p)));
    return Math.max(...along) - Math.min(...along);
  };
  return [extent(u), extent(cross(plane.normal, u))];
}

function slopeOf(plane) {
  const angle = degrees(Math.acos(Math.min(1, Math.max(-1, plane.normal[2]))));
  if (plane.kind === "tread") return `${number(angle, 1, "°")} off level`;
  if (plane.kind === "riser") return `${number(Math.abs(angle - 90), 1, "°")} off upright`;
  return `${number(angle, 1, "°")} to level`;
}

const noDepth = (plane) =>
  plane.pieces.reduce((sum, p) => sum + p.invalid_fraction * p.area_m2, 0) /
  (plane.pieces.reduce((sum, p) => sum + p.area_m2, 0) || 1);

/** select(id or null) shows one plane alone. */
export function planesPanel(frame, select) {
  const heads = [
    "plane",
    "kind",
    ...[
      "width × depth",
      "area",
      "height",
      "angle",
      "offset d",
      "±",
      "angle ±",
      "flat within",
      "no depth",
      "nosing",
    ].map((text) => ({ text, class: "n" })),
  ];
  let chosen = null;
  const rows = frame.planes.map((plane) => {
    const size = sizeOf(plane);
    const alone = h(
      "button.small",
      {
        type: "button",
        "aria-pressed": "false",
        title: "Show it alone",
        onclick: () => {
          chosen = chosen === plane.id ? null : plane.id;
          for (const [i, p] of frame.planes.entries()) rows[i][0].setAttribute("aria-pressed", p.id === chosen);
          select(chosen);
        },
      },
      `${plane.id}`,
    );
    const area = plane.pieces.reduce((sum, p) => sum + p.area_m2, 0);
    const edge = plane.nosing ? plane.nosing[1].map((c, k) => c - plane.nosing[0][k]) : null;
    return [
      alone,
      h("span", {}, h("i.key", { style: `--k: ${colourOf(plane.kind)}` }), plane.kind),
      `${number(size[0], 2)} × ${number(size[1], 2, "m")}`,
      number(area, 3, "m²"),
      plane.kind === "tread" ? mm(plane.middle[2] - frame.ground, 0) : "–",
      slopeOf(plane),
      number(plane.d_m, 3, "m"),
      number(plane.sigma_offset_mm, 2, "mm"),
      number(plane.sigma_angle_deg, 2, "°"),
      number(plane.rmse_mm, 1, "mm"),
      number(100 * noDepth(plane), 0, "%"),
      edge
        ? `${number(Math.hypot(...edge), 2, "m")}, ${number((plane.nosing[0][0] + plane.nosing[1][0]) / 2, 3)} m ahead`
        : "–",
    ];
  });
  return h(
    "section",
    { id: "planes" },
    h("h2", {}, "Planes"),
    h(
      "p.note",
      {},
      "Height is that above the lowest level plane, ahead is horizontal from the camera. ± is one sigma, by the depth noise as measured in this picture.",
    ),
    rows.length
      ? table(heads, rows, { label: "Planes", class: "steps" })
      : h("p.missing", {}, "No plane was found in this picture."),
  );
}

const UP = {
  given: "as --gravity says",
  found: "by the largest plane that looks level",
  assumed: "assumed as up in the picture, since no plane looks level; so kinds are not known",
};

export function sourcePanel(frame) {
  const { camera, cost, json } = { camera: frame.camera, cost: frame.json.cost, json: frame.json };
  const rows = [
    ["picture", `${camera.width_px} × ${camera.height_px} px`],
    ["focal length", `${number(camera.fx_px, 1)}, ${number(camera.fy_px, 1, "px")}`],
    [
      "depths in range",
      `${number(100 * json.in_range_share, 1, "%")}, ${camera.min_depth_m} to ${camera.max_depth_m} m`,
    ],
    ["up", UP[json.up_source] ?? json.up_source],
    ["points drawn", `${frame.points.planes.length}, of one in ${json.points.stride} columns and rows`],
    ["parameters", json.params_hash],
  ];
  const took = `${number(cost.median_us, 0)} µs in the median of ${cost.repeats}, ${number(cost.most_us, 0)} µs at most`;
  return h(
    "section",
    { id: "source" },
    h("h2", {}, "What it was found with"),
    table(["", ""], rows, { label: "Source" }),
    h("p.note", {}, `The extraction took ${took}, on the machine that wrote this page: no robot's figure.`),
  );
}
