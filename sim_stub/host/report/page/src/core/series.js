// SPDX-License-Identifier: Apache-2.0
// A series: columns over a clock, read at any time. Between samples it is linear; quaternions turn evenly (slerp).

/** The last i with t[i] <= at, -1 before the first. */
export function indexAt(t, at) {
  let low = 0,
    high = t.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle] <= at) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Where at lies: between samples i and i + 1, the share u of the way; the ends hold. */
function between(t, at) {
  const i = indexAt(t, at);
  if (i < 0) return [0, 0];
  if (i >= t.length - 1) return [t.length - 1, 0];
  const span = t[i + 1] - t[i];
  return [i, span > 0 ? (at - t[i]) / span : 0];
}

export function slerp(a, b, u) {
  let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const sign = dot < 0 ? -1 : 1;
  dot = Math.min(Math.abs(dot), 1);
  const angle = Math.acos(dot);
  const s = Math.sin(angle);
  const p = s < 1e-6 ? 1 - u : Math.sin((1 - u) * angle) / s;
  const q = sign * (s < 1e-6 ? u : Math.sin(u * angle) / s);
  const out = a.map((v, k) => p * v + q * b[k]);
  const norm = Math.hypot(...out) || 1;
  return out.map((v) => v / norm);
}

export class Series {
  constructor(t_s, columns) {
    this.t_s = t_s;
    this.columns = columns;
    this.count = t_s.length;
  }

  row(i) {
    return this.columns.map((c) => c[i]);
  }

  /** All columns at a time; NaN where a sample beside it is missing. */
  at(t_s) {
    const [i, u] = between(this.t_s, t_s);
    if (u === 0) return this.row(i);
    return this.columns.map((c) => c[i] + u * (c[i + 1] - c[i]));
  }

  /** A pose: {p: [x, y, z], q: [x, y, z, w]}, or null where it is missing. */
  poseAt(t_s) {
    if (!this.count) return null;
    const [i, u] = between(this.t_s, t_s);
    const a = this.row(i);
    if (u === 0) return Number.isFinite(a[0]) ? { p: a.slice(0, 3), q: a.slice(3, 7) } : null;
    const b = this.row(i + 1);
    const p = [0, 1, 2].map((k) => a[k] + u * (b[k] - a[k]));
    return Number.isFinite(p[0]) ? { p, q: slerp(a.slice(3, 7), b.slice(3, 7), u) } : null;
  }
}
