// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/step_search.hpp"

#include <algorithm>

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

void StepSearch::begin(const RobotModel& robot, const StepParams& params, const StepGoal& goal,
                       const StepGoal& trailing, std::int32_t shift_ticks, const TorsoTrajectory::State& from,
                       const std::array<Transform, kFootCount>& soles) noexcept {
  goal_ = goal;
  trailing_ = trailing;
  shift_ticks_ = shift_ticks;
  from_ = from;
  soles_ = soles;
  try_ = 0;
  leading_found_ = false;
  state_ = State::kSearching;
  try_candidate(robot, params);
}

void StepSearch::try_candidate(const RobotModel& robot, const StepParams& params) noexcept {
  const StepGoal& goal = leading_found_ ? trailing_ : goal_;
  std::array<Transform, kFootCount> soles = soles_;
  TorsoTrajectory::State from = from_;
  if (leading_found_) {
    soles[index_of(goal_.foot)] = goal_.target.transform();
    from = TorsoTrajectory::at_rest(
        {rotation_zyx(torso_landed_.yaw_rad, torso_landed_.lean_rad, 0.0), torso_landed_.position_m});
    TorsoTrajectory::set_horizontal(from, com_landed_);
  }
  const SolePair from_soles{sole_pose(soles[0]), sole_pose(soles[1])};
  tries_ = tries_for(params, goal, from_soles);
  candidate_ = plan_step(params, goal, from_soles, tries_[try_]);
  if (leading_found_) {
    candidate_.joint_margin_rad = params.joint_margin_rad;  // the needed one is for a foot that lands some mm off
  } else {
    candidate_.shift_ticks = shift_ticks_;
  }
  const std::int32_t knot_ticks = leading_found_ ? kLookAhead * params.knot_ticks : params.knot_ticks;
  proof_.begin(robot, StepKnots(robot, params, knot_ticks, candidate_, from, soles));
}

// How far the toes point down, how long the legs are and when a heel rises is nothing to a knee that lacks torque: the
// next try is the next slower one.
void StepSearch::next_try() noexcept {
  const StepTry failed = tries_[try_++];
  if (proof_.check().torque_share <= proof_.knots().torque_share()) return;
  while (try_ < tries_.size() && tries_[try_].longer <= failed.longer && tries_[try_].rise_longer <= failed.rise_longer)
    ++try_;
}

// Can the weight then move over the foot that landed? A wide diagonal step could be a dead end: the ankle roll of the
// leg left behind.
bool StepSearch::leads_on(const RobotModel& robot, const StepParams& params) const noexcept {
  SolePair landed{sole_pose(soles_[0]), sole_pose(soles_[1])};
  landed[index_of(goal_.foot)] = goal_.target;
  const TorsoPose over = torso_over(robot.legs, params.torso, goal_.foot, landed);
  const Transform base_T_odom = Transform{rotation_z(over.yaw_rad), over.position_m}.inverse();
  const double margin_rad = 2.0 * params.joint_margin_rad;  // the foot lands some mm off
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const LegSolution s = solve_leg(robot.legs, leg, base_T_odom * landed[index_of(leg)].transform());
    if (!s.reachable || s.q_rad[kKnee] < params.knee_min_rad) return false;
    LegVector q_rad = s.q_rad;
    q_rad[kKnee] = std::max(q_rad[kKnee], margin_rad);  // the stretched leg has a margin of its own
    if (limit_margin_rad(robot.drives, leg, q_rad) < margin_rad) return false;
  }
  return true;
}

StepSearch::State StepSearch::step(const RobotModel& robot, const StepParams& params) noexcept {
  if (state_ != State::kSearching || !proof_.advance(robot, params, kKnotsPerCall)) return state_;
  if (!proof_.check().feasible) {
    next_try();
    if (try_ == tries_.size()) return state_ = State::kImpossible;
  } else {
    if (!leading_found_) plan_ = candidate_;
    if (goal_.kind == StepKind::kFloor && !leads_on(robot, params)) return state_ = State::kImpossible;
    if (leading_found_ || !leads(goal_.kind)) return state_ = State::kFound;
    leading_found_ = true;
    com_landed_ = proof_.knots().com_at_landing();
    torso_landed_ = proof_.knots().torso_at_landing();
    try_ = 0;
  }
  try_candidate(robot, params);
  return state_;
}

}  // namespace polygmap
