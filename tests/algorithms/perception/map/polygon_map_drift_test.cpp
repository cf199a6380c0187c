// SPDX-License-Identifier: Apache-2.0
// What a whole frame is off by: the pose, or the world.
#include <gtest/gtest.h>

#include "sim_stub/robot_camera.hpp"
#include "tests/support/remembered_stairs.hpp"

namespace polygmap {
namespace {

using namespace test;

class PolygonMapDrift : public PolygonMapTest {};

// Beside a map that was spared that frame: as good at once, and the same 2 s later.
TEST_F(PolygonMapDrift, OneFrame40mmOff_IsForgotten) {
  const Stairs stairs{.width_m = 0.7};
  for (const double sigma_m : {0.0, 0.004}) {
    for (const Vec3& jump_m : {Vec3{0.04, 0, 0}, Vec3{0, 0.04, 0}, Vec3{0, 0, 0.04}, Vec3{0.04, 0, -0.04}}) {
      const auto spared = std::make_unique<PolygonMap>();
      map_->clear();
      for (int frame = 0; frame < 91; ++frame) {
        const Vec3 error_m = frame == 30 ? jump_m : Vec3{Vec3::Zero()};
        look(stairs, on_floor_, {}, error_m, sigma_m);
        if (frame == 30) continue;
        const Transform camera = test::camera_of(on_floor_);
        spared->begin(test::seen_from(stairs, camera, stamp_ns_, {}, random_),
                      {camera, sigma_m, 0.0, robot_camera_intrinsics()});
        WorkBudget budget(1 << 20);
        ASSERT_EQ(spared->step(budget), Progress::kDone);
        for (int step = 1; frame > 30 && step <= 2; ++step) {
          const MapPolygon* tread = level_at(step * stairs.rise_m);
          ASSERT_NE(tread, nullptr);
          EXPECT_LT(tread_error_m(*tread, stairs, step), 0.001) << jump_m.transpose() << ", frame " << frame;
        }
      }
      const MapPolygons &a = map_->snapshot().polygons, &b = spared->snapshot().polygons;
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i) {
        ASSERT_EQ(a[i].surface.polygon.size(), b[i].surface.polygon.size());
        for (std::size_t k = 0; k < a[i].surface.polygon.size(); ++k) {
          EXPECT_LT((a[i].surface.polygon[k] - b[i].surface.polygon[k]).norm(), 5e-4) << jump_m.transpose();
        }
      }
      EXPECT_LT(map_->snapshot().drift_m.norm(), 2e-4);
    }
  }
  EXPECT_GT(counters().line_outliers, 0U);
  EXPECT_GT(counters().side_outliers, 0U);
  EXPECT_GT(counters().dropped_unconfirmed, 0U);
  EXPECT_EQ(counters().resets, 0U);
}

TEST_F(PolygonMapDrift, WorldThatReallyJumped_NewEvidenceWinsWithin1s) {
  Stairs stairs{.width_m = 0.7};
  look(stairs, on_floor_, {}, 30);
  stairs.origin_m.x() = 0.04;
  look(stairs, on_floor_, {}, 30);
  const MapPolygon* tread = level_at(stairs.rise_m);
  ASSERT_NE(tread, nullptr);
  EXPECT_NEAR(-extreme(*tread, -Vec3::UnitX()), 0.04, 0.002);
  EXPECT_GT(counters().resets, 0U);
}

TEST_F(PolygonMapDrift, DriftThatTheCovarianceAdmits_StaysOutOfTheMap) {
  const Stairs stairs{.width_m = 0.7};
  constexpr int kFrames = 300;  // 10 s
  for (const Vec3& ramp_m : {Vec3{0, 0, 0.08}, Vec3{0, 0, -0.08}, Vec3{0.08, 0, 0}}) {
    map_->clear();
    for (int i = 0; i < 30; ++i) look(stairs, on_floor_, {0.003, 0.002, 0.002}, Vec3::Zero(), 0.001);
    double worst_m = 0.0, worst_drift_m = 0.0;
    for (int i = 1; i <= kFrames; ++i) {
      const Vec3 drift_m = (static_cast<double>(i) / kFrames) * ramp_m;
      look(stairs, on_floor_, {0.003, 0.002, 0.002}, drift_m, 0.001 + 0.5 * drift_m.norm());
      for (int step = 1; step <= 2; ++step) {
        const MapPolygon* tread = level_at(step * stairs.rise_m);
        ASSERT_NE(tread, nullptr);
        worst_m = std::max(worst_m, tread_error_m(*tread, stairs, step));
      }
      worst_drift_m = std::max(worst_drift_m, (map_->snapshot().drift_m - drift_m).norm());
    }
    EXPECT_LT(worst_m, 0.01);
    EXPECT_LT(worst_drift_m, 0.01);
    EXPECT_LE(map_->snapshot().polygons.size(), 7U);
  }
}

TEST_F(PolygonMapDrift, DriftBeyondTheCovariance_IsFollowed) {
  const Stairs stairs{.width_m = 0.7};
  for (int i = 0; i < 30; ++i) look(stairs, on_floor_, {}, Vec3::Zero(), 0.002);
  for (int i = 1; i <= 300; ++i) look(stairs, on_floor_, {}, Vec3{0, 0, 0.03 * i / 300}, 0.002);
  const MapPolygon* tread = level_at(stairs.rise_m + 0.03);
  ASSERT_NE(tread, nullptr);
  EXPECT_LE(map_->snapshot().drift_m.cwiseAbs().maxCoeff(), 0.006);  // three sigma
  EXPECT_NEAR(tread->surface.centroid_m.z() + map_->snapshot().drift_m.z(), stairs.rise_m + 0.03, 0.005);
}

TEST_F(PolygonMapDrift, SlowDrift_IsFollowed) {
  Stairs stairs{.width_m = 0.7};
  look(stairs, on_floor_, {}, 30);
  for (int i = 0; i < 300; ++i) {  // 2 mm/s in every axis over 10 s
    stairs.origin_m += Vec3::Constant(0.002 / 30.0);
    look(stairs, on_floor_, {});
  }
  const MapPolygon* tread = level_at(stairs.rise_m + stairs.origin_m.z());
  ASSERT_NE(tread, nullptr);
  EXPECT_NEAR(tread->surface.centroid_m.z(), stairs.rise_m + stairs.origin_m.z(), 0.0035);
  EXPECT_NEAR(-extreme(*tread, -Vec3::UnitX()), stairs.origin_m.x(), 0.0035);
}

TEST_F(PolygonMapDrift, FloorAnd40mmStep_StayApart) {
  const Stairs stairs{.steps = 1, .rise_m = 0.04, .landing_m = 0.6};
  look(stairs, on_floor_, {0.005, 0.004, 0.004}, 60);
  ASSERT_NE(level_at(0.0), nullptr);
  ASSERT_NE(level_at(0.04), nullptr);
  EXPECT_NE(level_at(0.0)->id, level_at(0.04)->id);
  const std::uint32_t floor = level_at(0.0)->id, step = level_at(0.04)->id;
  for (int i = 1; i <= 300; ++i) {  // by two of its heights, upwards
    const Vec3 drift_m{0.0, 0.0, 0.08 * i / 300};
    look(stairs, on_floor_, {0.005, 0.004, 0.004}, drift_m, 0.001 + 0.5 * drift_m.z());
  }
  ASSERT_NE(level_at(0.0), nullptr);
  ASSERT_NE(level_at(0.04), nullptr);
  EXPECT_EQ(level_at(0.0)->id, floor);
  EXPECT_EQ(level_at(0.04)->id, step);
}

}  // namespace
}  // namespace polygmap
