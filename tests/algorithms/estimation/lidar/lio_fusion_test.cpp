// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/lidar/lio_fusion.hpp"

#include <gtest/gtest.h>

#include <random>

#include "algorithms/estimation/state_history.hpp"
#include "algorithms/geometry/so3.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kLioPeriod_ns;
using test::kTick_ns;
using test::kTick_s;
const Transform kPose{rotation_z(0.7) * rotation_y(-0.2) * rotation_x(0.1), Vec3{1.0, -2.0, 0.8}};
const Transform kOther{rotation_z(1.3) * rotation_y(0.1) * rotation_x(-0.3), Vec3{1.4, -1.5, 0.9}};

TEST(LioFusionEquations, Eq5_LidarPoseThroughTheMount_IsTheBase) {
  const Transform base = base_from_lidar(kPose * base_T_lidar(), base_T_lidar());
  EXPECT_LT((base.p_m - kPose.p_m).norm(), 1e-14);
  EXPECT_LT((base.R - kPose.R).norm(), 1e-14);
}

TEST(LioFusionEquations, Eq6_Position_IsTheWeightedMean) {
  const double gain = 0.3;
  EXPECT_LT((fuse_pose(kPose, kOther, gain).p_m - (0.7 * kPose.p_m + 0.3 * kOther.p_m)).norm(), 1e-15);
}

TEST(LioFusionEquations, Eq7And8_Rotation_TurnsTheGainsShareAboutOneAxis) {
  const Vec3 full = so3_log(kPose.R.transpose() * kOther.R);
  EXPECT_LT((kPose.R * so3_exp(full) - kOther.R).norm(), 1e-14);
  const Mat3 fused = fuse_pose(kPose, kOther, 0.25).R;
  EXPECT_LT((so3_log(kPose.R.transpose() * fused) - 0.25 * full).norm(), 1e-14);
}

TEST(LioFusionEquations, Eq9_Gain_IsDtOverTauPlusDt) {
  EXPECT_DOUBLE_EQ(complementary_gain(0.1, 4.0), 0.1 / 4.1);
  EXPECT_DOUBLE_EQ(complementary_gain(0.0, 4.0), 0.0);
  EXPECT_DOUBLE_EQ(complementary_gain(0.1, 0.0), 1.0);
}

TEST(LioFusionEquations, Eq10_GainOfZeroAndOne_AreTheTwoPoses) {
  EXPECT_LT((fuse_pose(kPose, kOther, 0.0).R - kPose.R).norm(), 1e-15);
  EXPECT_LT((fuse_pose(kPose, kOther, 1.0).R - kOther.R).norm(), 1e-14);
  EXPECT_EQ(fuse_pose(kPose, kOther, 1.0).p_m, kOther.p_m);
}
class LioFusionTest : public ::testing::Test {
 protected:
  void SetUp() override { fusion_.reset(params_, mount_); }

  // One LIO pose of the true base, now; the odometry's pose of the same moment beside it.
  LioVerdict feed(const Transform& true_T_base, const Transform& odom_T_base) {
    now_ns_ += kLioPeriod_ns;
    LioSample sample;
    sample.stamp_ns = now_ns_;
    sample.lio_T_lidar = lio_T_true_ * true_T_base * base_T_lidar();
    sample.position_sigma_m.setConstant(kLioSigma_m);
    sample.rotation_sigma_rad.setConstant(kLioSigma_rad);
    const LioVerdict verdict = fusion_.check(sample, now_ns_);
    return verdict == LioVerdict::kAccepted ? fusion_.fuse(sample, odom_T_base) : verdict;
  }
  void tick(const Transform& odom_T_base, int ticks = 50) {
    for (int i = 0; i < ticks; ++i) fusion_.tick(odom_T_base, Vec3::Zero(), kTick_s);
  }
  void align() {
    for (int i = 0; i < 60; ++i) ASSERT_EQ(feed(kPose, kPose), LioVerdict::kAccepted);
  }
  // The odometry's filter says that it may have drifted so far.
  void unsure(double sigma_m, double sigma_rad) {
    const double m2 = math::square(sigma_m);
    fusion_.follow({m2, m2, m2, math::square(sigma_rad)});
  }

  static constexpr double kLioSigma_m = 0.01, kLioSigma_rad = 0.0035;
  LioFusion::Params params_;
  LioFusion fusion_;
  Transform mount_ = base_T_lidar();
  Transform lio_T_true_{rotation_z(2.0), Vec3{12, -7, 1}};
  std::int64_t now_ns_ = 0;
};

TEST_F(LioFusionTest, FirstPoses_NoisyLio_AreAveragedIntoTheAlignment) {
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

TEST_F(LioFusionTest, Offset_OdometryStepsAway_DecaysWithTau) {
  align();
  unsure(0.1, 0.1);
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

// 2 mm/s while the robot stands, and its legs are sure to a millimetre: no foot moved.
TEST_F(LioFusionTest, LioDrifts_OdometryIsSureThatItDidNot_FusedPoseStays) {
  const auto drift_for_25s = [this] {
    align();
    for (int i = 1; i <= 250; ++i) {
      const Transform drifted{kPose.R, kPose.p_m + Vec3{2e-4 * i, -1e-4 * i, 0}};
      ASSERT_EQ(feed(drifted, kPose), LioVerdict::kAccepted);
      tick(kPose);
    }
  };
  drift_for_25s();
  EXPECT_LT((fusion_.world_T_odom() * kPose.p_m - kPose.p_m).norm(), 0.001);  // of 56 mm
  const Vec3 sure_m = fusion_.position_sigma_m();
  fusion_.reset(params_, mount_);
  unsure(0.05, 0.01);
  drift_for_25s();
  EXPECT_GT((fusion_.world_T_odom() * kPose.p_m - kPose.p_m).norm(), 0.045);  // it may be the odometry's
  EXPECT_LT(sure_m.maxCoeff(), 0.005);
}

// The odometry walks and turns on, far from its origin; what it does not do itself, the world's offset does.
TEST_F(LioFusionTest, Slew_YawCorrectedFiftyMetresFromTheOrigin_BaseMovesByNoMoreThanTheBoundPerTick) {
  Transform odom_T_base{rotation_z(0.4), Vec3{40, 30, 0.8}};
  for (int i = 0; i < 60; ++i) ASSERT_EQ(feed(odom_T_base, odom_T_base), LioVerdict::kAccepted);
  const Transform true_T_odom{rotation_z(0.02), Vec3{0.02, 0.03, 0.01}};  // at the base a displacement of 1 m ...
  const Vec3 there_m = odom_T_base.p_m;
  const Transform drift{true_T_odom.R, there_m - true_T_odom.R * there_m + true_T_odom.p_m};  // ... taken back
  now_ns_ += 20 * kNsPerS;
  unsure(0.1, 0.05);
  double offset_moved_m = 0.0, corrected_m = 0.0;
  for (int i = 0; i < 1000; ++i) {
    if (i % 50 == 0) {
      ASSERT_EQ(feed(drift * odom_T_base, odom_T_base), LioVerdict::kAccepted);
    }
    const Vec3 step_m = odom_T_base.R * Vec3{5e-4, 0, 1e-4};
    odom_T_base = Transform{rotation_z(4e-5), Vec3::Zero()} * odom_T_base;  // about the origin: 2 mm
    odom_T_base.p_m += step_m;
    const Transform before = fusion_.world_T_odom();
    fusion_.tick(odom_T_base, step_m, kTick_s);
    const Transform by_odometry = before * odom_T_base, now = fusion_.world_T_odom() * odom_T_base;
    ASSERT_LE((now.p_m - by_odometry.p_m).norm(), params_.slew.speed_mps * kTick_s * (1.0 + 1e-6));
    ASSERT_LE(so3_log(by_odometry.R.transpose() * now.R).norm(), params_.slew.turn_radps * kTick_s * (1.0 + 1e-6));
    corrected_m += (now.p_m - by_odometry.p_m).norm();
    offset_moved_m = std::max(offset_moved_m, (fusion_.world_T_odom().p_m - before.p_m).norm());
  }
  EXPECT_GT(corrected_m, 0.005);
  tick(odom_T_base, 2000);
  fusion_.tick(odom_T_base, Vec3::Zero(), kTick_s);
  const Transform arrived = fusion_.world_T_odom();
  tick(odom_T_base, 1);
  EXPECT_EQ(arrived.p_m, fusion_.world_T_odom().p_m);  // it gets there
  EXPECT_GT(offset_moved_m,
            10.0 * params_.slew.speed_mps * kTick_s);  // a limit on the transform's own origin would have been another
}

TEST_F(LioFusionTest, Slew_AfterLongSilence_NoTickMovesTheFusedPoseByMoreThanTheBound) {
  align();
  unsure(0.2, 0.1);
  const Transform drifted = Transform{rotation_z(0.06), Vec3{0.05, 0.03, 0}} * kPose;
  now_ns_ += 20 * kNsPerS;
  ASSERT_EQ(feed(kPose, drifted), LioVerdict::kAccepted);
  Transform before = fusion_.world_T_odom() * drifted;
  double moved_m = 0.0;
  for (int i = 0; i < 500; ++i) {
    fusion_.tick(drifted, Vec3::Zero(), kTick_s);
    const Transform now = fusion_.world_T_odom() * drifted;
    EXPECT_LE((now.p_m - before.p_m).norm(), params_.slew.speed_mps * kTick_s * (1.0 + 1e-9));
    EXPECT_LE(so3_log(before.R.transpose() * now.R).norm(), params_.slew.turn_radps * kTick_s * (1.0 + 1e-6));
    moved_m += (now.p_m - before.p_m).norm();
    before = now;
  }
  const double gain = complementary_gain(params_.max_gap_s, params_.tau_s);  // not 20 s: no single pose decides
  EXPECT_NEAR(moved_m, gain * (drifted.p_m - kPose.p_m).norm(), 1e-3);
}

TEST_F(LioFusionTest, Slew_TicksOfAnyLength_IsARateAndNoTickMovesByMoreThanOneMillimetre) {
  align();
  unsure(0.2, 0.1);
  const Transform drifted = Transform{Mat3::Identity(), Vec3{0.05, 0.03, 0}} * kPose;
  now_ns_ += 20 * kNsPerS;
  ASSERT_EQ(feed(kPose, drifted), LioVerdict::kAccepted);
  for (const double dt_s : {0.001, 0.002, 0.005, 0.5}) {
    const Transform before = fusion_.world_T_odom() * drifted;
    fusion_.tick(drifted, Vec3::Zero(), dt_s);
    EXPECT_NEAR((fusion_.world_T_odom() * drifted.p_m - before.p_m).norm(), std::min(0.1 * dt_s, 1e-3), 1e-9) << dt_s;
  }
}

// A lidar that is mounted a degree off in heading, tied by its heading: it has the base's headings right, and the way
// turned about the tie. Legs that know their heading by LIO tell by how much, and the published pose stays with them
// for the most part. A jump of LIO's ties anew, where the pose was published and as sure as it was.
TEST_F(LioFusionTest, WalkWithALidarMountedADegreeOff_FollowsASmallPartOfTheBend) {
  const auto seen = [](const Transform& true_T_base) {
    return Transform{true_T_base.R, kPose.p_m + rotation_z(0.0175) * (true_T_base.p_m - kPose.p_m)};
  };
  align();
  Transform now = kPose;
  const auto walk = [&] {
    const Vec3 step_m{4e-4, 3e-4, 1e-4};
    for (int i = 0; i < 50; ++i) {
      now.p_m += step_m;
      fusion_.tick(now, step_m, kTick_s);
    }
    return feed(seen(now), now);
  };
  for (int i = 0; i < 120; ++i) ASSERT_EQ(walk(), LioVerdict::kAccepted);  // 3 m
  const Vec3 bend_m = seen(now).p_m - now.p_m;
  EXPECT_GT(bend_m.norm(), 0.05);
  EXPECT_LT((fusion_.world_T_odom() * now.p_m - now.p_m).norm(), 0.2 * bend_m.norm());
  EXPECT_GT(fusion_.position_sigma_m().head<2>().norm(), 0.3 * (fusion_.world_T_odom() * now.p_m - now.p_m).norm());
  const Vec3 before_m = fusion_.world_T_odom() * now.p_m - now.p_m;
  lio_T_true_ = Transform{rotation_z(0.5), Vec3{4, 1, 0}} * lio_T_true_;
  for (std::uint32_t i = 1; i < params_.realign_count; ++i) ASSERT_EQ(walk(), LioVerdict::kJump);
  const Vec3 sigma_m = fusion_.position_sigma_m();
  EXPECT_EQ(walk(), LioVerdict::kRealigned);
  tick(now, 200);
  EXPECT_GT((fusion_.position_sigma_m() - sigma_m).minCoeff(), -1e-4);
  EXPECT_LT((fusion_.world_T_odom() * now.p_m - now.p_m - before_m).norm(), 0.002);
}

TEST_F(LioFusionTest, FirstPose_ContradictedByTheSecond_IsThrownAway) {
  const Transform wrong{kPose.R, kPose.p_m + Vec3{3, 0, 0}};
  EXPECT_EQ(feed(wrong, kPose), LioVerdict::kAccepted);
  EXPECT_EQ(feed(kPose, kPose), LioVerdict::kRealigned);
  EXPECT_EQ(feed(kPose, kPose), LioVerdict::kAccepted);
}

// As of positions in millimetres: every pose contradicts the one before. The first two cannot be told from a first pose
// that was wrong; all others are refused, and what is known of the odometry is what is known without LIO.
TEST_F(LioFusionTest, PosesThatContradictEachOtherForEver_AreJumps_AndLeaveTimeAndSigmasAlone) {
  LioFusion without;
  without.reset(params_, mount_);
  Transform odom_T_base = kPose;
  const auto walk = [&] {
    const Vec3 step_m{5e-4, 1e-4, 0};
    for (int i = 0; i < 50; ++i) {
      odom_T_base.p_m += step_m;
      for (LioFusion* fusion : {&fusion_, &without}) {
        fusion->follow(LioUncertainty::Quantities::Constant(1e-6 * odom_T_base.p_m.x()));
        fusion->tick(odom_T_base, step_m, kTick_s);
      }
    }
  };
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 5.0);
  std::array<int, kLioVerdictCount> verdicts{};
  for (int i = 0; i < 100; ++i) {
    walk();
    Transform wrong = odom_T_base;
    for (int a = 0; a < 3; ++a) wrong.p_m[a] += normal(random);
    ++verdicts[static_cast<std::size_t>(feed(wrong, odom_T_base))];
  }
  walk();
  EXPECT_EQ(verdicts[static_cast<std::size_t>(LioVerdict::kAccepted)], 1);
  EXPECT_EQ(verdicts[static_cast<std::size_t>(LioVerdict::kRealigned)], 1);
  EXPECT_EQ(verdicts[static_cast<std::size_t>(LioVerdict::kJump)], 98);
  EXPECT_EQ(fusion_.last_accepted_ns(), kLioPeriod_ns);  // the first one: a realigned pose shows nothing
  EXPECT_FALSE(fusion_.aligned());
  EXPECT_EQ(fusion_.position_sigma_m(), without.position_sigma_m());
  EXPECT_EQ(fusion_.yaw_sigma_rad(), without.yaw_sigma_rad());
}

// As of a quaternion whose numbers stand in another order: alike among themselves, but no heading makes them upright.
TEST_F(LioFusionTest, PosesTiltedAgainstGravity_AreNeverTaken) {
  const Transform tilted{rotation_x(1.0) * kPose.R, kPose.p_m};
  for (int i = 0; i < 100; ++i) ASSERT_EQ(feed(tilted, kPose), LioVerdict::kJump) << i;
  EXPECT_EQ(fusion_.last_accepted_ns(), -1);
  align();
  const Vec3 sigma_m = fusion_.position_sigma_m();
  for (int i = 0; i < 100; ++i) ASSERT_EQ(feed(tilted, kPose), LioVerdict::kJump) << i;
  tick(kPose, 1);
  EXPECT_LT((fusion_.position_sigma_m() - sigma_m).norm(), 1e-3);
}

TEST_F(LioFusionTest, FirstPoseReplaced_TwentyPosesThatAgree_AreTheNewWorld) {
  ASSERT_EQ(feed(kPose, kPose), LioVerdict::kAccepted);
  ASSERT_EQ(feed({kPose.R, kPose.p_m + Vec3{3, 0, 0}}, kPose), LioVerdict::kRealigned);
  for (std::uint32_t i = 1; i < params_.realign_count; ++i) ASSERT_EQ(feed(kPose, kPose), LioVerdict::kJump);
  EXPECT_EQ(feed(kPose, kPose), LioVerdict::kRealigned);
  align();
  EXPECT_TRUE(fusion_.aligned());
}

TEST_F(LioFusionTest, LastingJump_LioRelocalises_RealignsAndTheWorldStays) {
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

TEST_F(LioFusionTest, Sigma_WithoutLio_GrowsWithTheWayAndItsHeadingAndWithLioShrinks) {
  align();
  tick(kPose, 2000);
  const Vec3 start_m = fusion_.position_sigma_m();
  for (int i = 0; i < 5000; ++i) {  // 2.5 m in 10 s, by an odometry that turns
    fusion_.follow({0.0, 0.0, 0.0, math::square(2e-4 * i * kTick_s)});
    fusion_.tick(kPose, {5e-4, 0, 0}, kTick_s);
  }
  const LioUncertainty::Params& p = params_.uncertainty;
  const double drift_m = p.drift_per_m * 2.5;
  const Vec3 grown_m = fusion_.position_sigma_m();
  EXPECT_NEAR(grown_m.z(), std::hypot(start_m.z(), drift_m), 1e-4);
  EXPECT_GT(grown_m.y(), std::hypot(start_m.y(), drift_m) + 5e-4);  // the way was along x, its heading unknown
  EXPECT_NEAR(grown_m.x(), grown_m.z(), 1e-4);
  EXPECT_GT(fusion_.yaw_sigma_rad(), 0.99 * 2e-3);
  for (int i = 0; i < 400; ++i) ASSERT_EQ(feed(kPose, kPose), LioVerdict::kAccepted);
  fusion_.tick(kPose, Vec3::Zero(), kTick_s);
  EXPECT_LT(fusion_.position_sigma_m().maxCoeff(), 0.0025);  // 10 mm and 3.5 mrad at 0.7 m, low-passed over 4 s
  EXPECT_GT(fusion_.position_sigma_m().minCoeff(), 0.001);
}

// A world is tied to LIO's by noisy poses: the mean of so many stays wrong as they were, and a turn of it shows far
// off.
TEST_F(LioFusionTest, Sigma_FarFromWhereTheWorldWasTied_IsLarger) {
  params_.mount.sigma_rad = 0.0;  // it adds to this
  SetUp();
  align();
  tick(kPose, 10);
  for (int i = 0; i < 400; ++i) ASSERT_EQ(feed(kPose, kPose), LioVerdict::kAccepted);
  fusion_.tick(kPose, Vec3::Zero(), kTick_s);
  const Vec3 near_m = fusion_.position_sigma_m();
  fusion_.tick({kPose.R, kPose.p_m + Vec3{10, 0, 0}}, Vec3::Zero(), kTick_s);
  const Vec3 far_m = fusion_.position_sigma_m();
  const double turn_rad = kLioSigma_rad / std::sqrt(41.0);
  EXPECT_NEAR(far_m.x(), near_m.x(), 1e-9);
  EXPECT_NEAR(far_m.y(), std::hypot(near_m.y(), 10 * turn_rad), 1e-4);
  EXPECT_NEAR(far_m.z(), std::hypot(near_m.z(), 10 * turn_rad), 1e-4);
}

class NoisyLioFusionTest : public LioFusionTest {
 protected:
  // Poses of a robot at rest, white noise of kLioSigma_m on every axis and kLioSigma_rad on yaw and tilt.
  void feed_noisy(int poses, bool stated, double scale) {
    mount_ = {};
    SetUp();
    for (int i = 0; i < poses; ++i) {
      const auto draw = [&](double sigma) { return scale * sigma * normal_(random_); };
      Transform noisy = kPose;
      for (int a = 0; a < 3; ++a) noisy.p_m[a] += draw(kLioSigma_m);
      const double roll = draw(kLioSigma_rad), pitch = draw(kLioSigma_rad), yaw = draw(kLioSigma_rad);
      noisy.R = rotation_z(yaw) * rotation_y(pitch) * rotation_x(roll) * noisy.R;
      now_ns_ += kLioPeriod_ns;
      const double share = stated ? scale : 0.0;
      const LioSample sample{now_ns_, lio_T_true_ * noisy, Vec3::Constant(share * kLioSigma_m),
                             Vec3::Constant(share * kLioSigma_rad)};
      ASSERT_EQ(fusion_.fuse(sample, kPose), LioVerdict::kAccepted);
      tick(kPose, 50);
    }
  }
  std::mt19937 random_{4};
  std::normal_distribution<double> normal_;
};

TEST_F(NoisyLioFusionTest, Innovations_HonestSigmas_AreOneInTheMean) {
  feed_noisy(2000, true, 1.0);
  const LioInnovations& seen = fusion_.innovations();
  EXPECT_EQ(seen.position.stamp_ns, now_ns_);
  EXPECT_EQ(seen.position.count, 2000U - 41U);
  EXPECT_NEAR(seen.position.mean, 1.0, 0.06);  // +-3 sigma of 3 x 1959 squares
  EXPECT_NEAR(seen.yaw.mean, 1.0, 0.1);
  EXPECT_NEAR(seen.position.last / (seen.last.head<3>().squaredNorm() / 3.0), 1e4, 3e2);
  EXPECT_NEAR(seen.yaw.last / math::square(seen.last[3]), 81e3, 3e3);
}

TEST_F(NoisyLioFusionTest, Lio_ThatStatesNoSigma_IsAsNoisyAsItIsMeasuredToBe) {
  for (const double scale : {0.3, 1.0, 1.5}) {
    feed_noisy(600, false, scale);
    EXPECT_NEAR(fusion_.innovations().position.mean, 1.0, 0.2) << scale;
    EXPECT_NEAR(fusion_.innovations().yaw.mean, 1.0, 0.25) << scale;
  }
}

// Gravity holds the odometry's tilt, LIO's own is noise of every single pose.
TEST_F(NoisyLioFusionTest, TiltOfLio_NeverTiltsTheFusedPose) {
  feed_noisy(600, true, 1.5);
  const Mat3 off = fusion_.world_T_odom().R;
  EXPECT_GT(off(2, 2), 1.0 - 1e-15);
  EXPECT_GT(std::abs(off(1, 0)), 1e-6);  // yaw is LIO's to tell
}
// Root mean square of the fused position's error. Not at_stamp: against the odometry of the pose's arrival.
double fused_rmse_m(bool at_stamp) {
  LioFusion::Params params;
  params.tau_s = 0.5;
  LioFusion fusion;
  fusion.reset(params, base_T_lidar());
  StateHistory ring;
  std::mt19937 random(1);
  std::normal_distribution<double> noise_m(0.0, 0.005);
  const auto truth = [](std::int64_t t_ns) -> Transform {
    const double walked_s = std::max(0.0, seconds(t_ns) - 2.0);
    return {rotation_z(0.02 * std::sin(4.0 * walked_s)),
            Vec3{0.23 * walked_s, 0.08 * std::sin(2.0 * walked_s), 0.8 + 0.1 * walked_s}};
  };
  const auto odometry = [&truth](std::int64_t t_ns) -> Transform {
    const Transform at = truth(t_ns);
    return {at.R, Vec3{0.98 * at.p_m.x(), at.p_m.y(), at.p_m.z()}};
  };
  double sum_m2 = 0.0;
  std::int64_t ticks = 0;
  Vec3 before_m = odometry(0).p_m;
  for (std::int64_t t_ns = kTick_ns; t_ns <= 62 * kNsPerS; t_ns += kTick_ns, ++ticks) {
    StateEstimate state;
    state.stamp_ns = t_ns;
    state.odom_T_base = odometry(t_ns);
    ring.push(state);
    if (t_ns % kLioPeriod_ns == 0 && t_ns > kLioPeriod_ns) {
      LioSample sample;
      sample.stamp_ns = t_ns - kLioPeriod_ns;
      sample.lio_T_lidar = truth(sample.stamp_ns) * base_T_lidar();
      for (int a = 0; a < 3; ++a) sample.lio_T_lidar.p_m[a] += noise_m(random);
      sample.position_sigma_m.setConstant(0.005);
      EXPECT_TRUE(ring.try_at(at_stamp ? sample.stamp_ns : t_ns, state));
      EXPECT_EQ(fusion.fuse(sample, state.odom_T_base), LioVerdict::kAccepted);
    }
    const Transform odom_T_base = odometry(t_ns);
    fusion.follow({math::square(0.04 * odom_T_base.p_m.x()), 0.0, 0.0, 0.0});  // its filter knows of it
    fusion.tick(odom_T_base, odom_T_base.p_m - before_m, kTick_s);
    before_m = odom_T_base.p_m;
    sum_m2 += (fusion.world_T_odom() * odom_T_base.p_m - truth(t_ns).p_m).squaredNorm();
  }
  return std::sqrt(sum_m2 / static_cast<double>(ticks));
}

TEST(LioFusionOfLatePoses, OdometryTwoPercentShort_FusedAtItsStamp_IsWithinSixMillimetres) {
  const double rmse_m = fused_rmse_m(true);
  EXPECT_LT(rmse_m, 0.006);              // 3.5 mm
  EXPECT_GT(fused_rmse_m(false), 0.02);  // on arrival: 25.5 mm, nearly all of it lag
}
}  // namespace
}  // namespace polygmap
