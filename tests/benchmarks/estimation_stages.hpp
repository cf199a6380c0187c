// SPDX-License-Identifier: Apache-2.0
// Estimation cut into stages over the same ticks of a stair climb, each a function of its own: callgrind counts what is
// spent inside it.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "algorithms/estimation/estimator.hpp"

namespace polygmap::bench {

// What one tick gets.
struct EstimationTick {
  std::int64_t now_ns = 0;
  ImuSample imu;
  JointFeedback joints;
  std::array<bool, kFootCount> stance{};
  LioSample lio;  // 100 ms old
  Transform odom_T_base;
};

// The estimator and its parts by themselves, as they are when the ticks begin: on both feet, before a step up.
struct EstimationBench {
  Estimator estimator;
  LioFusion fusion;
  StateHistory ring;
};
struct EstimationWalk {
  EstimationWalk();
  EstimationBench start;
  std::vector<EstimationTick> ticks;  // the weight goes over, a foot lifts, swings and lands
};

// What makes the stages, run through all ticks, useless as a benchmark; empty when nothing does.
[[nodiscard]] std::string_view complaint(const EstimationBench& end, const EstimationWalk& walk);

void stage_lio_alignment(EstimationBench& bench,
                         const EstimationTick& tick);  // store a state, gate, find the stamp, fuse
void stage_fused_tick(EstimationBench& bench,
                      const EstimationTick& tick);  // all of estimation, a LIO pose in every one

struct EstimationStage {
  std::string_view name;
  void (*run)(EstimationBench&, const EstimationTick&);
};
inline constexpr std::array<EstimationStage, 2> kEstimationStages{
    {{"lio_alignment", stage_lio_alignment}, {"fused_tick", stage_fused_tick}}};

}  // namespace polygmap::bench
