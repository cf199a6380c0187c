// SPDX-License-Identifier: Apache-2.0
// A robot that looks at stairs, or at patches, and a map that remembers them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "algorithms/perception/map/polygon_map.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/seen_stairs.hpp"

namespace polygmap::test {

inline constexpr std::int64_t kFrame_ns = 33'333'333;

inline double extreme(const MapPolygon& p, const Vec3& u) {
  double most = -1e9;
  for (const Vec3& v : p.surface.polygon) most = std::max(most, u.dot(v));
  return most;
}

// The most that an edge or the height of a step's tread is off, m; stairs of yaw 0.
inline double tread_error_m(const MapPolygon& tread, const Stairs& stairs, int step) {
  const double half_m = 0.5 * stairs.width_m;
  double most = std::abs(tread.surface.centroid_m.z() - stairs.origin_m.z() - step * stairs.rise_m);
  for (const double error : {-extreme(tread, -Vec3::UnitX()) - stairs.nosing_x_m(step),
                             extreme(tread, Vec3::UnitX()) - stairs.back_x_m(step),
                             extreme(tread, Vec3::UnitY()) - half_m, extreme(tread, -Vec3::UnitY()) - half_m}) {
    most = std::max(most, std::abs(error));
  }
  return most;
}

// A robot that looks and a map that remembers.
class PolygonMapTest : public ::testing::Test {
 protected:
  void fuse(const SurfaceFrame& frame, const Transform& odom_T_camera, double position_sigma_m = 0.0,
            double mount_sigma_rad = 0.0) {
    PolygonMap::View view{odom_T_camera, position_sigma_m, 0.0, robot_camera_intrinsics()};
    view.mount_sigma_rad = mount_sigma_rad;
    map_->begin(frame, view);
    WorkBudget budget(1 << 20);
    ASSERT_EQ(map_->step(budget), Progress::kDone);
    most_units_ = std::max(most_units_, (1 << 20) - budget.left());
  }
  // pose_error_m: of where the robot believes to be.
  void look(const Stairs& stairs, const Transform& odom_T_base, const Noise& noise, const Vec3& pose_error_m,
            double position_sigma_m) {
    stamp_ns_ += kFrame_ns;
    Transform camera = camera_of(odom_T_base);
    const SurfaceFrame frame = seen_from(stairs, camera, stamp_ns_, noise, random_);
    camera.p_m += pose_error_m;
    fuse(frame, camera, position_sigma_m);
  }
  void look(const Stairs& stairs, const Transform& odom_T_base, const Noise& noise, int frames = 1) {
    for (int i = 0; i < frames; ++i) look(stairs, odom_T_base, noise, Vec3::Zero(), 0.0);
  }
  Vec3 gauss(double sigma) {
    std::normal_distribution<> normal(0.0, sigma);
    const double x = normal(random_), y = normal(random_);
    return {x, y, normal(random_)};
  }
  // The confirmed level polygon within 15 mm of that height, null if there is none.
  const MapPolygon* level_at(double z_m) const {
    for (const MapPolygon& p : map_->snapshot().polygons) {
      if (p.surface.kind == SurfaceKind::kTread && p.sightings >= 5 &&
          std::abs(p.surface.centroid_m.z() - z_m) < 0.015) {
        return &p;
      }
    }
    return nullptr;
  }
  const PolygonMap::Counters& counters() const { return map_->counters(); }

  std::unique_ptr<PolygonMap> map_ = std::make_unique<PolygonMap>();
  std::mt19937 random_{7};
  std::int32_t most_units_ = 0;  // of a frame
  std::int64_t stamp_ns_ = kNsPerS;
  const Transform on_floor_ = base_above({-0.45, 0.0, 0.0}, 0.0);
};

// A level patch given in the world, seen from straight above.
inline SurfacePatch level_patch(const Vec3& middle_m, double half_x_m, double half_y_m) {
  SurfacePatch patch;
  patch.kind = SurfaceKind::kTread;
  patch.d_m = -middle_m.z();
  patch.centroid_m = middle_m;
  patch.offset_sigma_m = patch.tilt_sigma_rad = 0.001;
  for (const Vec2& v : {Vec2{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    EXPECT_TRUE(patch.polygon.try_push_back(middle_m + Vec3{v.x() * half_x_m, v.y() * half_y_m, 0.0}));
  }
  return patch;
}

// Camera at a world point, looking straight down, picture up along world x.
inline Transform looking_down(const Vec3& from_m) {
  Mat3 R;
  R << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  return {R, from_m};
}

inline SurfaceFrame in_camera(const std::vector<SurfacePatch>& world, const Transform& odom_T_camera,
                              std::int64_t stamp_ns) {
  SurfaceFrame frame;
  frame.stamp_ns = stamp_ns;
  const Transform inverse = odom_T_camera.inverse();
  for (SurfacePatch patch : world) {
    const Plane plane = inverse * Plane{patch.normal, patch.d_m};
    patch.normal = plane.normal;
    patch.d_m = plane.d_m;
    patch.centroid_m = inverse * patch.centroid_m;
    for (Vec3& v : patch.polygon) v = inverse * v;
    for (EdgeLine* line : {&patch.nosing, &patch.back}) {
      line->a_m = inverse * line->a_m;
      line->b_m = inverse * line->b_m;
    }
    EXPECT_TRUE(frame.surfaces.try_push_back(patch));
  }
  return frame;
}

}  // namespace polygmap::test
