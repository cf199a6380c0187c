// SPDX-License-Identifier: Apache-2.0
// Colour ramps that grow evenly in lightness, for eyes of every kind (after cividis).

const STOPS = [
  [253, 231, 55],
  [203, 186, 105],
  [155, 146, 118],
  [102, 105, 112],
  [50, 73, 109],
  [0, 34, 78],
];

function ramp(share, stops) {
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const i = Math.min(Math.floor(at), stops.length - 2),
    u = at - i;
  return stops[i].map((c, k) => Math.round(c + u * (stops[i + 1][k] - c)));
}

/** Near is bright, far is dark; what has no depth is grey. */
export const depthColour = (share) => (Number.isFinite(share) ? ramp(share, STOPS) : [128, 128, 128]);

/** Low is dark, high is bright. */
export const heightColour = (share) => ramp(1 - share, STOPS);
