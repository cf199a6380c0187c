// SPDX-License-Identifier: Apache-2.0
// Late and slow control under physics, perception in the loop: ticks that do not come, rows that take their time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <string>

#include "tests/support/physical_climb.hpp"

namespace polygmap::sim {
namespace {

// Every row takes between half of its time and all of it.
std::function<double(std::size_t)> jitter(std::uint64_t seed) {
  return [random = std::mt19937_64(seed),
          share = std::uniform_real_distribution<double>(0.5, 1.0)](std::size_t) mutable { return share(random); };
}

struct StallCase {
  GaitPattern pattern;
  int stall_ms;
};
std::string name_of(const testing::TestParamInfo<StallCase>& info) {
  return std::string(kGaitPatternNames[static_cast<std::size_t>(info.param.pattern)]) + "_" +
         std::to_string(info.param.stall_ms) + "_ms";
}

// A stall every 0.94 s, each a fifth of a second later in the gait's phases than the last one. first_s: of the first.
void climb_with_stalls(const StallCase& c, std::uint64_t seed, double first_s) {
  Params params;
  params.gait.planner.pattern = c.pattern;
  PhysicalClimb climb(stairs_of(3, seed), params);
  climb.row_share = jitter(seed);
  constexpr double kEvery_s = 0.94;
  int stalls = 0;
  std::array<int, 5> in_phase{};
  climb.run(3.0 + first_s);  // it stands and has initialised
  while (climb.time_s() < 60.0) {
    const double end_s = climb.time_s() + kEvery_s;
    ++in_phase[static_cast<std::size_t>(climb.status().phase)];
    climb.stall(std::max(c.stall_ms / 2, 1));
    ++stalls;
    climb.run(end_s - climb.time_s());
    if (climb.truth().fell || climb.status().phase == GaitPhase::kFinished ||
        climb.status().phase == GaitPhase::kStopped) {
      break;
    }
  }
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << static_cast<int>(climb.status().stop_reason);
  EXPECT_EQ(climb.status().treads_climbed, 3U);
  EXPECT_GE(climb.sole_margin_min_m(), 0.0);
  EXPECT_GT(in_phase[static_cast<std::size_t>(GaitPhase::kSwing)], 2);
  EXPECT_GT(in_phase[static_cast<std::size_t>(GaitPhase::kDoubleSupport)], 2);
  EXPECT_EQ(climb.health().count(Fault::kTimeShort).count, 0U);
}

constexpr std::array kStalls{StallCase{GaitPattern::kDoubleStep, 3}, StallCase{GaitPattern::kDoubleStep, 10},
                             StallCase{GaitPattern::kSingleStep, 3}, StallCase{GaitPattern::kSingleStep, 10}};

class Stalled : public testing::TestWithParam<StallCase> {};
TEST_P(Stalled, AgainAndAgainOnTheWay_ClimbsOn) { climb_with_stalls(GetParam(), 1, 0.0); }
INSTANTIATE_TEST_SUITE_P(Climbs, Stalled, testing::ValuesIn(kStalls), name_of);

class LongStalled : public testing::TestWithParam<StallCase> {};
TEST_P(LongStalled, InEveryPhase_ClimbsOn) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const double first_s : {0.1, 0.3, 0.5, 0.7}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", first stall " + std::to_string(first_s) + " s later");
      climb_with_stalls(GetParam(), seed, first_s);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Long, LongStalled, testing::ValuesIn(kStalls), name_of);

// Once, at a moment of the first stairs. A foot that was to land meanwhile may stand over an edge, or so that the legs
// cannot do the next step. True where it stands in the end.
bool stands_after_one_stall(GaitPattern pattern, std::uint64_t seed, double at_s) {
  SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(at_s) + " s after the first lift-off");
  Params params;
  params.gait.planner.pattern = pattern;
  PhysicalClimb climb(stairs_of(2, seed), params);
  climb.row_share = jitter(seed);
  EXPECT_TRUE(run_to_swing_onto(climb, 1));
  climb.run(at_s);
  climb.stall(25);
  climb.run(60.0);
  climb.run_on(1.0);
  if (climb.truth().fell) return false;
  const GaitStatus& status = climb.status();
  EXPECT_TRUE(status.phase == GaitPhase::kFinished || status.phase == GaitPhase::kStopped);
  if (status.phase == GaitPhase::kFinished) {
    EXPECT_EQ(status.treads_climbed, 2U);
  } else {
    EXPECT_NE(status.stop_reason, StopReason::kNone);
  }
  return true;
}

class StalledForFiftyMs : public testing::TestWithParam<GaitPattern> {};
TEST_P(StalledForFiftyMs, OnTheFirstStair_DoesNotFall) {
  for (const double at_s : {0.1, 0.7, 1.0, 1.5}) EXPECT_TRUE(stands_after_one_stall(GetParam(), 1, at_s)) << at_s;
}
// While nobody wakes the module the plan stands still and the body does not.
class LongStalledForFiftyMs : public testing::TestWithParam<GaitPattern> {};
TEST_P(LongStalledForFiftyMs, InEveryPhase_DoesNotFall) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (int i = 0; i < 26; ++i) {
      EXPECT_TRUE(stands_after_one_stall(GetParam(), seed, 0.1 * i)) << "seed " << seed << ", " << 0.1 * i << " s";
    }
  }
}
constexpr std::array kBothGaits{GaitPattern::kDoubleStep, GaitPattern::kSingleStep};
INSTANTIATE_TEST_SUITE_P(Gaits, StalledForFiftyMs, testing::ValuesIn(kBothGaits));
INSTANTIATE_TEST_SUITE_P(Long, LongStalledForFiftyMs, testing::ValuesIn(kBothGaits));

// From the second swing onto a tread on, the gait's row takes half as long again as it may, in every cycle.
TEST(ControlOverruns, InEveryCycle_StopsOnBothFeetAndSaysSo) {
  PhysicalClimb climb(stairs_of(2, 1));
  ASSERT_TRUE(run_to_swing_onto(climb, 2));
  constexpr std::size_t gait = row_named(kSchedule, "gait");
  climb.row_share = [](std::size_t row) { return row == gait ? 1.5 : 0.3; };
  const double begin_s = climb.time_s();
  while (climb.health().count(Fault::kTimeShort).count == 0 && climb.tick()) {
  }
  EXPECT_NEAR(climb.time_s() - begin_s, 0.1, 0.01);
  climb.run(3.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kTimeShort);
  EXPECT_LT(climb.time_s() - begin_s, 1.6);
  EXPECT_TRUE(stands_for(climb, 2.0));
}

// What perception's rows take too long is control's concern only where a cycle gets too long by it.
TEST(PerceptionOverruns, InEveryPictureInOneLane_ClimbsOn) {
  PhysicalClimb climb(stairs_of(2, 1));
  constexpr std::size_t surfaces = row_named(kSchedule, "surfaces");
  climb.row_share = [](std::size_t row) { return row == surfaces ? 1.1 : 0.5; };
  climb.run(60.0);
  EXPECT_GT(climb.health().count(Fault::kRowOverrun).count, 1000U);
  EXPECT_EQ(climb.health().count(Fault::kCycleOverrun).count, 0U);
  EXPECT_EQ(climb.health().count(Fault::kTimeShort).count, 0U);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << static_cast<int>(climb.status().stop_reason);
}

}  // namespace
}  // namespace polygmap::sim
