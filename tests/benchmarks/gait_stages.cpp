// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/gait_stages.hpp"

#include "tests/support/ideal_climb.hpp"

namespace polygmap::bench {
namespace {

constexpr double kRise_m = 0.13, kTread_m = 0.28;

}  // namespace

GaitStair::GaitStair() {
  test::IdealClimb climb({.stairs = {.steps = 3, .rise_m = kRise_m, .tread_m = kTread_m}});
  GaitTick seen;
  climb.tamper = [&seen](StateEstimate& state, FootholdSet& footholds, JointFeedback& feedback) {
    seen = {state.stamp_ns, state, footholds, feedback, false};
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

StairPlan::StairPlan() {
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    soles[index_of(foot)] = {Mat3::Identity(), Vec3{0.0, side_sign(foot) * kStanceHalfWidth_m, 0.0}};
    StepGoal& goal = foot == Foot::kLeft ? leading : trailing;
    goal.kind = foot == Foot::kLeft ? StepKind::kLeading : StepKind::kTrailing;
    goal.foot = foot;
    goal.target = sole_pose(soles[index_of(foot)]);
    goal.target.position_m += Vec3{kTread_m, 0.0, kRise_m};
  }
  const SolePair flat{sole_pose(soles[0]), sole_pose(soles[1])};
  const TorsoPose middle = torso_between(geometry, params.torso, flat);
  from = TorsoTrajectory::at_rest({rotation_z(middle.yaw_rad), middle.position_m});
}

std::string_view complaint(const GaitBench& end, const StairPlan& plan) {
  if (end.gait.status().treads_climbed != 2) return "the gait did not climb the stair";
  if (plan.search.state() != StepSearch::State::kFound) return "no plan of the stair";
  return {};
}

void stage_gait_swing_tick(GaitBench& bench, const GaitTick& tick) {
  bench.gait.tick(tick.now_ns, tick.state, tick.footholds, tick.feedback, bench.swinging);
}
void stage_gait_shift_tick(GaitBench& bench, const GaitTick& tick) {
  bench.gait.tick(tick.now_ns, tick.state, tick.footholds, tick.feedback, bench.shifting);
}

void stage_gait_plan(StairPlan& p) {
  TorsoTrajectory::State from = p.from;
  std::array<Transform, kFootCount> soles = p.soles;
  for (const StepGoal& goal : {p.leading, p.trailing}) {
    p.search.begin(p.geometry, p.params, goal, p.trailing, p.params.stair_shift_ticks, from, soles);
    while (p.search.step() == StepSearch::State::kSearching) {
    }
    const SolePair flat{sole_pose(soles[0]), sole_pose(soles[1])};
    StepPlan plan = plan_step(p.params, goal, flat, p.search.plan().toe_down_rad);
    const HorizontalMotion com = TorsoTrajectory::horizontal(from);
    p.com.plan(p.params.com, com, zmp_of_shift(p.params, plan, ComPlan::zmp_under(p.params.com, com)));
    plan_torso(p.geometry, p.params, flat, p.com, plan.shift_ticks, plan);
    const HorizontalMotion lift_off = p.com.at(plan.shift_ticks);
    p.com.plan(p.params.com, lift_off, zmp_of_swing(p.params, plan));
    plan_torso(p.geometry, p.params, flat, p.com, 0, plan);
    p.swing.plan(soles[index_of(goal.foot)], goal.target, plan.shape, plan.swing_ticks);
    soles[index_of(goal.foot)] = goal.target.transform();
    from = TorsoTrajectory::at_rest({rotation_z(plan.touch_down.yaw_rad), plan.touch_down.position_m});
    TorsoTrajectory::set_horizontal(from, p.com.at(plan.swing_ticks));
  }
}

}  // namespace polygmap::bench
