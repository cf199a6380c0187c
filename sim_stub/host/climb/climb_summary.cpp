// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/climb_summary.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "algorithms/robot/robot_model.hpp"
#include "firmware/config/operator_request_text.hpp"

namespace polygmap::sim {
namespace {

using Json = nlohmann::ordered_json;

// Not measured (NaN) becomes JSON's null; -0 becomes 0, or one run could print two texts.
Json rounded(double value, double per_unit) {
  if (!std::isfinite(value)) return nullptr;
  return std::round(value * per_unit) / per_unit + 0.0;
}
Json mm(double length_m) { return rounded(length_m * 1e3, 100.0); }
Json metres(double length_m) { return rounded(length_m, 1e5); }
Json seconds_of(double time_s) { return rounded(time_s, 1e4); }
Json ms(double time_ms) { return rounded(time_ms, 1e3); }

Json spread_mm(const Spread& s) { return {{"median", mm(s.median)}, {"max", mm(s.max)}}; }
Json spread_ms(const Spread& s) { return {{"median", ms(s.median)}, {"max", ms(s.max)}}; }

Json per_joint(const std::array<double, kJointsPerLeg>& ratio) {
  Json j = Json::object();
  for (std::size_t i = 0; i < kJointsPerLeg; ++i) j[std::string(kLegJointNames[i])] = rounded(ratio[i], 1e3);
  return j;
}

Json pose(const Transform& T) {
  return {{"x", metres(T.p_m.x())},
          {"y", metres(T.p_m.y())},
          {"z", metres(T.p_m.z())},
          {"yaw_rad", rounded(yaw_of(T.R), 1e5)}};
}

Json footstep_json(const Footstep& f) {
  return {{"sequence", f.sequence},
          {"foot", f.foot == Foot::kLeft ? "left" : "right"},
          {"onto_tread", f.onto_tread},
          {"step", f.landed ? Json(f.step_index + 1) : Json(nullptr)},
          {"planned_m", pose(f.true_T_planned)},
          {"landed_m", f.landed ? pose(f.true_T_landed) : Json(nullptr)},
          {"execution_error_mm", mm(f.execution_error_m)},
          {"along_error_mm", mm(f.along_error_m)},
          {"across_error_mm", mm(f.across_error_m)},
          {"sole_margin_mm", mm(f.sole_margin_m)},
          {"swing_clearance_mm", mm(f.swing_clearance_m)},
          {"map_age_at_latch_ms", ms(f.map_age_at_latch_ms)},
          {"target_last_seen_ms", ms(f.target_last_seen_ms)}};
}

Json pushes_json(const std::vector<Push>& pushes) {
  Json list = Json::array();
  for (const Push& push : pushes) {
    list.push_back({{"at_s", push.at_s}, {"axis", push.axis == 0 ? "x" : "y"}, {"impulse_ns", push.impulse_ns}});
  }
  return list;
}

Json asked_json(const std::vector<TimedRequest>& asked) {
  Json list = Json::array();
  for (const TimedRequest& one : asked) list.push_back({{"at_s", one.at_s}, {"command", text_of(one.request)}});
  return list;
}

// What the command line said beside gait and seed, defaults included: enough to run it again.
Json arguments_json(const ClimbOptions& o) {
  const StairParams& stairs = o.stairs;
  Json json = {{"steps", stairs.steps},
               {"rise_m", stairs.rise_m},
               {"tread_m", stairs.tread_m},
               {"width_m", stairs.width_m},
               {"nosing_m", stairs.nosing_m},
               {"landing_m", stairs.landing_m},
               {"jitter_m", stairs.jitter_m},
               {"noise", o.noise == NoiseKind::kWhite ? "white" : "correlated"},
               {"camera", o.camera ? Json(o.camera_file) : Json(nullptr)},
               {"scan_ms", o.scan_ms},
               {"mount_error_deg", rounded(o.reality.sensors.camera_mount_rad * 180.0 / kPi, 1e6)},
               {"scale_error", o.reality.sensors.depth_scale},
               {"params", o.params_file.empty() ? Json(nullptr) : Json(o.params_file)},
               {"estimate_mount", o.estimate_mount},
               {"self_filter", o.self_filter},
               {"contacts", o.foot_sensors ? "sensed" : "inferred"},
               {"pushes", pushes_json(o.pushes)},
               {"asked", asked_json(o.asked)},
               {"mass_scale", o.reality.plant.torso_mass_scale},
               {"torso_offset_x_m", o.reality.plant.torso_offset_x_m},
               {"friction", o.reality.plant.friction},
               {"render_shift_m", {o.render_dx_m, o.render_dy_m, o.render_dz_m}},
               {"render_missing_step", o.render_missing_step < 0 ? Json(nullptr) : Json(o.render_missing_step + 1)},
               {"blank_depth", o.blank_depth}};
  if (o.world) {
    for (const char* key : {"steps", "rise_m", "tread_m", "width_m", "nosing_m", "landing_m", "jitter_m"})
      json.erase(key);
    json["world"] = o.world_file;
    if (!o.world_kind.empty()) {
      json["kind"] = o.world_kind;
      json["drawn"] = o.world_drawn;
    }
  }
  if (stairs.balusters.spacing_m > 0.0) {
    const Balusters& posts = stairs.balusters;
    json["balusters"] = {{"spacing_m", posts.spacing_m},
                         {"inset_m", posts.inset_m},
                         {"size_m", posts.size_m},
                         {"height_m", posts.height_m},
                         {"side", posts.left && posts.right ? "both" : (posts.left ? "left" : "right")}};
  }
  for (const Obstacle& box : stairs.obstacles) {
    json["obstacles"].push_back({{"centre_m", {box.centre_m.x(), box.centre_m.y(), box.centre_m.z()}},
                                 {"size_m", {box.size_m.x(), box.size_m.y(), box.size_m.z()}}});
  }
  return json;
}

std::string format(const char* text, double a, double b) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, text, a, b);
  return buffer;
}

}  // namespace

Spread spread_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  const double median = values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
  return {median, values.back()};
}

Json to_json(const ClimbSummary& s) {
  Json j;
  j["verdict"] = s.interrupted_by != 0 ? "interrupted" : s.pass ? "pass" : "fail";
  j["reason"] = s.reason;
  j["fell"] = s.fell;
  j["ended_by"] = s.ended_by;
  j["ended_at_s"] = seconds_of(s.ended_at_s);
  j["plant"] = name_of(s.options.plant);
  j["gait"] = name_of(s.options.gait);
  j["seed"] = s.options.seed;
  j["command"] = s.options.command;
  j["arguments"] = arguments_json(s.options);
  j["params_hash"] = s.params_hash;
  j["reality"] = {{"scale", s.options.reality_scale}};
  for (const NamedValue& item : values_of(s.options.reality)) j["reality"][item.name] = Json::parse(item.text);
  const CameraFigures& camera = s.camera;
  const auto degrees = [](double x) { return rounded(x, 1e3); };
  j["camera"] = {
      {"scan_ms", ms(camera.scan_ms)},
      {"scale_error_percent", rounded(1e2 * camera.scale_error, 1e3)},
      {"mount_error_deg",
       {{"roll", degrees(camera.mount_error_deg.x())},
        {"pitch", degrees(camera.mount_error_deg.y())},
        {"yaw", degrees(camera.mount_error_deg.z())}}},
      {"mount_error_mm",
       {{"x", mm(camera.mount_error_m.x())}, {"y", mm(camera.mount_error_m.y())}, {"z", mm(camera.mount_error_m.z())}}},
      {"mount_found",
       {{"roll_deg", degrees(camera.mount_found_deg.x())},
        {"pitch_deg", degrees(camera.mount_found_deg.y())},
        {"height_mm", mm(camera.mount_found_height_m)},
        {"ahead_mm", mm(camera.mount_found_ahead_m)}}}};
  if (s.bus) {
    j["bus"] = {{"file", s.options.bus ? s.options.bus->path : ""},
                {"load_percent", Json::object()},
                {"module_state", s.bus->module_state},
                {"silent_joints", s.bus->silent_joints},
                {"error_joints", s.bus->error_joints},
                {"hot_joints", s.bus->hot_joints},
                {"frames_sent", s.bus->sent},
                {"frames_received", s.bus->received}};
    for (const auto& [name, load] : s.bus->loads) j["bus"]["load_percent"][name] = rounded(1e2 * load, 10.0);
  }
  j["states"] = Json::array();
  for (const StateChange& change : s.states) {
    j["states"].push_back({{"at_s", seconds_of(change.at_s)}, {"state", name_of(change.state)}});
  }
  j["steps_total"] = s.steps_total;
  j["steps_climbed"] = s.steps_climbed;
  const RouteFigures& route = s.route;
  j["goal_reached"] = route.goal_reached ? Json(*route.goal_reached) : Json(nullptr);
  j["footsteps_total"] = s.footsteps.size();
  j["surfaces_stood_on"] = route.surfaces_stood_on;
  j["stood_on_wrongly"] = route.stood_on_wrongly.empty() ? Json(nullptr) : Json(route.stood_on_wrongly);
  j["body_clearance_mm_min"] = mm(route.body_clearance_min_m);
  const bool stood = !std::isnan(s.sole_margin_min_m);
  j["overhang_mm_max"] = stood ? mm(std::max(0.0, -s.sole_margin_min_m)) : Json(nullptr);
  j["stop_sentence"] = s.stop_sentence.empty() ? Json(nullptr) : Json(s.stop_sentence);
  j["climb_time_s"] = seconds_of(s.climb_time_s);
  j["seconds_per_step"] = seconds_of(s.seconds_per_step);
  j["plane_rate_hz"] = rounded(s.plane_rate_hz, 100.0);
  j["execution_error_mm"] = spread_mm(s.execution_error_m);
  j["foothold_error_mm"] = spread_mm(s.foothold_error_m);
  j["foothold_error_mm"]["along"] = spread_mm(s.foothold_error_along_m);
  j["foothold_error_mm"]["across"] = spread_mm(s.foothold_error_across_m);
  j["sole_margin_mm_min"] = mm(s.sole_margin_min_m);
  j["swing_clearance_mm_min"] = mm(s.swing_clearance_min_m);
  j["stand_off_mm"] = mm(s.stand_off_m);
  j["closure_error_mm"] = spread_mm(s.closure_error_m);
  j["tracking_error_mm"] = {{"x_max", mm(s.tracking_error_x_max_m)}, {"z_max", mm(s.tracking_error_z_max_m)}};
  j["com_tracking_mm_max"] = mm(s.com_tracking_max_m);
  j["zmp_margin_mm_min"] = mm(s.zmp_margin_min_m);
  j["torque_peak_ratio"] = per_joint(s.torque_peak_ratio);
  j["torque_limited_ms"] = s.torque_limited_ms;
  j["joint_speed_peak_ratio"] = per_joint(s.joint_speed_peak_ratio);
  const OdometryFigures& o = s.odometry;
  j["odometry_rmse_mm"] = {{"base", mm(o.rmse_base_m)}, {"lio", mm(o.rmse_lio_m)}, {"fused", mm(o.rmse_fused_m)}};
  j["odometry_drift_mm"] = {{"base", mm(o.drift_base_m)}, {"fused", mm(o.drift_fused_m)}};
  j["odometry_jitter_mm"] = {{"lio", mm(o.jitter_lio_m)}, {"fused", mm(o.jitter_fused_m)}};
  j["odometry_nees"] = {{"mean", rounded(o.nees_mean, 100.0)}, {"in_bounds", rounded(o.nees_in_bounds, 1e3)}};
  j["occupied_cells_most"] = s.occupied_cells_most;
  j["exposure_to_map_ms"] = spread_ms(s.exposure_to_map_ms);
  j["map_age_at_latch_ms"] = spread_ms(s.map_age_at_latch_ms);
  j["target_last_seen_ms"] = spread_ms(s.target_last_seen_ms);
  j["heap_calls"] = s.heap_calls;
  j["faults"] = Json::object();
  for (const auto& [name, count] : s.faults) j["faults"][name] = count;

  std::size_t total_bytes = 0;
  Json stages = Json::object();
  for (const StageBytes& stage : s.static_memory) {
    stages[stage.stage] = stage.bytes;
    total_bytes += stage.bytes;
  }
  j["static_memory_bytes"] = total_bytes;
  j["static_memory"] = stages;

  Json schedule = Json::array();
  Json wall_tasks = Json::object();
  for (const ScheduleRow& row : s.schedule) {
    schedule.push_back({{"task", row.task},
                        {"lane", row.lane},
                        {"budget_us", rounded(row.budget_us, 1e3)},
                        {"runs", row.runs},
                        {"overruns", row.overruns}});
    wall_tasks[row.task] = {{"mean_us", rounded(row.wall_mean_us, 1e3)}, {"max_us", rounded(row.wall_max_us, 1e3)}};
  }
  j["schedule"] = schedule;
  const double recall = s.surfaces_in_view > 0
                            ? 1.0 - static_cast<double>(s.surfaces_missed) / static_cast<double>(s.surfaces_in_view)
                            : kNotMeasured;
  j["surfaces"] = {{"frames", s.frames},
                   {"frames_matching", s.frames_matching},
                   {"seen", s.surfaces},
                   {"unmatched", s.surfaces_unmatched},
                   {"in_view", s.surfaces_in_view},
                   {"missed", s.surfaces_missed},
                   {"recall", rounded(recall, 1e4)}};
  Json footsteps = Json::array();
  for (const Footstep& f : s.footsteps) footsteps.push_back(footstep_json(f));
  j["footsteps"] = footsteps;
  j["wall"] = {{"seconds", rounded(s.wall_seconds, 1e3)}, {"tasks", wall_tasks}};
  return j;
}

std::string summary_text(const ClimbSummary& s) {
  return to_json(s).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string verdict_line(const ClimbSummary& s) {
  std::string line = (s.interrupted_by != 0 ? "INTERRUPTED: " : s.pass ? "PASS: " : "FAIL: ") + s.reason;
  if (std::isfinite(s.foothold_error_m.max)) {
    line += format(" Foothold error up to %.1f mm, execution error up to %.1f mm", s.foothold_error_m.max * 1e3,
                   s.execution_error_m.max * 1e3);
    line += format("; planes at %.1f Hz.", s.plane_rate_hz, 0.0);
  }
  return line;
}

}  // namespace polygmap::sim
