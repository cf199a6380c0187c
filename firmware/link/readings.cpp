// SPDX-License-Identifier: Apache-2.0
#include "firmware/link/readings.hpp"

#include <algorithm>

namespace polygmap::link {
namespace {

static_assert(POLYGMAP_STATE_RELEASED == static_cast<int>(ModuleState::kReleased));
static_assert(POLYGMAP_PHASE_STOPPED == static_cast<int>(GaitPhase::kStopped));
static_assert(POLYGMAP_MAX_FAULTS >= kFaultTable.size() + kLimitTable.size());

polygmap_arming arming_of(const ArmingWait& wait) noexcept {
  return {static_cast<std::int32_t>(wait.what), wait.joints.bits(), wait.lean_deg};
}
polygmap_drives drives_of(const DriveReport& drives) noexcept {
  return {drives.silent.bits(), drives.bus.drive_errors.bits(), drives.hot.bits()};
}
polygmap_answer answer_of(const PushedOperator::Answered& answered) noexcept {
  if (answered.count == 0) return {};
  return {answered.count, static_cast<std::int32_t>(answered.command) + POLYGMAP_OPERATE_ARM,
          static_cast<std::int32_t>(answered.answer.refusal), answered.answer.joints.bits()};
}
polygmap_cycles cycles_of(const Instance& instance) noexcept {
  const LaneStatistics& lane = instance.executive->lane_statistics();
  const std::int64_t next_ns = instance.clock.runs() ? instance.clock.to_caller(instance.executive->next_due_ns()) : 0;
  return {next_ns, lane.cycles, lane.slips, lane.caught_up};
}

template <class Code>
void append_raised(const Instance& instance, const auto& table, polygmap_faults& to) noexcept {
  for (const EventInfo<Code>& line : table) {
    const EventCount raised = instance.pipeline->health().count(line.code);
    if (raised.count == 0) continue;
    to.fault[to.count++] = {line.number(), raised.count, instance.clock.to_caller(raised.first_ns),
                            instance.clock.to_caller(raised.last_ns)};
  }
}

// A line of a table, where the number has one.
template <class Line, std::size_t N>
[[nodiscard]] const Line* line_of(const std::array<Line, N>& table, int number) noexcept {
  return number >= 0 && number < static_cast<int>(N) ? &table[static_cast<std::size_t>(number)] : nullptr;
}
[[nodiscard]] const EventInfo<Fault>* fault_of(int number) noexcept {
  const auto line = std::ranges::find(kFaultTable, number, &EventInfo<Fault>::number);
  return line == kFaultTable.end() ? nullptr : &*line;
}
[[nodiscard]] const EventInfo<Limit>* limit_of(int number) noexcept {
  const auto line = std::ranges::find(kLimitTable, number, &EventInfo<Limit>::number);
  return line == kLimitTable.end() ? nullptr : &*line;
}
constexpr const char* kUnknown = "unknown";

}  // namespace

bool read_command(const Instance& instance, polygmap_command& to) noexcept {
  const JointCommand* command = instance.joints.command();
  if (command == nullptr) return false;
  to.stamp_ns = instance.clock.to_caller(command->stamp_ns);
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const JointSetpoint& joint = command->joints[n];
    to.q_rad[n] = joint.q_rad;
    to.dq_radps[n] = joint.dq_radps;
    to.tau_ff_nm[n] = joint.tau_ff_nm;
    to.kp_nmprad[n] = joint.kp_nmprad;
    to.kd_nmsprad[n] = joint.kd_nmsprad;
  }
  return true;
}

bool read_pose(const Instance& instance, polygmap_pose& to) noexcept {
  const StateEstimate& state = instance.pipeline->control().state();
  if (state.stamp_ns == 0) return false;
  to.initialised = state.initialised ? 1 : 0;
  to.stamp_ns = instance.clock.to_caller(state.stamp_ns);
  to.oldest_input_ns = instance.clock.to_caller_or_0(state.oldest_input_ns);
  to.lio_age_ns = state.lio_age_ns;
  to.odom_T_base = transform_of(state.odom_T_base);
  copy(state.odom_v_base_mps, to.odom_v_base_mps);
  copy(state.base_w_base_radps, to.base_w_base_radps);
  to.world_T_base = transform_of(state.world_T_base());
  to.world_T_odom = transform_of(state.world_T_odom);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    to.odom_T_sole[foot] = transform_of(state.odom_T_sole[foot]);
    to.contact_probability[foot] = state.contact_probability[foot];
  }
  copy(state.position_sigma_m, to.position_sigma_m);
  copy(state.velocity_sigma_mps, to.velocity_sigma_mps);
  to.odom_sigma_m = state.odom_sigma_m;
  to.yaw_sigma_rad = state.yaw_sigma_rad;
  to.tilt_sigma_rad = state.tilt_sigma_rad;
  const auto& covariance = instance.pipeline->control().estimator().quality().covariance;
  for (int row = 0; row < 9; ++row) {
    for (int column = 0; column < 9; ++column) to.covariance[row][column] = covariance(row, column);
  }
  return true;
}

bool read_status(const Instance& instance, polygmap_status& to) noexcept {
  const ControlLane& control = instance.pipeline->control();
  const GaitStatus& gait = control.gait_status();
  const bool any = instance.executive->lane_statistics().cycles > 0;
  to.state = static_cast<std::int32_t>(control.module_state());
  to.stamp_ns = any ? instance.clock.to_caller(instance.executive->last_cycle().due_ns) : 0;
  to.phase = static_cast<std::int32_t>(gait.phase);
  to.stop_reason = static_cast<std::int32_t>(gait.stop_reason);
  to.stop_measured_m = gait.stop_measured_m;
  to.treads_climbed = gait.treads_climbed;
  to.arming = arming_of(control.arming_waits_for());
  to.drives = drives_of(control.drives());
  to.answer = answer_of(instance.operations.answered());
  to.dropped = {instance.imu.queue.dropped(), instance.lio.queue.dropped(), instance.depth.dropped()};
  to.cycles = cycles_of(instance);
  return true;
}

bool read_faults(const Instance& instance, polygmap_faults& to) noexcept {
  to.count = 0;
  append_raised<Fault>(instance, kFaultTable, to);
  append_raised<Limit>(instance, kLimitTable, to);
  std::fill(std::begin(to.fault) + to.count, std::end(to.fault), polygmap_fault{});
  return true;
}

}  // namespace polygmap::link

// Texts of the module's tables; all of them are literals, which end in a null.

const char* polygmap_state_name(int state) {
  const auto* line = polygmap::link::line_of(polygmap::kModuleStateTable, state);
  return line == nullptr ? polygmap::link::kUnknown : line->name.data();
}
const char* polygmap_stop_reason_name(int stop_reason) {
  const auto* line = polygmap::link::line_of(polygmap::kStopReasonTable, stop_reason);
  return line == nullptr ? polygmap::link::kUnknown : line->name.data();
}
const char* polygmap_stop_reason_text(int stop_reason) {
  const auto* line = polygmap::link::line_of(polygmap::kStopReasonTable, stop_reason);
  return line == nullptr ? polygmap::link::kUnknown : line->text.data();
}
const char* polygmap_arming_text(int arming_wait) {
  constexpr int kLast = static_cast<int>(polygmap::ArmingWait::For::kGravity);
  if (arming_wait < 0 || arming_wait > kLast) return polygmap::link::kUnknown;
  return polygmap::text_of(static_cast<polygmap::ArmingWait::For>(arming_wait)).data();
}
const char* polygmap_refusal_text(int refusal) {
  if (refusal == static_cast<int>(polygmap::Refusal::kState)) return "the state has no answer to it";
  if (refusal < 0 || refusal > static_cast<int>(polygmap::Refusal::kJointsAway)) return polygmap::link::kUnknown;
  return polygmap::text_of(static_cast<polygmap::Refusal>(refusal)).data();
}
const char* polygmap_joint_name(int joint) {
  const auto* name = polygmap::link::line_of(polygmap::kJointNames, joint);
  return name == nullptr ? polygmap::link::kUnknown : name->data();
}
const char* polygmap_fault_name(int number) {
  if (const auto* fault = polygmap::link::fault_of(number)) return fault->name.data();
  if (const auto* limit = polygmap::link::limit_of(number)) return limit->name.data();
  return polygmap::link::kUnknown;
}
const char* polygmap_fault_text(int number) {
  if (const auto* fault = polygmap::link::fault_of(number)) return fault->text.data();
  if (const auto* limit = polygmap::link::limit_of(number)) return limit->text.data();
  return polygmap::link::kUnknown;
}
