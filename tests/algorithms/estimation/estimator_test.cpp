// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/estimator.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "algorithms/geometry/so3.hpp"
#include "sim_stub/sensors/imu_interval.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/slow_machine.hpp"
#include "tests/support/synthetic_walk.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kNaN;
using test::kTick_ns;
using test::kTick_s;
using test::SyntheticWalk;
using test::WalkSpec;
using test::WalkTruth;

constexpr std::array<bool, kFootCount> kBothStand{true, true};
class EstimatorTest : public ::testing::Test {
 protected:
  void tick(const ImuSample& imu, const JointFeedback& joints, const std::array<bool, kFootCount>& stance) {
    estimator_.add_imu(imu, t_ns_);
    estimator_.add_joints(joints, t_ns_);
    estimator_.tick(stance);
  }
  // Runs to `until_ns` (exclusive), LIO arriving late; each(tick) after every tick.
  template <typename Each>
  void run(SyntheticWalk& walk, const WalkSpec& spec, std::int64_t until_ns, bool with_lio, const Each& each) {
    for (; t_ns_ < std::min(until_ns, walk.end_ns()); t_ns_ += kTick_ns) {
      const ImuSample imu = walk.imu(t_ns_);
      const JointFeedback joints = walk.joints(t_ns_);
      tick(imu, joints, walk.truth(t_ns_).stance);
      const std::int64_t stamp_ns = t_ns_ - spec.lio_delay_ns;
      if (with_lio && stamp_ns >= 0 && t_ns_ % (100 * kNsPerMs) == 0) estimator_.add_lio(walk.lio(stamp_ns), t_ns_);
      each(t_ns_);
    }
  }
  void run(SyntheticWalk& walk, const WalkSpec& spec, std::int64_t until_ns) {
    run(walk, spec, until_ns, false, [](std::int64_t) {});
  }
  // Odom in the truth's world, fixed at the first initialised tick.
  bool align(const SyntheticWalk& walk) {
    if (!aligned_ && estimator_.state().initialised) {
      true_T_odom_ = walk.truth(t_ns_).true_T_base * estimator_.state().odom_T_base.inverse();
      aligned_ = true;
    }
    return aligned_;
  }
  void SetUp() override { estimator_.reset({}, nominal_robot()); }

  static Estimator estimator_;  // its ring is too large for a stack
  std::int64_t t_ns_ = 0;
  Transform true_T_odom_;
  bool aligned_ = false;
};
Estimator EstimatorTest::estimator_;

TEST_F(EstimatorTest, Standstill_BiasedSensors_FindsBiasTiltAndFloor) {
  const WalkSpec spec;
  SyntheticWalk walk(spec);
  run(walk, spec, 990 * kNsPerMs);
  EXPECT_FALSE(estimator_.state().initialised);
  run(walk, spec, 1100 * kNsPerMs);
  const StateEstimate& state = estimator_.state();
  ASSERT_TRUE(state.initialised);
  EXPECT_LT((estimator_.odometry().filter().gyro_bias_radps() - walk.gyro_bias_radps()).norm(), 6e-4);
  EXPECT_NEAR(yaw_of(state.odom_T_base.R), 0.0, 5e-4);
  EXPECT_LT(so3_log(state.odom_T_base.R).head<2>().norm(),
            0.02);  // accelerometer bias and mount: 0.4 deg each, 1 sigma
  EXPECT_NEAR(0.5 * (state.odom_T_sole[0].p_m.z() + state.odom_T_sole[1].p_m.z()), 0.0, 5e-4);
  // By what the first sample had the tilt wrong: the soles have not moved since.
  EXPECT_NEAR(state.odom_T_base.p_m.x(), 0.0, 5e-3);
  EXPECT_NEAR(state.odom_T_base.p_m.y(), 0.0, 5e-3);
  EXPECT_NEAR(state.odom_T_base.p_m.z(), 0.77, 0.01);
  EXPECT_EQ(state.lio_age_ns, -1);
}

TEST_F(EstimatorTest, Standstill_RobotIsMoved_StartsOver) {
  const WalkSpec spec;
  SyntheticWalk walk(spec);
  run(walk, spec, 800 * kNsPerMs);
  ImuSample pushed = walk.imu(t_ns_);
  pushed.gyro_radps.x() = 0.3;
  tick(pushed, walk.joints(t_ns_), kBothStand);
  t_ns_ += kTick_ns;
  EXPECT_EQ(estimator_.counters().standstill_restarts, 1U);
  run(walk, spec, 1700 * kNsPerMs);
  EXPECT_FALSE(estimator_.state().initialised);
  run(walk, spec, 1900 * kNsPerMs);
  EXPECT_TRUE(estimator_.state().initialised);
}

TEST_F(EstimatorTest, Walk_PerfectSensors_FollowsTheTruth) {
  WalkSpec spec;
  spec.noise_scale = 0.0;
  spec.steps = 3;
  spec.yaw_per_step_rad = 0.1;
  SyntheticWalk walk(spec);
  double worst_m = 0.0, worst_rad = 0.0, worst_mps = 0.0;
  run(walk, spec, walk.end_ns(), false, [&](std::int64_t t_ns) {
    if (!align(walk)) return;
    const StateEstimate& s = estimator_.state();
    const Transform estimated = true_T_odom_ * s.odom_T_base, truth = walk.truth(t_ns).true_T_base;
    worst_m = std::max(worst_m, (estimated.p_m - truth.p_m).norm());
    worst_rad = std::max(worst_rad, so3_log(truth.R.transpose() * estimated.R).norm());
    const Vec3 v = (walk.truth(t_ns + kNsPerMs).true_T_base.p_m - walk.truth(t_ns - kNsPerMs).true_T_base.p_m) / 2e-3;
    worst_mps = std::max(worst_mps, (true_T_odom_.R * s.odom_v_base_mps - v).norm());
  });
  EXPECT_LT(worst_m, 2e-3);
  EXPECT_LT(worst_rad, 1e-3);
  EXPECT_LT(worst_mps, 0.011);  // a bias that is known to 2 mrad/s is bent by what contacts creep
}

TEST_F(EstimatorTest, Walk_NoisySensorsWithoutLio_DriftStaysBelowOnePercentAndIsSmooth) {
  double sum2_m2 = 0.0;
  constexpr int kSeeds = test::kSlowMachine ? 2 : 8;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 6;
    SyntheticWalk walk(spec);
    estimator_.reset({}, nominal_robot());
    t_ns_ = 0;
    aligned_ = false;
    Transform estimated_before, truth_before;
    double worst_tick_m = 0.0, worst_yaw_rad = 0.0, worst_tilt_rad = 0.0, worst_mps = 0.0;
    bool have_before = false;
    run(walk, spec, walk.end_ns(), false, [&](std::int64_t t_ns) {
      if (!align(walk)) return;
      const Transform estimated = true_T_odom_ * estimator_.state().odom_T_base, truth = walk.truth(t_ns).true_T_base;
      if (have_before) {
        worst_tick_m =
            std::max(worst_tick_m, ((estimated.p_m - estimated_before.p_m) - (truth.p_m - truth_before.p_m)).norm());
      }
      const Vec3 turn = so3_log(truth.R.transpose() * estimated.R);
      worst_yaw_rad = std::max(worst_yaw_rad, std::abs(turn.z()));
      worst_tilt_rad = std::max(worst_tilt_rad, turn.head<2>().norm());
      const Vec3 v = (truth.p_m - truth_before.p_m) / kTick_s;
      if (have_before) {
        worst_mps = std::max(worst_mps, (true_T_odom_.R * estimator_.state().odom_v_base_mps - v).norm());
      }
      estimated_before = estimated;
      truth_before = truth;
      have_before = true;
    });
    const Vec3 error_m = estimated_before.p_m - truth_before.p_m;
    sum2_m2 += error_m.squaredNorm();
    EXPECT_LT(worst_tick_m, 3e-4) << seed;
    EXPECT_LT(worst_yaw_rad, 5e-3) << seed;
    EXPECT_LT(worst_tilt_rad, 2.5e-3) << seed;
    EXPECT_LT(worst_mps, 0.03) << seed;
    for (int a = 0; a < 3; ++a) EXPECT_LT(std::abs(error_m[a]), 3.0 * estimator_.state().position_sigma_m[a]) << seed;
  }
  constexpr double kWay_m = 1.85;  // six steps up
  EXPECT_LT(std::sqrt(sum2_m2 / kSeeds), 0.01 * kWay_m);
}

TEST_F(EstimatorTest, TreadHeight_SlightlyOff_IsTakenSoftlyAndForgottenAtLiftOff) {
  WalkSpec spec;
  spec.steps = 1;
  spec.noise_scale = 0.0;
  SyntheticWalk walk(spec);
  run(walk, spec, 4500 * kNsPerMs);  // the right foot swings, the left one is on the tread
  ASSERT_FALSE(walk.truth(t_ns_).stance[1]);
  ASSERT_DOUBLE_EQ(estimator_.state().contact_probability[0], 1.0);
  const double tread_z = estimator_.state().odom_T_sole[0].p_m.z();
  estimator_.set_tread_height(Foot::kLeft, tread_z + 0.015, 0.004);
  double before = tread_z, largest = 0.0;
  run(walk, spec, walk.end_ns(), false, [&](std::int64_t) {
    const double z = estimator_.state().odom_T_sole[0].p_m.z();
    largest = std::max(largest, std::abs(z - before));
    before = z;
  });
  EXPECT_GT(before - tread_z, 3e-4);
  EXPECT_LT(before - tread_z, 0.0155);
  EXPECT_LT(largest, 1e-4);
  EXPECT_EQ(estimator_.counters().height_rejected, 0U);
}

TEST_F(EstimatorTest, TreadHeight_FarOffOrNonsense_IsRejectedAndCounted) {
  WalkSpec spec;
  SyntheticWalk walk(spec);
  estimator_.set_tread_height(Foot::kLeft, 0.0, 0.003);  // not initialised yet
  EXPECT_EQ(estimator_.counters().height_invalid, 1U);
  run(walk, spec, 1500 * kNsPerMs);
  estimator_.set_tread_height(Foot::kLeft, 0.05, 0.003);
  EXPECT_EQ(estimator_.counters().height_rejected, 1U);
  estimator_.set_tread_height(Foot::kLeft, kNaN, 0.003);
  estimator_.set_tread_height(Foot::kLeft, 0.0, 0.0);
  EXPECT_EQ(estimator_.counters().height_invalid, 3U);
  const double z = estimator_.state().odom_T_base.p_m.z();
  run(walk, spec, 2000 * kNsPerMs);
  EXPECT_NEAR(estimator_.state().odom_T_base.p_m.z(), z, 1e-3);
}

TEST_F(EstimatorTest, BadSamples_EveryKind_IsCountedAndTheStateStaysGood) {
  const WalkSpec spec;
  SyntheticWalk walk(spec);
  run(walk, spec, 1500 * kNsPerMs);
  const Transform before = estimator_.state().odom_T_base;
  const auto spoilt = [&](auto&& spoil) {
    ImuSample imu = walk.imu(t_ns_);
    JointFeedback joints = walk.joints(t_ns_);
    spoil(imu, joints);
    tick(imu, joints, kBothStand);
    t_ns_ += kTick_ns;
  };
  spoilt([](ImuSample& imu, JointFeedback&) { imu.gyro_radps.y() = kNaN; });
  spoilt([](ImuSample& imu, JointFeedback&) { imu.accel_mps2.z() = 1e9; });
  spoilt([](ImuSample& imu, JointFeedback&) { imu.stamp_ns -= 4 * kTick_ns; });
  spoilt([](ImuSample&, JointFeedback& joints) { joints.q_rad[3] = kNaN; });
  spoilt([](ImuSample&, JointFeedback& joints) { joints.foot_force_n[0] = std::numeric_limits<double>::infinity(); });
  spoilt([](ImuSample&, JointFeedback& joints) { joints.stamp_ns -= 10 * kTick_ns; });
  spoilt([](ImuSample&, JointFeedback& joints) { joints.q_rad[3] += 0.5; });
  spoilt([](ImuSample& imu, JointFeedback& joints) {
    imu.stamp_ns = -1;
    joints.stamp_ns = -1;
  });
  t_ns_ += 60 * kTick_ns;
  spoilt([](ImuSample&, JointFeedback&) {});
  const Estimator::Counters& counters = estimator_.counters();
  EXPECT_EQ(counters.imu_invalid, 2U);
  EXPECT_EQ(counters.imu_stale, 2U);
  EXPECT_EQ(estimator_.leg_sensing().counters().invalid, 2U);
  EXPECT_EQ(estimator_.leg_sensing().counters().stale, 2U);
  EXPECT_EQ(estimator_.leg_sensing().counters().jump, 1U);
  EXPECT_EQ(counters.gaps, 1U);
  const StateEstimate& state = estimator_.state();
  EXPECT_EQ(state.stamp_ns, t_ns_ - kTick_ns);
  EXPECT_LT((state.odom_T_base.p_m - before.p_m).norm(), 1e-3);
  EXPECT_LT(so3_log(before.R.transpose() * state.odom_T_base.R).norm(), 2e-3);
}

// A robot that is known by its feet alone, on the way already: no standstill, no joints.
TEST_F(EstimatorTest, StartGiven_PointFeetWithStatedContact_CarryTheStateOn) {
  const Vec3 base_p_left_m{0.0, 0.1, -0.8};
  const auto legs_at = [&](std::int64_t stamp_ns, double gone_m) {
    LegSample sample;
    sample.stamp_ns = stamp_ns;
    sample.stated_contact = {1.0, 0.0};
    for (LegMeasurement& leg : sample.legs) {
      leg.sole_known = false;
      leg.base_T_sole.p_m = base_p_left_m - Vec3{gone_m, 0.0, 0.0};
    }
    return sample;
  };
  constexpr double kSpeed_mps = 0.2;
  estimator_.add_imu({0, Vec3::Zero(), Vec3{0, 0, kGravity_mps2}}, 0);
  estimator_.add_legs(legs_at(0, 0.0));
  estimator_.tick({true, true});
  EXPECT_FALSE(estimator_.state().initialised) << "legs alone are no standstill";
  ContactInEkf::Start start;
  start.odom_v_base_mps = {kSpeed_mps, 0.0, 0.0};
  start.odom_p_base_m = {0.0, 0.0, 0.8};
  estimator_.start(start);
  EXPECT_TRUE(estimator_.state().initialised);
  EXPECT_EQ(estimator_.state().odom_T_base.p_m, start.odom_p_base_m);
  std::int64_t t_ns = 0;
  for (int i = 0; i < 500; ++i) {
    t_ns += kTick_ns;
    estimator_.add_imu({t_ns, Vec3::Zero(), Vec3{0, 0, kGravity_mps2}}, t_ns);
    estimator_.add_legs(legs_at(t_ns, kSpeed_mps * seconds(t_ns)));
    estimator_.tick({true, true});
  }
  EXPECT_EQ(estimator_.state().stamp_ns, t_ns);
  EXPECT_NEAR(estimator_.state().odom_T_base.p_m.x(), kSpeed_mps * seconds(t_ns), 1e-3);
  EXPECT_TRUE(estimator_.contacts()[0].stands);
  EXPECT_FALSE(estimator_.contacts()[1].stands);
}

// Of samples of moments, a turn that grows evenly: the mean of both ends is right, the end is half a sample ahead.
TEST_F(EstimatorTest, ImuOfMoments_CountsAsTheMeanOfBothEnds) {
  Estimator::Params params;
  params.imu_of_moments = true;
  const RobotModel robot;
  for (const bool of_moments : {true, false}) {
    params.imu_of_moments = of_moments;
    estimator_.reset(params, robot);
    constexpr std::int64_t kPeriod_ns = 10 * kNsPerMs;
    constexpr double kTurn_radps2 = 1.0;
    LegSample legs;
    legs.stated_contact = {0.0, 0.0};
    for (LegMeasurement& leg : legs.legs) leg.sole_known = false;
    for (std::int64_t t_ns = 0; t_ns <= 500 * kNsPerMs; t_ns += kPeriod_ns) {
      estimator_.add_imu({t_ns, Vec3{0, 0, kTurn_radps2 * seconds(t_ns)}, Vec3{0, 0, kGravity_mps2}}, t_ns);
      legs.stamp_ns = t_ns;
      estimator_.add_legs(legs);
      if (t_ns == 0) {
        estimator_.start({});
      } else {
        estimator_.tick({true, true});
      }
    }
    const Mat3& R = estimator_.state().odom_T_base.R;
    EXPECT_NEAR(std::atan2(R(1, 0), R(0, 0)), of_moments ? 0.125 : 0.125 + 0.5 * 0.5 * seconds(kPeriod_ns), 2e-4);
  }
}

// A wrong clock, once: were its stamp taken, every later sample would be a stale one.
TEST_F(EstimatorTest, StampsOfTheFuture_OfEitherSensor_AreCountedAndTheNextSampleIsTaken) {
  const WalkSpec spec;
  SyntheticWalk walk(spec);
  run(walk, spec, 1500 * kNsPerMs);
  ImuSample imu = walk.imu(t_ns_);
  JointFeedback joints = walk.joints(t_ns_);
  imu.stamp_ns = joints.stamp_ns = t_ns_ + kNsPerS;
  tick(imu, joints, kBothStand);
  t_ns_ += kTick_ns;
  EXPECT_EQ(estimator_.counters().imu_future, 1U);
  EXPECT_EQ(estimator_.leg_sensing().counters().future, 1U);
  run(walk, spec, 1600 * kNsPerMs);
  EXPECT_EQ(estimator_.counters().imu_stale + estimator_.leg_sensing().counters().stale, 0U);
  EXPECT_EQ(estimator_.state().oldest_input_ns, t_ns_ - kTick_ns);
}

// A frame that catches up gets samples of after its own time.
TEST_F(EstimatorTest, StampsSixMillisecondsAhead_OfALateTick_AreTaken) {
  const WalkSpec spec;
  SyntheticWalk walk(spec);
  estimator_.add_imu(walk.imu(6 * kNsPerMs), 0);
  estimator_.add_joints(walk.joints(6 * kNsPerMs), 0);
  EXPECT_EQ(estimator_.newest_imu_ns(), 6 * kNsPerMs);
  EXPECT_EQ(estimator_.leg_sensing().joints().stamp_ns, 6 * kNsPerMs);
}

TEST_F(EstimatorTest, ImuFasterThanTheTick_EverySampleCounts) {
  WalkSpec spec;
  spec.noise_scale = 0.0;
  SyntheticWalk walk(spec);
  run(walk, spec, 1500 * kNsPerMs);
  ASSERT_TRUE(estimator_.state().initialised);
  for (int i = 3; i >= 0; --i) {  // all of the turn is in the oldest of four
    ImuSample imu = walk.imu(t_ns_);
    imu.stamp_ns -= i * kTick_ns / 4;
    if (i == 3) imu.gyro_radps.z() = 0.4;
    estimator_.add_imu(imu, t_ns_);
  }
  estimator_.add_joints(walk.joints(t_ns_), t_ns_);
  estimator_.tick(kBothStand);
  EXPECT_NEAR(estimator_.state().base_w_base_radps.z(), 0.1, 1e-3);
}

// In cycles without a sample the last one holds.
TEST_F(EstimatorTest, ImuSlowerThanTheTick_FollowsTheTruthNearlyAsWellAndItsSigmasTell) {
  struct Outcome {
    double worst_m = 0.0, worst_rad = 0.0, sigma_m = 0.0, tilt_sigma_rad = 0.0;
  };
  const auto climb = [&](std::int64_t interval_ns) {
    WalkSpec spec;
    spec.steps = 2;
    spec.yaw_per_step_rad = 0.1;
    SyntheticWalk walk(spec);
    sim::ImuInterval imu(interval_ns, kTick_ns);
    estimator_.reset({}, nominal_robot());
    aligned_ = false;
    Outcome outcome;
    for (t_ns_ = 0; t_ns_ < walk.end_ns(); t_ns_ += kTick_ns) {
      ImuSample sample;
      if (imu.push(walk.imu(t_ns_), sample)) estimator_.add_imu(sample, t_ns_);
      estimator_.add_joints(walk.joints(t_ns_), t_ns_);
      const WalkTruth truth = walk.truth(t_ns_);
      estimator_.tick(truth.stance);
      if (!align(walk)) continue;
      const Transform estimated = true_T_odom_ * estimator_.state().odom_T_base;
      outcome.worst_m = std::max(outcome.worst_m, (estimated.p_m - truth.true_T_base.p_m).norm());
      outcome.worst_rad = std::max(outcome.worst_rad, so3_log(truth.true_T_base.R.transpose() * estimated.R).norm());
    }
    EXPECT_TRUE(aligned_);
    EXPECT_EQ(estimator_.counters().gaps, 0U);
    outcome.sigma_m = estimator_.state().position_sigma_m.norm();
    outcome.tilt_sigma_rad = estimator_.state().tilt_sigma_rad;
    return outcome;
  };
  const Outcome every_tick = climb(kTick_ns);
  struct Times {
    std::int64_t interval_ns;
    double worst_m, worst_rad;
  };
  for (const Times& most : {Times{5 * kNsPerMs, 1.3, 2.5}, Times{10 * kNsPerMs, 1.8, 5.0}}) {
    const Outcome slow = climb(most.interval_ns);
    EXPECT_LT(slow.worst_m, most.worst_m * every_tick.worst_m) << most.interval_ns;
    EXPECT_LT(slow.worst_rad, most.worst_rad * every_tick.worst_rad) << most.interval_ns;
    EXPECT_GT(slow.sigma_m, 0.95 * every_tick.sigma_m) << most.interval_ns;  // its feet agree less well
    EXPECT_LT(slow.sigma_m, most.worst_m * every_tick.sigma_m) << most.interval_ns;
    EXPECT_NEAR(slow.tilt_sigma_rad, every_tick.tilt_sigma_rad, 0.05 * every_tick.tilt_sigma_rad) << most.interval_ns;
  }
}

TEST_F(EstimatorTest, OneSensorSilentInSwing_OtherOneCarriesTheStateOn) {
  for (const bool imu_silent : {true, false}) {
    WalkSpec spec;
    spec.steps = 1;
    SyntheticWalk walk(spec);
    estimator_.reset({}, nominal_robot());
    t_ns_ = 0;
    aligned_ = false;
    run(walk, spec, 3000 * kNsPerMs, false, [&](std::int64_t) { align(walk); });
    ASSERT_FALSE(walk.truth(t_ns_).stance[0]);
    const std::int64_t silent_since_ns = t_ns_;
    // Legs alone for the rest of the swing; the IMU alone for half as long as it takes to drift away.
    const std::int64_t until_ns = t_ns_ + (imu_silent ? 400 : 100) * kNsPerMs;
    for (; t_ns_ < until_ns; t_ns_ += kTick_ns) {
      const ImuSample imu = walk.imu(t_ns_);
      const JointFeedback joints = walk.joints(t_ns_);
      if (imu_silent) {
        estimator_.add_joints(joints, t_ns_);
      } else {
        estimator_.add_imu(imu, t_ns_);
      }
      estimator_.tick(walk.truth(t_ns_).stance);
    }
    const StateEstimate& state = estimator_.state();
    EXPECT_EQ(state.stamp_ns, t_ns_ - kTick_ns);
    EXPECT_EQ(state.oldest_input_ns, silent_since_ns - kTick_ns);
    const Transform truth = walk.truth(state.stamp_ns).true_T_base;
    EXPECT_LT(((true_T_odom_ * state.odom_T_base).p_m - truth.p_m).norm(), 0.01) << imu_silent;
    StateEstimate then;  // nothing late is fused with a state on one leg
    EXPECT_TRUE(estimator_.try_state_at(silent_since_ns + 20 * kNsPerMs, then));
    EXPECT_FALSE(estimator_.try_state_at(state.stamp_ns, then));
    run(walk, spec, t_ns_ + 200 * kNsPerMs);
    EXPECT_EQ(estimator_.state().oldest_input_ns, t_ns_ - kTick_ns);
    EXPECT_TRUE(estimator_.try_state_at(t_ns_ - kTick_ns, then));
    EXPECT_FALSE(estimator_.try_state_at(until_ns - 30 * kNsPerMs, then)) << "in the gap";
  }
}

TEST_F(EstimatorTest, StateAt_BetweenTicks_IsInterpolatedAndOutsideRefused) {
  WalkSpec spec;
  SyntheticWalk walk(spec);
  run(walk, spec, 4000 * kNsPerMs);
  StateEstimate a, b, middle;
  const std::int64_t at_ns = t_ns_ - 100 * kTick_ns;
  ASSERT_TRUE(estimator_.try_state_at(at_ns, a));
  ASSERT_TRUE(estimator_.try_state_at(at_ns + kTick_ns, b));
  ASSERT_TRUE(estimator_.try_state_at(at_ns + kTick_ns / 2, middle));
  EXPECT_EQ(middle.stamp_ns, at_ns + kTick_ns / 2);
  EXPECT_LT((middle.odom_T_base.p_m - 0.5 * (a.odom_T_base.p_m + b.odom_T_base.p_m)).norm(), 1e-12);
  EXPECT_LT((so3_log(a.odom_T_base.R.transpose() * middle.odom_T_base.R) -
             0.5 * so3_log(a.odom_T_base.R.transpose() * b.odom_T_base.R))
                .norm(),
            1e-12);
  EXPECT_LT((middle.q_rad - 0.5 * (a.q_rad + b.q_rad)).norm(), 1e-12);
  EXPECT_LT((middle.odom_T_sole[1].p_m - 0.5 * (a.odom_T_sole[1].p_m + b.odom_T_sole[1].p_m)).norm(), 1e-12);
  EXPECT_FALSE(estimator_.try_state_at(t_ns_ + kTick_ns, middle));
  EXPECT_FALSE(estimator_.try_state_at(t_ns_ - 600 * kNsPerMs, middle));
  EXPECT_TRUE(estimator_.try_state_at(t_ns_ - 500 * kNsPerMs, middle));
}

TEST_F(EstimatorTest, SameInputs_RunTwice_SameBits) {
  std::array<StateEstimate, 2> end;
  for (StateEstimate& state : end) {
    WalkSpec spec;
    spec.steps = 1;
    SyntheticWalk walk(spec);
    estimator_.reset({}, nominal_robot());
    t_ns_ = 0;
    run(walk, spec, walk.end_ns(), true, [](std::int64_t) {});
    state = estimator_.state();
  }
  EXPECT_EQ(end[0].odom_T_base.p_m, end[1].odom_T_base.p_m);
  EXPECT_EQ(end[0].world_T_odom.R, end[1].world_T_odom.R);
}
}  // namespace
}  // namespace polygmap
