// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/extrinsics/way_scale.hpp"

#include <algorithm>

#include "algorithms/geometry/line.hpp"

namespace polygmap {
namespace {

constexpr double kLongestStep_m = 0.1;                   // from frame to frame; a longer one counts as this
constexpr double kSameAlong_m = 0.08, kSameUp_m = 0.05;  // less than between any two treads

}  // namespace

double WayScale::excess() const noexcept {
  const double most = 3.0 * params_.legs_share;
  return math::clamp(weighted_ / (information_ + 1.0 / math::square(params_.legs_share)), -most, most);
}

void WayScale::update(const SurfaceFrame& frame, const Transform& odom_T_camera, const Vec3& odom_p_base_m) noexcept {
  if (!math::all_finite(odom_p_base_m) || !math::all_finite(odom_T_camera.p_m)) return;
  const double way_m =
      begun_ ? std::min(math::sqrt((odom_p_base_m - last_base_m_).squaredNorm()), kLongestStep_m) : 0.0;
  begun_ = true;
  last_base_m_ = odom_p_base_m;
  if (!(way_m > 0.0)) return;  // a robot that stands learns nothing
  const Vec2 looks = odom_T_camera.R.col(0).head<2>().normalized();
  for (const SurfacePatch& patch : frame.surfaces) {
    if (patch.kind != SurfaceKind::kTread || !patch.nosing.valid) continue;
    EdgeLine nosing = patch.nosing;
    nosing.a_m = odom_T_camera * nosing.a_m;
    nosing.b_m = odom_T_camera * nosing.b_m;
    if (math::all_finite(nosing.a_m) && math::all_finite(nosing.b_m)) add(nosing, looks, odom_p_base_m, way_m);
  }
}

Vec2 WayScale::place_m(const Tread& tread, const EdgeLine& odom_nosing, const Vec3& odom_p_base_m) noexcept {
  const Vec2 a_m = odom_nosing.a_m.head<2>(), along_nosing_m = odom_nosing.b_m.head<2>() - a_m;
  const Vec2 base_m = odom_p_base_m.head<2>();
  // base + ahead * distance = a + (b - a) * share
  const double across_m = cross(tread.ahead, along_nosing_m);
  const double distance_m = cross(a_m - base_m, along_nosing_m) / across_m;
  const double share = math::clamp(cross(a_m - base_m, tread.ahead) / across_m, 0.0, 1.0);
  return {tread.ahead.dot(base_m) + distance_m,
          odom_nosing.a_m.z() + share * (odom_nosing.b_m.z() - odom_nosing.a_m.z())};
}

void WayScale::add(const EdgeLine& odom_nosing, const Vec2& looks, const Vec3& odom_p_base_m, double way_m) noexcept {
  const std::optional<Line2> line = line_through(odom_nosing.a_m.head<2>(), odom_nosing.b_m.head<2>());
  if (!line) return;
  Tread fresh;
  fresh.ahead = left_of(line->direction);
  fresh.looked = looks;
  double ahead_m = fresh.ahead.dot(line->point_m - odom_p_base_m.head<2>());
  if (ahead_m < 0.0) fresh.ahead = -fresh.ahead;
  ahead_m = std::abs(ahead_m);
  if (ahead_m < params_.nearest_m || ahead_m > params_.farthest_m) return;

  constexpr double kParallel_cos = 0.9;
  const auto same = [&](const Tread& tread) {
    if (tread.ahead.dot(fresh.ahead) < kParallel_cos) return false;
    const Vec2 moved_m = place_m(tread, odom_nosing, odom_p_base_m) - tread.last_m;
    return std::abs(moved_m.x()) < kSameAlong_m && std::abs(moved_m.y()) < kSameUp_m;
  };
  const auto end = treads_.begin() + static_cast<std::ptrdiff_t>(std::min(known_, kTreads));
  auto tread = std::find_if(treads_.begin(), end, same);
  if (tread == end) {
    tread = treads_.begin() + static_cast<std::ptrdiff_t>(known_++ % kTreads);
    *tread = fresh;
  }
  tread->last_m = place_m(*tread, odom_nosing, odom_p_base_m);
  if (!(std::abs(cross(tread->looked, looks)) <= params_.turned_rad)) return;
  const Vec2 base_m{tread->ahead.dot(odom_p_base_m.head<2>()), odom_p_base_m.z()};
  const Vec2 base_off_m = base_m - tread->mean_base_m, nosing_off_m = tread->last_m - tread->mean_nosing_m;
  const double share = way_m / (tread->way_m + way_m);
  const double frames = tread->way_m * share / params_.alike_m;  // as many that err by themselves; of the first none
  tread->way_m += way_m;
  tread->mean_base_m += share * base_off_m;
  tread->mean_nosing_m += share * nosing_off_m;
  const Vec2 sigma_m{params_.along_sigma_m, params_.up_sigma_m};
  for (int axis = 0; axis < 2; ++axis) {
    const double weight = frames / math::square(sigma_m[axis]);
    information_ += weight * math::square(base_off_m[axis]);
    weighted_ -= weight * base_off_m[axis] * nosing_off_m[axis];
  }
}

}  // namespace polygmap
