// SPDX-License-Identifier: Apache-2.0
// Estimation cut into stages over the same ticks of a stair climb, each a function of its own: callgrind counts what is
// spent inside it.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "algorithms/estimation/estimator.hpp"
#include "tests/reference/base_filter/full_filters.hpp"

namespace polygmap::bench {

// What one tick gets.
struct EstimationTick {
  std::int64_t now_ns = 0;
  ImuSample imu;
  JointFeedback joints;
  std::array<bool, kFootCount> stance{};
  LioSample lio;  // 100 ms old
  Transform odom_T_base;
  ContactRows rows;
  Vec3 accel_mps2 = Vec3::Zero();
};

// Every form of the filter and the estimator, as they are when the ticks begin: on both feet, before a step up.
struct EstimationBench {
  Estimator estimator;
  LioFusion fusion;
  StateHistory ring;
  BaseFilter axes;
  reference::DenseFilter dense;
  reference::SequentialFilter sequential;
  reference::DynamicFilter dynamic;
};
struct EstimationWalk {
  EstimationWalk();
  EstimationBench start;
  std::vector<EstimationTick> ticks;  // the weight goes over, a foot lifts, swings and lands
};

// What makes the stages, run through all ticks, useless as a benchmark; empty when nothing does.
[[nodiscard]] std::string_view complaint(const EstimationBench& end, const EstimationWalk& walk);

void stage_base_filter(EstimationBench& bench, const EstimationTick& tick);  // predict and 56 rows: three axis filters
void stage_base_dense(EstimationBench& bench, const EstimationTick& tick);   // the same as printed, fixed size
void stage_base_sequential(EstimationBench& bench, const EstimationTick& tick);
void stage_base_dynamic(EstimationBench& bench, const EstimationTick& tick);  // matrices on the heap
void stage_lio_alignment(EstimationBench& bench,
                         const EstimationTick& tick);  // store a state, gate, find the stamp, fuse
void stage_fused_tick(EstimationBench& bench,
                      const EstimationTick& tick);  // all of estimation, a LIO pose in every one

struct EstimationStage {
  std::string_view name;
  void (*run)(EstimationBench&, const EstimationTick&);
};
inline constexpr std::array<EstimationStage, 6> kEstimationStages{{{"base_filter", stage_base_filter},
                                                                   {"base_dense", stage_base_dense},
                                                                   {"base_sequential", stage_base_sequential},
                                                                   {"base_dynamic", stage_base_dynamic},
                                                                   {"lio_alignment", stage_lio_alignment},
                                                                   {"fused_tick", stage_fused_tick}}};

}  // namespace polygmap::bench
