// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/extrinsics/way_scale.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace polygmap {
namespace {

constexpr double kTread_m = 0.3, kRise_m = 0.15, kFrame_m = 0.01;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// A robot that climbs by legs of which odometry has the length wrong, and sees every nosing where it is.
class Climb {
 public:
  explicit Climb(double excess, double yaw_rad = 0.0) : excess_(excess), odom_R_stairs_(rotation_z(yaw_rad)) {}

  void go(WayScale& way, double way_m, double noise_m = 0.0) {
    std::normal_distribution<> noise(0.0, 1.0);
    for (const double end_m = x_m_ + way_m; x_m_ < end_m; x_m_ += kFrame_m)
      see(way, [&] { return noise_m * noise(random_); });
  }
  void stand(WayScale& way, int frames) {
    std::normal_distribution<> noise(0.0, 0.003);
    for (int i = 0; i < frames; ++i) see(way, [&] { return noise(random_); });
  }
  SurfaceFrame& frame() { return frame_; }
  double turn_per_m = 0.0;  // of the robot
  [[nodiscard]] Transform odom_T_camera() const {
    return {odom_R_stairs_ * rotation_z(turn_per_m * x_m_) * rotation_x(kPi),
            odom_R_stairs_ * Vec3{odom_p_base_m() + Vec3{0.1, 0.0, 0.2}}};
  }
  [[nodiscard]] Vec3 odom_p_base_m() const {
    return Vec3{x_m_, 0.05 * std::sin(3.0 * x_m_), kRise_m / kTread_m * x_m_ + 0.8} / (1.0 + excess_);
  }
  template <typename Noise>
  void see(WayScale& way, const Noise& noise) {
    frame_.surfaces.clear();
    const Transform camera_T_odom = odom_T_camera().inverse();
    const Vec3 true_p_base_m = odom_p_base_m() * (1.0 + excess_);
    for (int step = 1; step < 30; ++step) {
      const Vec3 ahead_m = Vec3{step * kTread_m, 0.0, step * kRise_m} - true_p_base_m;
      if (ahead_m.x() < 0.1 || ahead_m.x() > 1.4) continue;
      SurfacePatch patch;
      patch.kind = SurfaceKind::kTread;
      const Vec3 off_m{noise(), 0.0, 0.3 * noise()};
      patch.nosing.valid = true;
      // Its ends wander, as far as the picture shows it.
      patch.nosing.a_m = seen(camera_T_odom, ahead_m + off_m + Vec3{0.0, 0.5 + 0.3 * std::sin(9.0 * x_m_), 0.0});
      patch.nosing.b_m = seen(camera_T_odom, ahead_m + off_m - Vec3{0.0, 0.4, 0.0});
      ASSERT_TRUE(frame_.surfaces.try_push_back(patch));
    }
    way.update(frame_, odom_T_camera(), odom_R_stairs_ * odom_p_base_m());
  }

 private:
  [[nodiscard]] Vec3 seen(const Transform& camera_T_odom, const Vec3& ahead_m) const {
    return camera_T_odom * (odom_R_stairs_ * Vec3{odom_p_base_m() + ahead_m});
  }
  double excess_;
  Mat3 odom_R_stairs_;
  double x_m_ = -0.4;
  SurfaceFrame frame_;
  std::mt19937 random_{1};
};

// Of whom nothing is known before, so that the treads alone speak.
WayScale without_prior() {
  WayScale::Params params;
  params.legs_share = 0.1;
  return WayScale{params};
}

TEST(WayScale, LegsOfAnotherLengthThanThought_FoundInAnyDirection) {
  for (const double excess : {-0.01, 0.0, 0.013}) {
    for (const double yaw_rad : {0.0, 0.8, 3.0}) {
      WayScale way = without_prior();
      Climb(excess, yaw_rad).go(way, 3.0);
      EXPECT_NEAR(way.excess(), excess, 2e-4) << "yaw " << yaw_rad;
    }
  }
}

TEST(WayScale, FewTreads_DataSheetIsBelievedMore) {
  WayScale way;
  Climb climb(0.01);
  climb.go(way, 0.4);
  const double first = way.excess();
  EXPECT_GT(first, 0.0);
  EXPECT_LT(first, 0.004);
  climb.go(way, 2.6);
  EXPECT_GT(way.excess(), 0.007);
  EXPECT_LT(way.excess(), 0.01);
}

// A spiral: what the camera's mount is off in yaw would move its nosings, too.
TEST(WayScale, RobotThatTurnsOnItsWay_IsNotBelieved) {
  WayScale way;
  Climb climb(0.01);
  climb.turn_per_m = 0.6;
  climb.go(way, 3.0);
  EXPECT_LT(way.excess(), 0.001);
}

TEST(WayScale, NosingsThatWander_AreNoScale) {
  WayScale way;
  Climb(0.0).go(way, 3.0, 0.005);
  EXPECT_LT(std::abs(way.excess()), 5e-4);
}

TEST(WayScale, RobotThatStands_LearnsNothing) {
  WayScale way;
  Climb climb(0.01);
  climb.go(way, 1.0);
  const double before = way.excess();
  climb.stand(way, 1);
  const double stopped = way.excess();  // with the last centimetre that it went
  climb.stand(way, 500);
  EXPECT_NE(before, 0.0);
  EXPECT_EQ(way.excess(), stopped);
}

TEST(WayScale, MoreThanLegsCanBeOff_IsBounded) {
  WayScale way;
  Climb(0.1).go(way, 5.0);
  EXPECT_DOUBLE_EQ(way.excess(), 3.0 * WayScale::Params{}.legs_share);
}

TEST(WayScale, NotANumber_IsNotTaken) {
  WayScale way = without_prior();
  Climb climb(0.01);
  climb.go(way, 1.5);
  const double before = way.excess();
  SurfaceFrame& frame = climb.frame();
  ASSERT_FALSE(frame.surfaces.empty());
  const Vec3 moved_m = climb.odom_p_base_m() + Vec3{0.02, 0.0, 0.01};
  for (SurfacePatch& patch : frame.surfaces) patch.nosing.a_m.x() = kNaN;
  way.update(frame, climb.odom_T_camera(), moved_m);
  for (SurfacePatch& patch : frame.surfaces) patch.nosing.a_m = patch.nosing.b_m;  // no line
  way.update(frame, climb.odom_T_camera(), moved_m + Vec3{0.02, 0.0, 0.01});
  way.update(frame, climb.odom_T_camera(), Vec3{kNaN, 0.0, 0.0});
  EXPECT_EQ(way.excess(), before);
  climb.go(way, 1.5);
  EXPECT_NEAR(way.excess(), 0.01, 5e-4);
}

}  // namespace
}  // namespace polygmap
