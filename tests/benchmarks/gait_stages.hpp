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
  JointCommand swinging, shifting;  // of either stage: two functions that do the same become one
};
// Both feet onto a tread, as an ideal climb does it: the gait as it was when the tread below was climbed.
struct GaitStair {
  GaitStair();
  GaitBench start;
  std::vector<GaitTick> ticks;
};

// Both steps of a stair from rest, with shifts, searches, proofs and trajectories as the gait makes them.
struct StairPlan {
  StairPlan();
  LegGeometry geometry;
  StepParams params;
  std::array<Transform, kFootCount> soles;
  StepGoal leading, trailing;
  TorsoTrajectory::State from{};
  StepSearch search;
  ComPlan com;
  Swing swing;
};

// What makes the stair, run through by `end`, useless as a benchmark; empty when nothing does.
[[nodiscard]] std::string_view complaint(const GaitBench& end, const StairPlan& plan);

void stage_gait_swing_tick(GaitBench& bench, const GaitTick& tick);
void stage_gait_shift_tick(GaitBench& bench, const GaitTick& tick);  // and of touch-down and lift-off: searches, plans
void stage_gait_plan(StairPlan& plan);

}  // namespace polygmap::bench
