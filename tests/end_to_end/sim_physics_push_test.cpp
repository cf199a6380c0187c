// SPDX-License-Identifier: Apache-2.0
// Pushes under physics, with known footholds.
#include <gtest/gtest.h>

#include "tests/support/physical_climb.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::sim {
namespace {

// Of both steps onto a tread, from the first lift-off on: the module is still climbing when each push comes. Each seed
// has its share of the eight moments.
struct PushedCase {
  std::uint64_t seed;
  GaitPattern pattern;
};
class Pushed : public testing::TestWithParam<PushedCase> {};

TEST_P(Pushed, AnyWayAtEightMomentsOfAStair_DoesNotFall) {
  const auto [seed, pattern] = GetParam();
  if (test::kSlowMachine && seed != 3) GTEST_SKIP() << "one seed of each gait";
  Gait::Params params;
  params.planner.pattern = pattern;
  PhysicalClimb calm(few_steps(seed), params);
  ASSERT_TRUE(run_to_swing_onto(calm, 1));
  const double begin_s = calm.time_s();
  for (int moment = static_cast<int>(seed % 3); moment < 8; moment += test::kSlowMachine ? 6 : 3) {
    for (const int axis : {0, 1}) {
      for (const double impulse_ns : {10.0, -10.0}) {
        SimOptions options = few_steps(seed);
        options.pushes = {{.at_s = begin_s + 0.32 * moment, .axis = axis, .impulse_ns = impulse_ns}};
        PhysicalClimb climb(options, params);
        climb.run(options.pushes.front().at_s - climb.time_s());
        EXPECT_LT(climb.status().treads_climbed, 2U);
        EXPECT_FALSE(climb.truth().fell);
        climb.run(3.0);
        for (int tick = 0; tick < 1000; ++tick) (void)climb.tick();  // where it stopped, it stands
        EXPECT_FALSE(climb.truth().fell) << "moment " << moment << ", axis " << axis << ", " << impulse_ns << " N s";
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(
    Seeds, Pushed,
    testing::Values(PushedCase{2, GaitPattern::kDoubleStep}, PushedCase{3, GaitPattern::kDoubleStep},
                    PushedCase{4, GaitPattern::kDoubleStep}, PushedCase{5, GaitPattern::kDoubleStep},
                    PushedCase{3, GaitPattern::kSingleStep}, PushedCase{4, GaitPattern::kSingleStep}));

}  // namespace
}  // namespace polygmap::sim
