// SPDX-License-Identifier: Apache-2.0
// The gait over the ticks of one stair, and the plan of one stair, each a function of its own: callgrind counts what is
// spent inside it.
#pragma once

#include <string_view>
#include <vector>

#include "algorithms/gait/gait.hpp"

namespace polygmap::bench {

// What one tick gets.
struct GaitTick {
  std::int64_t now_ns = 0;
  StateEstimate state;
  FootholdSet footholds;
  JointFeedback feedback;
  bool swings = false;  // before and after it: nothing is planned
};

struct GaitBench {
  Gait gait;
  JointCommand swinging, shifting, walking;  // of each stage: functions that do the same become one
};
// Both feet onto a tread, as an ideal climb does it: the gait as it was when the tread below was climbed.
struct GaitStair {
  GaitStair();
  GaitBench start;
  std::vector<GaitTick> ticks;
};

// On the way to a place behind a wall: the gait looks for a step that comes nearer, and for a way round. From its first
// tick on.
struct WalkAtAWall {
  WalkAtAWall();
  GaitBench start;
  std::vector<GaitTick> ticks;
};

// Both steps of a stair from rest as the gait plans them: schedules, centre of mass, torso, swing; and the proof that
// the legs can do them.
struct StairPlan {
  StairPlan();
  StepParams params;
  std::array<StepGoal, 2> goals;  // leading, trailing
  // Before each of them, as the one before leaves it.
  std::array<std::array<Transform, kFootCount>, 2> soles;
  std::array<TorsoTrajectory::State, 2> from{};
  std::array<StepSearch, 2> searches;
  ComPlan com;
  Swing swing;
};

// What makes the stair, run through by `end`, useless as a benchmark; empty when nothing does.
[[nodiscard]] std::string_view complaint(const GaitBench& end, const StairPlan& plan);

void stage_gait_swing_tick(GaitBench& bench, const GaitTick& tick);
void stage_gait_shift_tick(GaitBench& bench, const GaitTick& tick);  // and of touch-down and lift-off: searches, plans
void stage_gait_walk_tick(GaitBench& bench, const GaitTick& tick);   // on both feet
void swing_on(GaitBench& bench, const GaitTick& tick);               // between those, not counted
void stage_gait_plan(StairPlan& plan);
void stage_gait_proof(StairPlan& plan);

}  // namespace polygmap::bench
