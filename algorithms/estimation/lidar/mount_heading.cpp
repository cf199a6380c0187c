// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/lidar/mount_heading.hpp"

#include <utility>

namespace polygmap {
namespace {

Vec3 turned(const Vec3& way_m) noexcept { return {-way_m.y(), way_m.x(), 0.0}; }  // by a radian of heading

}  // namespace

void MountHeading::see(const Seen& seen) noexcept {
  seen_ = true;
  variance_m2_ = seen.variance_m2;
  if (!tied_) return;
  lagging_m_ += seen.gain * (seen.world_p_base_m - lagging_m_);
  legs_m_ += seen.turn_rad * turned(seen.world_p_base_m - lagging_m_);
}

void MountHeading::move(const Vec3& world_p_base_m, const Vec3& world_step_m) noexcept {
  constexpr double kPiece_m = 0.2;
  if (!tied_) {
    tied_ = true;
    tied_m_ = legs_m_ = lagging_m_ = counted_m_ = world_p_base_m;
    walked_m_ = 0.0;
  } else {
    legs_m_ += world_step_m;
  }
  const double piece_m = (world_p_base_m - counted_m_).head<2>().norm();
  if (piece_m >= kPiece_m) {
    walked_m_ += piece_m;
    counted_m_ = world_p_base_m;
  }
  if (std::exchange(seen_, false)) bend_ = shared_out(world_p_base_m);
}

MountHeading::Bend MountHeading::shared_out(const Vec3& world_p_base_m) const noexcept {
  const Vec3 turned_m = turned(world_p_base_m - tied_m_);
  const double walked_m = walked_m_ + (world_p_base_m - counted_m_).head<2>().norm();
  const double mount_rad2 = math::square(params_.sigma_rad);
  const double drift_m2 = math::square(params_.drift_mprm) * walked_m + variance_m2_;
  const double all_m2 = mount_rad2 * turned_m.squaredNorm() + drift_m2;
  if (!(all_m2 > 0.0)) return {};
  const double heading_rad = mount_rad2 * (world_p_base_m - legs_m_).dot(turned_m) / all_m2;
  const double heading_rad2 = mount_rad2 * drift_m2 / all_m2;
  return {heading_rad * turned_m, heading_rad2 * turned_m.cwiseAbs2()};
}

}  // namespace polygmap
