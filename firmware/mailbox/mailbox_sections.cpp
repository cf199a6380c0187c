// SPDX-License-Identifier: Apache-2.0
#include "firmware/mailbox/mailbox_sections.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "algorithms/core/math/transform.hpp"

namespace polygmap {
namespace {

void put(double (&to)[3], const Vec3& v) noexcept {
  for (Eigen::Index i = 0; i < 3; ++i) to[i] = v[i];
}
void put(double (&to)[4], const Mat3& R) noexcept {
  const Eigen::Quaterniond q(R);
  to[0] = q.w();
  to[1] = q.x();
  to[2] = q.y();
  to[3] = q.z();
}

void put(polygmap_mailbox_foothold& to, const Foothold& foothold, bool valid) noexcept {
  put(to.odom_p_sole_m, foothold.position_m);
  to.odom_yaw_rad = foothold.yaw_rad;
  to.clearance_m = foothold.clearance_m;
  to.toe_clearance_m = foothold.toe_clearance_m;
  to.polygon_id = foothold.polygon_id;
  to.valid = valid ? 1U : 0U;
}

void put_name(polygmap_mailbox_name& to, std::string_view name) noexcept {
  const std::size_t length = std::min(name.size(), sizeof to.text - 1);
  std::memcpy(to.text, name.data(), length);
}
template <std::size_t Most>
void put_names(polygmap_mailbox_name (&to)[Most], const auto& table) noexcept {
  static_assert(std::tuple_size_v<std::remove_cvref_t<decltype(table)>> < Most, "the list of names is too short");
  for (std::size_t i = 0; i < table.size(); ++i) put_name(to[i], table[i].name);
}

constexpr std::array<std::string_view, 10> kArmingWaitNames{
    "nothing", "answers_of_drives",   "drive_errors",   "hot_drives",       "joints_out_of_range", "imu_samples",
    "feet",    "strength_of_gravity", "soles_disagree", "gravity_disagrees"};
static_assert(kArmingWaitNames.size() == static_cast<std::size_t>(ArmingWait::For::kGravity) + 1);

}  // namespace

void fill(polygmap_mailbox_names& names) noexcept {
  names = {};
  put_names(names.module_states, kModuleStateTable);
  put_names(names.stop_reasons, kStopReasonTable);
  for (std::size_t i = 0; i <= static_cast<std::size_t>(GaitPhase::kStopped); ++i) {
    put_name(names.gait_phases[i], name_of(static_cast<GaitPhase>(i)));
  }
  for (std::size_t i = 0; i < kArmingWaitNames.size(); ++i) put_name(names.arming_waits[i], kArmingWaitNames[i]);
  static_assert(kSchedule.size() <= POLYGMAP_MAILBOX_ROWS);
  for (std::size_t row = 0; row < kSchedule.size(); ++row) {
    put_name(names.rows[row], kSchedule[row].task);
    names.row_budgets_us[row] = kSchedule[row].budget_us;
  }
  static_assert(kFaultTable.size() + kLimitTable.size() < POLYGMAP_MAILBOX_EVENTS);
  std::size_t at = 0;
  const auto put_events = [&](const auto& table) {
    for (const auto& line : table) {
      put_name(names.events[at], line.name);
      names.event_numbers[at++] = static_cast<std::uint16_t>(line.number());
    }
  };
  put_events(kFaultTable);
  put_events(kLimitTable);
}

void fill(polygmap_mailbox_pose& pose, const StateEstimate& state) noexcept {
  pose.stamp_ns = state.stamp_ns;
  put(pose.odom_p_base_m, state.odom_T_base.p_m);
  put(pose.odom_q_base, state.odom_T_base.R);
  put(pose.world_p_odom_m, state.world_T_odom.p_m);
  put(pose.world_q_odom, state.world_T_odom.R);
  put(pose.odom_v_base_mps, state.odom_v_base_mps);
  put(pose.base_w_base_radps, state.base_w_base_radps);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    put(pose.odom_p_sole_m[foot], state.odom_T_sole[foot].p_m);
    put(pose.odom_q_sole[foot], state.odom_T_sole[foot].R);
    pose.contact_probability[foot] = state.contact_probability[foot];
  }
  static_assert(kFootCount == POLYGMAP_MAILBOX_FEET && kJointCount == POLYGMAP_MAILBOX_JOINTS);
  for (std::size_t n = 0; n < kJointCount; ++n) pose.q_rad[n] = state.q_rad[static_cast<Eigen::Index>(n)];
  put(pose.world_p_base_sigma_m, state.position_sigma_m);
  put(pose.odom_v_base_sigma_mps, state.velocity_sigma_mps);
  pose.odom_p_base_sigma_m = state.odom_sigma_m;
  pose.yaw_sigma_rad = state.yaw_sigma_rad;
  pose.tilt_sigma_rad = state.tilt_sigma_rad;
  pose.initialised = state.initialised ? 1U : 0U;
  pose.reserved = 0;
}

void fill(polygmap_mailbox_status& status, const ControlLane& control, const Telemetry& telemetry,
          std::uint64_t cycles) noexcept {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const GaitStatus& gait = telemetry.gait;
  const StateEstimate& state = telemetry.state;
  const FootholdSet& found = control.footholds();
  const DriveReport& drives = telemetry.drives;
  status.stamp_ns = telemetry.now_ns;
  status.cycles = cycles;
  status.module_state = static_cast<std::uint32_t>(telemetry.module_state);
  status.gait_phase = static_cast<std::uint32_t>(gait.phase);
  status.stop_reason = static_cast<std::uint32_t>(gait.stop_reason);
  status.treads_climbed = gait.treads_climbed;
  status.step_sequence = gait.step.sequence;
  status.step_foot = static_cast<std::uint32_t>(gait.step.foot);
  status.step_onto_tread = gait.step.onto_tread ? 1U : 0U;
  status.joints_silent = drives.silent.bits();
  status.joints_in_error = drives.bus.drive_errors.bits();
  status.joints_hot = drives.hot.bits();
  status.arming_wait = static_cast<std::uint32_t>(telemetry.arming_waits_for.what);
  status.picture_stamp_ns = telemetry.surfaces.stamp_ns;
  status.map_stamp_ns = telemetry.map.stamp_ns;
  status.lio_stamp_ns = state.lio_age_ns < 0 ? 0 : state.stamp_ns - state.lio_age_ns;
  for (std::size_t foot = 0; foot < kFootCount; ++foot)
    put(status.next[foot], found.p_star_feet[foot], found.has_p_star);
  status.way_reason = static_cast<std::uint32_t>(found.obstruction);
  status.measured_rise_m = found.obstruction == StopReason::kNothingSeen ? kUnknown : found.measured_rise_m;
  status.measured_tread_m = found.measured_tread_m > 0.0 ? found.measured_tread_m : kUnknown;
}

void fill(polygmap_mailbox_events& events, const Health& health, std::int64_t now_ns) noexcept {
  events = {};
  events.stamp_ns = now_ns;
  std::size_t at = 0;
  for (const EventCount& fault : health.counts<Fault>()) events.count[at++] = fault.count;
  for (const EventCount& limit : health.counts<Limit>()) events.count[at++] = limit.count;
}

}  // namespace polygmap
