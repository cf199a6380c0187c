// SPDX-License-Identifier: Apache-2.0
// The kinds of planes and their colours, by Okabe and Ito: people of any colour vision tell them apart, and they are the
// same in light and dark, and in `perceive --picture` (perceived_picture.cpp).

export const KINDS = {
  tread: { colour: "#009e73", said: "tread, floor" },
  riser: { colour: "#56b4e9", said: "riser" },
  other: { colour: "#e69f00", said: "other" },
  unknown: { colour: "#cc79a7", said: "kind unknown" },
};
export const NOSING = "#f0e442",
  CASING = "#14181c",
  NO_PLANE = "#8b949a";

export const colourOf = (kind) => (KINDS[kind] ?? KINDS.unknown).colour;
