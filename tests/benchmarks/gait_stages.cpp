// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/gait_stages.hpp"

#include "tests/support/ideal_climb.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::bench {
namespace {

constexpr double kRise_m = 0.13, kTread_m = 0.28;

}  // namespace

GaitStair::GaitStair() {
  test::IdealClimb climb({.stairs = {.steps = 3, .rise_m = kRise_m, .tread_m = kTread_m}});
  GaitTick seen;
  climb.tamper = [&seen](StateEstimate& state, FootholdSet& footholds, JointFeedback& feedback) {
    seen = {state.stamp_ns, state, footholds, feedback, false};
    // A tick measures the zero-moment point. What this climb's forces know of it is nothing: worked out, then refused.
    seen.feedback.tau_nm.setOnes();
    for (double& force_n : seen.feedback.foot_force_n) force_n *= 1.5;
  };
  bool recording = false;
  while (climb.status().treads_climbed < 2) {
    const bool swung = climb.status().phase == GaitPhase::kSwing;
    if (!recording && climb.status().treads_climbed == 1) {
      recording = true;
      start.gait = climb.gait();
    }
    if (!climb.tick()) break;
    if (!recording) continue;
    seen.swings = swung && climb.status().phase == GaitPhase::kSwing;
    ticks.push_back(seen);
  }
}

WalkAtAWall::WalkAtAWall() {
  constexpr std::size_t kTicks = 5000;
  test::IdealClimb climb({.stairs = {}, .distance_m = 5.0});
  climb.gait().go_to({.ahead_m = 2.0});
  GroundView ground;
  ground.corner_m = Vec2::Constant(-0.5 * GroundView::kSide_cells * GroundView::kCell_m);
  ground.level.fill(~std::uint64_t{0});
  GaitTick seen;
  climb.tamper = [&](StateEstimate& state, FootholdSet& footholds, JointFeedback& feedback) {
    if (climb.record().ticks == 0) {  // right across all of the view, 0.3 m ahead
      ground.corner_m += state.odom_T_base.p_m.head<2>();
      ground.height_m = 0.5 * (state.odom_T_sole[0].p_m.z() + state.odom_T_sole[1].p_m.z());
      const auto column = static_cast<std::uint32_t>(GroundView::kSide_cells / 2 + GroundView::cell_of(0.30));
      ground.tall.fill(std::uint64_t{3} << column);
      for (std::uint64_t& row : ground.level) row &= ~(std::uint64_t{3} << column);
    }
    footholds = {};
    footholds.map_stamp_ns = state.stamp_ns;
    footholds.obstruction = StopReason::kNoStaircase;
    footholds.ground = ground;
    seen = {state.stamp_ns, state, footholds, feedback, false};
  };
  start.gait = climb.gait();
  while (ticks.size() < kTicks && climb.tick()) {
    seen.swings = climb.status().phase == GaitPhase::kSwing;
    ticks.push_back(seen);
  }
}

StairPlan::StairPlan() {
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const std::size_t f = index_of(foot);
    soles[0][f] = {Mat3::Identity(), Vec3{0.0, side_sign(foot) * kStanceHalfWidth_m, 0.0}};
    goals[f].kind = f == 0 ? StepKind::kLeading : StepKind::kTrailing;
    goals[f].foot = foot;
    goals[f].target = sole_pose(soles[0][f]);
    goals[f].target.position_m += Vec3{kTread_m, 0.0, kRise_m};
  }
  soles[1] = {goals[0].target.transform(), soles[0][1]};
  const TorsoPose middle =
      torso_between(nominal_robot().legs, params.torso, {sole_pose(soles[0][0]), sole_pose(soles[0][1])});
  from[0] = TorsoTrajectory::at_rest({rotation_z(middle.yaw_rad), middle.position_m});
}

std::string_view complaint(const GaitBench& end, const StairPlan& plan) {
  if (end.gait.status().treads_climbed != 2) return "the gait did not climb the stair";
  for (const StepSearch& search : plan.searches) {
    if (search.state() != StepSearch::State::kFound) return "the legs cannot do the stair";
  }
  return {};
}

void stage_gait_swing_tick(GaitBench& bench, const GaitTick& tick) {
  bench.gait.tick(tick.now_ns, tick.state, tick.footholds, tick.feedback, bench.swinging);
}
void stage_gait_shift_tick(GaitBench& bench, const GaitTick& tick) {
  bench.gait.tick(tick.now_ns, tick.state, tick.footholds, tick.feedback, bench.shifting);
}
void swing_on(GaitBench& bench, const GaitTick& tick) {
  bench.gait.tick(tick.now_ns, tick.state, tick.footholds, tick.feedback, bench.swinging);
}
void stage_gait_walk_tick(GaitBench& bench, const GaitTick& tick) {
  bench.gait.tick(tick.now_ns, tick.state, tick.footholds, tick.feedback, bench.walking);
}

void stage_gait_plan(StairPlan& p) {
  for (std::size_t i = 0; i < p.goals.size(); ++i) {
    const SolePair flat{sole_pose(p.soles[i][0]), sole_pose(p.soles[i][1])};
    StepPlan plan = plan_step(p.params, p.goals[i], flat, kStepTries[0]);
    const HorizontalMotion com = TorsoTrajectory::horizontal(p.from[i]);
    p.com.plan(p.params.com, com, zmp_of_shift(p.params, plan, ComPlan::zmp_under(p.params.com, com)));
    plan_torso(nominal_robot().legs, p.params, flat, p.com, plan.shift_ticks, plan);
    const HorizontalMotion lift_off = p.com.at(plan.shift_ticks);
    p.com.plan(p.params.com, lift_off, zmp_of_swing(plan));
    plan_torso(nominal_robot().legs, p.params, flat, p.com, 0, plan);
    p.swing.plan(kSole, p.soles[i][index_of(plan.goal.foot)], plan.goal.target, plan.shape, plan.swing_ticks);
    if (i > 0) continue;
    p.from[1] = TorsoTrajectory::at_rest({rotation_z(plan.touch_down.yaw_rad), plan.touch_down.position_m});
    TorsoTrajectory::set_horizontal(p.from[1], p.com.at(plan.swing_ticks));
  }
}

void stage_gait_proof(StairPlan& p) {
  for (std::size_t i = 0; i < p.goals.size(); ++i) {
    StepSearch& search = p.searches[i];
    search.begin(nominal_robot(), p.params, p.goals[i], p.goals[1], p.params.durations.stair_shift_ticks, p.from[i],
                 p.soles[i]);
    while (search.step(nominal_robot(), p.params) == StepSearch::State::kSearching) {
    }
  }
}

}  // namespace polygmap::bench
