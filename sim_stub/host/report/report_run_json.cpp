// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "firmware/config/param_table.hpp"
#include "sim_stub/host/record/preview_camera.hpp"
#include "sim_stub/host/report/report_run.hpp"
#include "sim_stub/host/report/robot_description.hpp"
#include "sim_stub/plant/plant.hpp"

namespace polygmap::sim {
namespace {

constexpr double kMillisecond = 1e-3;
// So much of a page that its ten steps stay within 4 MB, and one of an hour opens.
constexpr std::size_t kMostSamples = 6000, kMostPictures_bytes = 1'700'000;

std::size_t every_of(std::size_t count, std::size_t most) {
  return std::max<std::size_t>(1, (count + most - 1) / most);
}

const char* name_of_foot(Foot foot) { return foot == Foot::kLeft ? "left" : "right"; }

ReportJson times_json(const std::vector<double>& at_ms, std::size_t every = 1) {
  ReportTable table({1.0});
  for (const double ms : at_ms) table.add(std::array{ms});
  if (table.empty()) return nullptr;
  ReportJson block = table.json(every);  // milliseconds as whole numbers, told as seconds
  for (auto& number : block["scale"]) number = number.get<double>() * kMillisecond;
  for (auto& number : block["offset"]) number = number.get<double>() * kMillisecond;
  return block;
}

}  // namespace

ReportJson ReportRun::steps_json() const {
  ReportJson list = ReportJson::array();
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const LatchedStep& step = steps_[i];
    ReportJson json{{"sequence", step.sequence},
                    {"foot", name_of_foot(step.foot)},
                    {"onto_tread", step.onto_tread},
                    {"latch_s", rounded(time_s(step.latch_stamp_ns), 3)},
                    {"touch_down_s", step.touch_down_stamp_ns == 0 ? ReportJson(nullptr)
                                                                   : rounded(time_s(step.touch_down_stamp_ns), 3)}};
    for (const auto& [key, value] : step_places_[i].items()) json[key] = value;
    if (step.touch_down_stamp_ns != 0) {
      const Vec3 off_m = step.odom_T_executed.p_m - step.odom_T_target.p_m;
      json["execution_error_mm"] = rounded(1e3 * off_m.norm(), 2);
    }
    if (step.onto_tread) {
      json["polygon_id"] = step.target.polygon_id;
      json["clearance_mm"] = rounded(1e3 * step.target.clearance_m, 1);
      json["toe_clearance_mm"] = rounded(1e3 * step.target.toe_clearance_m, 1);
      json["map_age_at_latch_ms"] = rounded(1e-6 * static_cast<double>(step.latch_stamp_ns - step.map_stamp_ns), 1);
    }
    // What a judge who knows the truth said of it.
    for (const ReportJson& judged : summary_.value("footsteps", ReportJson::array())) {
      if (judged.value("sequence", 0U) != step.sequence) continue;
      for (const char* key : {"step", "along_error_mm", "across_error_mm", "sole_margin_mm", "swing_clearance_mm",
                              "execution_error_mm", "target_last_seen_ms"}) {
        if (judged.contains(key) && !judged[key].is_null()) json[key] = judged[key];
      }
      if (judged.contains("landed_m")) {
        const ReportJson& at = judged["landed_m"];
        json["landed_m"] = {at["x"], at["y"], at["z"], at["yaw_rad"]};
      }
    }
    list.push_back(std::move(json));
  }
  return list;
}

ReportJson ReportRun::stairs_json() const {
  ReportJson treads = ReportJson::array();
  double half_width_m = 0.6;
  for (const ReportJson& box : boxes_) {
    if (!box.contains("step")) continue;
    const double x = box["pose"][0].get<double>(), half = box["half_m"][0].get<double>();
    half_width_m = box["half_m"][1].get<double>();
    treads.push_back({{"step", box["step"]},
                      {"nosing_x_m", rounded(x - half)},
                      {"back_x_m", rounded(x + half)},
                      {"height_m", rounded(2.0 * box["half_m"][2].get<double>())}});
  }
  return {{"boxes", boxes_}, {"treads", treads}, {"half_width_m", half_width_m}};
}

// Evenly fewer where they are too many, the last one among them.
ReportJson ReportRun::pictures_json() const {
  std::size_t bytes = 0;
  for (const ReportJson& picture : pictures_) bytes += picture["png"].get_ref<const std::string&>().size();
  const std::size_t every = every_of(bytes, kMostPictures_bytes);
  ReportJson list = ReportJson::array();
  for (std::size_t i = (pictures_.size() - 1) % every; i < pictures_.size(); i += every) list.push_back(pictures_[i]);
  return list;
}

ReportJson ReportRun::json() const {
  const Params& params = file_->params();
  const CameraIntrinsics& k = file_->camera();
  ReportJson run{{"name", std::filesystem::path(path_).filename().string()},
                 {"duration_s", rounded(time_s(now_ns_), 3)},
                 {"world", has_truth_ ? "true" : "module"},
                 {"clock_t0_s", rounded(1e-9 * static_cast<double>(first_ns_), 3)},
                 {"missing", ReportJson::object()}};
  const std::size_t every = every_of(motion_ms_.size(), kMostSamples);
  run["clocks"] = {{"motion", times_json(motion_ms_, every)}};
  if (!lio_ms_.empty()) run["clocks"]["lio"] = times_json(lio_ms_);
  if (!cost_ms_.empty()) run["clocks"]["cost"] = times_json(cost_ms_);
  const auto add = [&run](const std::string& name, const char* clock, const ReportTable& table, std::size_t every_row) {
    if (table.empty()) return;
    ReportJson series{{"clock", clock}};
    series.update(table.json(every_row));
    run["series"][name] = std::move(series);
  };
  if (has_truth_) add("base_true", "motion", base_true_, every);
  add("base_fused", "motion", base_fused_, every);
  add("base_odometry", "motion", base_odometry_, every);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const std::string name = name_of_foot(static_cast<Foot>(foot));
    if (has_truth_) add("sole_true_" + name, "motion", sole_true_[foot], every);
    add("sole_estimated_" + name, "motion", sole_estimated_[foot], every);
    add("sole_desired_" + name, "motion", sole_desired_[foot], every);
  }
  add("sigma_fused", "motion", sigma_, every);
  add("joints", "motion", joint_angles_, every);
  add("torque_share", "motion", torque_share_, every);
  add("contact", "motion", contact_, every);
  add("lio", "lio", lio_, 1);
  add("cost", "cost", cost_, 1);
  run["states"] = states_;
  run["phases"] = phases_;
  run["events"] = events_;
  run["operator"] = operator_;
  run["robot"] = robot_json(params.robot);
  run["camera"] = {{"width_px", k.width_px},
                   {"height_px", k.height_px},
                   {"fx_px", k.fx_px},
                   {"fy_px", k.fy_px},
                   {"cx_px", k.cx_px},
                   {"cy_px", k.cy_px},
                   {"base_T_camera", pose_json(params.robot.mounts.base_T_camera)},
                   {"near_m", Preview::kNearest_m},
                   {"far_m", Preview::kFarthest_m},
                   {"range_m", {params.surfaces.limits.min_depth_m, params.surfaces.limits.max_depth_m}}};
  run["steps"] = steps_json();
  run["map"] = versions_.json();
  run["searches"] = searches_;
  if (!pictures_.empty()) {
    run["pictures"] = pictures_json();
  } else {
    run["missing"]["pictures"] = "The file has no pictures: record them with --record all.";
  }
  if (has_truth_) {
    run["stairs"] = stairs_json();
  } else {
    run["missing"]["truth"] =
        "The file has no truth, as a robot's own has none: stairs, true poses and true margins are not known.";
  }
  if (!summary_.empty()) run["summary"] = summary_;
  ReportJson pushes = ReportJson::array();
  if (summary_.contains("arguments")) {
    for (const ReportJson& push : summary_["arguments"].value("pushes", ReportJson::array())) {
      const double force_n = push["impulse_ns"].get<double>() / Push::kDuration_s;
      const bool is_x = push["axis"] == "x";
      pushes.push_back({{"t_s", rounded(push["at_s"].get<double>() - 1e-9 * static_cast<double>(first_ns_), 3)},
                        {"duration_s", Push::kDuration_s},
                        {"force_n", {is_x ? force_n : 0.0, is_x ? 0.0 : force_n, 0.0}}});
    }
    const ReportJson memory = summary_.value("static_memory", ReportJson::object());
    for (const auto& [name, bytes] : memory.items()) {
      run["memory"].push_back({name, bytes});
    }
  }
  run["pushes"] = pushes;
  if (summary_.contains("command")) run["arguments"] = summary_["command"];
  // A row that takes what its resumable predecessor left may spend all of both; and the last piece of work may
  // overdraw, which is paid back.
  double shared = 0.0;
  for (const ScheduleRow& row : kSchedule) {
    const auto own = static_cast<double>(instructions_per_slot(row));
    shared = row.takes_leftover ? shared + own : own;
    run["schedule"].push_back({{"task", row.task},
                               {"lane", row.lane == kControlLane ? "control" : "perception"},
                               {"budget_us", row.budget_us},
                               {"resumable", row.resumable()},
                               {"budget_instructions", row.resumable() ? shared + kOverdraftInstructions : own}});
  }
  if (!file_->damage().empty()) run["damage"] = file_->damage();
  if (!ends_.empty()) {
    run["ending"] = {{"t_s", rounded(time_s(now_ns_), 3)}, {"sentence", ends_}};
  } else if (outputs_.gait.stop_reason != StopReason::kNone && outputs_.gait.stop_reason != StopReason::kTop) {
    run["ending"] = {{"t_s", states_.back()[0]},
                     {"sentence", summary_.value("reason", std::string(text_of(outputs_.gait.stop_reason)))},
                     {"stop", name_of(outputs_.gait.stop_reason)},
                     {"stop_text", text_of(outputs_.gait.stop_reason)}};
  }
  Params defaults, own = params;
  const config::ParamTable own_table = config::param_table(own), default_table = config::param_table(defaults);
  ReportJson differing = ReportJson::array();
  for (std::size_t i = 0; i < own_table.params.size(); ++i) {
    const config::Param &mine = own_table.params[i], &usual = default_table.params[i];
    if (config::same_value(mine, usual)) continue;
    differing.push_back({{"name", mine.name},
                         {"value", config::text_of(mine)},
                         {"default", config::text_of(usual)},
                         {"unit", config::unit_of(mine.name)},
                         {"text", mine.text}});
  }
  run["params"] = {{"hash", config::hash_of(own_table)}, {"differing", differing}};
  run["versions"] = {{"polygmap", POLYGMAP_PROGRAM_VERSION}, {"recording", std::to_string(recording::kVersion)}};
  return run;
}

}  // namespace polygmap::sim
