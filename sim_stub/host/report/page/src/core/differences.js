// SPDX-License-Identifier: Apache-2.0
// What two runs differ in: verdict figures, how they were started, parameters, versions.

// The figures that decide about a climb come first, in this order; the others follow by name.
const FIRST = [
  "verdict",
  "steps_climbed",
  "fell",
  "ended_by",
  "seconds_per_step",
  "climb_time_s",
  "plane_rate_hz",
  "execution_error_mm.max",
  "foothold_error_mm.max",
  "sole_margin_mm_min",
  "swing_clearance_mm_min",
  "tracking_error_mm.x_max",
  "tracking_error_mm.z_max",
  "odometry_drift_mm.fused",
  "zmp_margin_mm_min",
  "heap_calls",
];
// Of no use here: lists that have tables of their own, and what this machine's clock measured.
const LEFT_OUT = /^(reason|footsteps|states|schedule|wall|arguments|reality|seed|plant|gait|params_hash)\b/;
const STARTED = /^(arguments|reality|seed|plant|gait|params_hash)\b/;

export function flat(value, path = "", out = new Map()) {
  if (value !== null && typeof value === "object")
    for (const [key, part] of Object.entries(value)) flat(part, path ? `${path}.${key}` : key, out);
  else out.set(path, value);
  return out;
}

function differing(a, b, wanted = () => true) {
  const out = [];
  for (const name of new Set([...a.keys(), ...b.keys()])) {
    if (wanted(name) && a.get(name) !== b.get(name)) out.push({ name, a: a.get(name), b: b.get(name) });
  }
  return out;
}

const rank = (name) => (FIRST.includes(name) ? FIRST.indexOf(name) : FIRST.length);

/** {figures, started, parameters, versions}: lists of {name, a, b}; of figures those that decide come first. */
export function differences(runA, runB) {
  const a = flat(runA.summary ?? {}),
    b = flat(runB.summary ?? {});
  const values = (run) => new Map((run.json.params?.differing ?? []).map((p) => [p.name, p.value]));
  const defaults = new Map(
    [runA, runB].flatMap((run) => (run.json.params?.differing ?? []).map((p) => [p.name, `${p.default} (default)`])),
  );
  const started = differing(a, b, (name) => STARTED.test(name));
  if (!started.length)
    started.push(
      ...differing(
        flat({ command: (runA.json.arguments ?? []).join(" ") }),
        flat({ command: (runB.json.arguments ?? []).join(" ") }),
      ),
    );
  return {
    figures: differing(a, b, (name) => !LEFT_OUT.test(name)).sort(
      (x, y) => rank(x.name) - rank(y.name) || x.name.localeCompare(y.name),
    ),
    started,
    parameters: differing(values(runA), values(runB)).map((p) => ({
      name: p.name,
      a: p.a ?? defaults.get(p.name),
      b: p.b ?? defaults.get(p.name),
    })),
    versions: differing(flat(runA.json.versions ?? {}), flat(runB.json.versions ?? {})),
    isDecisive: (name) => FIRST.includes(name),
  };
}
