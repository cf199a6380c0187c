// SPDX-License-Identifier: Apache-2.0
// The scores of a log, and how its replay went.
import { h, isNumber, number, table, words } from "../core/dom.js";

const SCORES = [
  ["position_rmse_mm", "position, RMSE", "mm", 1],
  ["velocity_rmse_mmps", "velocity, RMSE", "mm/s", 1],
  ["attitude_rmse_deg", "attitude, RMSE", "°", 3],
  ["tilt_rmse_deg", "of it tilt", "°", 3],
  ["yaw_rmse_deg", "of it yaw", "°", 3],
  ["odometry_position_rmse_mm", "position without LIO, RMSE", "mm", 1],
  ["drift_percent", "error at the end, of the way gone", "%", 2],
  ["horizontal_drift_percent", "the same, horizontal", "%", 2],
  ["final_error_mm", "error at the end", "mm", 1],
  ["distance_m", "way gone", "m", 2],
  ["planted_foot_mm", "most that a planted foot seems to move", "mm", 1],
  ["nees_in_bounds_percent", "rows with the error within the stated 95 % bounds", "%", 1],
  ["nees_mean", "mean NEES of 6 states (6 is right)", "", 2],
];

export function saidOf(data) {
  const s = data.summary;
  const rows = `${s.rows} rows, ${number(data.duration_s, 1, "s")}`;
  if (!data.has_truth) return `${rows}. The log has no truth: nothing is scored.`;
  return `${rows}. Position ${number(s.position_rmse_mm, 1, "mm")}, attitude ${number(s.attitude_rmse_deg, 2, "°")} RMSE; drift ${number(s.drift_percent, 2, "%")} of ${number(s.distance_m, 1, "m")}.`;
}

export function scoresPanel(data) {
  const rows = SCORES.filter(
    ([key]) => key in data.summary && (data.has_lio || key !== "odometry_position_rmse_mm"),
  ).map(([key, what, unit, digits]) => [what, number(data.summary[key], digits, unit)]);
  const heads = ["", { text: "", class: "n" }];
  return h("section", { id: "scores" }, h("h2", {}, "Scores"), table(heads, rows, { label: "Scores" }));
}

const vector = (v, scale, digits, unit) => `${v.map((c) => number(c * scale, digits)).join(", ")} ${unit}`;

export function sourcePanel(data) {
  const s = data.summary;
  const rows = [
    ["start", s.start],
    ["feet as", data.has_soles ? "soles" : "points"],
    ["parameters", s.params_hash],
    ["gyro bias at the end", vector(s.gyro_bias_radps, 1e3, 2, "mrad/s")],
    ["accelerometer bias at the end", vector(s.accel_bias_mps2, 1e3, 1, "mm/s²")],
    ["gaps without rows", s.gaps],
    ["rows with an impossible IMU", s.imu_invalid],
    ["rows in which a standing foot moves", s.moving_contact_rows],
    ["rows with no foot on the ground", number(s.rows_without_contact_percent, 1, "%")],
    ["updates with less weight", s.innovation_outliers],
    ...Object.entries(s.innovations)
      .filter(([, of]) => of.updates > 0)
      .map(([name, of]) => [
        `innovations, ${words(name).replace("lio", "LIO")}`,
        `${number(of.mean, 2)} in the mean of ${of.updates}`,
      ]),
    ["σ of the position at the end", vector(s.final_position_sigma_mm, 1, 1, "mm")],
    ["σ of the yaw at the end", number(s.final_yaw_sigma_deg, 3, "°")],
    ["LIO", data.has_lio ? lio(s.lio) : "none"],
  ];
  return h("section", { id: "source" }, h("h2", {}, "How the replay went"), table(["", ""], rows, { label: "Replay" }));
}

const REFUSED = {
  no_odometry: "from before the start",
  jump: "too far from the odometry",
  realigned: "taken as a new world",
  future: "of the future",
  order: "not newer than the last",
};

function lio(counts) {
  const refused = Object.entries(counts)
    .filter(([name, n]) => !["poses", "accepted", "age_at_end_s"].includes(name) && n > 0)
    .map(([name, n]) => `${n} ${REFUSED[name] ?? words(name)}`);
  const age = isNumber(counts.age_at_end_s)
    ? `; the last one is ${number(counts.age_at_end_s, 2, "s")} old at the end`
    : "";
  return `${counts.accepted} of ${counts.poses} poses accepted${refused.length ? `, ${refused.join(", ")}` : ""}${age}`;
}
