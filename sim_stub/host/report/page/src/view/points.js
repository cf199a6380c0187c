// SPDX-License-Identifier: Apache-2.0

/** A flat list of numbers as points of so many. */
export function points(numbers, each = 3) {
  const out = [];
  for (let i = 0; i + each <= numbers.length; i += each) out.push(numbers.slice(i, i + each));
  return out;
}
