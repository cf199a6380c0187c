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

void MountHeading::move(const Vec3& world_p_base_m, const Vec3& world_step_m, double yaw_sigma_rad) noexcept {
  if (!tied_) {
    tied_ = true;
    tied_m_ = lagging_m_ = legs_m_ = world_p_base_m;
    bent_m_.setZero();
  } else {
    legs_m_ += world_step_m;
    bent_m_ += yaw_sigma_rad * turned(world_step_m);
  }
  if (std::exchange(seen_, false)) bend_ = shared_out(world_p_base_m);
}

void MountHeading::rebase(const Transform& new_T_old) noexcept {
  tied_m_ = new_T_old * tied_m_;
  lagging_m_ = new_T_old * lagging_m_;
  legs_m_ = new_T_old * legs_m_;
  bent_m_ = new_T_old.R * bent_m_;
  bend_ = {new_T_old.R * bend_.way_m, new_T_old.R.cwiseAbs2() * bend_.variance_m2};
}

MountHeading::Bend MountHeading::shared_out(const Vec3& world_p_base_m) const noexcept {
  const Vec3 way_m = world_p_base_m - tied_m_;
  const Vec3 turned_m = turned(way_m);
  const double way_m2 = turned_m.squaredNorm();
  const double mount_rad2 = math::square(params_.sigma_rad);
  const double drift_m2 = math::square(params_.legs_mrm) * math::sqrt(way_m2) + bent_m_.squaredNorm() + variance_m2_;
  const double all_m2 = mount_rad2 * way_m2 + drift_m2;
  if (!(all_m2 > 0.0)) return {};
  const double heading_rad = mount_rad2 * (world_p_base_m - legs_m_).dot(turned_m) / all_m2;
  const double heading_rad2 = mount_rad2 * drift_m2 / all_m2;
  return {heading_rad * turned_m, heading_rad2 * turned_m.cwiseAbs2()};
}

}  // namespace polygmap
