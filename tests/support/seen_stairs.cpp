// SPDX-License-Identifier: Apache-2.0
#include "tests/support/seen_stairs.hpp"

#include <algorithm>

#include "algorithms/geometry/convex.hpp"
#include "algorithms/geometry/plane.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::test {
namespace {

// A rectangle in the xy plane of its own frame: front (x min), right, back, left edges are the sides of a tread.
struct Face {
  SurfaceKind kind;
  Transform world_T_face;  // z out of the surface
  double x_min_m, x_max_m, y_min_m, y_max_m;
  bool nosing, back;
};

constexpr std::uint8_t kRight = 0, kBack = 1, kLeft = 2, kFront = 3, kPicture = 9;

double gauss(std::mt19937& random, double sigma) {
  return sigma > 0.0 ? std::normal_distribution<>(0.0, sigma)(random) : 0.0;
}

void add(const Face& face, const Transform& odom_T_camera, const Noise& noise, std::mt19937& random,
         SurfaceFrame& frame) {
  const Transform face_T_camera = face.world_T_face.inverse() * odom_T_camera;
  const Vec3 eye = face_T_camera.p_m;
  if (eye.z() < 0.05) return;
  ConvexPolygon polygon;
  EdgeTags tags{kRight, kBack, kLeft, kFront};
  for (const Vec2& v : {Vec2{face.x_min_m, face.y_min_m},
                        {face.x_max_m, face.y_min_m},
                        {face.x_max_m, face.y_max_m},
                        {face.x_min_m, face.y_max_m}}) {
    (void)polygon.try_push_back(v);
  }
  const CameraIntrinsics c = robot_camera_intrinsics();
  const std::array<Vec3, 5> picture{Vec3{c.fx_px, 0, c.cx_px}, Vec3{-c.fx_px, 0, c.width_px - 1 - c.cx_px},
                                    Vec3{0, c.fy_px, c.cy_px}, Vec3{0, -c.fy_px, c.height_px - 1 - c.cy_px},
                                    Vec3{0, 0, 1}};
  for (const Vec3& inward : picture) {
    const Vec3 n = face_T_camera.R * inward;
    const double norm = n.head<2>().norm();
    if (norm < 1e-9) continue;
    polygon = clip(polygon, {n.head<2>() / norm, n.dot(eye) / norm}, &tags, kPicture);
  }
  if (area_m2(polygon) < 0.005) return;

  SurfacePatch patch;
  patch.kind = face.kind;
  const Vec2 middle = centroid_m(polygon);
  const Vec3 pivot{middle.x(), middle.y(), 0.0};  // the noise tilts the patch about its middle
  const Mat3 tilt = rotation_x(gauss(random, noise.tilt_rad)) * rotation_y(gauss(random, noise.tilt_rad));
  const Transform camera_T_face = face_T_camera.inverse() *
                                  Transform{Mat3::Identity(), pivot + Vec3{0, 0, gauss(random, noise.offset_m)}} *
                                  Transform{tilt, -(tilt * pivot)};
  // Each edge is off as a whole, each vertex on top of it.
  std::array<double, 4> shift{};
  for (double& s : shift) s = gauss(random, noise.edge_m);
  const auto seen = [&](const Vec2& v, std::uint8_t tag_before, std::uint8_t tag_after) {
    Vec2 p = v;
    for (const std::uint8_t tag : {tag_before, tag_after}) {
      if (tag == kFront || tag == kBack) p.x() += shift[tag];
      if (tag == kLeft || tag == kRight) p.y() += shift[tag];
    }
    return p;
  };
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 p = seen(polygon[i], tags[i == 0 ? n - 1 : i - 1], tags[i]);
    (void)patch.polygon.try_push_back(camera_T_face * Vec3{p.x(), p.y(), 0.0});
    patch.edges[i] = tags[i] == kPicture ? EdgeKind::kUnknown : EdgeKind::kObserved;
    const Vec2 q = seen(polygon[i + 1 == n ? 0 : i + 1], tags[i], tags[i + 1 == n ? 0 : i + 1]);
    if (std::abs(q.y() - p.y()) < 0.1) continue;
    EdgeLine line{camera_T_face * Vec3{p.x(), p.y(), 0.0}, camera_T_face * Vec3{q.x(), q.y(), 0.0},
                  std::max(noise.edge_m, 0.001), true};
    if (face.nosing && tags[i] == kFront) patch.nosing = line;
    if (face.back && tags[i] == kBack) patch.back = line;
  }
  patch.centroid_m = camera_T_face * Vec3{middle.x(), middle.y(), 0.0};
  patch.normal = camera_T_face.R.col(2);
  patch.d_m = -patch.normal.dot(patch.centroid_m);
  patch.offset_sigma_m = std::max(noise.offset_m, 0.001);
  patch.tilt_sigma_rad = std::max(noise.tilt_rad, 0.001);
  patch.area_m2 = area_m2(polygon);
  if (!frame.surfaces.try_push_back(patch)) ++frame.dropped;
}

}  // namespace

Transform camera_of(const Transform& odom_T_base) { return odom_T_base * base_T_camera(); }

Transform base_above(const Vec3& sole_m, double yaw_rad) {
  return {rotation_z(yaw_rad), sole_m + Vec3{0, 0, kNominalBaseHeight_m}};
}

std::array<Transform, kFootCount> soles_at(const Vec3& middle_m, double yaw_rad) {
  const Transform middle{rotation_z(yaw_rad), middle_m};
  return {middle * Transform{Mat3::Identity(), Vec3{0, kStanceHalfWidth_m, 0}},
          middle * Transform{Mat3::Identity(), Vec3{0, -kStanceHalfWidth_m, 0}}};
}

SurfaceFrame seen_from(const Stairs& stairs, const Transform& odom_T_camera, std::int64_t stamp_ns, const Noise& noise,
                       std::mt19937& random) {
  SurfaceFrame frame;
  frame.stamp_ns = stamp_ns;
  const double half = 0.5 * stairs.width_m;
  const Transform base = stairs.world_T_stairs();
  const auto is_missing = [&](int step) {
    return std::find(stairs.missing.begin(), stairs.missing.end(), step) != stairs.missing.end();
  };
  add({SurfaceKind::kTread, base, -3.0, is_missing(1) ? stairs.tread_m : 0.0, -3.0, 3.0, false, stairs.steps > 0},
      odom_T_camera, noise, random, frame);
  Mat3 upright;  // x to the right looking up the stairs, y up, z towards the viewer
  upright << 0, 0, -1, -1, 0, 0, 0, 1, 0;
  for (int step = 1; step <= stairs.steps; ++step) {
    if (is_missing(step)) continue;
    const double top = step * stairs.rise_m;
    const double foot = top - stairs.rise_m * (is_missing(step - 1) ? 2 : 1);
    const double back = is_missing(step + 1) ? stairs.back_x_m(step + 1) : stairs.back_x_m(step);
    add({SurfaceKind::kRiser, base * Transform{upright, Vec3{(step - 1) * stairs.tread_m, 0, 0}}, -half, half, foot,
         top, false, false},
        odom_T_camera, noise, random, frame);
    add({SurfaceKind::kTread, base * Transform{Mat3::Identity(), Vec3{0, 0, top}}, stairs.nosing_x_m(step), back, -half,
         half, true, step < stairs.steps},
        odom_T_camera, noise, random, frame);
  }
  return frame;
}

}  // namespace polygmap::test
