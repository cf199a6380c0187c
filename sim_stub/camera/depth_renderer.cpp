// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/camera/depth_renderer.hpp"

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

CapsuleRow capsule_row(const Vec3& a, const Vec3& b, double radius) {
  const double length = (b - a).norm(), r2 = radius * radius;
  const Vec3 n = (b - a) / length;
  const Eigen::Vector3f af = a.cast<float>(), bf = b.cast<float>(), nf = n.cast<float>();
  return {af.x(),
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
}

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
  for (int v = 0; v < intrinsics.height_px; ++v) {
    for (int u = 0; u < intrinsics.width_px; ++u) {
      const double x = (u - intrinsics.cx_px) / intrinsics.fx_px, y = (v - intrinsics.cy_px) / intrinsics.fy_px;
      inverse_length_[offset(v) + static_cast<std::size_t>(u)] =
          static_cast<float>(1.0 / std::sqrt(x * x + y * y + 1.0));
    }
  }
}

void DepthRenderer::render(const DepthScene& first, const DepthScene& last) {
  std::fill(inverse_depth_.begin(), inverse_depth_.end(), 0.0F);
  std::fill(plane_distance_.begin(), plane_distance_.end(), 0.0F);
  const Transform first_T_true = first.true_T_camera.inverse(), last_T_true = last.true_T_camera.inverse();
  const auto moved = [](const Transform& camera_T, const Capsule& c) {
    return Capsule{camera_T * c.a_m, camera_T * c.b_m, c.radius_m};
  };

  const double x = first.true_T_camera.p_m.x(), y = first.true_T_camera.p_m.y(), r = kFloorReach_m;
  const auto floor = [&](const Transform& camera_T_true) {
    return Face{{camera_T_true * Vec3{x - r, y - r, 0}, camera_T_true * Vec3{x + r, y - r, 0},
                 camera_T_true * Vec3{x + r, y + r, 0}, camera_T_true * Vec3{x - r, y + r, 0}},
                camera_T_true.R.col(2)};
  };
  draw_face(floor(first_T_true), floor(last_T_true));
  for (const SolidBox& solid : first.solids) {
    if (solid.round_m > 0.0) {
      draw_capsule(moved(first_T_true, bar_of(solid)), moved(last_T_true, bar_of(solid)));
      continue;
    }
    const OrientedBox box = solid.box();
    draw_box(first_T_true * box.centre, last_T_true * box.centre, box.half_m);
  }
  if (!first.legs_visible) return;
  const Transform first_T_base = first.base_T_camera.inverse(), last_T_base = last.base_T_camera.inverse();
  for (std::size_t i = 0; i < kFootCount; ++i) {
    const LegShapes &a = first.base_legs[i], &b = last.base_legs[i];
    draw_capsule(moved(first_T_base, a.thigh), moved(last_T_base, b.thigh));
    draw_capsule(moved(first_T_base, a.shank), moved(last_T_base, b.shank));
    draw_box(first_T_base * a.foot.centre, last_T_base * b.foot.centre, a.foot.half_m);
  }
}

void DepthRenderer::fatten_edges(double px, const CounterNoise& noise) {
  constexpr float kJump_m = 0.03F;
  const auto width = static_cast<std::size_t>(intrinsics_.width_px);
  const int height = intrinsics_.height_px;
  std::vector<float> nearest(width);  // 1 / depth of the nearest one beside each pixel of a row
  for (double left_px = px; left_px > 0.0; left_px -= 1.0) {
    const std::vector<float> inverse = inverse_depth_, distance = plane_distance_;
    for (int v = 0; v < height; ++v) {
      const std::size_t begin = offset(v), above = offset(std::max(v - 1, 0)),
                        below = offset(std::min(v + 1, height - 1));
      const float* row = inverse.data() + begin;
      for (std::size_t u = 0; u < width; ++u) nearest[u] = std::max(inverse[above + u], inverse[below + u]);
      for (std::size_t u = 1; u < width; ++u) nearest[u] = std::max(nearest[u], row[u - 1]);
      for (std::size_t u = 1; u < width; ++u) nearest[u - 1] = std::max(nearest[u - 1], row[u]);
      for (std::size_t u = 0; u < width; ++u) {
        if (nearest[u] - row[u] <= kJump_m * nearest[u] * row[u]) continue;
        const std::size_t here = begin + u;
        if (left_px < 1.0 && noise.uniform(here) >= left_px) continue;
        const std::array<std::size_t, 4> beside{here - (u > 0), here + (u + 1 < width), above + u, below + u};
        const auto* from = std::ranges::find_if(beside, [&](std::size_t i) { return inverse[i] == nearest[u]; });
        inverse_depth_[here] = nearest[u];
        plane_distance_[here] = distance[*from];
      }
    }
  }
}

DepthRenderer::Face DepthRenderer::box_face(const Transform& camera_T_box, const Vec3& half_m, int axis, double sign) {
  const Vec3 a = camera_T_box.R.col((axis + 1) % 3) * half_m[(axis + 1) % 3];
  const Vec3 b = camera_T_box.R.col((axis + 2) % 3) * half_m[(axis + 2) % 3];
  const Vec3 normal = sign * camera_T_box.R.col(axis);
  const Vec3 middle = camera_T_box.p_m + half_m[axis] * normal;
  return {{middle - a - b, middle + a - b, middle + a + b, middle - a + b}, normal};
}

void DepthRenderer::draw_box(const Transform& first, const Transform& last, const Vec3& half_m) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      draw_face(box_face(first, half_m, axis, sign), box_face(last, half_m, axis, sign));
    }
  }
}

// All rows that a face may be seen in. Between the two moments a corner's row changes steadily.
DepthRenderer::Rows DepthRenderer::rows_of(const Face& first, const Face& last) const {
  double top = std::numeric_limits<double>::infinity(), bottom = -top;
  for (const Face* face : {&first, &last}) {
    for (const Vec3& corner : face->corners_m) {
      if (corner.z() < kNear_m) return {0, intrinsics_.height_px - 1};
      const double row = intrinsics_.fy_px * corner.y() / corner.z() + intrinsics_.cy_px;
      top = std::min(top, row);
      bottom = std::max(bottom, row);
    }
  }
  return {first_pixel(top, intrinsics_.height_px), last_pixel(bottom, intrinsics_.height_px)};
}

void DepthRenderer::draw_face(const Face& first, const Face& last) {
  constexpr double kLeastDistance_m = 1e-6;
  if (first.distance_m() < kLeastDistance_m && last.distance_m() < kLeastDistance_m) return;  // from behind, edge-on
  const Rows rows = rows_of(first, last);
  for (int v = rows.first; v <= rows.last; ++v) {
    const double s = moment_of(v), y = (v - intrinsics_.cy_px) / intrinsics_.fy_px;
    std::array<Vec3, 4> corner;
    std::array<double, 4> below;  // how far below the row's plane through the camera
    for (std::size_t i = 0; i < corner.size(); ++i) {
      corner[i] = first.corners_m[i] + s * (last.corners_m[i] - first.corners_m[i]);
      below[i] = corner[i].y() - y * corner[i].z();
    }
    // The row cuts a convex face in one segment.
    std::array<Vec3, 2> end;
    std::size_t count = 0;
    for (std::size_t i = 0; i < corner.size(); ++i) {
      std::size_t a = i, b = (i + 1) % corner.size();
      if ((below[a] < 0.0) == (below[b] < 0.0)) continue;
      if (below[a] > below[b]) std::swap(a, b);  // both faces at an edge compute it alike
      end[count++] = corner[a] + below[a] / (below[a] - below[b]) * (corner[b] - corner[a]);
    }
    if (count < 2 || (end[0].z() < kNear_m && end[1].z() < kNear_m)) continue;
    for (std::size_t i = 0; i < 2; ++i) {
      const Vec3& other = end[1 - i];
      if (end[i].z() < kNear_m) end[i] += (other - end[i]) * ((kNear_m - end[i].z()) / (other.z() - end[i].z()));
    }
    const auto column = [this](const Vec3& p) { return intrinsics_.fx_px * p.x() / p.z() + intrinsics_.cx_px; };
    const double u0 = column(end[0]), u1 = column(end[1]);
    const int from = first_pixel(std::min(u0, u1), intrinsics_.width_px);
    const int to = last_pixel(std::max(u0, u1), intrinsics_.width_px) + 1;
    const Vec3 normal = first.normal + s * (last.normal - first.normal);
    const double distance = -normal.dot(corner[0]);
    if (distance < kLeastDistance_m) continue;
    const double slope = -normal.x() / (distance * intrinsics_.fx_px);
    const double at_zero = -(normal.y() * y + normal.z()) / distance - slope * intrinsics_.cx_px;
    draw_span(inverse_depth_.data() + offset(v), plane_distance_.data() + offset(v), from, to,
              static_cast<float>(at_zero), static_cast<float>(slope), static_cast<float>(distance));
  }
}

void DepthRenderer::draw_capsule(const Capsule& first, const Capsule& last) {
  const double radius = first.radius_m;
  const std::array<Vec3, 4> ends{first.a_m, first.b_m, last.a_m, last.b_m};
  if (std::max({ends[0].z(), ends[1].z(), ends[2].z(), ends[3].z()}) + radius < kNear_m) return;
  double x_low = std::numeric_limits<double>::infinity(), x_high = -x_low, y_low = x_low, y_high = x_high;
  for (const Vec3& end : ends) {
    sphere_bounds(end.x(), end.z(), radius, x_low, x_high);
    sphere_bounds(end.y(), end.z(), radius, y_low, y_high);
  }
  const int width = intrinsics_.width_px, height = intrinsics_.height_px;
  const int from = first_pixel(intrinsics_.fx_px * x_low + intrinsics_.cx_px, width);
  const int to = last_pixel(intrinsics_.fx_px * x_high + intrinsics_.cx_px, width) + 1;
  const int first_row = first_pixel(intrinsics_.fy_px * y_low + intrinsics_.cy_px, height);
  const int last_row = last_pixel(intrinsics_.fy_px * y_high + intrinsics_.cy_px, height);
  for (int v = first_row; v <= last_row; ++v) {
    const double s = moment_of(v);
    const Vec3 a = first.a_m + s * (last.a_m - first.a_m), b = first.b_m + s * (last.b_m - first.b_m);
    draw_capsule_row(inverse_depth_.data() + offset(v), plane_distance_.data() + offset(v), from, to,
                     capsule_row(a, b, radius), static_cast<float>(intrinsics_.cx_px),
                     static_cast<float>(1.0 / intrinsics_.fx_px),
                     static_cast<float>((v - intrinsics_.cy_px) / intrinsics_.fy_px));
  }
}

}  // namespace polygmap::sim
