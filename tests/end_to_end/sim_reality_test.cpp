// SPDX-License-Identifier: Apache-2.0
// Climbs under physics by robots and sensors that are not as their data sheet says.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "sim_stub/host/climb/climb.hpp"
#include "sim_stub/reality.hpp"

namespace polygmap::sim {
namespace {

ClimbSummary climb(double scale, GaitPattern gait, std::uint64_t seed) {
  ClimbOptions options;
  options.seed = seed;
  options.gait = gait;
  options.stairs.steps = 10;
  options.noise = seed % 2 == 0 ? NoiseKind::kCorrelated : NoiseKind::kWhite;
  options.reality_scale = scale;
  options.reality = draw_reality(scale, seed);
  return run_climb(options, {});
}

void expect_climbed_as_real_robots(GaitPattern gait, std::uint64_t seed) {
  const ClimbSummary summary = climb(1.0, gait, seed);
  EXPECT_TRUE(summary.pass) << "seed " << seed << ": " << summary.reason;
  EXPECT_LE(summary.foothold_error_m.max, 0.010) << "seed " << seed;
}

constexpr std::array kBothGaits{GaitPattern::kDoubleStep, GaitPattern::kSingleStep};

class ClimbReality : public testing::TestWithParam<GaitPattern> {};
TEST_P(ClimbReality, AsRealRobotsAre_ClimbedWithinTheFigures) { expect_climbed_as_real_robots(GetParam(), 31); }
INSTANTIATE_TEST_SUITE_P(Gaits, ClimbReality, testing::ValuesIn(kBothGaits));

// While it stood at the start it leant within its joints' play: the gyro's bias was found wrong by 7 mrad/s, and
// believed to be known to 0.2 it turned the base by 35 mrad and felled the robot.
TEST(ClimbPlay, TwiceAsBadAndLeaningInItsPlay_IsClimbed) {
  const ClimbSummary summary = climb(2.0, GaitPattern::kDoubleStep, 55);
  EXPECT_EQ(summary.steps_climbed, 10) << summary.reason;
  EXPECT_LE(summary.foothold_error_m.max, 0.020);
}

class LongClimbReality : public testing::TestWithParam<GaitPattern> {};
// Of the climbs that do not pass, one in fifty, a sole stands a millimetre over its edge.
TEST_P(LongClimbReality, AsRealRobotsAre_AllButOneClimbAndNoneFalls) {
  int climbed = 0;
  for (std::uint64_t seed = 32; seed <= 40; ++seed) {
    const ClimbSummary summary = climb(1.0, GetParam(), seed);
    climbed += summary.pass ? 1 : 0;
    EXPECT_FALSE(summary.fell) << "seed " << seed << ": " << summary.reason;
    EXPECT_LE(summary.foothold_error_m.max, 0.013) << "seed " << seed;
    EXPECT_GE(summary.sole_margin_min_m, -0.002) << "seed " << seed;
  }
  EXPECT_GE(climbed, 8);
}
// It may stop, touch a riser or stand a little over an edge.
TEST_P(LongClimbReality, TwiceAsBad_NoneFalls) {
  for (std::uint64_t seed = 31; seed <= 60; ++seed) {
    const ClimbSummary summary = climb(2.0, GetParam(), seed);
    EXPECT_FALSE(summary.fell) << "seed " << seed << ": " << summary.reason;
  }
}
INSTANTIATE_TEST_SUITE_P(Long, LongClimbReality, testing::ValuesIn(kBothGaits));

}  // namespace
}  // namespace polygmap::sim
