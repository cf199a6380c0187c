// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/world/clearance.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kFoundation_m = 1.0;  // how far the solids reach below the floor

std::array<Vec3, 8> corners(const OrientedBox& box) noexcept {
  std::array<Vec3, 8> out;
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3 sign{(i & 1U) != 0U ? 1.0 : -1.0, (i & 2U) != 0U ? 1.0 : -1.0, (i & 4U) != 0U ? 1.0 : -1.0};
    out[i] = box.centre * Vec3(sign.cwiseProduct(box.half_m));
  }
  return out;
}

// Pairs of corner indices: four edges along each axis.
constexpr std::array<std::array<unsigned, 2>, 12> kEdges{
    {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};

double segment_distance_m(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1) noexcept {
  const Vec3 u = a1 - a0, v = b1 - b0, w = a0 - b0;
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm(), uw = u.dot(w), vw = v.dot(w);
  const double det = uu * vv - uv * uv;
  const auto share = [](double part, double whole) {  // of an edge without length: none
    return whole > 0.0 ? math::clamp(part / whole, 0.0, 1.0) : 0.0;
  };
  double s = det > 1e-12 * uu * vv ? share(uv * vw - vv * uw, det) : 0.0;
  const double t = share(uv * s + vw, vv);
  s = share(uv * t - uw, uu);
  return (w + s * u - t * v).norm();
}

// Largest gap along any separating axis (exact when negative: the penetration depth of two convex boxes).
double axis_gap_m(const OrientedBox& a, const OrientedBox& b) noexcept {
  const Vec3 between = b.centre.p_m - a.centre.p_m;
  const auto gap = [&](const Vec3& axis) {
    const double reach_a = (a.centre.R.transpose() * axis).cwiseAbs().dot(a.half_m);
    const double reach_b = (b.centre.R.transpose() * axis).cwiseAbs().dot(b.half_m);
    return std::abs(between.dot(axis)) - reach_a - reach_b;
  };
  double largest = -kInf;
  for (int i = 0; i < 3; ++i) {
    largest = std::max({largest, gap(a.centre.R.col(i)), gap(b.centre.R.col(i))});
    for (int j = 0; j < 3; ++j) {
      const Vec3 axis = a.centre.R.col(i).cross(b.centre.R.col(j));
      const double norm = axis.norm();
      if (norm > 1e-6) largest = std::max(largest, gap(axis / norm));
    }
  }
  return largest;
}

double gap_m(const OrientedBox& a, const OrientedBox& b) noexcept {
  const std::array<Vec3, 8> ca = corners(a), cb = corners(b);
  double least = kInf;
  for (const Vec3& p : ca) least = std::min(least, polygmap::signed_distance_m(b, p));
  for (const Vec3& p : cb) least = std::min(least, polygmap::signed_distance_m(a, p));
  for (const auto& ea : kEdges) {
    for (const auto& eb : kEdges) {
      least = std::min(least, segment_distance_m(ca[ea[0]], ca[ea[1]], cb[eb[0]], cb[eb[1]]));
    }
  }
  return std::max(least, 0.0);
}

}  // namespace

std::vector<SolidBox> solids_of(const StairWorld& world) {
  if (!world.is_staircase) return world.solids;
  std::vector<SolidBox> solids;
  const double w = world.half_width_m;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    const Step& s = world.steps[k];
    const double back_x_m = s.back_x_m + s.beneath_m, slab_z_m = s.height_m - kTreadSlab_m;
    const auto add = [&](double from_x_m, double from_z_m, double to_z_m) {
      solids.push_back({Vec3{from_x_m, -w, from_z_m}, Vec3{back_x_m, w, to_z_m}, static_cast<int>(k), s.true_T_step});
    };
    const bool overhangs = s.nosing_x_m < s.riser_x_m;
    if (s.worn_m > 0.0) {
      const Vec3 bar_m{s.edge_x_m(), 0.0, s.height_m - s.worn_m}, along_m{0.0, w - s.worn_m, 0.0};
      add(s.riser_x_m, -kFoundation_m, bar_m.z());
      if (overhangs) add(s.nosing_x_m, slab_z_m, bar_m.z());
      add(bar_m.x(), slab_z_m, s.height_m);
      solids.push_back({bar_m - along_m, bar_m + along_m, static_cast<int>(k), s.true_T_step, s.worn_m});
      continue;
    }
    add(s.riser_x_m, -kFoundation_m, s.height_m);
    if (overhangs) add(s.nosing_x_m, slab_z_m, s.height_m);
  }
  for (const Obstacle& o : world.obstacles) {
    solids.push_back({o.centre_m - 0.5 * o.size_m, o.centre_m + 0.5 * o.size_m, kObstacleStep});
  }
  return solids;
}

Capsule bar_of(const SolidBox& solid) noexcept {
  return {solid.true_T_solid * solid.min_m, solid.true_T_solid * solid.max_m, solid.round_m};
}

double signed_distance_m(const OrientedBox& box, const SolidBox& solid) noexcept {
  const OrientedBox other = solid.box();
  const double gap = axis_gap_m(box, other);
  return (gap <= 0.0 ? gap : gap_m(box, other)) - solid.round_m;
}

double clearance_m(const OrientedBox& box, std::span<const SolidBox> solids, std::span<const int> excluded,
                   double at_most_m) noexcept {
  const auto is_excluded = [&](int step) {
    return std::find(excluded.begin(), excluded.end(), step) != excluded.end();
  };
  const Vec3 reach = box.centre.R.cwiseAbs() * box.half_m;
  double least = is_excluded(kFloorStep) ? at_most_m : std::min(at_most_m, box.centre.p_m.z() - reach.z());
  for (const SolidBox& solid : solids) {
    if (is_excluded(solid.step)) continue;
    const OrientedBox other = solid.box();
    const Vec3 other_reach = other.centre.R.cwiseAbs() * other.half_m + Vec3::Constant(solid.round_m);
    const Vec3 apart = ((box.centre.p_m - other.centre.p_m).cwiseAbs() - other_reach - reach).cwiseMax(0.0);
    if (apart.norm() >= std::max(least, 1e-9)) continue;  // the boxes' bounds are a lower bound of their distance
    least = std::min(least, signed_distance_m(box, solid));
  }
  return least;
}

double tread_margin_m(const Vec3& point_m, const StairWorld& world, int step) noexcept {
  const auto along = [&point_m](const Step& s) { return Vec3(s.true_T_step.inverse() * point_m); };
  if (step < 0) {
    if (world.steps.empty()) return kInf;
    const Step &first = world.steps.front(), &last = world.steps.back();
    const double outside_x = std::max(first.riser_x_m - along(first).x(), along(last).x() - last.back_x_m);
    return std::max(outside_x, std::abs(point_m.y()) - world.half_width_m);
  }
  const auto k = static_cast<std::size_t>(step);
  const Step& s = world.steps[k];
  const Vec3 p_m = along(s);
  double behind_m = s.back_x_m - p_m.x();
  if (k + 1 < world.steps.size() && world.steps[k + 1].turned()) {  // the next riser is not parallel to this tread
    behind_m = world.steps[k + 1].riser_x_m - along(world.steps[k + 1]).x();
  }
  return std::min({p_m.x() - s.carries_from_x_m(), behind_m, world.half_width_m - std::abs(p_m.y())});
}

double sole_margin_m(const Transform& true_T_sole, const StairWorld& world, int step, const SoleModel& sole) noexcept {
  double least = kInf;
  for (const Vec3& corner : sole.contacts_m())
    least = std::min(least, tread_margin_m(true_T_sole * corner, world, step));
  return least;
}

}  // namespace polygmap::sim
