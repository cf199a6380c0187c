// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/depth_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polygmap::sim {
namespace {

constexpr double kNear_m = 0.02;
constexpr double kFloorReach_m = 20.0;

// Spans and capsules keep the nearer surface: the larger inverse depth.
void draw_span(float* __restrict inverse_depth, float* __restrict plane_distance, int from, int to, float first,
               float slope, float distance) {
  for (int u = from; u < to; ++u) {
    const float value = first + slope * static_cast<float>(u);
    const bool nearer = value > inverse_depth[u];
    inverse_depth[u] = nearer ? value : inverse_depth[u];
    plane_distance[u] = nearer ? distance : plane_distance[u];
  }
}

// What a row's loop over a capsule needs; camera frame, single precision.
struct CapsuleRow {
  float ax, ay, az, bx, by, bz;  // ends
  float nx, ny, nz;              // unit axis
  float length, radius;
  float a_along, a_c, b_c;  // a . n, |a|^2 - r^2, |b|^2 - r^2
};

void draw_capsule_row(float* __restrict inverse_depth, float* __restrict plane_distance, int from, int to,
                      const CapsuleRow& c, float cx, float inverse_fx, float y) {
  const float cylinder_c = c.a_c - c.a_along * c.a_along;
  for (int u = from; u < to; ++u) {
    const float x = (static_cast<float>(u) - cx) * inverse_fx;
    const float dd = x * x + y * y + 1.0F;
    const float dn = x * c.nx + y * c.ny + c.nz;
    const float da = x * c.ax + y * c.ay + c.az;
    const float db = x * c.bx + y * c.by + c.bz;
    // The infinite cylinder first; where it is hit beyond an end, that end's sphere decides.
    const float qa = std::max(dd - dn * dn, 1e-9F);
    const float qb = da - dn * c.a_along;
    const float disc = qb * qb - qa * cylinder_c;
    const float z_side = (qb - std::sqrt(std::max(disc, 0.0F))) / qa;
    const float along = z_side * dn - c.a_along;
    const bool before = along<0.0F, beyond = along> c.length;
    const float db_end = before ? da : db;
    const float c_end = before ? c.a_c : c.b_c;
    const float disc_end = db_end * db_end - dd * c_end;
    const float z_end = (db_end - std::sqrt(std::max(disc_end, 0.0F))) / dd;
    const bool end = before || beyond;
    const float z = end ? z_end : z_side;
    const bool hit = (disc >= 0.0F) && (!end || disc_end >= 0.0F) && z > static_cast<float>(kNear_m);
    const float value = 1.0F / z;
    // Normal times hit point; the axis point nearest to the hit is an end or a + along n.
    const float p_axis = end ? z * db_end : z * (da + along * dn);
    const float distance = std::abs(z * z * dd - p_axis) / c.radius;
    const bool nearer = hit && value > inverse_depth[u];
    inverse_depth[u] = nearer ? value : inverse_depth[u];
    plane_distance[u] = nearer ? distance : plane_distance[u];
  }
}

// Columns (or rows) between which a sphere projects, as tangents of the view angle.
void sphere_bounds(double sideways, double forward, double radius, double& low, double& high) {
  const double q = forward * forward - radius * radius;
  if (forward <= radius) {
    low = -std::numeric_limits<double>::infinity();
    high = std::numeric_limits<double>::infinity();
    return;
  }
  const double root = radius * std::sqrt(sideways * sideways + q);
  low = std::min(low, (sideways * forward - root) / q);
  high = std::max(high, (sideways * forward + root) / q);
}

int first_pixel(double px, int limit) { return static_cast<int>(std::ceil(math::clamp(px, 0.0, limit))); }
int last_pixel(double px, int limit) { return static_cast<int>(std::floor(math::clamp(px, -1.0, limit - 1))); }

}  // namespace

DepthRenderer::DepthRenderer(const CameraIntrinsics& intrinsics) : intrinsics_(intrinsics) {
  const auto width = static_cast<std::size_t>(intrinsics.width_px),
             height = static_cast<std::size_t>(intrinsics.height_px);
  inverse_depth_.resize(width * height);
  plane_distance_.resize(width * height);
  inverse_length_.resize(width * height);
  left_px_.resize(height);
  right_px_.resize(height);
  for (int v = 0; v < intrinsics.height_px; ++v) {
    for (int u = 0; u < intrinsics.width_px; ++u) {
      const double x = (u - intrinsics.cx_px) / intrinsics.fx_px, y = (v - intrinsics.cy_px) / intrinsics.fy_px;
      inverse_length_[offset(v) + static_cast<std::size_t>(u)] =
          static_cast<float>(1.0 / std::sqrt(x * x + y * y + 1.0));
    }
  }
}

void DepthRenderer::render(const DepthScene& scene) {
  std::fill(inverse_depth_.begin(), inverse_depth_.end(), 0.0F);
  std::fill(plane_distance_.begin(), plane_distance_.end(), 0.0F);
  const Transform camera_T_true = scene.true_T_camera.inverse();

  const double x = scene.true_T_camera.p_m.x(), y = scene.true_T_camera.p_m.y();
  std::array<Vec3, 4> floor;
  for (std::size_t i = 0; i < 4; ++i) {
    floor[i] = camera_T_true * Vec3{x + (i == 1 || i == 2 ? kFloorReach_m : -kFloorReach_m),
                                    y + (i >= 2 ? kFloorReach_m : -kFloorReach_m), 0.0};
  }
  draw_face(floor, camera_T_true.R.col(2));
  for (const SolidBox& solid : scene.solids) {
    const Transform true_T_box{Mat3::Identity(), 0.5 * (solid.min_m + solid.max_m)};
    draw_box(camera_T_true * true_T_box, 0.5 * (solid.max_m - solid.min_m));
  }
  if (!scene.legs_visible) return;
  const Transform camera_T_base = scene.base_T_camera.inverse();
  for (const LegShapes& leg : scene.base_legs) {
    for (const Capsule& capsule : {leg.thigh, leg.shank}) {
      draw_capsule({camera_T_base * capsule.a_m, camera_T_base * capsule.b_m, capsule.radius_m});
    }
    draw_box(camera_T_base * leg.foot.centre, leg.foot.half_m);
  }
}

void DepthRenderer::draw_box(const Transform& camera_T_box, const Vec3& half_m) {
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 a = camera_T_box.R.col((axis + 1) % 3) * half_m[(axis + 1) % 3];
    const Vec3 b = camera_T_box.R.col((axis + 2) % 3) * half_m[(axis + 2) % 3];
    for (const double sign : {1.0, -1.0}) {
      const Vec3 normal = sign * camera_T_box.R.col(axis);
      const Vec3 middle = camera_T_box.p_m + half_m[axis] * normal;
      const std::array<Vec3, 4> corners{middle - a - b, middle + a - b, middle + a + b, middle - a + b};
      draw_face(corners, normal);
    }
  }
}

void DepthRenderer::draw_face(std::span<const Vec3> corners_m, const Vec3& normal) {
  const double distance = -normal.dot(corners_m[0]);
  if (distance < 1e-6) return;  // seen from behind or edge-on

  // Cut off at the near plane.
  std::array<Vec3, 8> kept;
  std::size_t count = 0;
  for (std::size_t i = 0; i < corners_m.size(); ++i) {
    const Vec3 &a = corners_m[i], &b = corners_m[(i + 1) % corners_m.size()];
    if (a.z() >= kNear_m) kept[count++] = a;
    if ((a.z() >= kNear_m) != (b.z() >= kNear_m)) kept[count++] = a + (b - a) * ((kNear_m - a.z()) / (b.z() - a.z()));
  }
  if (count < 3) return;

  // Per row, the columns between which the convex face lies.
  const int width = intrinsics_.width_px, height = intrinsics_.height_px;
  std::array<Vec2, 8> pixel;
  double top = std::numeric_limits<double>::infinity(), bottom = -top;
  for (std::size_t i = 0; i < count; ++i) {
    pixel[i] = {intrinsics_.fx_px * kept[i].x() / kept[i].z() + intrinsics_.cx_px,
                intrinsics_.fy_px * kept[i].y() / kept[i].z() + intrinsics_.cy_px};
    top = std::min(top, pixel[i].y());
    bottom = std::max(bottom, pixel[i].y());
  }
  const int first_row = first_pixel(top, height), last_row = last_pixel(bottom, height);
  for (int v = first_row; v <= last_row; ++v) {
    left_px_[static_cast<std::size_t>(v)] = std::numeric_limits<double>::infinity();
    right_px_[static_cast<std::size_t>(v)] = -std::numeric_limits<double>::infinity();
  }
  for (std::size_t i = 0; i < count; ++i) {
    Vec2 a = pixel[i], b = pixel[(i + 1) % count];
    if (a.y() > b.y()) std::swap(a, b);  // both faces at an edge compute it alike
    if (a.y() == b.y()) continue;
    const double slope = (b.x() - a.x()) / (b.y() - a.y());
    for (int v = first_pixel(a.y(), height); v <= last_pixel(b.y(), height); ++v) {
      const double u = a.x() + slope * (v - a.y());
      double &left = left_px_[static_cast<std::size_t>(v)], &right = right_px_[static_cast<std::size_t>(v)];
      left = std::min(left, u);
      right = std::max(right, u);
    }
  }
  const double slope = -normal.x() / (distance * intrinsics_.fx_px);
  for (int v = first_row; v <= last_row; ++v) {
    const int from = first_pixel(left_px_[static_cast<std::size_t>(v)], width);
    const int to = last_pixel(right_px_[static_cast<std::size_t>(v)], width) + 1;
    const double y = (v - intrinsics_.cy_px) / intrinsics_.fy_px;
    const double first = -(normal.y() * y + normal.z()) / distance - slope * intrinsics_.cx_px;
    draw_span(inverse_depth_.data() + offset(v), plane_distance_.data() + offset(v), from, to,
              static_cast<float>(first), static_cast<float>(slope), static_cast<float>(distance));
  }
}

void DepthRenderer::draw_capsule(const Capsule& capsule) {
  const Vec3 &a = capsule.a_m, &b = capsule.b_m;
  const double radius = capsule.radius_m;
  if (std::max(a.z(), b.z()) + radius < kNear_m) return;
  double x_low = std::numeric_limits<double>::infinity(), x_high = -x_low, y_low = x_low, y_high = x_high;
  for (const Vec3& end : {a, b}) {
    sphere_bounds(end.x(), end.z(), radius, x_low, x_high);
    sphere_bounds(end.y(), end.z(), radius, y_low, y_high);
  }
  const int width = intrinsics_.width_px, height = intrinsics_.height_px;
  const int from = first_pixel(intrinsics_.fx_px * x_low + intrinsics_.cx_px, width);
  const int to = last_pixel(intrinsics_.fx_px * x_high + intrinsics_.cx_px, width) + 1;
  const int first_row = first_pixel(intrinsics_.fy_px * y_low + intrinsics_.cy_px, height);
  const int last_row = last_pixel(intrinsics_.fy_px * y_high + intrinsics_.cy_px, height);

  const double length = (b - a).norm(), r2 = radius * radius;
  const Vec3 n = (b - a) / length;
  const Eigen::Vector3f af = a.cast<float>(), bf = b.cast<float>(), nf = n.cast<float>();
  const CapsuleRow row{af.x(),
                       af.y(),
                       af.z(),
                       bf.x(),
                       bf.y(),
                       bf.z(),
                       nf.x(),
                       nf.y(),
                       nf.z(),
                       static_cast<float>(length),
                       static_cast<float>(radius),
                       static_cast<float>(a.dot(n)),
                       static_cast<float>(a.squaredNorm() - r2),
                       static_cast<float>(b.squaredNorm() - r2)};
  for (int v = first_row; v <= last_row; ++v) {
    draw_capsule_row(inverse_depth_.data() + offset(v), plane_distance_.data() + offset(v), from, to, row,
                     static_cast<float>(intrinsics_.cx_px), static_cast<float>(1.0 / intrinsics_.fx_px),
                     static_cast<float>((v - intrinsics_.cy_px) / intrinsics_.fy_px));
  }
}

}  // namespace polygmap::sim
