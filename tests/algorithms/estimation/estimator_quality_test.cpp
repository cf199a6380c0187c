// SPDX-License-Identifier: Apache-2.0
// What a controller is told of the estimate besides the pose, and a foot that slips.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "algorithms/estimation/estimator.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/slow_machine.hpp"
#include "tests/support/synthetic_walk.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_ns;
using test::SyntheticWalk;
using test::WalkSpec;

struct WalkErrors {
  double worst_m = 0.0;
  double velocity_rmse_mps = 0.0;
};

class EstimatorQualityTest : public ::testing::Test {
 protected:
  template <typename Each>
  void run(const WalkSpec& spec, const Estimator::Params& params, bool with_lio, const Each& each) {
    SyntheticWalk walk(spec);
    estimator_.reset(params, nominal_robot());
    for (std::int64_t t_ns = 0; t_ns < walk.end_ns(); t_ns += kTick_ns) {
      estimator_.add_imu(walk.imu(t_ns), t_ns);
      estimator_.add_joints(walk.joints(t_ns), t_ns);
      estimator_.tick(walk.truth(t_ns).stance);
      const std::int64_t stamp_ns = t_ns - spec.lio_delay_ns;
      if (with_lio && stamp_ns >= 0 && t_ns % (100 * kNsPerMs) == 0) estimator_.add_lio(walk.lio(stamp_ns), t_ns);
      if (estimator_.state().initialised) each(walk, t_ns);
    }
  }
  // Of the odometry, without heights of treads.
  WalkErrors walk_errors(const WalkSpec& spec, const Estimator::Params& params) {
    WalkErrors errors;
    Transform true_T_odom;
    double ticks = 0.0;
    run(spec, params, false, [&](const SyntheticWalk& walk, std::int64_t t_ns) {
      const StateEstimate& state = estimator_.state();
      const Transform truth = walk.truth(t_ns).true_T_base;
      if (ticks == 0.0) true_T_odom = truth * state.odom_T_base.inverse();
      ticks += 1.0;
      const Vec3 v_mps =
          (walk.truth(t_ns + kNsPerMs).true_T_base.p_m - walk.truth(t_ns - kNsPerMs).true_T_base.p_m) / 2e-3;
      errors.worst_m = std::max(errors.worst_m, (true_T_odom * state.odom_T_base.p_m - truth.p_m).norm());
      errors.velocity_rmse_mps += (true_T_odom.R * state.odom_v_base_mps - v_mps).squaredNorm();
    });
    errors.velocity_rmse_mps = std::sqrt(errors.velocity_rmse_mps / ticks);
    return errors;
  }

  static Estimator estimator_;  // its ring is too large for a stack
};
Estimator EstimatorQualityTest::estimator_;

TEST_F(EstimatorQualityTest, Climb_EveryTick_CovarianceIsSymmetricPositiveAndHasTheStatesSigmas) {
  WalkSpec spec;
  spec.steps = 2;
  run(spec, {}, true, [&](const SyntheticWalk&, std::int64_t) {
    const StateEstimate& state = estimator_.state();
    const EstimateQuality& quality = estimator_.quality();
    ASSERT_EQ(quality.stamp_ns, state.stamp_ns);
    ASSERT_EQ(estimator_.counters().stamp_ns, state.stamp_ns);
    ASSERT_EQ(quality.covariance, quality.covariance.transpose());
    ASSERT_GT((quality.covariance.ldlt().vectorD().minCoeff()), 0.0);
    const Eigen::Matrix<double, 9, 1> sigma = quality.covariance.diagonal().cwiseSqrt();
    ASSERT_LT((sigma.head<3>() - state.position_sigma_m).norm(), 1e-12);
    ASSERT_LT((sigma.segment<3>(3) - state.velocity_sigma_mps).norm(), 1e-12);
    ASSERT_NEAR(sigma[8], state.yaw_sigma_rad, 1e-12);
  });
}

TEST_F(EstimatorQualityTest, Climb_Innovations_AreCountedByGroupAndStamped) {
  WalkSpec spec;
  spec.steps = 4;
  run(spec, {}, true, [](const SyntheticWalk&, std::int64_t) {});
  const EstimateQuality& quality = estimator_.quality();
  const auto of = [&](MeasurementGroup group) { return quality.innovations_of(group); };
  const auto steps = of(MeasurementGroup::kFootPosition).count;
  EXPECT_GT(steps, 5000U);
  EXPECT_EQ(of(MeasurementGroup::kSoleAttitude).count, steps);
  EXPECT_GT(of(MeasurementGroup::kTreadHeight).count, 500U);  // the floor, until both feet have left it
  EXPECT_LT(of(MeasurementGroup::kTreadHeight).count, steps);
  EXPECT_LT(of(MeasurementGroup::kTreadHeight).stamp_ns, quality.stamp_ns - kNsPerS);
  EXPECT_EQ(of(MeasurementGroup::kFootPosition).stamp_ns, quality.stamp_ns);
  EXPECT_GT(of(MeasurementGroup::kLioPosition).count, 50U);
  EXPECT_EQ(of(MeasurementGroup::kLioYaw).count, of(MeasurementGroup::kLioPosition).count);
  EXPECT_LT(of(MeasurementGroup::kLioPosition).stamp_ns, quality.stamp_ns);
  EXPECT_NEAR(of(MeasurementGroup::kLioPosition).mean, 1.0, 0.5);
  for (const InnovationStatistics& group : quality.innovations) {
    EXPECT_GT(group.mean, 0.0);
    EXPECT_LT(group.mean, 2.0);
  }
}

// In double support, alone, and early: the left foot stands on the first step from 3.4 to 5.5 s, alone from 4.1 to 4.8.
TEST_F(EstimatorQualityTest, FootSlipsThreeTenthsForAFifthOfASecond_PositionStaysWithinTwentyMillimetres) {
  Estimator::Params careless;
  careless.motion.gain = 0.0;
  constexpr std::uint32_t kSeeds = test::kSlowMachine ? 1 : 4;
  for (const std::int64_t slip_ms : {3500, 3800, 4300, 4500, 5000}) {
    for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
      WalkSpec spec;
      spec.seed = seed;
      spec.steps = 2;
      spec.slip_ns = slip_ms * kNsPerMs;
      EXPECT_LT(walk_errors(spec, {}).worst_m, 0.020) << slip_ms << " ms, seed " << seed;
    }
  }
  WalkSpec spec;
  spec.steps = 2;
  spec.slip_ns = 4300 * kNsPerMs;
  EXPECT_GT(walk_errors(spec, careless).worst_m, 0.020);
}

TEST_F(EstimatorQualityTest, Climb_VelocityErrors_AreWithinThreeOfTheirSigmas) {
  constexpr std::uint32_t kSeeds = test::kSlowMachine ? 1 : 4;
  double ticks = 0.0, within = 0.0, squares = 0.0;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 4;
    run(spec, {}, false, [&](const SyntheticWalk& walk, std::int64_t t_ns) {
      const StateEstimate& state = estimator_.state();
      const Vec3 v_mps =
          (walk.truth(t_ns + kNsPerMs).true_T_base.p_m - walk.truth(t_ns - kNsPerMs).true_T_base.p_m) / 2e-3;
      const Vec3 true_v_mps = walk.truth(t_ns).true_T_base.R * state.odom_T_base.R.transpose() * state.odom_v_base_mps;
      const Vec3 errors = (true_v_mps - v_mps).cwiseQuotient(state.velocity_sigma_mps);
      ticks += 1.0;
      squares += errors.squaredNorm();
      within += errors.cwiseAbs().maxCoeff() <= 3.0 ? 1.0 : 0.0;
    });
  }
  EXPECT_GT(within / ticks, 0.95);
  EXPECT_GT(squares / ticks, 0.15);  // of 3: they mean something, though no foot creeps here as real ones do
}

TEST_F(EstimatorQualityTest, NoSlip_VelocityIsAsGoodAsThatOfAFilterThatLetsNothingGo) {
  Estimator::Params careless;
  careless.motion.gain = 0.0;
  constexpr std::uint32_t kSeeds = test::kSlowMachine ? 1 : 6;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 4;
    EXPECT_LT(walk_errors(spec, {}).velocity_rmse_mps, 1.05 * walk_errors(spec, careless).velocity_rmse_mps) << seed;
  }
}
}  // namespace
}  // namespace polygmap
