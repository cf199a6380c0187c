// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/lidar/lidar_tie.hpp"

#include <gtest/gtest.h>

#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kLioPeriod_ns;
using test::kTick_ns;
using test::kTick_s;

constexpr double kPositionSigma_m = 0.01, kYawSigma_rad = 0.004;
// A base that no foot holds, known but for its velocity, 0.1 s after the tie: variances, m^2, of the way since, of an
// innovation (the way, the world's drift, the poses of the tie and of now); covariance of way and velocity, m^2/s.
constexpr double kWay_m2 = 9e-4, kInnovation_m2 = kWay_m2 + 9e-5 + 2e-4, kWayVelocity_m2ps = 9e-3;

class LidarTieTest : public testing::Test {
 protected:
  LidarTieTest() {
    params_.walk_mprs = 0.03;
    params_.walk_radprs = 3e-4;
    params_.most_ratio = 5.0;
    params_.most_denied = 10;
    start_.odom_R_base = rotation_z(0.7);
    start_.odom_p_base_m = {1.0, -2.0, 0.8};
    start_.velocity_sigma_mps = 0.3;
    initialise();
  }
  void initialise() {
    tie_.reset(params_);
    filter_.reset({});
    filter_.initialise(start_, {});
    now_ns_ = 0;
  }
  // Moves as it did.
  void pass(std::int64_t for_ns, ContactInEkf::Motion motion = ContactInEkf::Motion::kFelt) {
    for (std::int64_t ns = 0; ns < for_ns; ns += kTick_ns) {
      filter_.predict(Vec3::Zero(), {0, 0, kGravity_mps2}, kTick_s, motion);
    }
    now_ns_ += for_ns;
  }
  [[nodiscard]] Transform world_T_base() const { return {filter_.odom_R_base(), filter_.odom_p_base_m()}; }
  // What odometry has the base at, which has no part in lidar odometry's offset.
  [[nodiscard]] Transform odom_T_base() const { return tie_.filter_T_odom().inverse() * world_T_base(); }
  // A pose of now of a base that is at off * where the filter has it.
  bool correct(const Transform& off = {}) {
    const Transform lidar_T_base = lidar_T_world_ * off * world_T_base();
    return tie_.try_correct(odom_T_base(), lidar_T_base, now_ns_, 0.0, kPositionSigma_m, kYawSigma_rad, filter_,
                            moved_);
  }
  bool correct_by(const Vec3& off_m) { return correct({Mat3::Identity(), off_m}); }
  void tie_and_pass() {
    ASSERT_FALSE(correct());
    pass(kLioPeriod_ns);
  }
  [[nodiscard]] double sigma_m() const { return std::sqrt(filter_.covariance()(0, 0)); }

  LidarTie::Params params_;
  ContactInEkf::Start start_;
  ContactInEkf filter_;
  LidarTie tie_;
  Transform lidar_T_world_, moved_;
  std::int64_t now_ns_ = 0;
};

TEST_F(LidarTieTest, FirstPose_TiesAndMovesNothing) {
  pass(kLioPeriod_ns);
  const Transform before = world_T_base();
  const Vec3 v_mps = filter_.odom_v_base_mps();
  const auto covariance = filter_.covariance();
  EXPECT_FALSE(correct({rotation_z(2.0), Vec3{30, -20, 1}}));
  EXPECT_EQ(world_T_base().p_m, before.p_m);
  EXPECT_EQ(world_T_base().R, before.R);
  EXPECT_EQ(filter_.odom_v_base_mps(), v_mps);
  EXPECT_EQ(filter_.covariance(), covariance);
  EXPECT_EQ(tie_.filter_T_odom().p_m, Vec3::Zero());
  EXPECT_EQ(tie_.filter_T_odom().R, Mat3::Identity());
}

TEST_F(LidarTieTest, ConsistentPoses_SigmasShrinkAndTheStateStays) {
  tie_and_pass();
  EXPECT_NEAR(sigma_m(), std::sqrt(kWay_m2), 1e-4);
  const Transform before = world_T_base();
  EXPECT_TRUE(correct());
  EXPECT_LT((world_T_base().p_m - before.p_m).norm(), 1e-12);
  EXPECT_LT((world_T_base().R - before.R).norm(), 1e-12);
  EXPECT_LT(filter_.odom_v_base_mps().norm(), 1e-12);
  EXPECT_LT(tie_.filter_T_odom().p_m.norm(), 1e-12);
  EXPECT_NEAR(sigma_m(), std::sqrt(kWay_m2 * (1.0 - kWay_m2 / kInnovation_m2)), 1e-4);  // 15 of 30 mm
  EXPECT_NEAR(filter_.velocity_sigma_mps(), std::sqrt(0.09 - kWayVelocity_m2ps * kWayVelocity_m2ps / kInnovation_m2),
              1e-3);
  for (int i = 0; i < 20; ++i) {
    pass(kLioPeriod_ns);
    ASSERT_TRUE(correct());
  }
  EXPECT_LT((world_T_base().p_m - before.p_m).norm(), 1e-11);
  EXPECT_LT(filter_.velocity_sigma_mps(), 0.03);
}

TEST_F(LidarTieTest, WorldAtAnyOffsetAndHeading_IsAsGood) {
  const auto corrected = [this](const Transform& lidar_T_world) {
    initialise();
    lidar_T_world_ = lidar_T_world;
    EXPECT_FALSE(correct());
    for (int i = 0; i < 20; ++i) {
      pass(kLioPeriod_ns);
      EXPECT_TRUE(correct({rotation_z(1e-3), Vec3{0.02, -0.01, 0.005}}));
    }
    return filter_;
  };
  const ContactInEkf here = corrected({});
  const ContactInEkf there = corrected({rotation_z(2.5), Vec3{40, -70, 5}});
  EXPECT_GT((here.odom_p_base_m() - start_.odom_p_base_m).norm(), 0.05);
  EXPECT_LT((there.odom_p_base_m() - here.odom_p_base_m()).norm(), 1e-9);
  EXPECT_LT((there.odom_R_base() - here.odom_R_base()).norm(), 1e-9);
  EXPECT_LT((there.odom_v_base_mps() - here.odom_v_base_mps()).norm(), 1e-9);
  EXPECT_LT((there.covariance() - here.covariance()).norm(), 1e-9);
}

// A ratio of 5 over four rows: 4.5 sigmas of one of them.
TEST_F(LidarTieTest, PoseOffByMoreThanTheRatio_IsDeniedAndOneByLessTaken) {
  const double most_m = std::sqrt(4.0 * 5.0 * kInnovation_m2);  // 154 mm
  tie_and_pass();
  const Transform before = world_T_base();
  EXPECT_FALSE(correct_by({1.05 * most_m, 0, 0}));
  EXPECT_EQ(world_T_base().p_m, before.p_m);
  EXPECT_EQ(filter_.odom_v_base_mps(), Vec3::Zero());
  initialise();
  tie_and_pass();
  EXPECT_TRUE(correct_by({0.95 * most_m, 0, 0}));
}

TEST_F(LidarTieTest, TenDeniedInARow_TieIsMadeAnewAndTheStateIsNotPulled) {
  tie_and_pass();
  const Transform before = world_T_base();
  lidar_T_world_ = Transform{rotation_z(0.5), Vec3{4, 1, 0}};  // it has jumped
  for (int i = 0; i < 10; ++i) ASSERT_FALSE(correct()) << i;
  EXPECT_FALSE(correct_by({3, 0, 0}));  // ten more are needed against the new tie
  EXPECT_TRUE(correct());
  EXPECT_LT((world_T_base().p_m - before.p_m).norm(), 1e-12);
  EXPECT_LT((world_T_base().R - before.R).norm(), 1e-12);
  EXPECT_LT(filter_.odom_v_base_mps().norm(), 1e-12);
  EXPECT_LT(tie_.filter_T_odom().p_m.norm(), 1e-12);
  lidar_T_world_ = {};
  EXPECT_FALSE(correct());  // the old one is no more
}

TEST_F(LidarTieTest, NineDeniedAndOneThatIsRight_TieStaysAndTheyAreForgotten) {
  tie_and_pass();
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 9; ++i) ASSERT_FALSE(correct_by({3, 0, 0})) << i;
    ASSERT_TRUE(correct()) << round;
  }
}

TEST_F(LidarTieTest, Untied_NextPoseTiesAnew) {
  tie_and_pass();
  tie_.untie();
  EXPECT_FALSE(correct_by({0.05, 0, 0}));
  EXPECT_EQ(world_T_base().p_m, start_.odom_p_base_m);
  EXPECT_TRUE(correct_by({0.05, 0, 0}));
  EXPECT_NEAR(world_T_base().p_m.x(), 1.0, 1e-4);  // at once: neither has gone anywhere since
}

TEST_F(LidarTieTest, SmallOffset_PullsFilterItsVelocityAndTheLidarsWorldByTheirGain) {
  tie_and_pass();
  const Vec3 off_m{0.02, 0, -0.01};
  const Transform seen{world_T_base().R, world_T_base().p_m + off_m};
  EXPECT_TRUE(correct_by(off_m));
  EXPECT_LT((world_T_base().p_m - start_.odom_p_base_m - kWay_m2 / kInnovation_m2 * off_m).norm(), 1e-4);
  EXPECT_LT((filter_.odom_v_base_mps() - kWayVelocity_m2ps / kInnovation_m2 * off_m).norm(), 2e-3);
  // What is left of it is the pose's own noise; some was the world's.
  const auto left = filter_.lidar_rows(world_T_base(), seen, 0.0, {kPositionSigma_m, kYawSigma_rad, 0.0}).innovation;
  EXPECT_LT((left.head<3>() - 1e-4 / kInnovation_m2 * off_m).norm(), 1e-4);
}

TEST_F(LidarTieTest, SmallOffset_MovesOdomsOffsetAndOdometryDoesNotStep) {
  ASSERT_FALSE(correct());
  for (int i = 0; i < 10; ++i) {
    pass(kLioPeriod_ns, ContactInEkf::Motion::kUnfelt);  // heading and tilt are unsure as well
    const Transform odom = odom_T_base(), world = world_T_base(), offset = tie_.filter_T_odom();
    ASSERT_TRUE(correct({rotation_z(0.01), Vec3{0.02, -0.03, 0.01}}));
    ASSERT_LT((odom_T_base().p_m - odom.p_m).norm(), 1e-12);
    ASSERT_NEAR(yaw_of(odom_T_base().R), yaw_of(odom.R), 1e-12);
    ASSERT_GT((world_T_base().p_m - world.p_m).norm(), 0.02);
    ASSERT_GT(yaw_of(world_T_base().R) - yaw_of(world.R), 0.005);
    ASSERT_EQ(tie_.filter_T_odom().R(2, 2), 1.0);  // place and heading alone
    ASSERT_LT(((moved_ * offset).p_m - tie_.filter_T_odom().p_m).norm(), 1e-12);
    ASSERT_LT(((moved_ * offset).R - tie_.filter_T_odom().R).norm(), 1e-12);
  }
}

// The pose is as old as the way from the tie to it: half of the way that the base has gone.
TEST_F(LidarTieTest, LatePose_CorrectsByWhereTheBaseWasThen) {
  const auto correct_late = [this](const Vec3& v_mps, const Vec3& off_m) {
    start_.odom_v_base_mps = v_mps;
    initialise();
    EXPECT_FALSE(correct());
    pass(kLioPeriod_ns);
    const Transform then = world_T_base();
    const std::int64_t stamp_ns = now_ns_;
    pass(kLioPeriod_ns);
    EXPECT_TRUE(tie_.try_correct(then, {then.R, then.p_m + off_m}, stamp_ns, seconds(now_ns_ - stamp_ns),
                                 kPositionSigma_m, kYawSigma_rad, filter_, moved_));
  };
  correct_late({1.0, -0.5, 0.0}, Vec3::Zero());
  EXPECT_LT((filter_.odom_p_base_m() - start_.odom_p_base_m - Vec3(0.2, -0.1, 0.0)).norm(), 1e-9);
  EXPECT_LT((filter_.odom_v_base_mps() - Vec3(1.0, -0.5, 0.0)).norm(), 1e-9);
  correct_late(Vec3::Zero(), {0.02, 0, 0});
  EXPECT_NEAR(filter_.odom_v_base_mps().x(), kWayVelocity_m2ps / kInnovation_m2 * 0.02, 2e-3);
  EXPECT_NEAR(filter_.odom_p_base_m().x(), 1.0 + 2.0 * kWay_m2 / kInnovation_m2 * 0.02, 2e-4);  // twice as far by now
}

}  // namespace
}  // namespace polygmap
