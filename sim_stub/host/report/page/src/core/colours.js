// SPDX-License-Identifier: Apache-2.0
// Colours by role. Map green, safe regions blue, p* red and p** purple are the paper's; tones are chosen so that people
// who see red and green alike tell them by lightness, and no role is told by colour alone.

const NAMES = [
  "map",
  "safe",
  "pstar",
  "pstarstar",
  "truth",
  "odometry",
  "lio",
  "fused",
  "left",
  "right",
  "ink",
  "faint",
  "line",
  "panel",
  "page",
  "stair",
  "stairline",
  "riser",
  "robot",
  "robotdark",
  "camera",
  "bad",
  "good",
  "warn",
  "band",
  "band3",
  "grid",
  "stage",
  "floor",
  "nosing",
  "runA",
  "runB",
];

export const colours = {};

const dark = window.matchMedia("(prefers-color-scheme: dark)");
const listeners = [];

function read() {
  const style = getComputedStyle(document.documentElement);
  for (const name of NAMES) colours[name] = style.getPropertyValue(`--${name}`).trim();
  colours.isDark = dark.matches;
}

/** Calls back when the reader's system turns light or dark. */
export function onTheme(call) {
  listeners.push(call);
}

read();
dark.addEventListener("change", () => {
  read();
  for (const call of listeners) call();
});

/** The same colour, so much of it opaque. */
export function faded(colour, alpha) {
  const n = parseInt(colour.slice(1), 16);
  return `rgba(${(n >> 16) & 255}, ${(n >> 8) & 255}, ${n & 255}, ${alpha})`;
}
