// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/extrinsics/camera_extrinsics.hpp"

#include <algorithm>
#include <utility>

namespace polygmap {
namespace {

bool is_unit(const Vec3& v) noexcept { return std::abs(v.squaredNorm() - 1.0) < 1e-3; }  // false for NaN

}  // namespace

CameraExtrinsicsEstimator::CameraExtrinsicsEstimator(const Params& params,
                                                     const Transform& nominal_base_T_camera) noexcept
    : params_(params), nominal_(nominal_base_T_camera), base_T_camera_(nominal_base_T_camera) {}

double CameraExtrinsicsEstimator::tilt_sigma_rad() const noexcept {
  const double left = 1.0 / (1.0 + tilt_.information * math::square(params_.prior.tilt_sigma_rad));  // of the prior
  const double alike_rad2 = math::square((1.0 - by_gravity_) * params_.soles_tilt_sigma_rad) +
                            math::square(by_gravity_ * params_.gravity_tilt_sigma_rad) +
                            (seen_as_well_ > 0.0 ? 1.0 / seen_as_well_ : 0.0);
  return math::sqrt(math::square(left * params_.prior.tilt_sigma_rad) + math::square(1.0 - left) * alike_rad2);
}

bool CameraExtrinsicsEstimator::usable(const SurfacePatch& patch) noexcept {
  return is_unit(patch.normal) && std::isfinite(patch.d_m) && math::all_finite(patch.centroid_m) &&
         patch.tilt_sigma_rad >= 0.0;
}

bool CameraExtrinsicsEstimator::says_level(const SurfacePatch& patch) const noexcept {
  return patch.kind == SurfaceKind::kTread && !(patch.tilt_sigma_rad > params_.max_tilt_sigma_rad);
}

bool CameraExtrinsicsEstimator::near_level(const SurfacePatch& patch, const Vec3& up) const noexcept {
  return (base_T_camera_.R * patch.normal).dot(up) > math::cos(params_.tilt_gate_rad);
}

// Level is what the standing soles lie on: a foot is put down by the same kinematics.
// Gravity as the estimator has it errs by more than twice as much, and alike in everything but the camera.
CameraExtrinsicsEstimator::Level CameraExtrinsicsEstimator::level_of(const Stance& stance) const noexcept {
  Level level{stance.base_up, {}, {}};
  std::array<Vec3, kFootCount>& up = level.sole_up;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    up[foot] = stance.base_T_sole[foot].R.col(2);
    level.flat[foot] = stance.stands[foot] && up[foot].dot(stance.base_up) > math::cos(params_.max_sole_tilt_rad);
  }
  // What their encoders are off against each other was taken off before, so that one alone says what both do.
  if (level.flat[0] && level.flat[1]) {
    level.up = (up[0] + up[1]).normalized();
  } else if (level.by_soles()) {
    level.up = level.flat[0] ? up[0] : up[1];
  }
  return level;
}

void CameraExtrinsicsEstimator::update(const SurfaceFrame& frame, const Stance& stance) noexcept {
  bool good = is_unit(stance.base_up) && frame.stamp_ns > last_ns_;
  for (const Transform& sole : stance.base_T_sole)
    good = good && math::all_finite(sole.R) && math::all_finite(sole.p_m);
  if (!good) {
    ++counters_.rejected_frames;
    return;
  }
  const double dt_s = last_ns_ == 0 ? 0.0 : std::min(seconds(frame.stamp_ns - last_ns_), params_.longest_step_s);
  last_ns_ = frame.stamp_ns;
  learn_x(stance, dt_s);
  const Level level = level_of(stance);
  if (try_learn_tilt(frame, stance, level, dt_s)) learn_height(frame, stance, level, dt_s);
  place_x();
  place(level.up);
}

Vec3 CameraExtrinsicsEstimator::camera_p_sole(const Stance& stance, std::size_t foot) const noexcept {
  return base_T_camera_.R.transpose() * (stance.base_T_sole[foot].p_m - nominal_.p_m);
}

bool CameraExtrinsicsEstimator::stands_on(const SurfacePatch& patch, const Vec3& camera_p_sole,
                                          double& above_m) const noexcept {
  above_m = patch.normal.dot(camera_p_sole) + patch.d_m;
  return std::abs(above_m - height_m_) <= params_.height_gate_m;
}

CameraExtrinsicsEstimator::Parallel CameraExtrinsicsEstimator::parallel_of(
    const SurfacePatch& patch, const Level& level, const std::array<Vec3, kFootCount>& camera_p_soles) const noexcept {
  if (!level.by_soles()) return {level.up, params_.gravity_tilt_sigma_rad};
  std::array<bool, kFootCount> on{};
  double above_m = 0.0;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    on[foot] = level.flat[foot] && stands_on(patch, camera_p_soles[foot], above_m);
  }
  if (on[0] && on[1]) return {level.up, params_.systematic_tilt_rad};
  // One sole lies by the play of its own leg's joints, and on a tread that is seen in part.
  return {on[0] ? level.sole_up[0] : on[1] ? level.sole_up[1] : level.up, params_.treads_tilt_rad};
}

bool CameraExtrinsicsEstimator::try_learn_tilt(const SurfaceFrame& frame, const Stance& stance, const Level& level,
                                               double dt_s) noexcept {
  const std::array<Vec3, kFootCount> camera_p_soles{camera_p_sole(stance, 0), camera_p_sole(stance, 1)};
  Vec2 sum = Vec2::Zero();
  double weights = 0.0;
  for (const SurfacePatch& patch : frame.surfaces) {
    if (!says_level(patch)) continue;
    const Parallel parallel = usable(patch) ? parallel_of(patch, level, camera_p_soles) : Parallel{};
    if (!usable(patch) || !near_level(patch, parallel.up)) {
      ++counters_.rejected_surfaces;
      continue;
    }
    const double weight = 1.0 / (math::square(patch.tilt_sigma_rad) + math::square(parallel.sigma_rad));
    sum += weight * (nominal_.R * patch.normal).cross(parallel.up).head<2>();
    weights += weight;
  }
  if (!(weights > 0.0)) return false;
  ++counters_.frames;
  // A surface errs in every frame alike: on the stairs many frames of narrow treads, 4 mrad off, must not outvote the
  // few of the floor, 1 mrad off, neither by their number nor by age. So what sees level worse than what is known has
  // been seen counts, and lets fade, by the square of that.
  const double trust = math::square(seen_as_well_ > weights ? weights / seen_as_well_ : 1.0);
  const double information = trust / math::square(params_.frame_tilt_sigma_rad);
  const double tilt_variance = fuse(tilt_, Vec2{sum / weights}, math::exp(-trust * dt_s / params_.window_s),
                                    information, params_.prior.tilt_sigma_rad);
  const double share = information / tilt_.information;
  seen_as_well_ += share * (weights - seen_as_well_);
  by_gravity_ += share * ((level.by_soles() ? 0.0 : 1.0) - by_gravity_);
  for (int i = 0; i < 2; ++i) {
    tilt_rad_[i] = math::clamp(tilt_variance * tilt_.weighted[i], -params_.max_tilt_rad, params_.max_tilt_rad);
  }
  base_T_camera_.R = rotation_y(tilt_rad_.y()) * rotation_x(tilt_rad_.x()) * nominal_.R;
  return true;
}

bool CameraExtrinsicsEstimator::try_height(const SurfaceFrame& frame, const Vec3& camera_p_sole, const Vec3& up,
                                           double& height_m) const noexcept {
  double largest_m2 = 0.0;
  for (const SurfacePatch& patch : frame.surfaces) {
    if (!says_level(patch) || !usable(patch) || !near_level(patch, up) || !(patch.area_m2 > largest_m2)) continue;
    double above_m = 0.0;
    if (!stands_on(patch, camera_p_sole, above_m)) continue;
    largest_m2 = patch.area_m2;
    height_m = above_m;
  }
  return largest_m2 > 0.0;
}

void CameraExtrinsicsEstimator::learn_height(const SurfaceFrame& frame, const Stance& stance, const Level& level,
                                             double dt_s) noexcept {
  double sum_m = 0.0;
  int soles = 0;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    if (!level.flat[foot]) continue;
    double height_m = 0.0;
    if (!try_height(frame, camera_p_sole(stance, foot), level.up, height_m)) continue;
    sum_m += height_m;
    ++soles;
  }
  if (soles == 0) return;
  ++counters_.heights;
  const double variance = fuse(height_, sum_m / soles, math::exp(-dt_s / params_.window_s),
                               1.0 / math::square(params_.frame_height_sigma_m), params_.prior.height_sigma_m);
  height_m_ = math::clamp(variance * height_.weighted, -params_.max_height_m, params_.max_height_m);
}

void CameraExtrinsicsEstimator::place(const Vec3& base_level) noexcept {
  const Vec3 ahead = (Vec3::UnitX() - base_level.x() * base_level).normalized();
  base_T_camera_.p_m = nominal_.p_m + height_m_ * base_level + x_m_ * ahead;
}

void CameraExtrinsicsEstimator::learn_x(const Stance& stance, double dt_s) noexcept {
  const double fade = math::exp(-dt_s / params_.window_s);
  bool seen = false;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const std::optional<ToeSighting>& toe = stance.toes[foot];
    if (!stance.stands[foot] || !toe || !std::isfinite(toe->ahead_m) || !std::isfinite(toe->sigma_m)) continue;
    // What the other toe told fades as well: else all that has changed since would seem to be between the legs.
    if (!std::exchange(seen, true)) {
      for (ToeMean& mean : toes_) {
        mean = {fade * mean.information, fade * mean.weighted_m, fade * mean.weighted_above_m};
      }
    }
    // The toe is in the last rows of an image: a base that moves alike in many frames shows it off alike in all.
    const double variance_m2 = math::square(params_.frame_x_sigma_m) + math::square(toe->sigma_m) +
                               params_.frames_alike * math::square(params_.half_scan_s * stance.speed_mps);
    above_toes_m_ = (nominal_.p_m - stance.base_T_sole[foot] * toe->sole_p_edge_m).dot(stance.base_up);
    ToeMean& mean = toes_[foot];
    mean.information += 1.0 / variance_m2;
    mean.weighted_m += (x_m_ - toe->ahead_m - above_toes_m_ * tilt_rad_.y()) / variance_m2;
    mean.weighted_above_m += above_toes_m_ / variance_m2;
  }
  if (seen) ++counters_.toes;
}

// The toes tell a sum: where the mount is and both legs have the feet, as long as the feet are as the data sheet says,
// and half of what the legs are apart, which is the other way in the other foot.
void CameraExtrinsicsEstimator::place_x() noexcept {
  const double mount_m2 = math::square(params_.prior.x_sigma_m) + math::square(above_toes_m_ * tilt_sigma_rad());
  const double common_m2 = mount_m2 + math::square(params_.prior.toe_sigma_m);
  const double apart_m2 = math::square(0.5 * params_.prior.legs_apart_sigma_m);
  const double own = (common_m2 + apart_m2) / (4.0 * common_m2 * apart_m2);
  const double other = (apart_m2 - common_m2) / (4.0 * common_m2 * apart_m2);
  const auto told = [this](const ToeMean& mean) { return mean.weighted_m + mean.weighted_above_m * tilt_rad_.y(); };
  const Mat2 information{{own + toes_[0].information, other}, {other, own + toes_[1].information}};
  const Vec2 by_toe_m = information.inverse() * Vec2{told(toes_[0]), told(toes_[1])};
  x_m_ = math::clamp(mount_m2 / common_m2 * 0.5 * by_toe_m.sum(), -params_.max_x_m, params_.max_x_m);
  const double most_m = 3.0 * math::sqrt(apart_m2);
  const double half_m = math::clamp(0.5 * (by_toe_m[1] - by_toe_m[0]), -most_m, most_m);
  feet_ahead_m_ = {half_m, -half_m};
}

}  // namespace polygmap
