// SPDX-License-Identifier: Apache-2.0
// The paper's Fig. 4 on climbs of ten steps under physics: what of the lidar odometry's noise and lateness, and what of
// the odometry's drift, is left in the fused pose; and whether its covariance is honest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "sim_stub/host/climb/climb.hpp"
#include "sim_stub/host/climb/odometry_report.hpp"
#include "sim_stub/plant/plant.hpp"

namespace polygmap::sim {
namespace {

OdometryFigures climb(std::uint64_t seed, int steps) {
  ClimbOptions options;
  options.seed = seed;
  options.stairs.steps = steps;
  const ClimbSummary summary = run_climb(options, {});
  EXPECT_TRUE(summary.pass) << "seed " << seed << ": " << summary.reason;
  return summary.odometry;
}

TEST(BandRms, SineOfTwoHertzAndDrift_CountsTheSineAlone) {
  std::vector<Vec3> signal_m;
  for (int i = 0; i < 10000; ++i) {
    const double t_s = i * kPlantTick_s;
    signal_m.push_back(
        {3e-3 * std::sin(2.0 * kPi * 2.03 * t_s) + 1e-2 * t_s, 4e-3 * std::sin(2.0 * kPi * 0.4 * t_s), 1});
  }
  EXPECT_NEAR(band_rms_m(signal_m, 1.0, 5.0), 3e-3 / std::sqrt(2.0), 2e-5);
}

// At the module's tau of 4 s.
TEST(ClimbOdometry, Fig4_TenSteps_FusedHasNeitherLiosJitterNorTheOdometrysDrift) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const OdometryFigures f = climb(seed, 10);
    EXPECT_LT(f.jitter_fused_m, f.jitter_lio_m / 10.0) << seed;
    // Where the odometry drifted by chance by a centimetre only, what is left is the lidar's own.
    EXPECT_LT(f.drift_fused_m, std::max(f.drift_base_m / 3.0, 0.005)) << seed;
  }
}

// Map and footholds lie in odometry. Were they in the world that LIO corrects, soles would stand 20 mm over edges.
TEST(ClimbOdometry, LioThatDriftsOrJumps_MovesNoFoothold) {
  for (const int kind : {0, 1, 2, 3}) {
    ClimbOptions options;
    options.seed = 8;
    options.stairs.steps = 4;
    options.noise = NoiseKind::kCorrelated;
    ErrorParams& sensors = options.reality.sensors;
    if (kind == 0) sensors.lio_drift_mps = {0.02, 0.0, 0.0};
    if (kind == 1) sensors.lio_drift_mps = {0.0, 0.0, 0.02};
    if (kind == 2) sensors.lio_drift_radps = 0.02;
    if (kind == 3) {
      sensors.lio_jump_m = {0.06, 0.06, 0.06};
      sensors.lio_jump_s = 14.0;
    }
    const ClimbSummary summary = run_climb(options, {});
    EXPECT_TRUE(summary.pass) << kind << ": " << summary.reason;
    EXPECT_LE(summary.foothold_error_m.max, 0.010) << kind;
  }
}

// A climb's error lasts (how its world was tied to LIO's), so that its ticks are nearly one case: twenty climbs are
// twenty. The covariance was set on the kinematic plant. Under physics it is too sure, by 1.2 to 1.5 in sigma
// (toolchain/campaign odometry, 2026-11-23: 4.1 and 6.2 where 3 is honest): these bounds say that it is not worse.
class ClimbOdometrySeeds : public testing::TestWithParam<std::uint64_t> {};

TEST_P(ClimbOdometrySeeds, FusedPosition_TwentyClimbs_SquaredErrorOverVarianceIsBounded) {
  constexpr std::uint64_t kSeeds = 20;
  double mean = 0.0, in_bounds = 0.0;
  for (std::uint64_t seed = GetParam(); seed < GetParam() + kSeeds; ++seed) {
    const OdometryFigures f = climb(seed, 10);
    mean += f.nees_mean / kSeeds;
    in_bounds += f.nees_in_bounds / kSeeds;
  }
  std::printf("mean %.2f of 3, within the 95 %% bounds in %.1f %% of the ticks\n", mean, 100.0 * in_bounds);
  EXPECT_GT(mean, 2.0);
  EXPECT_LT(mean, 8.0);
  EXPECT_GE(in_bounds, 0.6);
}

INSTANTIATE_TEST_SUITE_P(Long, ClimbOdometrySeeds, testing::Values(1, 101));

}  // namespace
}  // namespace polygmap::sim
