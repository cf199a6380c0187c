// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/climb_report.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "algorithms/robot/body_shapes.hpp"
#include "sim_stub/host/output_file.hpp"
#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

constexpr std::int64_t kPast_ns = kNsPerS;        // covers the latest frame
constexpr std::int64_t kRest_ns = 50 * kNsPerMs;  // a sole that stands this long rests
constexpr std::uint64_t kTrailEvery_ticks = 10;   // 20 ms

double ms(std::int64_t duration_ns) { return static_cast<double>(duration_ns) * 1e-6; }

void keep_min(double& least, double value) {
  if (!std::isnan(value) && !(least <= value)) least = value;
}
void keep_max(double& greatest, double value) {
  if (!std::isnan(value) && !(greatest >= value)) greatest = value;
}

// The point seen from a sole: along its heading, across it, up.
Vec3 level_frame_p(const Transform& any_T_sole, const Vec3& any_p_m) {
  return rotation_z(yaw_of(any_T_sole.R)).transpose() * (any_p_m - any_T_sole.p_m);
}

// Along the sole's axis from the nosing to the sole's origin; of a world file's tops, from whichever edge is behind it.
double nosing_distance_m(const StairWorld& world, int step, const Transform& true_T_sole) {
  if (!world.is_staircase) return edge_behind_m(true_T_sole.p_m, yaw_of(true_T_sole.R), world, step);
  const Step& tread = world.steps[static_cast<std::size_t>(step)];
  const Transform step_T_sole = tread.true_T_step.inverse() * true_T_sole;
  return (step_T_sole.p_m.x() - tread.nosing_x_m) / std::cos(yaw_of(step_T_sole.R));
}

}  // namespace

ClimbReport::ClimbReport(StairWorld world, const Transform& true_base_T_camera, const CameraIntrinsics& intrinsics,
                         const SoleModel& true_sole)
    : world_(std::move(world)),
      solids_(solids_of(world_)),
      true_base_T_camera_(true_base_T_camera),
      true_sole_(true_sole),
      visibility_(world_, intrinsics),
      route_(world_),
      climbed_(world_.steps.size(), false) {}

void ClimbReport::observe(const Truth& truth, const Telemetry& telemetry) {
  past_legs_.push_back({truth.stamp_ns, truth.base_legs});
  while (truth.stamp_ns - past_legs_.front().stamp_ns > kPast_ns) past_legs_.pop_front();
  last_stamp_ns_ = truth.stamp_ns;
  if (truth.fell && !fell_) {
    fell_ = true;
    ending_.fall_reason = truth.fall_reason;
  }
  ending_.arming_waits_for = telemetry.arming_waits_for;
  ending_.module_state = telemetry.module_state;
  ending_.phase = telemetry.gait.phase;
  ending_.stop_reason = telemetry.gait.stop_reason;
  ending_.stop_measured_m = telemetry.gait.stop_measured_m;
  odometry_.observe(truth, telemetry.state, telemetry.gait.phase);
  if (odometry_.aligned()) {
    observe_surfaces(telemetry.surfaces);
    observe_map(telemetry);
    observe_footsteps(truth, telemetry);
    observe_tracking(truth, telemetry.gait);
    observe_balance(truth, telemetry);
  }
  route_.observe(truth);
  observe_soles(truth, telemetry.gait.step.onto_tread);
  observe_stance(truth);
  observe_steps_climbed(truth);
  if (ticks_ % kTrailEvery_ticks == 0) observe_trails(truth);
  ++ticks_;
}

void ClimbReport::observe_surfaces(const SurfaceFrame& frame) {
  if (frame.sequence == frame_sequence_ && frame.stamp_ns == frame_stamp_ns_) return;
  frame_sequence_ = frame.sequence;
  frame_stamp_ns_ = frame.stamp_ns;
  ++frames_;
  surfaces_ += frame.surfaces.size();
  const std::optional<Transform> true_T_base = odometry_.true_T_base_at(frame.stamp_ns);
  const auto legs = std::lower_bound(past_legs_.begin(), past_legs_.end(), frame.stamp_ns,
                                     [](const PastLegs& past, std::int64_t stamp) { return past.stamp_ns < stamp; });
  if (!true_T_base || legs == past_legs_.end()) {
    surfaces_unmatched_ += frame.surfaces.size();
    return;
  }
  const Transform true_T_camera = *true_T_base * true_base_T_camera_;
  std::vector<int> found;
  for (const SurfacePatch& patch : frame.surfaces)
    found.push_back(matching_surface(visibility_.surfaces(), patch, true_T_camera));
  const auto unmatched = static_cast<std::uint64_t>(std::count(found.begin(), found.end(), kNoSurface));
  std::uint64_t missed = 0;
  const std::vector<int>& in_view = visibility_.in_view(true_T_camera, true_base_T_camera_, legs->base_legs);
  for (const int id : in_view) missed += std::find(found.begin(), found.end(), id) == found.end() ? 1U : 0U;
  surfaces_unmatched_ += unmatched;
  in_view_ += in_view.size();
  missed_ += missed;
  if (!found.empty() && unmatched == 0 && missed == 0) ++frames_matching_;
}

void ClimbReport::observe_map(const Telemetry& telemetry) {
  const MapSnapshot& map = telemetry.map;
  if (map.stamp_ns == map_stamp_ns_) return;
  map_stamp_ns_ = map.stamp_ns;
  exposure_to_map_ms_.push_back(ms(telemetry.now_ns - map.stamp_ns));
  occupied_cells_most_ = std::max<std::uint64_t>(occupied_cells_most_, map.occupied.size());
  for (auto& [id, seen] : polygons_) seen.remembered = false;
  for (const MapPolygon& polygon : map.polygons) {
    auto& seen = polygons_[polygon.id] = {polygon.surface, true};
    for (Vec3& vertex_m : seen.surface.polygon) vertex_m = odometry_.true_T_odom() * Vec3(vertex_m + map.drift_m);
  }
}

void ClimbReport::observe_footsteps(const Truth& truth, const Telemetry& telemetry) {
  const GaitStatus& gait = telemetry.gait;
  const LatchedStep& step = gait.step;
  if (step.sequence == 0) return;

  if (footsteps_.empty() || footsteps_.back().sequence != step.sequence) {
    Footstep f;
    f.sequence = step.sequence;
    f.foot = step.foot;
    f.onto_tread = step.onto_tread;
    if (step.onto_tread) f.map_age_at_latch_ms = ms(step.latch_stamp_ns - step.map_stamp_ns);
    footsteps_.push_back(f);
    landing_pending_ = true;
    take_target(telemetry);
  } else if (step.target.position_m != target_.position_m) {  // in the air, beside the standing foot instead
    take_target(telemetry);
  }

  Footstep& f = footsteps_.back();
  if (step.touch_down_stamp_ns == 0) return;
  if (std::isnan(f.execution_error_m)) {
    f.execution_error_m = (step.odom_T_executed.p_m - step.odom_T_target.p_m).norm();
    if (f.onto_tread) {
      std::int64_t last_seen_ns = target_.last_seen_ns;
      for (const MapPolygon& polygon : telemetry.map.polygons) {
        if (polygon.id == target_.polygon_id) last_seen_ns = std::max(last_seen_ns, polygon.last_seen_ns);
      }
      f.target_last_seen_ms = ms(step.touch_down_stamp_ns - last_seen_ns);
    }
  }
  // The module may report touch-down before the sole truly stands: the truth is taken when it does.
  if (landing_pending_ && truth.in_contact[index_of(f.foot)]) observe_landing(truth);
}

void ClimbReport::take_target(const Telemetry& telemetry) {
  const LatchedStep& step = telemetry.gait.step;
  target_ = step.target;
  target_mapped_ = step.height_mapped;
  constexpr double kLeastDrop_m = 0.015;
  const Transform& odom_T_foot = telemetry.state.odom_T_sole[index_of(step.foot)];
  target_below_ = step.target.position_m.z() < odom_T_foot.p_m.z() - kLeastDrop_m;
  footsteps_.back().true_T_planned =
      odometry_.true_T_odom() * Transform{rotation_z(step.target.yaw_rad), step.target.position_m};
  const Transform& odom_T_stance = telemetry.state.odom_T_sole[index_of(other(step.foot))];
  latched_across_m_ = level_frame_p(odom_T_stance, step.odom_T_target.p_m).y();
}

void ClimbReport::observe_landing(const Truth& truth) {
  Footstep& f = footsteps_.back();
  const std::size_t foot = index_of(f.foot);
  const Transform& true_T_sole = truth.true_T_sole[foot];
  landing_pending_ = false;
  f.landed = true;
  f.step_index = truth.step_index[foot];
  f.true_T_landed = true_T_sole;
  standing_footstep_[foot] = static_cast<int>(footsteps_.size()) - 1;
  if (!f.onto_tread || world_.steps.empty()) return;

  if (target_mapped_ && f.step_index >= 0) {
    f.along_error_m = target_.nosing_distance_m - nosing_distance_m(world_, f.step_index, true_T_sole);
  } else if (target_mapped_ && !target_below_) {  // down on the floor there is no nosing to measure from
    // It stands on the floor although a tread was meant: the nosing that makes the error least is the meant one.
    for (std::size_t step = 0; step < world_.steps.size(); ++step) {
      const double error_m = target_.nosing_distance_m - nosing_distance_m(world_, static_cast<int>(step), true_T_sole);
      if (!(std::abs(f.along_error_m) <= std::abs(error_m))) f.along_error_m = error_m;
    }
  }
  const Transform& true_T_stance = truth.true_T_sole[index_of(other(f.foot))];
  f.across_error_m = latched_across_m_ - level_frame_p(true_T_stance, true_T_sole.p_m).y();
}

void ClimbReport::observe_tracking(const Truth& truth, const GaitStatus& gait) {
  if (gait.phase != GaitPhase::kSwing) return;
  const std::size_t swing = index_of(gait.step.foot), stance = index_of(other(gait.step.foot));
  const Vec3 desired_m = level_frame_p(gait.odom_T_sole_desired[stance], gait.odom_T_sole_desired[swing].p_m);
  const Vec3 actual_m = level_frame_p(truth.true_T_sole[stance], truth.true_T_sole[swing].p_m);
  keep_max(tracking_x_max_m_, std::abs(desired_m.x() - actual_m.x()));
  keep_max(tracking_z_max_m_, std::abs(desired_m.z() - actual_m.z()));
}

void ClimbReport::observe_balance(const Truth& truth, const Telemetry& telemetry) {
  const GaitStatus& gait = telemetry.gait;
  keep_min(zmp_margin_min_m_, truth.zmp_margin_m);
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const std::size_t j = n % kJointsPerLeg;
    const auto i = static_cast<Eigen::Index>(n);
    const JointLimits& limits = nominal_robot().drives.limits[n];
    keep_max(torque_peak_ratio_[j], std::abs(truth.drive_tau_nm[i]) / limits.torque_nm);
    keep_max(joint_speed_peak_ratio_[j], std::abs(truth.drive_dq_radps[i]) / limits.speed_radps);
  }
  torque_limited_ticks_ += truth.torque_limited ? 1 : 0;
  if (gait.step.sequence == 0) return;  // it may not have begun to balance
  const std::size_t stance = gait.stands[0] ? 0 : 1;
  const Vec2& com_m = gait.odom_p_com_desired_m;
  const Vec3 desired_m = level_frame_p(telemetry.state.odom_T_sole[stance], {com_m.x(), com_m.y(), 0.0});
  const Vec3 actual_m = level_frame_p(truth.true_T_sole[stance], truth.true_p_com_m);
  keep_max(com_tracking_max_m_, (desired_m - actual_m).head<2>().norm());
}

// What a foot that stands there touches by right. What is in the way is no less so where a foot stands on it.
std::vector<int> ClimbReport::beneath_foot(int step) const {
  if (world_.is_staircase) return {std::max(step, kFloorStep)};
  if (step >= 0 && !world_.steps[static_cast<std::size_t>(step)].is_walkable) return {kFloorStep};
  std::vector<int> ones;
  if (world_.are_one(step, kFloorStep)) ones.push_back(kFloorStep);
  for (int other = 0; other < static_cast<int>(world_.steps.size()); ++other) {
    if (world_.are_one(step, other)) ones.push_back(other);
  }
  return ones;
}

double ClimbReport::flight_clearance_m(const Flight& flight, int to_step, double at_most_m) const {
  std::vector<int> excluded = beneath_foot(flight.from_step);
  const std::vector<int> landed_on = beneath_foot(to_step);
  excluded.insert(excluded.end(), landed_on.begin(), landed_on.end());
  for (const Transform& true_T_sole : flight.true_T_sole) {
    at_most_m = clearance_m(collision_box(true_sole_, true_T_sole), solids_, excluded, at_most_m);
  }
  return at_most_m;
}

void ClimbReport::observe_soles(const Truth& truth, bool onto_tread) {
  flight_onto_tread_ = onto_tread;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const Transform& true_T_sole = truth.true_T_sole[foot];
    if (!truth.in_contact[foot]) {
      swung_ = true;
      if (!flights_[foot]) flights_[foot] = Flight{last_step_[foot], truth.stamp_ns, {}};
      flights_[foot]->true_T_sole.push_back(true_T_sole);
      standing_footstep_[foot] = -1;
      continue;
    }
    const int step = truth.step_index[foot];
    if (flights_[foot]) {
      if (step >= 0 && first_lift_off_ns_ < 0) first_lift_off_ns_ = flights_[foot]->lift_off_ns;
      const double flight_m = flight_clearance_m(*flights_[foot], step, std::numeric_limits<double>::infinity());
      clearance_min_m_ = std::min(clearance_min_m_, flight_m);
      if (!footsteps_.empty() && index_of(footsteps_.back().foot) == foot) {
        keep_min(footsteps_.back().swing_clearance_m, flight_m);
      }
      flights_[foot].reset();
      landed_ns_[foot] = truth.stamp_ns;
      // It was in the air for a moment once more: it still stands where that footstep has landed.
      const bool has_landed =
          !footsteps_.empty() && index_of(footsteps_.back().foot) == foot && footsteps_.back().landed;
      if (has_landed) standing_footstep_[foot] = static_cast<int>(footsteps_.size()) - 1;
    }
    last_step_[foot] = step;
    clearance_min_m_ =
        clearance_m(collision_box(true_sole_, true_T_sole), solids_, beneath_foot(step), clearance_min_m_);
    if (step < 0 || truth.stamp_ns - landed_ns_[foot] < kRest_ns) continue;
    constexpr std::uint64_t kMarginEvery_ticks = 5;  // of a world file, where it takes longer
    if (!world_.is_staircase && ticks_ % kMarginEvery_ticks != 0) continue;
    const double margin_m = world_.is_staircase ? sole_margin_m(true_T_sole, world_, step, true_sole_)
                                                : margin_on_tops_m(true_T_sole, world_, step, true_sole_);
    if (std::isinf(margin_m)) continue;  // the floor has no edge
    keep_min(sole_margin_min_m_, margin_m);
    const int footstep = standing_footstep_[foot];
    if (footstep >= 0) keep_min(footsteps_[static_cast<std::size_t>(footstep)].sole_margin_m, margin_m);
  }
}

void ClimbReport::observe_stance(const Truth& truth) {
  if (!truth.in_contact[0] || !truth.in_contact[1]) return;
  closure_error_m_.push_back(truth.closure_error_m);
  if (!world_.is_staircase || world_.steps.empty() || first_lift_off_ns_ >= 0) return;
  double toe_x_m = -std::numeric_limits<double>::infinity();
  for (const Transform& true_T_sole : truth.true_T_sole) {
    const OrientedBox box = collision_box(true_sole_, world_.steps.front().true_T_step.inverse() * true_T_sole);
    toe_x_m = std::max(toe_x_m, box.centre.p_m.x() + box.centre.R.row(0).cwiseAbs().dot(box.half_m));
  }
  stand_off_m_ = world_.steps.front().nosing_x_m - toe_x_m;
}

void ClimbReport::observe_steps_climbed(const Truth& truth) {
  if (!world_.is_staircase) return;
  const int step = std::min(truth.step_index[0], truth.step_index[1]);
  bool rests = step >= 0 && truth.in_contact[0] && truth.in_contact[1];
  for (std::size_t foot = 0; rests && foot < kFootCount; ++foot) {
    rests = sole_margin_m(truth.true_T_sole[foot], world_, truth.step_index[foot], true_sole_) >= 0.0;
  }
  if (!rests) {
    resting_step_ = -1;
    return;
  }
  if (step != resting_step_) {
    resting_step_ = step;
    resting_since_ns_ = truth.stamp_ns;
  }
  const auto index = static_cast<std::size_t>(step);
  if (truth.stamp_ns - resting_since_ns_ < kRest_ns || climbed_[index]) return;
  climbed_[index] = true;
  ++steps_climbed_;
  if (index + 1 == world_.steps.size()) on_top_ns_ = resting_since_ns_;
}

void ClimbReport::observe_trails(const Truth& truth) {
  base_trail_m_.push_back(truth.true_T_base.p_m);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) sole_trail_m_[foot].push_back(truth.true_T_sole[foot].p_m);
}

int ClimbReport::meant_step(Foot foot, const Flight& flight) const {
  if (!flight_onto_tread_) return flight.from_step;
  if (footsteps_.empty() || footsteps_.back().foot != foot) return flight.from_step + 1;
  const auto off_m = [this](const Step& step) {
    const Vec3& planned_m = footsteps_.back().true_T_planned.p_m;
    if (world_.is_staircase) return std::abs(planned_m.z() - step.height_m);
    if (!step.is_walkable) return std::numeric_limits<double>::infinity();
    const Vec3 p_m = step.true_T_step.inverse() * planned_m;
    return std::max({std::abs(p_m.z()), std::abs(p_m.x()) - step.back_x_m, std::abs(p_m.y()) - step.half_width_m});
  };
  const auto nearest = std::ranges::min_element(world_.steps, {}, off_m);
  return nearest == world_.steps.end() ? kFloorStep : static_cast<int>(nearest - world_.steps.begin());
}

double ClimbReport::clearance_min_m() const {
  if (!swung_) return kNotMeasured;  // the feet stand clear of the stairs, which says nothing
  double least_m = clearance_min_m_;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const std::optional<Flight>& flight = flights_[index_of(foot)];
    if (flight) least_m = flight_clearance_m(*flight, meant_step(foot, *flight), least_m);  // the run ended in the air
  }
  return std::isinf(least_m) ? kNotMeasured : least_m;
}

ClimbSummary ClimbReport::finish(const RunFigures& run) const {
  ClimbSummary s;
  s.options = run.options;
  s.params_hash = run.params_hash;
  s.bus = run.bus;
  s.camera = run.camera;
  s.fell = fell_;
  s.steps_total = world_.is_staircase ? static_cast<int>(world_.steps.size()) : 0;
  s.route = route_.figures();
  s.steps_climbed = steps_climbed_;
  const bool module_ended = ending_.phase == GaitPhase::kFinished || ending_.phase == GaitPhase::kStopped ||
                            ending_.module_state == ModuleState::kFallen || ending_.arming_waits_for.leans();
  const bool operator_ended = run.operator_end != OperatorEnd::kNone;
  s.ended_at_s = seconds(last_stamp_ns_);
  s.interrupted_by = fell_ || module_ended ? 0 : run.interrupted_by;
  s.ended_by = fell_                   ? "fall"
               : module_ended          ? "module"
               : s.interrupted_by != 0 ? "interrupted"
               : operator_ended        ? "operator"
                                       : "time limit";
  if (on_top_ns_ >= 0 && first_lift_off_ns_ >= 0) {
    s.climb_time_s = seconds(on_top_ns_ - first_lift_off_ns_);
    s.seconds_per_step = s.climb_time_s / s.steps_total;
  }
  if (!world_.is_staircase) s.seconds_per_step = s.route.seconds_per_surface;

  const double run_s = odometry_.aligned() ? seconds(last_stamp_ns_ - odometry_.aligned_stamp_ns()) : 0.0;
  s.plane_rate_hz = run_s > 0.0 ? static_cast<double>(frames_matching_) / run_s : 0.0;
  s.frames = frames_;
  s.frames_matching = frames_matching_;
  s.surfaces = surfaces_;
  s.surfaces_unmatched = surfaces_unmatched_;
  s.surfaces_in_view = in_view_;
  s.surfaces_missed = missed_;

  std::vector<double> execution, foothold, along, across, map_age, last_seen;
  for (const Footstep& f : footsteps_) {
    if (!f.onto_tread) continue;
    map_age.push_back(f.map_age_at_latch_ms);
    if (!std::isnan(f.execution_error_m)) {
      execution.push_back(f.execution_error_m);
      last_seen.push_back(f.target_last_seen_ms);
    }
    if (!f.landed) continue;
    across.push_back(std::abs(f.across_error_m));
    if (!std::isnan(f.along_error_m)) along.push_back(std::abs(f.along_error_m));
    foothold.push_back(std::fmax(std::abs(f.along_error_m), across.back()));  // of one that is no number: the other
  }
  s.execution_error_m = spread_of(execution);
  s.foothold_error_m = spread_of(foothold);
  s.foothold_error_along_m = spread_of(along);
  s.foothold_error_across_m = spread_of(across);
  s.map_age_at_latch_ms = spread_of(map_age);
  s.target_last_seen_ms = spread_of(last_seen);
  s.occupied_cells_most = occupied_cells_most_;
  s.exposure_to_map_ms = spread_of(exposure_to_map_ms_);
  s.sole_margin_min_m = sole_margin_min_m_;
  s.swing_clearance_min_m = clearance_min_m();
  s.stand_off_m = stand_off_m_;
  s.closure_error_m = spread_of(closure_error_m_);
  s.tracking_error_x_max_m = tracking_x_max_m_;
  s.tracking_error_z_max_m = tracking_z_max_m_;
  s.com_tracking_max_m = com_tracking_max_m_;
  s.zmp_margin_min_m = zmp_margin_min_m_;
  s.torque_peak_ratio = torque_peak_ratio_;
  s.torque_limited_ms = ms(torque_limited_ticks_ * kCycle_ns);
  s.joint_speed_peak_ratio = joint_speed_peak_ratio_;
  s.odometry = odometry_.figures();

  s.heap_calls = run.heap_calls;
  s.faults = run.faults;
  s.states = run.states;
  for (const StageMemory& stage : run.static_memory) s.static_memory.push_back({stage.stage, stage.bytes});
  s.schedule = run.schedule;
  s.footsteps = footsteps_;
  s.wall_seconds = run.wall_seconds;

  ClimbEnding ending = ending_;
  ending.heap_first_caller = run.heap_first_caller;
  ending.operator_end = run.operator_end;
  judge(s, ending);
  return s;
}

ClimbDrawing ClimbReport::drawing() const {
  ClimbDrawing d;
  for (const auto& [id, seen] : polygons_) {
    ClimbDrawing::Polygon polygon{seen.surface.kind, {}, seen.remembered};
    for (const Vec3& vertex_m : seen.surface.polygon) polygon.vertices_m.push_back(vertex_m);
    d.polygons.push_back(std::move(polygon));
  }
  d.base_trail_m = base_trail_m_;
  d.sole_trail_m = sole_trail_m_;
  return d;
}

void write_climb_files(const std::string& directory, const ClimbReport& report, const ClimbSummary& summary) {
  write_output(directory + "/summary.json", summary_text(summary));
  write_output(directory + "/climb.svg", climb_svg(report.world(), report.drawing(), summary));
}

}  // namespace polygmap::sim
