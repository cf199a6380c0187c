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

OrientedBox oriented(const SolidBox& solid) noexcept {
  return {{Mat3::Identity(), 0.5 * (solid.min_m + solid.max_m)}, 0.5 * (solid.max_m - solid.min_m)};
}

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
  double s = det > 1e-12 * uu * vv ? math::clamp((uv * vw - vv * uw) / det, 0.0, 1.0) : 0.0;
  const double t = math::clamp((uv * s + vw) / vv, 0.0, 1.0);
  s = math::clamp((uv * t - uw) / uu, 0.0, 1.0);
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

std::vector<SolidBox> stair_solids(const StairWorld& world) {
  std::vector<SolidBox> solids;
  const double w = world.half_width_m;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    const Step& s = world.steps[k];
    const int step = static_cast<int>(k);
    solids.push_back({Vec3{s.riser_x_m, -w, -kFoundation_m}, Vec3{s.back_x_m, w, s.height_m}, step});
    if (s.nosing_x_m < s.riser_x_m) {
      solids.push_back({Vec3{s.nosing_x_m, -w, s.height_m - kTreadSlab_m}, Vec3{s.back_x_m, w, s.height_m}, step});
    }
  }
  for (const Obstacle& o : world.obstacles) {
    solids.push_back({o.centre_m - 0.5 * o.size_m, o.centre_m + 0.5 * o.size_m, kObstacleStep});
  }
  return solids;
}

double signed_distance_m(const OrientedBox& box, const SolidBox& solid) noexcept {
  const OrientedBox other = oriented(solid);
  const double gap = axis_gap_m(box, other);
  return gap <= 0.0 ? gap : gap_m(box, other);
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
    const Vec3 centre = 0.5 * (solid.min_m + solid.max_m), half = 0.5 * (solid.max_m - solid.min_m);
    const Vec3 apart = ((box.centre.p_m - centre).cwiseAbs() - half - reach).cwiseMax(0.0);
    if (apart.norm() >= std::max(least, 1e-9)) continue;  // the boxes' bounds are a lower bound of their distance
    least = std::min(least, signed_distance_m(box, solid));
  }
  return least;
}

double tread_margin_m(const Vec3& point_m, const StairWorld& world, int step) noexcept {
  if (step < 0) {
    if (world.steps.empty()) return kInf;
    const double outside_x =
        std::max(world.steps.front().riser_x_m - point_m.x(), point_m.x() - world.steps.back().back_x_m);
    return std::max(outside_x, std::abs(point_m.y()) - world.half_width_m);
  }
  const Step& s = world.steps[static_cast<std::size_t>(step)];
  return std::min({point_m.x() - s.nosing_x_m, s.back_x_m - point_m.x(), world.half_width_m - std::abs(point_m.y())});
}

double sole_margin_m(const Transform& true_T_sole, const StairWorld& world, int step, const SoleModel& sole) noexcept {
  double least = kInf;
  for (const Vec3& corner : sole.contacts_m())
    least = std::min(least, tread_margin_m(true_T_sole * corner, world, step));
  return least;
}

}  // namespace polygmap::sim
