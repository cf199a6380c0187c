// SPDX-License-Identifier: Apache-2.0
#include "firmware/control_lane.hpp"

#include <cmath>

namespace polygmap {
namespace {

constexpr std::int64_t kLioTimeout_ns = 2 * kNsPerS;  // twenty poses
constexpr int kMaxReadsPerFrame = 4;  // of one port: a backlog is worked off, a babbling driver is not followed

bool all_finite(const JointCommand& command) noexcept {
  for (const JointSetpoint& joint : command.joints) {
    if (!std::isfinite(joint.q_rad) || !std::isfinite(joint.dq_radps) || !std::isfinite(joint.tau_ff_nm)) return false;
  }
  return true;
}

}  // namespace

ControlLane::ControlLane(hal::Imu& imu, hal::JointBus& joints, hal::LidarOdometry& lio, LaneLink& link,
                         const Params& params) noexcept
    : imu_port_(imu), joint_port_(joints), lio_port_(lio), link_(link), params_(params) {
  estimator_.reset(params.estimator);
  gait_.reset(params.gait);
}

Progress ControlLane::sense(std::int64_t now_ns) noexcept {
  imu_fresh_ = false;
  for (int i = 0; i < kMaxReadsPerFrame && imu_port_.try_read(imu_); ++i) imu_fresh_ = true;
  joints_fresh_ = joint_port_.try_read(joints_);
  if (!imu_fresh_) health_.raise(Fault::kImuMissing, now_ns);
  if (!joints_fresh_) health_.raise(Fault::kJointFeedbackMissing, now_ns);
  LioSample lio;
  for (int i = 0; i < kMaxReadsPerFrame && lio_port_.try_read(lio); ++i) estimator_.add_lio(lio, now_ns);
  return Progress::kDone;
}

Progress ControlLane::estimate(std::int64_t /*now_ns*/) noexcept {
  if (!imu_fresh_ || !joints_fresh_) return Progress::kIdle;
  estimator_.tick(imu_, joints_, gait_.status().stands);
  answer_pose_request();
  return Progress::kDone;
}

Progress ControlLane::gait(std::int64_t /*now_ns*/) noexcept {
  command_ready_ = false;
  if (!joints_fresh_) return Progress::kIdle;
  if (link_.footholds.try_take()) footholds_ = link_.footholds.front();
  gait_.tick(estimator_.state(), footholds_, joints_, command_);
  command_ready_ = true;
  hand_over_touch_down();

  const GaitStatus& status = gait_.status();
  SearchContext& context = link_.search_context.back();
  context.state = estimator_.state();
  // Standing on two feet, the foot that landed last is on the highest tread reached.
  context.stance = status.phase == GaitPhase::kSwing ? other(status.step.foot) : status.step.foot;
  context.climbing = status.treads_climbed > 0 || status.step.onto_tread;
  link_.search_context.publish();
  return Progress::kDone;
}

Progress ControlLane::command(std::int64_t now_ns) noexcept {
  if (!command_ready_) return Progress::kIdle;
  if (!all_finite(command_)) {
    health_.raise(Fault::kJointCommandInvalid, now_ns);
  } else if (!joint_port_.try_write(command_)) {
    health_.raise(Fault::kJointCommandRefused, now_ns);
  }
  return Progress::kDone;
}

Progress ControlLane::health(std::int64_t now_ns) noexcept {
  report_rejections(now_ns);
  report_gait(now_ns);
  return Progress::kDone;
}

void ControlLane::report_rejections(std::int64_t now_ns) noexcept {
  const Estimator::Counters& now = estimator_.counters();
  const Estimator::Counters& seen = estimator_seen_;
  health_.raise(Fault::kImuRejected, now_ns, now.imu_invalid + now.imu_stale - seen.imu_invalid - seen.imu_stale);
  health_.raise(Fault::kJointFeedbackRejected, now_ns,
                now.joints_invalid + now.joints_stale + now.joints_jump - seen.joints_invalid - seen.joints_stale -
                    seen.joints_jump);
  for (std::size_t v = 0; v < kLioVerdictCount; ++v) {
    const auto verdict = static_cast<LioVerdict>(v);
    if (verdict == LioVerdict::kAccepted || verdict == LioVerdict::kRealigned) continue;
    health_.raise(Fault::kLioRejected, now_ns, now.lio[v] - seen.lio[v]);
  }
  estimator_seen_ = now;
  const std::int64_t lio_age_ns = estimator_.state().lio_age_ns;
  const bool missing = lio_age_ns > kLioTimeout_ns;
  if (missing && !lio_missing_) health_.raise(Fault::kLioMissing, now_ns);
  lio_missing_ = missing;
}

void ControlLane::report_gait(std::int64_t now_ns) noexcept {
  const GaitStatus& now = gait_.status();
  health_.raise(Limit::kReachLimited, now_ns, now.ik_limited_ticks - gait_seen_.ik_limited_ticks);
  health_.raise(Limit::kContactEarly, now_ns, now.early_contacts - gait_seen_.early_contacts);
  health_.raise(Limit::kContactLate, now_ns, now.late_contacts - gait_seen_.late_contacts);
  if (now.phase == GaitPhase::kStopped && gait_seen_.phase != GaitPhase::kStopped) {
    health_.raise(Fault::kGaitStopped, now_ns);
    if (now.stop_reason == Obstruction::kMapStale) health_.raise(Fault::kMapStale, now_ns);
  }
  gait_seen_ = now;
}

void ControlLane::answer_pose_request() noexcept {
  if (!link_.pose_request.try_take()) return;
  const PoseRequest& request = link_.pose_request.front();
  PoseAnswer& answer = link_.pose_answer.back();
  answer.sequence = request.sequence;
  answer.found = estimator_.try_state_at(request.stamp_ns, answer.state);
  if (!answer.found) health_.raise(Limit::kStateRingMissed, request.stamp_ns);
  link_.pose_answer.publish();
}

// A tread's height enters the estimator once, as it was frozen at the latch: the map never hears its own echo.
void ControlLane::hand_over_touch_down() noexcept {
  const LatchedStep& step = gait_.status().step;
  if (step.touch_down_stamp_ns == 0 || step.sequence == step_handed_over_) return;
  step_handed_over_ = step.sequence;
  estimator_.set_tread_height(step.foot, step.odom_T_target.p_m.z(), params_.tread_height_sigma_m);
}

}  // namespace polygmap
