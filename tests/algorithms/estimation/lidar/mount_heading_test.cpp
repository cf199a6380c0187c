// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/lidar/mount_heading.hpp"

#include <gtest/gtest.h>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {
namespace {

constexpr double kNoise_m2 = 4e-6;
const Vec3 kTied_m{1.0, -2.0, 0.8};

class MountHeadingTest : public ::testing::Test {
 protected:
  // Legs and LIO go the same way; LIO tells it turned by so much about the place of the tie.
  void walk(const Vec3& way_m, double turned_rad, const Vec3& legs_drift_m = Vec3::Zero()) {
    constexpr int kTicks = 1000;
    if (!tied_) mount_.move(kTied_m, Vec3::Zero());
    tied_ = true;
    const Vec3 begun_m = lidar_m_;
    for (int i = 1; i <= kTicks; ++i) {
      lidar_m_ = begun_m + rotation_z(turned_rad) * way_m * i / kTicks;
      mount_.move(lidar_m_, (way_m + legs_drift_m) / kTicks);
    }
  }
  [[nodiscard]] MountHeading::Bend bend() {
    mount_.see({lidar_m_, 0.0, 1.0, kNoise_m2});
    mount_.move(lidar_m_, Vec3::Zero());
    return mount_.bend();
  }

  MountHeading mount_;
  Vec3 lidar_m_ = kTied_m;
  bool tied_ = false;
};

TEST_F(MountHeadingTest, NotTied_BendsNothing) {
  EXPECT_EQ(bend().way_m, Vec3::Zero());
  EXPECT_EQ(bend().variance_m2, Vec3::Zero());
}

TEST_F(MountHeadingTest, MountTurnedByADegree_MostOfTheBendIsTheMounts) {
  constexpr double kTurn_rad = 0.0175;
  walk({2.0, 1.5, 0.8}, kTurn_rad);
  const Vec3 bend_m = lidar_m_ - (kTied_m + Vec3{2.0, 1.5, 0.8});
  EXPECT_LT((bend().way_m - bend_m).norm(), 0.16 * bend_m.norm());
  EXPECT_GT((bend().way_m - bend_m).norm(), 0.05 * bend_m.norm());  // legs may have drifted by as much
  EXPECT_LT((bend_m - bend().way_m).squaredNorm(), 9.0 * bend().variance_m2.sum());
}

TEST_F(MountHeadingTest, LegsThatGoTooFarOrTooHigh_AreNoMount) {
  walk({3.0, 0.0, 0.0}, 0.0, {0.03, 0.0, 0.02});
  EXPECT_LT(bend().way_m.norm(), 1e-12);
}

TEST_F(MountHeadingTest, LittleWay_IsTheLegsDrift) {
  walk({0.05, 0.0, 0.0}, 0.0, {0.0, 0.005, 0.0});
  EXPECT_LT(bend().way_m.norm(), 0.001);
}

// Legs turn by a milliradian each centimetre, LIO's headings follow by a low-pass: legs come to where LIO has them.
TEST_F(MountHeadingTest, HeadingsThatLag_TurnTheWayOfThatTimeAlong) {
  constexpr double kTurn_rad = 1e-3, kStep_m = 0.01, kGain = 0.05;
  mount_.move(kTied_m, Vec3::Zero());
  double missing_rad = 0.0;
  for (int i = 0; i < 300; ++i) {
    missing_rad += kTurn_rad;
    const Vec3 step_m = kStep_m * Vec3::UnitX();
    lidar_m_ += step_m;
    mount_.move(lidar_m_, rotation_z(-missing_rad) * step_m);
    mount_.see({lidar_m_, kGain * missing_rad, kGain, kNoise_m2});
    missing_rad -= kGain * missing_rad;
  }
  mount_.move(lidar_m_, Vec3::Zero());
  EXPECT_LT(mount_.bend().way_m.norm(), 0.1 * 3.0 * kTurn_rad / kGain);
}

TEST_F(MountHeadingTest, AtTheTieAgain_BendsNothing) {
  walk({3.0, 0.0, 0.0}, 0.0175);
  walk({-3.0, 0.0, 0.0}, 0.0175);
  EXPECT_LT(bend().way_m.norm(), 1e-9);
  EXPECT_LT(bend().variance_m2.norm(), 1e-12);
}

TEST_F(MountHeadingTest, TiedAgain_CountsFromThere) {
  walk({3.0, 0.0, 0.0}, 0.0175);
  mount_.tie();
  EXPECT_EQ(mount_.bend().way_m, Vec3::Zero());
  walk({1.0, 0.0, 0.0}, 0.0175);
  const Vec3 again_m = bend().way_m;
  mount_ = {};
  lidar_m_ = kTied_m;
  tied_ = false;
  walk({1.0, 0.0, 0.0}, 0.0175);
  EXPECT_LT((again_m - bend().way_m).norm(), 0.01 * again_m.norm());
  EXPECT_GT(again_m.norm(), 0.005);
}

// Legs that drift as they go say less of the mount near the tie again: what they drifted is not taken for its bend.
TEST_F(MountHeadingTest, PartOfTheWayBack_LeavesMostOfTheDriftToTheLegs) {
  walk({3.0, 0.0, 0.0}, 0.0, {0.0, 0.005, 0.0});
  walk({-2.8, 0.0, 0.0}, 0.0, {0.0, 0.005, 0.0});
  EXPECT_LT(bend().way_m.norm(), 0.0025);
}

// Legs alone go on from where LIO was silent.
TEST_F(MountHeadingTest, LidarIsSilent_TheBendStaysAsItWas) {
  walk({1.5, 0.0, 0.0}, 0.0175);
  const Vec3 before_m = bend().way_m;
  walk({1.5, 0.0, 0.0}, 0.0);
  EXPECT_EQ(mount_.bend().way_m, before_m);
}

TEST_F(MountHeadingTest, MountAsConfigured_BendsNothing) {
  MountHeading::Params params;
  params.sigma_rad = 0.0;
  mount_.reset(params);
  walk({3.0, 0.0, 0.0}, 0.0175);
  EXPECT_EQ(bend().way_m, Vec3::Zero());
}

}  // namespace
}  // namespace polygmap
