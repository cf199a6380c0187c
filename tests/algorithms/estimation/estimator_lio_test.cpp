// SPDX-License-Identifier: Apache-2.0
// The stage with LIO as it comes: late, noisy, silent, wrong.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "algorithms/estimation/estimator.hpp"
#include "algorithms/geometry/so3.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/slow_machine.hpp"
#include "tests/support/synthetic_walk.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kLioPeriod_ns;
using test::kNaN;
using test::kTick_ns;
using test::SyntheticWalk;
using test::WalkSpec;
using test::WalkTruth;

class EstimatorLioTest : public ::testing::Test {
 protected:
  void SetUp() override { start(); }
  void start() {
    estimator_.reset({}, nominal_robot());
    t_ns_ = 0;
    aligned_ = false;
    worst_m_ = most_slewed_m_ = most_slewed_rad_ = 0.0;
  }
  // LIO comes at 10 Hz and 100 ms late. after: whatever is to be looked at, once per tick, from the first state on.
  template <typename Deliver, typename After>
  void run(SyntheticWalk& walk, std::int64_t until_ns, const Deliver& deliver, const After& after) {
    for (; t_ns_ < std::min(until_ns, walk.end_ns()); t_ns_ += kTick_ns) {
      const Transform world_T_odom = estimator_.state().world_T_odom;
      estimator_.add_imu(walk.imu(t_ns_), t_ns_);
      estimator_.add_joints(walk.joints(t_ns_), t_ns_);
      const WalkTruth truth = walk.truth(t_ns_);
      estimator_.tick(truth.stance);
      if (t_ns_ % kLioPeriod_ns == 0 && t_ns_ >= kLioPeriod_ns) deliver(walk.lio(t_ns_ - kLioPeriod_ns));
      const StateEstimate& state = estimator_.state();
      if (!state.initialised) continue;
      if (!aligned_) true_T_world_ = level_tie(truth.true_T_base, state.world_T_base());
      aligned_ = true;
      error_m_ = true_T_world_ * state.world_T_base().p_m - truth.true_T_base.p_m;
      worst_m_ = std::max(worst_m_, error_m_.norm());
      const Transform by_odometry = world_T_odom * state.odom_T_base, now = state.world_T_base();
      most_slewed_m_ = std::max(most_slewed_m_, (now.p_m - by_odometry.p_m).norm());
      most_slewed_rad_ = std::max(most_slewed_rad_, so3_log(by_odometry.R.transpose() * now.R).norm());
      after(state);
    }
  }
  template <typename Deliver>
  void run(SyntheticWalk& walk, std::int64_t until_ns, const Deliver& deliver) {
    run(walk, until_ns, deliver, [](const StateEstimate&) {});
  }
  // Beyond the odometry's own motion, at the base, in the worst tick.
  void expect_no_step_beyond_the_slew_limit() const {
    const LioFusion::Params params;
    EXPECT_LE(most_slewed_m_, params.slew.speed_mps * seconds(kTick_ns) * (1.0 + 1e-6));
    EXPECT_LE(most_slewed_rad_, params.slew.turn_radps * seconds(kTick_ns) * (1.0 + 1e-6));
  }
  void silent_in_the_climb(double silent_s, int steps);
  // By heading and place: both worlds know which way is up, and a tie that took the tilt's first error over would hide
  // what it does on the way.
  static Transform level_tie(const Transform& true_T_base, const Transform& world_T_base) {
    const Mat3 R = rotation_z(yaw_of(true_T_base.R) - yaw_of(world_T_base.R));
    return {R, true_T_base.p_m - R * world_T_base.p_m};
  }
  auto deliver() {
    return [this](const LioSample& sample) { estimator_.add_lio(sample, t_ns_); };
  }

  static Estimator estimator_;
  std::int64_t t_ns_ = 0;
  Transform true_T_world_;
  bool aligned_ = false;
  Vec3 error_m_ = Vec3::Zero();  // of the fused position, true axes
  double worst_m_ = 0.0, most_slewed_m_ = 0.0, most_slewed_rad_ = 0.0;
};
Estimator EstimatorLioTest::estimator_;

TEST_F(EstimatorLioTest, TenSteps_NoisyLateLio_WorldStaysWithinAFewMillimetres) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 10;
    SyntheticWalk walk(spec);
    start();
    run(walk, walk.end_ns() / 4, deliver());
    const double quarter_m = estimator_.state().odom_sigma_m;
    run(walk, walk.end_ns(), deliver());
    EXPECT_LT(worst_m_, 0.012) << seed;
    EXPECT_LT(error_m_.cwiseAbs().cwiseQuotient(estimator_.state().position_sigma_m).maxCoeff(), 3.0) << seed;
    // Odometry itself drifts on, whatever LIO knows of the place: by the map it is bound to this.
    EXPECT_GT(estimator_.state().odom_sigma_m, 1.2 * quarter_m) << seed;
    EXPECT_EQ(estimator_.counters().lio_of(LioVerdict::kJump), 0U);
    EXPECT_GT(estimator_.counters().lio_of(LioVerdict::kAccepted), 300U);
    EXPECT_LE(estimator_.state().lio_age_ns, 202 * kNsPerMs);
  }
}

// Lidar odometry drifts by 8 mm in a second and 40 mm in twenty-five, along each axis, and its sigma knows nothing of
// that, or by four times as much: the published pose is worse than the odometry's own by a tenth at most. Without
// drift it is better than the odometry's.
TEST_F(EstimatorLioTest, LioOfRandomWalk_OnTheStairs_FusedPoseIsNoWorseThanTheOdometrys) {
  for (const double drift_mprs : {0.0, 0.008, 0.03}) {
    double fused_m2 = 0.0, odometry_m2 = 0.0;
    for (std::uint32_t seed = 1; seed <= 6; ++seed) {
      WalkSpec spec;
      spec.seed = seed;
      spec.steps = 10;
      SyntheticWalk walk(spec);
      start();
      std::mt19937 random(seed);
      std::normal_distribution<double> step_m(0.0, drift_mprs * std::sqrt(0.1));  // of a tenth of a second
      Vec3 drift_m = Vec3::Zero();
      Transform true_T_odom;
      bool tied = false;
      run(
          walk, walk.end_ns(),
          [&](LioSample sample) {
            if (drift_mprs > 0.0) {
              for (double& axis_m : drift_m) axis_m += step_m(random);
            }
            sample.lio_T_lidar.p_m += drift_m;
            estimator_.add_lio(sample, t_ns_);
          },
          [&](const StateEstimate& state) {
            const Transform true_T_base = walk.truth(t_ns_).true_T_base;
            if (!tied) true_T_odom = level_tie(true_T_base, state.odom_T_base);
            tied = true;
            fused_m2 += error_m_.squaredNorm();
            odometry_m2 += (true_T_odom * state.odom_T_base.p_m - true_T_base.p_m).squaredNorm();
          });
    }
    EXPECT_LT(std::sqrt(fused_m2 / odometry_m2), drift_mprs > 0.0 ? 1.1 : 0.9) << drift_mprs;
  }
}

// The filter that balances until the standstill is over has an origin of its own, in which no pose of LIO's says
// anything.
TEST_F(EstimatorLioTest, PosesBeforeTheOdometryHasBegun_DoNotMoveTheFilterThatBalances) {
  WalkSpec spec;
  spec.stand_s = 10.0;
  std::array<Vec3, 2> filter_p_base_m, filter_v_base_mps;
  for (const bool heard : {false, true}) {
    start();
    SyntheticWalk walk(spec);
    const auto deliver = [&](const LioSample& sample) {
      if (heard) estimator_.add_lio(sample, t_ns_);
    };
    for (std::int64_t until_ns = 100 * kNsPerMs; !aligned_; until_ns += 100 * kNsPerMs) {
      ASSERT_LT(until_ns, 10 * kNsPerS);
      filter_p_base_m[heard] = estimator_.odometry().filter().odom_p_base_m();
      filter_v_base_mps[heard] = estimator_.odometry().filter().odom_v_base_mps();
      run(walk, until_ns, deliver);
    }
    EXPECT_EQ(estimator_.counters().lio_of(LioVerdict::kAccepted) > 0, heard);
  }
  EXPECT_EQ(filter_p_base_m[0], filter_p_base_m[1]);
  EXPECT_EQ(filter_v_base_mps[0], filter_v_base_mps[1]);
}

TEST_F(EstimatorLioTest, LateLio_FastWalkPerfectSensors_IsFusedAtItsStampWithoutLag) {
  WalkSpec spec;
  spec.noise_scale = 0.0;
  spec.steps = 4;
  SyntheticWalk walk(spec);
  run(walk, walk.end_ns(), deliver());
  EXPECT_LT(worst_m_, 1e-3);  // 0.3 mm; fused on arrival 5.8 mm
}

TEST_F(EstimatorLioTest, BadPoses_EveryKind_HasItsOwnCounterAndDoesNotMoveTheWorld) {
  WalkSpec spec;
  spec.stand_s = 10.0;
  SyntheticWalk walk(spec);
  run(walk, 8 * kNsPerS, deliver());
  const std::array<std::uint32_t, kLioVerdictCount> before = estimator_.counters().lio;
  const auto send = [&](auto&& spoil) {
    LioSample sample = walk.lio(t_ns_ - 50 * kNsPerMs);
    spoil(sample);
    estimator_.add_lio(sample, t_ns_);
  };
  send([](LioSample& s) { s.lio_T_lidar.p_m.x() = kNaN; });
  send([](LioSample& s) { s.lio_T_lidar.R(1, 1) = kNaN; });
  send([](LioSample& s) { s.lio_T_lidar.p_m.z() = 2e5; });
  send([](LioSample& s) { s.lio_T_lidar.R *= 1.1; });
  send([](LioSample& s) { s.lio_T_lidar.R.col(0) *= -1.0; });
  send([](LioSample& s) { s.position_sigma_m.x() = -1.0; });
  send([](LioSample& s) { s.rotation_sigma_rad.x() = kNaN; });
  send([](LioSample& s) { s.position_sigma_m.setConstant(5.0); });
  send([](LioSample& s) { s.stamp_ns += kNsPerS; });
  send([](LioSample& s) { s.lio_T_lidar.p_m.y() += 0.5; });
  send([](LioSample& s) {
    s.lio_T_lidar.R = s.lio_T_lidar.R * rotation_z(0.5);
    s.stamp_ns += 1;
  });
  send([](LioSample& s) { s.stamp_ns -= 300 * kNsPerMs; });
  const auto counted = [&](LioVerdict verdict) {
    return estimator_.counters().lio_of(verdict) - before[static_cast<std::size_t>(verdict)];
  };
  EXPECT_EQ(counted(LioVerdict::kNonFinite), 2U);
  EXPECT_EQ(counted(LioVerdict::kOutOfRange), 1U);
  EXPECT_EQ(counted(LioVerdict::kNotRotation), 2U);
  EXPECT_EQ(counted(LioVerdict::kCovariance), 3U);
  EXPECT_EQ(counted(LioVerdict::kFuture), 1U);
  EXPECT_EQ(counted(LioVerdict::kJump), 2U);
  EXPECT_EQ(counted(LioVerdict::kOrder), 1U);
  EXPECT_EQ(counted(LioVerdict::kAccepted), 0U);
  const Transform world_T_odom = estimator_.state().world_T_odom;
  run(walk, 9 * kNsPerS, [](const LioSample&) {});
  EXPECT_LT((estimator_.state().world_T_odom.p_m - world_T_odom.p_m).norm(), 1e-3);
  estimator_.add_lio(walk.lio(t_ns_ - 450 * kNsPerMs), t_ns_);
  EXPECT_EQ(counted(LioVerdict::kTooOld), 1U);
}

void EstimatorLioTest::silent_in_the_climb(double silent_s, int steps) {
  WalkSpec spec;
  spec.steps = steps;
  SyntheticWalk walk(spec);
  run(walk, 8 * kNsPerS, deliver());
  const auto silence_ns = static_cast<std::int64_t>(silent_s * 1e9);
  Vec3 sigma_m = estimator_.state().position_sigma_m;
  double yaw_sigma_rad = estimator_.state().yaw_sigma_rad;
  for (int quarter = 0; quarter < 4; ++quarter) {
    run(walk, t_ns_ + silence_ns / 4, [](const LioSample&) {});
    EXPECT_GT((estimator_.state().position_sigma_m - sigma_m).minCoeff(), 0.0) << quarter;
    EXPECT_GT(estimator_.state().yaw_sigma_rad, yaw_sigma_rad) << quarter;
    EXPECT_LT(error_m_.cwiseAbs().cwiseQuotient(estimator_.state().position_sigma_m).maxCoeff(), 3.0) << quarter;
    sigma_m = estimator_.state().position_sigma_m;
    yaw_sigma_rad = estimator_.state().yaw_sigma_rad;
  }
  ASSERT_EQ(t_ns_, 8 * kNsPerS + silence_ns) << "the walk is too short";
  EXPECT_NEAR(seconds(estimator_.state().lio_age_ns), silent_s, 0.25);
  const std::uint32_t accepted = estimator_.counters().lio_of(LioVerdict::kAccepted);
  run(walk, t_ns_ + 2 * kNsPerS, deliver());
  EXPECT_GT(estimator_.counters().lio_of(LioVerdict::kAccepted), accepted + 17U);
  EXPECT_LT(estimator_.state().lio_age_ns, 300 * kNsPerMs);
  expect_no_step_beyond_the_slew_limit();
}
TEST_F(EstimatorLioTest, SilenceOf4s_OnTheStairs_SigmaGrowsAndTheReturnIsSlewed) {
  silent_in_the_climb(4.0, 6);
  EXPECT_LT(worst_m_, 0.015);
}
TEST_F(EstimatorLioTest, SilenceOf40s_OnTheStairs_ErrorStaysWithinThreeSigmaAndTheReturnIsSlewed) {
  silent_in_the_climb(40.0, 17);
  EXPECT_LT(worst_m_, 0.033);
  // LIO is believed again, but for what the heading of its mount may have bent on 5 m.
  EXPECT_LT(estimator_.state().position_sigma_m.maxCoeff(), 0.027);
  EXPECT_GT(most_slewed_m_, LioFusion::Params{}.slew.speed_mps * seconds(kTick_ns) * 0.99);  // and the limit was needed
}

TEST_F(EstimatorLioTest, JumpsAndStampsOfTheFuture_OnTheStairs_AreCountedAndThePoseDoesNotStep) {
  WalkSpec spec;
  spec.steps = 8;
  SyntheticWalk walk(spec);
  const auto within = [this](double from_s, double to_s) { return seconds(t_ns_) > from_s && seconds(t_ns_) <= to_s; };
  run(walk, walk.end_ns(), [&](LioSample sample) {
    if (within(9.95, 10.0)) sample.lio_T_lidar.p_m.x() += 0.5;   // once
    if (within(12.0, 13.0)) sample.lio_T_lidar.p_m.z() -= 0.5;   // for a second
    if (within(14.95, 15.95)) sample.stamp_ns += 5 * kNsPerS;    // and then stamps that are right again
    if (within(18.0, 18.5)) sample.lio_T_lidar.p_m.y() += 0.02;  // too little to be seen
    estimator_.add_lio(sample, t_ns_);
  });
  EXPECT_EQ(estimator_.counters().lio_of(LioVerdict::kJump), 11U);
  EXPECT_EQ(estimator_.counters().lio_of(LioVerdict::kFuture), 10U);
  EXPECT_EQ(estimator_.counters().lio_of(LioVerdict::kOrder), 0U);
  EXPECT_EQ(estimator_.counters().lio_of(LioVerdict::kRealigned), 0U);
  EXPECT_LT(worst_m_, 0.012);
  expect_no_step_beyond_the_slew_limit();
}

TEST_F(EstimatorLioTest, LioOfASilenceOfTheJoints_HasNoOdometryAndIsCounted) {
  SyntheticWalk walk(WalkSpec{});
  run(walk, 6 * kNsPerS, deliver());
  const std::uint32_t before = estimator_.counters().lio_of(LioVerdict::kNoOdometry);  // of the very first pose
  t_ns_ += 300 * kNsPerMs;                                                             // nothing came
  run(walk, t_ns_ + 20 * kNsPerMs, [](const LioSample&) {});
  estimator_.add_lio(walk.lio(t_ns_ - 150 * kNsPerMs), t_ns_);
  EXPECT_EQ(estimator_.counters().lio_of(LioVerdict::kNoOdometry), before + 1U);
}

// Squared error over variance of the fused position, mean over seeds and ticks: 3 where the sigmas are honest, a
// quarter or four times that where they are off by a factor of two. The error of a seed lasts (how its world was tied
// to LIO's), so 30 seeds scatter as 90 squares do; the 3 of slow machines only show that it runs there. Sigmas of the
// first second are a floor.
TEST_F(EstimatorLioTest, FusedPosition_ThirtySeeds_SigmasAreHonest) {
  const int seeds = test::kSlowMachine ? 3 : 30;
  double sum = 0.0, count = 0.0;
  for (int seed = 1; seed <= seeds; ++seed) {
    WalkSpec spec;
    spec.seed = static_cast<std::uint32_t>(seed);
    spec.steps = 6;
    SyntheticWalk walk(spec);
    start();
    run(walk, walk.end_ns(), deliver(), [&](const StateEstimate& state) {
      if (seconds(t_ns_) < spec.stand_s + 1.0) return;
      sum += error_m_.cwiseQuotient(state.position_sigma_m).squaredNorm();
      ++count;
    });
  }
  EXPECT_GT(sum / count, 0.5);
  EXPECT_LT(sum / count, 4.5);
}
static_assert(sizeof(Estimator) <= 512U * 1024U, "state and ring");
}  // namespace
}  // namespace polygmap
