// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/map/ground_map.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "sim_stub/robot_camera.hpp"
#include "tests/support/remembered_stairs.hpp"

namespace polygmap {
namespace {

using Height = std::function<double(double x_m, double y_m)>;  // of what is there; NaN: it gives no depth

class GroundMapTest : public ::testing::Test {
 protected:
  Transform camera_ = test::looking_down({0.5, 0.0, 1.0});
  const CameraIntrinsics intrinsics_ = robot_camera_intrinsics();
  std::unique_ptr<ColumnImage> picture_ = std::make_unique<ColumnImage>();
  std::unique_ptr<GroundMap> map_ = std::make_unique<GroundMap>(GroundMap::Params{});
  std::array<Transform, kFootCount> soles_{Transform{Mat3::Identity(), Vec3{0.0, 0.1, 0.0}},
                                           Transform{Mat3::Identity(), Vec3{0.0, -0.1, 0.0}}};
  std::array<bool, kFootCount> stands_{true, true};
  std::uint32_t sequence_ = 0;
  GroundView told_;

  // What the camera sees looking straight down, where heights change slowly beside the distance.
  void look(const Height& height_m, int frames) {
    picture_->inverse_depth.fill(0.0F);
    picture_->valid.fill(0);
    for (std::int32_t v = 0; v < intrinsics_.height_px; ++v) {
      for (std::int32_t g = 0; g < intrinsics_.width_px / kColumn_px; ++g) {
        const Vec3 ray{(kColumn_px * g + 0.5 * (kColumn_px - 1) - intrinsics_.cx_px) / intrinsics_.fx_px,
                       (v - intrinsics_.cy_px) / intrinsics_.fy_px, 1.0};
        const Vec3 way = camera_.R * ray;
        double t = camera_.p_m.z() / -way.z();
        for (int i = 0; i < 20 && t > 0.0; ++i) {  // until it is no number
          const Vec3 p_m = camera_.p_m + t * way;
          t = (camera_.p_m.z() - height_m(p_m.x(), p_m.y())) / -way.z();
        }
        if (!(t > 0.0)) continue;
        picture_->inverse_depth(g, v) = static_cast<float>(1.0 / t);
        picture_->valid(g, v) = kColumn_px;
      }
    }
    for (int i = 0; i < frames; ++i) {
      map_->begin({camera_, intrinsics_, picture_.get(), sequence_++, soles_, stands_, SoleModel{}.contact});
      while (!map_->look()) continue;
      while (!map_->tell(told_)) continue;
    }
  }
  [[nodiscard]] bool is(const GroundView::Rows& rows, double x_m, double y_m) const {
    const Vec2 p_m = Vec2{x_m, y_m} - told_.corner_m;
    return GroundView::has(rows, told_.cell_of(p_m.x()), told_.cell_of(p_m.y()));
  }
};

TEST_F(GroundMapTest, LevelFloor_IsLevelWhereItWasSeenAndNowhereElse) {
  look([](double, double) { return 0.0; }, 40);
  for (const double x_m : {0.3, 0.5, 0.7}) EXPECT_TRUE(is(told_.level, x_m, 0.1)) << x_m;
  EXPECT_FALSE(is(told_.level, -0.8, 0.0)) << "out of the picture";
  EXPECT_FALSE(is(told_.level, 9.0, 0.0)) << "out of the view";
  for (const std::uint64_t row : told_.tall) EXPECT_EQ(row, 0U);
}

TEST_F(GroundMapTest, RampSeenAmidTheFloor_IsLeftOutWithTwoSquaresAboutIt) {
  look([](double, double) { return 0.0; }, 40);
  const Transform ramp{rotation_z(0.5), Vec3{0.6, 0.0, 0.0}};
  ConvexPolygon outline;
  for (const auto& [x, y] : {std::pair{-0.2, -0.1}, {0.2, -0.1}, {0.2, 0.1}, {-0.2, 0.1}})
    static_cast<void>(outline.try_push_back({x, y}));
  map_->leave_out(ramp, outline, told_);
  for (const double x_m : {-0.24, -0.1, 0.0, 0.1, 0.24}) {
    const Vec3 p_m = ramp * Vec3{x_m, 0.0, 0.0};
    EXPECT_FALSE(is(told_.level, p_m.x(), p_m.y())) << x_m;
  }
  for (const double y_m : {-0.24, 0.24}) {
    const Vec3 p_m = ramp * Vec3{0.0, y_m, 0.0};
    EXPECT_TRUE(is(told_.level, p_m.x(), p_m.y())) << y_m;
  }
  const GroundView before = told_;
  map_->leave_out({Mat3::Identity(), Vec3{9.0, 9.0, 0.0}}, outline, told_);
  EXPECT_EQ(told_.level, before.level) << "out of the view";
  map_->leave_out({Mat3::Identity(), Vec3{0.3, 0.0, -0.5}}, outline, told_);
  EXPECT_EQ(told_.level, before.level) << "on the storey below";
}

// A ramp of 5 degrees about x = 0.6 m that rises ahead, of so great a length, and its nearer end so high.
GroundView with_ramp(GroundMap& map, GroundView told, double length_m, double near_end_m) {
  const double slope_rad = 5.0 * kPi / 180.0;
  ConvexPolygon outline;
  for (const auto& [x, y] : {std::pair{0.0, -0.3}, {length_m, -0.3}, {length_m, 0.3}, {0.0, 0.3}})
    static_cast<void>(outline.try_push_back({x, y}));
  map.leave_out({rotation_y(-slope_rad), Vec3{0.6, 0.0, near_end_m}}, outline, told);
  return told;
}

TEST_F(GroundMapTest, RampWhoseOutlineBeginsLate_IsLeftOutFromWhereItsPlaneMeetsTheGround) {
  look([](double, double) { return 0.0; }, 40);
  const GroundView told = with_ramp(*map_, told_, 1.0, 0.02);  // its plane meets the ground at 0.37 m
  EXPECT_FALSE(is(told.level, 0.40, 0.0));
  EXPECT_TRUE(is(told.level, 0.25, 0.0));
  EXPECT_TRUE(is(told.ramps, 0.40, 0.0));
  EXPECT_NEAR(told.steepest, std::tan(5.0 * kPi / 180.0), 1e-9);
}

TEST_F(GroundMapTest, RampThatFallsAway_IsLeftOutFromWhereItsPlaneMeetsTheGround) {
  look([](double, double) { return 0.0; }, 40);
  const double slope_rad = -5.0 * kPi / 180.0;
  ConvexPolygon outline;
  for (const auto& [x, y] : {std::pair{0.0, -0.3}, {1.0, -0.3}, {1.0, 0.3}, {0.0, 0.3}})
    static_cast<void>(outline.try_push_back({x, y}));
  map_->leave_out({rotation_y(-slope_rad), Vec3{0.6, 0.0, -0.02}}, outline, told_);
  EXPECT_FALSE(is(told_.level, 0.40, 0.0));
  EXPECT_TRUE(is(told_.level, 0.25, 0.0));
}

TEST_F(GroundMapTest, TreadBuiltAskew_IsNoLevelGroundAndNoRamp) {
  look([](double, double) { return 0.0; }, 40);
  const GroundView told = with_ramp(*map_, told_, 0.4, 0.0);
  EXPECT_FALSE(is(told.level, 0.7, 0.0));
  EXPECT_FALSE(is(told.ramps, 0.7, 0.0));
  EXPECT_EQ(told.steepest, 0.0);
}

TEST_F(GroundMapTest, RampOfAnotherStorey_LeavesNothingOut) {
  look([](double, double) { return 0.0; }, 40);
  EXPECT_EQ(with_ramp(*map_, told_, 1.0, 0.5).level, told_.level);
}

// A polygon around it would be convex.
TEST_F(GroundMapTest, HoleInTheFloor_IsNoGround) {
  const auto in_hole = [](double x, double y) { return x > 0.6 && x < 0.9 && std::abs(y) < 0.15; };
  look([&](double x, double y) { return in_hole(x, y) ? -0.3 : 0.0; }, 40);
  EXPECT_FALSE(is(told_.level, 0.75, 0.0));
  EXPECT_FALSE(is(told_.tall, 0.75, 0.0));
  EXPECT_TRUE(is(told_.level, 0.75, 0.3));
}

TEST_F(GroundMapTest, SquareThatIsLower_IsBridgedAndAWiderHoleIsNot) {
  for (const double side_m : {0.04, 0.12}) {
    const auto in_hole = [&](double x, double y) { return x > 0.6 && x < 0.6 + side_m && y > 0.0 && y < side_m; };
    map_->clear();
    look([&](double x, double y) { return in_hole(x, y) ? -0.3 : 0.0; }, 200);
    EXPECT_EQ(is(told_.level, 0.6 + 0.5 * side_m, 0.5 * side_m), side_m < 0.05);
  }
}

TEST_F(GroundMapTest, GroundWithoutDepth_IsNoGround) {
  const auto in_hole = [](double x, double y) { return x > 0.6 && x < 0.9 && std::abs(y) < 0.15; };
  look([&](double x, double y) { return in_hole(x, y) ? std::numeric_limits<double>::quiet_NaN() : 0.0; }, 40);
  EXPECT_FALSE(is(told_.level, 0.75, 0.0));
}

TEST_F(GroundMapTest, Box_RisesAndIsNoGround) {
  const auto in_box = [](double x, double y) { return x > 0.6 && x < 0.9 && std::abs(y) < 0.15; };
  look([&](double x, double y) { return in_box(x, y) ? 0.2 : 0.0; }, 40);
  EXPECT_TRUE(is(told_.tall, 0.7, 0.0));
  EXPECT_FALSE(is(told_.level, 0.7, 0.0));
}

TEST_F(GroundMapTest, WhereItIsMet_GroundAboutTheSolesIsLevelUntilItIsSeen) {
  look([](double, double) { return std::numeric_limits<double>::quiet_NaN(); }, 1);
  EXPECT_TRUE(is(told_.level, 0.45, 0.1));
  EXPECT_FALSE(is(told_.level, 0.6, 0.1));
  look([](double, double) { return -0.3; }, 80);
  EXPECT_FALSE(is(told_.level, 0.45, 0.1));
  EXPECT_TRUE(is(told_.level, 0.0, 0.1)) << "it stands there";
}

// What the edge hides is never seen: that pictures see through where it would be says that there is none.
TEST_F(GroundMapTest, EdgeWhereItIsMet_NothingBehindItIsGround) {
  camera_.p_m.x() = 0.1;
  look([](double x, double) { return x < 0.36 ? 0.0 : -0.8; }, 100);
  EXPECT_TRUE(is(told_.level, 0.30, 0.1));
  for (const double x_m : {0.38, 0.42, 0.46, 0.5}) EXPECT_FALSE(is(told_.level, x_m, 0.1)) << x_m;
}

// Of open stairs, seen from below: what is higher, seen a few times, is what it stands on.
TEST_F(GroundMapTest, FloorSeenThroughOpenStairs_IsForgottenOnceTheTreadIsSeen) {
  look([](double, double) { return 0.0; }, 200);
  for (Transform& sole : soles_) sole.p_m.z() = 0.13;
  const auto on_tread = [](double x, double y) { return x > 0.3 && std::abs(y) < 0.5; };
  int frames = 0;
  for (; frames < 100 && !is(told_.level, 0.7, 0.2); ++frames)
    look([&](double x, double y) { return on_tread(x, y) ? 0.13 : 0.0; }, 1);
  EXPECT_LE(frames, 16);
}

// A leg hides it, and no picture has shown it.
TEST_F(GroundMapTest, SoleOnGroundThatWasNeverSeen_CarriesItAndSomeCentimetresBeside) {
  const auto nothing = [](double, double) { return std::numeric_limits<double>::quiet_NaN(); };
  look(nothing, 1);
  for (Transform& sole : soles_) sole.p_m.x() += 1.0;
  look(nothing, 1);
  EXPECT_TRUE(is(told_.level, 1.0, 0.1));
  EXPECT_TRUE(is(told_.level, 1.19, 0.1));
  EXPECT_FALSE(is(told_.level, 1.35, 0.1));
}

TEST_F(GroundMapTest, OwnFoot_IsNoObstacle) {
  const Vec3& foot_m = soles_[0].p_m;
  soles_[0].p_m = {0.5, 0.1, 0.0};
  stands_[0] = false;
  const auto on_foot = [&](double x, double y) {
    return std::abs(x - foot_m.x() - 0.05) < 0.11 && std::abs(y - foot_m.y()) < 0.04;
  };
  look([&](double x, double y) { return on_foot(x, y) ? 0.1 : 0.0; }, 40);
  EXPECT_FALSE(is(told_.tall, 0.55, 0.1));
}

}  // namespace
}  // namespace polygmap
