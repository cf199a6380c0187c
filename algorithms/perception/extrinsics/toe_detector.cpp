// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/extrinsics/toe_detector.hpp"

#include <algorithm>
#include <limits>

namespace polygmap {

// Of steps first to last - 1, of those that were measured.
struct ToeDetector::Excess {
  double mean_m = 0.0;
  double least_m = std::numeric_limits<double>::infinity();
  double most_m = -std::numeric_limits<double>::infinity();
  int count = 0;
};
ToeDetector::Excess ToeDetector::excess_of(const Line& line, int first, int last) noexcept {
  Excess x;
  for (int i = first; i < last; ++i) {
    const double e = line[static_cast<std::size_t>(i)];
    if (!std::isfinite(e)) continue;
    x.mean_m += e;
    x.least_m = std::min(x.least_m, e);
    x.most_m = std::max(x.most_m, e);
    ++x.count;
  }
  if (x.count > 0) x.mean_m /= x.count;
  return x;
}

// A pixel at the edge may show a mixture.
std::optional<double> ToeDetector::end_of_line(const Line& line) noexcept {
  constexpr int kMixed = 2;  // steps, a pixel
  for (int end = kOnFoot; end + kBeyond <= kSteps; ++end) {
    work_.add(8);
    // What most steps fail, first.
    if (line[static_cast<std::size_t>(end + kMixed)] < params_.least_jump_m) continue;
    work_.add(kOnFoot + kBeyond, 13);
    const Excess on = excess_of(line, end - kOnFoot, end), beyond = excess_of(line, end + kMixed, end + kBeyond);
    if (2 * on.count < kOnFoot || on.least_m < -params_.most_off_m || on.most_m > params_.most_off_m) continue;
    if (2 * beyond.count < kBeyond - kMixed || beyond.least_m < params_.least_jump_m) continue;
    const double half_m = 0.5 * (on.mean_m + beyond.mean_m);
    int last_on = end - 1, first_beyond = end + kMixed;
    for (int i = end; i < first_beyond; ++i) {
      const double e = line[static_cast<std::size_t>(i)];
      if (e >= half_m) first_beyond = i;
      if (e < half_m) last_on = i;
    }
    return 0.5 * (last_on + first_beyond);
  }
  return std::nullopt;
}

void ToeDetector::begin(const ToeDetectorParams& params, const DepthFrameView& frame,
                        const CameraIntrinsics& intrinsics, const RawRange& range, const SoleModel& sole,
                        const Transform& camera_T_sole) noexcept {
  params_ = params;
  frame_ = frame;
  intrinsics_ = intrinsics;
  range_ = range;
  camera_T_sole_ = camera_T_sole;
  first_m_ = {sole.collision.toe_x_m - kStep_m * (kOnFoot + kSearch), 0.0, sole.collision_height_m};
  half_width_m_ = sole.collision.half_width_m;
  next_ = 0;
  ends_m_.clear();
  work_.add(150);
}

void ToeDetector::measure(const Vec3& from_m, int step, Line& line) noexcept {
  constexpr double kNear_m = 0.1;  // a guard of the division: no toe is nearer
  const CameraIntrinsics& k = intrinsics_;
  const Vec3 p = from_m + step * Vec3{kStep_m * camera_T_sole_.R.col(0)};
  if (!(p.z() > kNear_m)) return;
  const double u = p.x() / p.z() * k.fx_px + k.cx_px + 0.5, v = p.y() / p.z() * k.fy_px + k.cy_px + 0.5;
  if (!(u >= 0.0 && v >= 0.0 && u < k.width_px && v < k.height_px)) return;
  const std::uint16_t raw =
      frame_.depth[static_cast<std::size_t>(v) * static_cast<std::size_t>(k.width_px) + static_cast<std::size_t>(u)];
  if (range_.valid(raw)) line[static_cast<std::size_t>(step)] = raw * k.depth_unit_m - p.z();
}

bool ToeDetector::step() noexcept {
  if (next_ == kLines) return true;
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  const double y_m = half_width_m_ * ((2.0 * next_ + 1.0) / kLines - 1.0);
  ++next_;
  const Vec3 from_m = camera_T_sole_ * Vec3{first_m_.x(), y_m, first_m_.z()};
  Line line;
  line.fill(kNothing);
  work_.add(180);
  // On the foot wherever it ends within half of the search; mostly a knee is there.
  constexpr int kProbe = kOnFoot + kSearch / 2;
  measure(from_m, kProbe, line);
  if (line[kProbe] < -params_.most_off_m) return next_ == kLines;
  work_.add(kSteps, 40);
  for (int i = 0; i < kSteps; ++i) measure(from_m, i, line);
  if (const std::optional<double> end = end_of_line(line)) {
    (void)ends_m_.try_push_back(kStep_m * (*end - (kOnFoot + kSearch)));
  }
  return next_ == kLines;
}

std::optional<ToeSighting> ToeDetector::sighting() noexcept {
  const std::int32_t least_lines = params_.min_lines;
  work_.add(900);
  if (static_cast<std::int32_t>(ends_m_.size()) < least_lines) return std::nullopt;
  std::sort(ends_m_.begin(), ends_m_.end());
  const double median_m = ends_m_[ends_m_.size() / 2];
  double sum = 0.0, squares = 0.0;
  int inliers = 0;
  for (const double end_m : ends_m_) {
    if (std::abs(end_m - median_m) > params_.inlier_m) continue;
    sum += end_m;
    squares += end_m * end_m;
    ++inliers;
  }
  if (inliers < least_lines || 3 * inliers < 2 * static_cast<int>(ends_m_.size())) return std::nullopt;
  const double mean_m = sum / inliers;
  const double variance_m2 = std::max(0.0, squares / inliers - mean_m * mean_m);
  return ToeSighting{mean_m, std::max(params_.least_sigma_m, math::sqrt(variance_m2 / inliers)),
                     first_m_ + kStep_m * (kOnFoot + kSearch) * Vec3::UnitX()};
}

}  // namespace polygmap
