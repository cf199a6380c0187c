// SPDX-License-Identifier: Apache-2.0
// The rows of the paper's Tables I and II: trial, gait, T in s, steps, planes in Hz, e_m in mm.

export const kTableI = [
  ["1", "–", 34, 10, 21, 11.2],
  ["2", "–", 35, 10, 20, 10.3],
  ["3", "–", 34, 10, 25, 12.0],
  ["4", "–", 14, 4, 29, 12.4],
  ["5", "–", 15, 4, 28, 11.8],
];

export const kTableII = [
  ["indoor", "DS", 9.6, 4, 21, 12.1],
  ["indoor", "DS", 10.2, 4, 20, 11.4],
  ["indoor", "SS", 7.7, 4, 23, 24.7],
  ["outdoor", "SS", 11.2, 6, 20, 33.4],
  ["outdoor", "SS", 9.8, 5, 21, 22.2],
];
