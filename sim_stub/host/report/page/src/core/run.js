// SPDX-License-Identifier: Apache-2.0
// One recorded run: the parts that the page has (DATA.md), and what each is at a time. A part that the file lacks is
// null or empty, and missing() says why in a sentence.
import { load, unpack } from "./blocks.js";
import { Series, indexAt } from "./series.js";

const WHY_MISSING = {
  truth: "The file has no truth: true poses, stairs and margins are not known.",
  pictures: "The file has no pictures.",
  map: "The file has no polygon map.",
  searches: "The file has no foothold searches.",
  steps: "The robot took no step.",
  summary: "The file has no verdict: nobody judged this run.",
  motion: "The file has no poses of the robot.",
  robot: "The file does not describe the robot.",
  schedule: "The file has no schedule.",
  memory: "The file does not say how much memory the modules take.",
  cost: "The file does not say what the schedule's rows cost.",
  params: "The file does not list its parameters.",
  versions: "The file does not name its versions.",
  lio: "The file has no lidar odometry.",
};

export class Run {
  constructor(json) {
    this.json = json;
    this.name = json.name ?? "run";
    this.duration_s = json.duration_s ?? 0;
    this.hasTruth = json.world === "true" && !!json.series?.base_true;
    this.summary = json.summary ?? null;
    this.robot = json.robot ?? null;
    this.camera = json.camera ?? null;
    this.stairs = json.stairs ?? null;
    this.polygons = json.map?.polygons ?? [];
    for (const list of [
      "pictures",
      "searches",
      "steps",
      "states",
      "phases",
      "events",
      "pushes",
      "operator",
      "schedule",
      "memory",
    ]) {
      this[list] = json[list] ?? [];
    }
    this.occupied = json.map?.occupied ?? [];
    this.unpacked_ = new Map();
    this.clocks_ = new Map();
    this.times_ = new Map();
  }

  /** Fetches every block's bytes; numbers are made of them when somebody asks. */
  async load() {
    await Promise.all([...Object.values(this.json.clocks ?? {}), ...Object.values(this.json.series ?? {})].map(load));
  }

  missing(part) {
    return this.json.missing?.[part] ?? WHY_MISSING[part] ?? `The file has no ${part}.`;
  }

  /** The series of that name, or null. */
  series(name) {
    if (!this.unpacked_.has(name)) {
      const block = this.json.series?.[name];
      this.unpacked_.set(name, block ? new Series(this.clock_(block.clock), unpack(block)) : null);
    }
    return this.unpacked_.get(name);
  }

  clock_(name) {
    if (!this.clocks_.has(name)) {
      const block = this.json.clocks?.[name];
      if (!block) throw new Error(`a series names the clock "${name}", which the file lacks`);
      this.clocks_.set(name, unpack(block)[0]);
    }
    return this.clocks_.get(name);
  }

  /** The robot's base: true where that is known, else as the module has it. */
  get base() {
    return (
      (this.hasTruth ? this.series("base_true") : null) ?? this.series("base_fused") ?? this.series("base_odometry")
    );
  }

  sole(foot) {
    return (this.hasTruth ? this.series(`sole_true_${foot}`) : null) ?? this.series(`sole_estimated_${foot}`);
  }

  /** The newest entry of a list sorted by its time, at a time; null before the first. */
  newest(list, t_s, time = "t_s") {
    const entries = this[list];
    const key = `${list}.${time}`;
    if (!this.times_.has(key))
      this.times_.set(
        key,
        entries.map((e) => (Array.isArray(e) ? e[0] : e[time])),
      );
    return entries[indexAt(this.times_.get(key), t_s)] ?? null;
  }

  stateAt(t_s) {
    return this.newest("states", t_s)?.[1] ?? null;
  }

  phaseAt(t_s) {
    return this.newest("phases", t_s)?.[1] ?? null;
  }

  polygonsAt(t_s) {
    return this.polygons.filter((p) => p.from_s <= t_s && (p.to_s === undefined || p.to_s === null || t_s < p.to_s));
  }

  occupiedAt(t_s) {
    return (
      this.occupied.find((o) => o.from_s <= t_s && (o.to_s === undefined || o.to_s === null || t_s < o.to_s))?.cells ??
      []
    );
  }

  /** The step whose foot is in the air at a time, or null. */
  swingAt(t_s) {
    const step = this.newest("steps", t_s, "latch_s");
    if (!step || this.phaseAt(t_s) !== "swing") return null;
    return step.touch_down_s === null || step.touch_down_s === undefined || t_s <= step.touch_down_s ? step : null;
  }

  get verdict() {
    return this.summary?.verdict ?? null;
  }

  /** From the simulation's clock, as summary.json has it, to the page's. */
  fromClock(at_s) {
    return at_s - (this.json.clock_t0_s ?? 0);
  }
}

export function parse(text) {
  const data = JSON.parse(text);
  if (data.format !== "polygmap-report") throw new Error("the page's data are not a PolygMap report");
  if (data.version !== 1)
    throw new Error(`the page's data have version ${data.version}, and this page reads version 1`);
  return (data.runs ?? []).map((run) => new Run(run));
}
