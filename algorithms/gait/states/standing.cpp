// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/standing.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace polygmap {

void Standing::begin(const GaitInput& in, GaitShared& gait) noexcept {
  rest_.settle(in, gait, gait.params.step.torso.height_m);
}

BetweenFeet Standing::end(const GaitInput& in, GaitShared& gait) noexcept {
  if (std::exchange(toe_calibration_.active, false)) begin(in, gait);
  return rest_;
}

void Standing::begin_toe_calibration(const GaitInput& in, GaitShared& gait, Foot leading) noexcept {
  toe_calibration_ = {true, leading};
  rest_.settle(in, gait, gait.params.standing.toe_calibration.height_m);
}

Transition Standing::tick(const GaitInput& in, GaitShared& gait) noexcept {
  const StandingParams& params = gait.params.standing;
  if (in.stop_requested != StopReason::kNone) return Transition::stop(in.stop_requested);
  if (in.lost) return Transition::stop(StopReason::kStateStale);
  if (!in.state.initialised || !in.usable) return {};
  if (!in.may_step) {
    // It waits for nothing that it sees.
    gait.memory.shifts = gait.memory.idle_ticks = gait.memory.obstacle_ticks = wait_ticks_ = 0;
    return {};
  }
  // A body that sways sideways or back is best off between the feet: no step to come would catch it.
  const Mat3& R = gait.plan.plan_T_base().R;
  const double ahead_m = R.col(0).head<2>().dot(in.odom_dcm_error_m);
  const double left_m = R.col(1).head<2>().dot(in.odom_dcm_error_m);
  const bool sways = !(std::max(-ahead_m, std::abs(left_m)) <= gait.params.steady_m);
  if ((gait.memory.rests_first || sways) && rest_.tick() < params.settle_ticks) return {};
  // What it learns meanwhile may be that it does not stand straight yet: all of the time first, and once.
  if (toe_calibration_.active && rest_.tick() < params.toe_calibration.ticks) return {};
  gait.planner.watch_feet(situation(in).soles);
  const ClimbPlanner::Decision decision =
      gait.planner.look_and_decide(situation(in, toe_calibration_.active, toe_calibration_.leading), in.footholds);
  const bool was_tall = std::exchange(toe_calibration_.active, false);
  gait.memory.toes_calibrated = gait.memory.toes_calibrated || was_tall;
  if (decision.has_step) {
    wait_ticks_ = 0;
    if (!needs_toe_calibration(gait, decision.goal)) return Transition::shift(decision, false);
    begin_toe_calibration(in, gait, decision.goal.foot);
    return {};
  }
  if (was_tall) begin(in, gait);
  return wait(gait, decision, in.footholds.unsteady);
}

Transition Standing::wait(const GaitShared& gait, const ClimbPlanner::Decision& decision,
                          StopReason unsteady) noexcept {
  const StandingParams& params = gait.params.standing;
  StopReason reason = decision.obstruction;
  if (reason == StopReason::kTop || reason == StopReason::kNoStaircase) {  // nothing higher is mapped
    reason = gait.planner.treads_climbed() > 0 ? StopReason::kTop : StopReason::kNoStaircase;
  }
  wait_ticks_ = reason == waiting_for_ ? wait_ticks_ + 1 : 1;
  waiting_for_ = reason;
  ++gait.memory.idle_ticks;
  if (reason == StopReason::kObstacle) ++gait.memory.obstacle_ticks;
  std::int32_t patience = gait.status.step.sequence == 0 ? params.start_patience_ticks : params.patience_ticks;
  if (reason == StopReason::kObstacle) patience = std::max(patience, params.obstacle_patience_ticks);
  if (wait_ticks_ >= patience) {
    return reason == StopReason::kTop || reason == StopReason::kAtGoal ? Transition::finish()
                                                                       : Transition::stop(reason, decision.measured_m);
  }
  // At the margin of what it may stand beside, a thing is in the way in some pictures and not in others.
  const bool obstacle = 2 * gait.memory.obstacle_ticks > gait.memory.idle_ticks;
  const std::int32_t most = params.unsteady_patience * patience;
  if (gait.memory.idle_ticks < (obstacle ? std::max(most, params.obstacle_patience_ticks) : most)) return {};
  return Transition::stop(obstacle ? StopReason::kObstacle : unsteady);
}

}  // namespace polygmap
