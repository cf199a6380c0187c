// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>

#include "algorithms/estimation/estimator.hpp"
#include "algorithms/geometry/so3.hpp"
#include "tests/support/synthetic_walk.hpp"

namespace polygmap {
namespace {

using test::SyntheticWalk;
using test::WalkSpec;
using test::WalkTruth;

constexpr std::int64_t kTick_ns = SyntheticWalk::kTick_ns;
constexpr std::int64_t kLioPeriod_ns = 100 * kNsPerMs;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// --- Eqs (5)-(10), each by itself -----------------------------------------------------------------------------------

const Transform kPose{rotation_z(0.7) * rotation_y(-0.2) * rotation_x(0.1), Vec3{1.0, -2.0, 0.8}};
const Transform kOther{rotation_z(1.3) * rotation_y(0.1) * rotation_x(-0.3), Vec3{1.4, -1.5, 0.9}};

TEST(FusionEquations, Eq5_LidarPoseThroughTheMount_IsTheBase) {
  const Transform base = base_from_lidar(kPose * base_T_lidar(), base_T_lidar());
  EXPECT_LT((base.p_m - kPose.p_m).norm(), 1e-14);
  EXPECT_LT((base.R - kPose.R).norm(), 1e-14);
}

TEST(FusionEquations, Eq6_Position_IsTheWeightedMean) {
  const double gain = 0.3;
  EXPECT_LT((fuse_pose(kPose, kOther, gain).p_m - (0.7 * kPose.p_m + 0.3 * kOther.p_m)).norm(), 1e-15);
}

TEST(FusionEquations, Eq7And8_Rotation_TurnsTheGainsShareAboutOneAxis) {
  const Vec3 full = so3_log(kPose.R.transpose() * kOther.R);
  EXPECT_LT((kPose.R * so3_exp(full) - kOther.R).norm(), 1e-14);
  const Mat3 fused = fuse_pose(kPose, kOther, 0.25).R;
  EXPECT_LT((so3_log(kPose.R.transpose() * fused) - 0.25 * full).norm(), 1e-14);
}

TEST(FusionEquations, Eq9_Gain_IsDtOverTauPlusDt) {
  EXPECT_DOUBLE_EQ(complementary_gain(0.1, 4.0), 0.1 / 4.1);
  EXPECT_DOUBLE_EQ(complementary_gain(0.0, 4.0), 0.0);
  EXPECT_DOUBLE_EQ(complementary_gain(0.1, 0.0), 1.0);
}

TEST(FusionEquations, Eq10_GainOfZeroAndOne_AreTheTwoPoses) {
  EXPECT_LT((fuse_pose(kPose, kOther, 0.0).R - kPose.R).norm(), 1e-15);
  EXPECT_LT((fuse_pose(kPose, kOther, 1.0).R - kOther.R).norm(), 1e-14);
  EXPECT_EQ(fuse_pose(kPose, kOther, 1.0).p_m, kOther.p_m);
}

// --- The recursion, on odometry made by hand ------------------------------------------------------------------------

class FusionTest : public ::testing::Test {
 protected:
  void SetUp() override { fusion_.reset(params_); }

  // One LIO pose of the true base, now; the odometry's pose of the same moment beside it.
  LioVerdict feed(const Transform& true_T_base, const Transform& odom_T_base) {
    now_ns_ += kLioPeriod_ns;
    LioSample sample;
    sample.stamp_ns = now_ns_;
    sample.lio_T_lidar = lio_T_true_ * true_T_base * base_T_lidar();
    const LioVerdict verdict = fusion_.check(sample, now_ns_);
    return verdict == LioVerdict::kAccepted ? fusion_.fuse(sample, odom_T_base) : verdict;
  }
  void tick(const Transform& odom_T_base, int ticks = 50) {
    for (int i = 0; i < ticks; ++i) fusion_.tick(odom_T_base, 0.0, 0.002);
  }
  void align() {
    for (int i = 0; i < 60; ++i) ASSERT_EQ(feed(kPose, kPose), LioVerdict::kAccepted);
  }

  OdometryFusion::Params params_;
  OdometryFusion fusion_;
  Transform lio_T_true_{rotation_z(2.0), Vec3{12, -7, 1}};
  std::int64_t now_ns_ = 0;
};

TEST_F(FusionTest, FirstPoses_NoisyLio_AreAveragedIntoTheAlignment) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 0.01);
  for (int i = 0; i < 300; ++i) {
    Transform noisy = kPose;
    for (int a = 0; a < 3; ++a) noisy.p_m[a] += normal(random);
    ASSERT_EQ(feed(noisy, kPose), LioVerdict::kAccepted);
    tick(kPose);
    ASSERT_LT((fusion_.world_T_odom() * kPose.p_m - kPose.p_m).norm(), 0.007) << i;  // the first pose alone: 17 mm
  }
}

TEST_F(FusionTest, Offset_OdometryStepsAway_DecaysWithTau) {
  align();
  const Transform drift{rotation_z(0.02), Vec3{0.02, -0.01, 0.01}};
  const Transform drifted = drift * kPose;
  const int steps = static_cast<int>(params_.tau_s / 0.1);
  for (int i = 0; i < steps; ++i) {
    ASSERT_EQ(feed(kPose, drifted), LioVerdict::kAccepted);
    tick(drifted);
  }
  const Transform fused = fusion_.world_T_odom() * drifted;
  const double share = std::pow(params_.tau_s / (params_.tau_s + 0.1), steps);  // 1/e, sampled
  EXPECT_NEAR((fused.p_m - kPose.p_m).norm() / (drifted.p_m - kPose.p_m).norm(), share, 1e-3);
  EXPECT_NEAR(so3_log(kPose.R.transpose() * fused.R).norm() / 0.02, share, 1e-3);
}

TEST_F(FusionTest, Slew_AfterLongSilence_NoTickMovesTheFusedPoseByMoreThanTheBound) {
  align();
  const Transform drifted = Transform{rotation_z(0.06), Vec3{0.05, 0.03, 0}} * kPose;
  now_ns_ += 20 * kNsPerS;
  ASSERT_EQ(feed(kPose, drifted), LioVerdict::kAccepted);
  Transform before = fusion_.world_T_odom() * drifted;
  double moved_m = 0.0;
  for (int i = 0; i < 500; ++i) {
    fusion_.tick(drifted, 0.0, 0.002);
    const Transform now = fusion_.world_T_odom() * drifted;
    EXPECT_LE((now.p_m - before.p_m).norm(), params_.slew_m * (1.0 + 1e-9));
    EXPECT_LE(so3_log(before.R.transpose() * now.R).norm(), params_.slew_rad * (1.0 + 1e-6));
    moved_m += (now.p_m - before.p_m).norm();
    before = now;
  }
  const double gain = complementary_gain(params_.max_gap_s, params_.tau_s);  // not 20 s: no single pose decides
  EXPECT_NEAR(moved_m, gain * (drifted.p_m - kPose.p_m).norm(), 1e-3);
}

TEST_F(FusionTest, FirstPose_ContradictedByTheSecond_IsThrownAway) {
  const Transform wrong{kPose.R, kPose.p_m + Vec3{3, 0, 0}};
  EXPECT_EQ(feed(wrong, kPose), LioVerdict::kAccepted);
  EXPECT_EQ(feed(kPose, kPose), LioVerdict::kRealigned);
  EXPECT_EQ(feed(kPose, kPose), LioVerdict::kAccepted);
}

TEST_F(FusionTest, LastingJump_LioRelocalises_RealignsAndTheWorldStays) {
  align();
  const Transform drifted = Transform{Mat3::Identity(), Vec3{0.01, 0, 0}} * kPose;
  for (int i = 0; i < 200; ++i) ASSERT_EQ(feed(kPose, drifted), LioVerdict::kAccepted);
  tick(drifted, 200);
  const Transform fused = fusion_.world_T_odom() * drifted;
  lio_T_true_ = Transform{rotation_z(0.5), Vec3{4, 1, 0}} * lio_T_true_;
  for (std::uint32_t i = 1; i < params_.realign_count; ++i) ASSERT_EQ(feed(kPose, drifted), LioVerdict::kJump);
  EXPECT_EQ(feed(kPose, drifted), LioVerdict::kRealigned);
  EXPECT_EQ(feed(kPose, drifted), LioVerdict::kAccepted);
  tick(drifted, 200);
  EXPECT_LT(((fusion_.world_T_odom() * drifted).p_m - fused.p_m).norm(), 1e-3);
}

TEST_F(FusionTest, Sigma_WithoutLio_GrowsAndWithLioShrinks) {
  align();
  const double start_m = fusion_.position_sigma_m(), start_rad = fusion_.yaw_sigma_rad();
  for (int i = 0; i < 5000; ++i) fusion_.tick(kPose, 5e-4, 0.002);  // 2.5 m in 10 s
  EXPECT_NEAR(fusion_.position_sigma_m() - start_m, 0.025, 1e-9);
  EXPECT_NEAR(fusion_.yaw_sigma_rad() - start_rad, 1e-3, 1e-9);
  for (int i = 0; i < 400; ++i) ASSERT_EQ(feed(kPose, kPose), LioVerdict::kAccepted);
  EXPECT_LT(fusion_.position_sigma_m(), 0.002);  // 10 mm and 3.5 mrad at 0.7 m, low-passed over 4 s
  EXPECT_GT(fusion_.position_sigma_m(), 0.0005);
}

// --- The stage ------------------------------------------------------------------------------------------------------

class EstimatorLioTest : public ::testing::Test {
 protected:
  void SetUp() override { estimator_.reset({}); }
  template <typename Deliver>
  void run(SyntheticWalk& walk, std::int64_t until_ns, const Deliver& deliver) {
    for (; t_ns_ < std::min(until_ns, walk.end_ns()); t_ns_ += kTick_ns) {
      const ImuSample imu = walk.imu(t_ns_);
      const JointFeedback joints = walk.joints(t_ns_);
      estimator_.add_imu(imu, t_ns_);
      estimator_.add_joints(joints, t_ns_);
      estimator_.tick(walk.truth(t_ns_).stance);
      if (t_ns_ % kLioPeriod_ns == 0 && t_ns_ >= kLioPeriod_ns) deliver(walk.lio(t_ns_ - kLioPeriod_ns));
      if (!aligned_ && estimator_.state().initialised) {
        true_T_world_ = walk.truth(t_ns_).true_T_base * estimator_.state().world_T_base().inverse();
        aligned_ = true;
      }
      if (aligned_) {
        error_m_ = (true_T_world_ * estimator_.state().world_T_base().p_m - walk.truth(t_ns_).true_T_base.p_m).norm();
        worst_m_ = std::max(worst_m_, error_m_);
      }
    }
  }
  auto deliver() {
    return [this](const LioSample& sample) { estimator_.add_lio(sample, t_ns_); };
  }

  static Estimator estimator_;
  std::int64_t t_ns_ = 0;
  Transform true_T_world_;
  bool aligned_ = false;
  double error_m_ = 0.0, worst_m_ = 0.0;
};
Estimator EstimatorLioTest::estimator_;

TEST_F(EstimatorLioTest, TenSteps_NoisyLateLio_WorldStaysWithinAFewMillimetres) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 10;
    SyntheticWalk walk(spec);
    estimator_.reset({});
    t_ns_ = 0;
    aligned_ = false;
    worst_m_ = 0.0;
    run(walk, walk.end_ns(), deliver());
    EXPECT_LT(worst_m_, 0.012) << seed;
    EXPECT_LT(error_m_, 3.0 * estimator_.state().position_sigma_m.x()) << seed;
    EXPECT_EQ(estimator_.counters().lio_of(LioVerdict::kJump), 0U);
    EXPECT_GT(estimator_.counters().lio_of(LioVerdict::kAccepted), 300U);
    EXPECT_LE(estimator_.state().lio_age_ns, 202 * kNsPerMs);
  }
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

TEST_F(EstimatorLioTest, Silence_FiveSecondsOnTheStairs_OdometryGoesOnAndSaysSo) {
  WalkSpec spec;
  spec.steps = 6;
  SyntheticWalk walk(spec);
  run(walk, 8 * kNsPerS, deliver());
  const double sigma_m = estimator_.state().position_sigma_m.x();
  run(walk, 13 * kNsPerS, [](const LioSample&) {});
  EXPECT_GT(estimator_.state().lio_age_ns, 5 * kNsPerS);
  EXPECT_GT(estimator_.state().position_sigma_m.x(), sigma_m + 0.002);
  EXPECT_LT(worst_m_, 0.015);
  run(walk, walk.end_ns(), deliver());
  EXPECT_LT(estimator_.state().lio_age_ns, 300 * kNsPerMs);
  EXPECT_LT(worst_m_, 0.015);
}

}  // namespace
}  // namespace polygmap
