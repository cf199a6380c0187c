// SPDX-License-Identifier: Apache-2.0
#include "firmware/control_lane.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "firmware/sensor_reading.hpp"
#include "scheduler/schedule_table.hpp"

namespace polygmap {
namespace {

// A sensor that delivers every cycle is missing when nothing came and its newest sample is at least this old. Cycles
// that catch up find everything read by the first of them; for a latency below one cycle none of them is misled.
constexpr std::int64_t kMissing_ns = kCycle_ns;
// The same of one that delivers less often: what was due within a cycle is read by the next.
[[nodiscard]] constexpr std::int64_t missing_after_ns(std::int64_t interval_ns) noexcept {
  return interval_ns <= kCycle_ns ? kMissing_ns : interval_ns + kCycle_ns;
}
constexpr std::int64_t kLioTimeout_ns = 2 * kNsPerS;  // twenty poses
// Drives and the feet's board take less to start, and are asked in every cycle of it.
constexpr std::int64_t kArmingTimeout_ns = kNsPerS / 2;

bool all_finite(const JointCommand& command) noexcept {
  for (const JointSetpoint& joint : command.joints) {
    for (const double x : {joint.q_rad, joint.dq_radps, joint.tau_ff_nm, joint.kp_nmprad, joint.kd_nmsprad}) {
      if (!std::isfinite(x)) return false;
    }
  }
  return true;
}

JointSet silent_drives(const JointFeedback& joints) noexcept {
  JointSet silent;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (joints.is_mute(n)) silent.insert(n);
  }
  return silent;
}

std::uint32_t imu_rejections(const Estimator::Counters& counters) noexcept {
  return counters.imu_invalid + counters.imu_stale + counters.imu_future;
}
std::uint32_t joint_rejections(const LegSensing::Counters& counters) noexcept {
  return counters.invalid + counters.stale + counters.future + counters.jump;
}
std::uint32_t lio_rejections(const Estimator::Counters& counters) noexcept {
  return std::accumulate(counters.lio.begin(), counters.lio.end(), 0U) - counters.lio_of(LioVerdict::kAccepted) -
         counters.lio_of(LioVerdict::kRealigned);
}

}  // namespace

ControlLane::ControlLane(const ControlPorts& ports, ControlPerceptionLink& link, LaneHealths& health,
                         const Params& params) noexcept
    : ports_(ports), link_(link), healths_(health), health_(health[kControlLane].own), params_(params) {
  estimator_.reset(params.estimator, params.robot);
  Gait::Params gait = params.gait;
  if (!params.estimate_mount) gait.standing.toe_calibration.ticks = 0;
  gait_.reset(gait, params.robot);
  supervisor_.reset(params.supervisor);
}

Progress ControlLane::sense(std::int64_t now_ns) noexcept {
  if (start_.first_ns < 0) imu_came_ns_ = now_ns;
  // Before it is to arm nobody is waited for.
  if (start_.first_ns < 0 || !supervisor_.may_arm()) start_.first_ns = now_ns;
  look_across(now_ns);
  read_operator(now_ns);
  sense_imu(now_ns);
  read_joints(now_ns);
  return Progress::kDone;
}

void ControlLane::read_operator(std::int64_t now_ns) noexcept {
  OperatorRequest request;
  if (ports_.operator_input == nullptr || !ports_.operator_input->try_read(request)) return;
  const OperatorAnswer answer = obey(request, now_ns);
  if (!answer.is_obeyed()) health_.raise(Limit::kOperatorRefused, now_ns);
  ports_.operator_input->answer(answer);
}

OperatorAnswer ControlLane::obey(const OperatorRequest& request, std::int64_t now_ns) noexcept {
  const OperatorCommand command = request.command;
  const ModuleState state = module_state();
  if (!Supervisor::answers(state, command)) return {Refusal::kState, {}};
  if (command == OperatorCommand::kGoTo && !request.destination.is_valid()) return {Refusal::kNoPlace, {}};
  // At its goal it may be sent on at once.
  const bool goes_on = command == OperatorCommand::kGoTo && state == ModuleState::kOnTop;
  if (command == OperatorCommand::kReset || goes_on) {
    if (const OperatorAnswer answer = answer_to_reset(now_ns); !answer.is_obeyed()) return answer;
    const JointVector& q_rad = estimator_.state().q_rad;
    if (!gait_.try_restart(q_rad)) return {Refusal::kJointsAway, gait_.joints_away(q_rad)};
    overload_ = {};
  }
  if (command == OperatorCommand::kHandOver) {
    if (const OperatorAnswer answer = answer_if_it_stands(now_ns); !answer.is_obeyed()) return answer;
    hand_over_.begin();
  }
  if (command == OperatorCommand::kGoTo) gait_.go_to(request.destination);
  if (command == OperatorCommand::kStart) gait_.climb();
  supervisor_.obey(command, state);
  const bool ends = command == OperatorCommand::kStop && state != ModuleState::kArming;
  const bool stands_on = command == OperatorCommand::kHandOver && state == ModuleState::kStanding;
  if (ends || stands_on) gait_.request_stop(StopReason::kOperator);
  return {};
}

// What may have stopped it is over, and both feet carry: one that a mute knee kept up counts as standing only until the
// drive speaks again.
OperatorAnswer ControlLane::answer_to_reset(std::int64_t now_ns) const noexcept {
  if (!drives_.silent.is_empty()) return {Refusal::kDrivesSilent, drives_.silent};
  if (!drives_.bus.drive_errors.is_empty()) return {Refusal::kDrivesInError, drives_.bus.drive_errors};
  if (!drives_.hot.is_empty()) return {Refusal::kDrivesHot, drives_.hot};
  return answer_if_it_stands(now_ns);
}

OperatorAnswer ControlLane::answer_if_it_stands(std::int64_t now_ns) const noexcept {
  constexpr double kStands = 0.5;  // probability
  const StateEstimate& state = estimator_.state();
  if (!drives_.silent.is_empty()) return {Refusal::kDrivesSilent, drives_.silent};
  if (!overload_.takes_commands()) return {Refusal::kCommandRefused, {}};
  if (!(now_ns - state.oldest_input_ns <= params_.gait.steer_age_ns)) return {Refusal::kEstimateStale, {}};
  const bool carry = state.contact_probability[0] > kStands && state.contact_probability[1] > kStands;
  return {carry ? Refusal::kNone : Refusal::kFootLifted, {}};
}

// One that came and was rejected is not missing, too.
void ControlLane::sense_imu(std::int64_t now_ns) noexcept {
  if (read_imu(ports_.imu, now_ns, estimator_)) {
    imu_came_ns_ = now_ns;
    return;
  }
  const std::int64_t silent_ns = now_ns - std::max(estimator_.newest_imu_ns(), imu_came_ns_);
  if (silent_ns >= missing_after_ns(params_.imu_interval_ns)) health_.raise(Fault::kImuMissing, now_ns);
}

void ControlLane::read_joints(std::int64_t now_ns) noexcept {
  const bool was_asked = command_.stamp_ns != 0;  // a drive answers a command
  JointFeedback joints;
  const bool came = ports_.joints.try_read(joints);
  if (supervisor_.has_let_go()) return;  // they answer another's commands
  if (!gait_.armed()) {
    arm(came ? &joints : nullptr, now_ns);
  } else if (came) {
    note_silent_drives(silent_drives(joints), now_ns);
    estimator_.add_joints(joints, now_ns);
  }
  if (!came && was_asked && now_ns - estimator_.leg_sensing().joints().stamp_ns >= kMissing_ns) {
    health_.raise(Fault::kJointFeedbackMissing, now_ns);
  }
}

// The estimator hears of the joints no sooner: what it learnt from a robot that is being put down would be wrong.
void ControlLane::arm(const JointFeedback* joints, std::int64_t now_ns) noexcept {
  const JointSet late = late_drives(joints, now_ns);
  drives_.bus = ports_.joints.status();
  note_hot_drives(now_ns);
  if (joints != nullptr) {
    const JointSet outside = JointReference::out_of_range(params_.robot, params_.gait.joints, joints->q_rad);
    note_out_of_range(JointSet::of_bits(outside.bits() & ~late.bits()), now_ns);
  }
  const std::int64_t imu_ns = estimator_.newest_imu_ns();
  const bool hears_imu = imu_ns != 0 && now_ns - imu_ns <= params_.gait.steer_age_ns;
  start_.imu_settled = hears_imu && estimator_.resting_accel().is_settled();
  if (now_ns - start_.first_ns >= kArmingTimeout_ns) note_silent_drives(start_.silent, now_ns);
  if (!late.is_empty() || !drives_.bus.drive_errors.is_empty() || !drives_.out_of_range.is_empty()) return;
  if (!drives_.hot.is_empty() || drives_.bus.feet_silent) return;
  if (!start_.imu_settled || gait_.stop_requested() || !supervisor_.may_arm()) return;
  if (check_stance(joints->q_rad, now_ns)) estimator_.add_joints(*joints, now_ns);
}

// A robot that balances by another gravity than the true one falls with its first step, or before.
bool ControlLane::check_stance(const JointVector& q_rad, std::int64_t now_ns) noexcept {
  using For = ArmingWait::For;
  const auto [soles_rad, gravity_rad] =
      StanceCheck::leans(params_.robot.legs, q_rad, estimator_.resting_accel().mean_mps2());
  const auto wait_for = [](For what, double lean_rad) {
    return ArmingWait{what, {}, static_cast<std::uint16_t>(lean_rad * 180.0 / kPi + 0.5)};
  };
  start_.disagreement = {};
  if (!(gravity_rad <= params_.stance.most_gravity_rad)) start_.disagreement = wait_for(For::kGravity, gravity_rad);
  if (!(soles_rad <= params_.stance.most_soles_rad)) start_.disagreement = wait_for(For::kSoles, soles_rad);
  const double felt_mps2 = estimator_.resting_accel().mean_mps2().norm();
  if (!(std::abs(felt_mps2 - kGravity_mps2) <= params_.stance.most_strength_mps2)) {
    start_.disagreement = wait_for(For::kStrength, 0.0);
  }
  const bool agrees = start_.disagreement.what == For::kNothing;
  const bool is_named = !agrees && now_ns - start_.first_ns >= kArmingTimeout_ns;
  if (is_named && !start_.disagreement_named) {
    const bool soles_do = start_.disagreement.what == For::kSoles;
    health_.raise(soles_do ? Fault::kSolesDisagree : Fault::kGravityDisagrees, now_ns);
  }
  start_.disagreement_named = is_named;
  return agrees;
}

// Those that did not answer the last command.
JointSet ControlLane::late_drives(const JointFeedback* joints, std::int64_t now_ns) noexcept {
  if (joints == nullptr) {
    const std::int64_t last_ns = std::max(start_.answered_ns, start_.first_ns);
    if (now_ns - last_ns > JointFeedback::kCarried_cycles * kBusCycle_ns) start_.silent = JointSet::all();
    return JointSet::all();
  }
  start_.answered_ns = now_ns;
  start_.silent = silent_drives(*joints);
  JointSet late;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (joints->silent_cycles[n] > 0) late.insert(n);
  }
  return late;
}

void ControlLane::note_out_of_range(JointSet out_of_range, std::int64_t now_ns) noexcept {
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const bool is_news = out_of_range.contains(n) && !drives_.out_of_range.contains(n);
    if (is_news) health_.raise(Fault::kJointOutOfRange, now_ns);
  }
  drives_.out_of_range = out_of_range;
}

void ControlLane::note_silent_drives(JointSet silent, std::int64_t now_ns) noexcept {
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (silent.contains(n) && !drives_.silent.contains(n)) health_.raise(Fault::kDriveSilent, now_ns);
  }
  drives_.silent = silent;
  drives_.ever_silent = JointSet::of_bits(drives_.ever_silent.bits() | silent.bits());
}

void ControlLane::note_hot_drives(std::int64_t now_ns) noexcept {
  const JointSet hot = Supervisor::hot(params_.supervisor, drives_.bus.drive_degc, drives_.hot);
  if (hot == drives_.hot) return;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (hot.contains(n) && !drives_.hot.contains(n)) health_.raise(Fault::kDriveHot, now_ns);
  }
  drives_.hot = hot;
  drives_.ever_hot = JointSet::of_bits(drives_.ever_hot.bits() | hot.bits());
}

ModuleState ControlLane::module_state() const noexcept {
  const GaitStatus& status = gait_.status();
  const bool on_stairs = status.treads_climbed > 0 || status.step.onto_tread;
  return supervisor_.state({gait_.armed(), status.phase, gait_.stop_requested(), on_stairs});
}

ArmingWait ControlLane::arming_waits_for() const noexcept {
  using For = ArmingWait::For;
  if (module_state() != ModuleState::kArming) return {};
  if (!start_.silent.is_empty()) return {For::kAnswers, start_.silent};
  if (!drives_.bus.drive_errors.is_empty()) return {For::kErrors, drives_.bus.drive_errors};
  if (!drives_.hot.is_empty()) return {For::kCooler, drives_.hot};
  if (!drives_.out_of_range.is_empty()) return {For::kRange, drives_.out_of_range};
  if (!start_.imu_settled) return {For::kImu, {}};
  return drives_.bus.feet_silent ? ArmingWait{For::kFeet, {}} : start_.disagreement;
}

// Everything that crosses is taken when the frame begins: the writer may be ahead by then, but not by more than it has
// slots for.
void ControlLane::look_across(std::int64_t now_ns) noexcept {
  const std::int64_t finished_ns = link_.progress[kPerceptionLane].finished_ns.load(std::memory_order_acquire);
  if (!view_.begin(now_ns, finished_ns)) health_.raise(Fault::kLaneBehind, now_ns);
  pose_asked_ = view_.take(link_.pose_request);
  (void)view_.take(link_.footholds);  // the newest, or the last one again
  std::uint32_t lost = link_.pose_request.lost() + link_.footholds.lost();
  for (LaneHealth& lane : healths_) {
    if (&lane.own == &health_) continue;
    (void)view_.take(lane.published);
    lost += lane.published.lost();
  }
  health_.follow(Limit::kHandOverLost, now_ns, lost);
}

Progress ControlLane::estimate(std::int64_t now_ns) noexcept {
  const GaitStatus& planned = gait_.status();
  estimator_.tick({planned.stands[0] && !planned.on_toe[0], planned.stands[1] && !planned.on_toe[1]});
  if (estimator_.state().odom_turned_rad.norm() > params_.estimator.imu_mount.told_rad) {
    health_.raise(Limit::kImuTurned, now_ns);
  }
  if (gait_.armed()) {
    read_lio(ports_.lio, now_ns, estimator_);
  } else {
    drop_lio(ports_.lio);
  }
  answer_pose_request(now_ns);
  return Progress::kDone;
}

// Whatever is silent, the gait runs: a foot in the air has to come down.
Progress ControlLane::gait(std::int64_t now_ns) noexcept {
  if (supervisor_.has_let_go()) {
    command_ = {};
    return Progress::kDone;
  }
  if (!estimator_.leg_sensing().any()) {
    command_ = {};
    if (!listens(now_ns)) command_.stamp_ns = now_ns;
    return Progress::kDone;
  }
  gait_.allow_steps(supervisor_.may_step());
  gait_.tick(now_ns, estimator_.state(), footholds(), estimator_.leg_sensing().joints(), command_);
  const StateEstimate& state = estimator_.state();
  if (gait_.armed() && now_ns - estimator_.newest_imu_ns() <= params_.gait.steer_age_ns) {
    supervisor_.watch_lean(params_.supervisor, state.odom_T_base.R);
  }
  if (supervisor_.has_fallen()) damp_joints(now_ns);
  if (supervisor_.hands_over()) hand_over_robot(now_ns);
  estimator_.leg_sensing().to_drives(command_);
  hand_over_touch_down();

  const GaitStatus& status = gait_.status();
  SearchContext& context = link_.search_context.back();
  context.state = estimator_.state();
  // The foot that landed last is on the highest tread reached; one in the air, or put back, has not landed.
  const LatchedStep& step = status.step;
  const bool stands = step.touch_down_stamp_ns != 0 || step.sequence == 0;
  context.stance = stands ? step.foot : other(step.foot);
  context.climbing = status.step.onto_tread;  // a step on the floor behind stairs ends it
  context.goes_to = gait_.goes_to();
  link_.search_context.publish(now_ns);
  return Progress::kDone;
}

void ControlLane::hand_over_robot(std::int64_t now_ns) noexcept {
  const StateEstimate& state = estimator_.state();
  const bool knows = now_ns - state.oldest_input_ns <= params_.gait.steer_age_ns;
  const bool ended = gait_.status().phase == GaitPhase::kStopped || gait_.status().phase == GaitPhase::kFinished;
  const bool at_rest = knows && ended && HandOver::is_at_rest(params_.hand_over, state);
  hand_over_.tick(params_.hand_over, params_.robot.drives, at_rest, estimator_.leg_sensing().joints(), command_);
}

void ControlLane::damp_joints(std::int64_t now_ns) noexcept {
  if (!std::exchange(raised_.fallen, true)) health_.raise(Fault::kFallen, now_ns);
  const JointVector& q_rad = estimator_.leg_sensing().joints().q_rad;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    command_.joints[n] = {q_rad[static_cast<Eigen::Index>(n)], 0.0, 0.0, 0.0, params_.robot.drives.kd_of(n)};
  }
}

// A drive that is asked for feedback with a command without gains lets go of what another controller had it hold. So
// nobody is asked until the IMU was listened to; one that is silent is not waited for.
bool ControlLane::listens(std::int64_t now_ns) const noexcept {
  return !gait_.armed() && supervisor_.may_arm() && !estimator_.resting_accel().is_settled() &&
         now_ns - start_.first_ns < kArmingTimeout_ns;
}

Progress ControlLane::command(std::int64_t now_ns) noexcept {
  if (command_.stamp_ns == 0) return Progress::kDone;
  bool taken = false;  // a drive that is sent nothing keeps its last command, whoever refused
  if (all_finite(command_)) {
    taken = ports_.joints.try_write(command_).is_all();
    if (!taken) health_.raise(Fault::kJointCommandRefused, now_ns);
  } else {
    health_.raise(Fault::kJointCommandInvalid, now_ns);
  }
  overload_.count_command(params_.overload, taken);
  if (!supervisor_.hands_over()) return Progress::kDone;
  // A hold that not all drives have holds nobody: it balances again.
  if (!taken || !drives_.silent.is_empty()) hand_over_.begin();
  if (hand_over_.is_over(params_.hand_over)) supervisor_.let_go();
  return Progress::kDone;
}

Progress ControlLane::health(std::int64_t now_ns) noexcept {
  report_rejections(now_ns);
  report_bus(now_ns);
  report_overload(now_ns);
  report_lidar(now_ns);
  report_gait(now_ns);
  all_faults_ = health_;
  for (LaneHealth& lane : healths_) {
    if (&lane.own == &health_) continue;
    all_faults_.merge(lane.published.front());
  }
  return Progress::kDone;
}

void ControlLane::report_rejections(std::int64_t now_ns) noexcept {
  const Estimator::Counters& counters = estimator_.counters();
  health_.follow(Fault::kImuRejected, now_ns, imu_rejections(counters));
  health_.follow(Fault::kJointFeedbackRejected, now_ns, joint_rejections(estimator_.leg_sensing().counters()));
  health_.follow(Fault::kLioRejected, now_ns, lio_rejections(counters));
  health_.follow(Limit::kHeightRejected, now_ns, counters.height_rejected);
}

// A drive in error gives no torque that could be trusted, and one that is too hot will soon be in error: the step is
// finished, then the gait stops. While it arms there is nothing to stop, and the bus clears errors that can be cleared.
void ControlLane::report_bus(std::int64_t now_ns) noexcept {
  drives_.bus = ports_.joints.status();
  note_hot_drives(now_ns);
  const hal::JointBusStatus& bus = drives_.bus;
  health_.follow(Fault::kDriveError, now_ns, bus.drive_error_replies);
  health_.follow(Fault::kBusOff, now_ns, bus.bus_offs);
  health_.follow(Fault::kBusUnknownId, now_ns, bus.unknown_ids);
  health_.follow(Fault::kBusBadFrame, now_ns, bus.bad_frames);
  health_.follow(Fault::kBusFrameLost, now_ns, bus.lost);
  health_.follow(Fault::kBusCallFailed, now_ns, bus.failed_calls);
  health_.follow(Fault::kBusReplyStale, now_ns, bus.stale);
  health_.follow(Limit::kDriveClamped, now_ns, bus.clamped);
  const bool arms = !gait_.armed();
  const bool may_start = arms && now_ns - start_.first_ns < kArmingTimeout_ns;
  const bool feet_silent = bus.feet_silent && !may_start;
  if (feet_silent && !raised_.feet_silent) health_.raise(Fault::kFeetSilent, now_ns);
  raised_.feet_silent = feet_silent;
  if (!arms && !bus.drive_errors.is_empty()) gait_.request_stop(StopReason::kDriveError);
  if (!arms && !drives_.hot.is_empty()) gait_.request_stop(StopReason::kDriveHot);
}

// While the drives are still silent there is nothing to stop.
void ControlLane::report_overload(std::int64_t now_ns) noexcept {
  if (!is_running(module_state())) return;
  if (overload_.time_is_short(params_.overload)) {
    health_.raise(Fault::kTimeShort, now_ns);
    gait_.request_stop(StopReason::kTimeShort);
  } else if (overload_.commands_are_refused(params_.overload)) {
    health_.raise(Fault::kCommandsRefused, now_ns);
    gait_.request_stop(StopReason::kCommandsRefused);
  }
}

void ControlLane::report_lidar(std::int64_t now_ns) noexcept {
  const StateEstimate& state = estimator_.state();
  const std::int64_t last_ns = state.lio_age_ns < 0 ? start_.first_ns : state.stamp_ns - state.lio_age_ns;
  const bool missing = now_ns - last_ns > kLioTimeout_ns;
  if (missing && !raised_.lio_missing) health_.raise(Fault::kLioMissing, now_ns);
  raised_.lio_missing = missing;
}

void ControlLane::report_gait(std::int64_t now_ns) noexcept {
  const GaitStatus& gait = gait_.status();
  health_.follow(Limit::kReachLimited, now_ns, gait.ik_limited_ticks);
  health_.follow(Limit::kContactEarly, now_ns, gait.early_contacts);
  health_.follow(Limit::kContactLate, now_ns, gait.late_contacts);
  health_.follow(Limit::kFootPutBack, now_ns, gait.aborted_swings);
  const bool stopped = gait.phase == GaitPhase::kStopped;
  if (stopped && !raised_.gait_stopped) {
    health_.raise(Fault::kGaitStopped, now_ns);
    if (gait.stop_reason == StopReason::kMapStale) health_.raise(Fault::kMapStale, now_ns);
    if (gait.stop_reason == StopReason::kStateStale) health_.raise(Fault::kStateStale, now_ns);
  }
  raised_.gait_stopped = stopped;
}

void ControlLane::answer_pose_request(std::int64_t now_ns) noexcept {
  if (!pose_asked_) return;
  const PoseRequest& request = link_.pose_request.front();
  PoseAnswer& answer = link_.pose_answer.back();
  answer.number = request.number;
  answer.found = estimator_.try_state_at(request.stamp_ns, answer.state);
  if (!answer.found && estimator_.state().initialised) health_.raise(Limit::kStateRingMissed, now_ns);
  link_.pose_answer.publish(now_ns);
}

// A tread's height enters the estimator once, as it was frozen at the latch: what the map has learnt from this pose
// since is left out.
void ControlLane::hand_over_touch_down() noexcept {
  const LatchedStep& step = gait_.status().step;
  if (step.touch_down_stamp_ns == 0 || step.sequence == step_handed_over_) return;
  step_handed_over_ = step.sequence;
  if (!step.height_mapped) return;  // no news at all
  estimator_.set_tread_height(step.foot, step.odom_T_target.p_m.z(), params_.tread_height_sigma_m);
}

}  // namespace polygmap
