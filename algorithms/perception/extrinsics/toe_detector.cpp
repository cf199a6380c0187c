// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/extrinsics/toe_detector.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {
namespace {

// What lines are sampled at is compiled in: their arrays have these sizes.
constexpr int kLines = 16;         // across the foot, 6 mm apart: three pixels at 0.7 m
constexpr double kStep_m = 0.001;  // along a line; a pixel is 1.9 mm there
constexpr int kOnFoot = 12;        // steps on the foot before its end: a shank hides what lies farther back
constexpr int kBeyond = 6;         // steps past its end: what lies there a riser may hide after a centimetre
constexpr int kSearch = 14;        // the toe is looked for this far to both sides of where it is believed
constexpr int kSteps = kOnFoot + 2 * kSearch + kBeyond;

// What is measured behind the upper face, m; not a number where nothing is.
using Line = std::array<double, kSteps>;

// Of steps first to last - 1, of those that were measured.
struct Excess {
  double mean_m = 0.0;
  double least_m = std::numeric_limits<double>::infinity();
  double most_m = -std::numeric_limits<double>::infinity();
  int count = 0;
};
Excess excess_of(const Line& line, int first, int last) noexcept {
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

// Where a line leaves the foot, in steps; nothing when that is not seen. A pixel at the edge may show a mixture.
std::optional<double> end_of_line(const ToeDetectorParams& params, const Line& line) noexcept {
  constexpr int kMixed = 2;  // steps, a pixel
  for (int end = kOnFoot; end + kBeyond <= kSteps; ++end) {
    // What most steps fail, first.
    if (line[static_cast<std::size_t>(end + kMixed)] < params.least_jump_m) continue;
    const Excess on = excess_of(line, end - kOnFoot, end), beyond = excess_of(line, end + kMixed, end + kBeyond);
    if (2 * on.count < kOnFoot || on.least_m < -params.most_off_m || on.most_m > params.most_off_m) continue;
    if (2 * beyond.count < kBeyond - kMixed || beyond.least_m < params.least_jump_m) continue;
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

}  // namespace

std::optional<ToeSighting> detect_toe(const ToeDetectorParams& params, const DepthFrameView& frame,
                                      const CameraIntrinsics& k, const RawRange& range, const SoleModel& sole,
                                      const Transform& camera_T_sole) noexcept {
  constexpr double kNear_m = 0.1;  // a guard of the division: no toe is nearer
  const double first_m = sole.collision.toe_x_m - kStep_m * (kOnFoot + kSearch);
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  StaticVector<double, kLines> ends_m;
  for (int n = 0; n < kLines; ++n) {
    const double y_m = sole.collision.half_width_m * ((2.0 * n + 1.0) / kLines - 1.0);
    const Vec3 from = camera_T_sole * Vec3{first_m, y_m, sole.collision_height_m};
    const Vec3 step = kStep_m * camera_T_sole.R.col(0);
    Line line;
    line.fill(kNothing);
    const auto measure = [&](int i) {
      const Vec3 p = from + i * step;
      if (!(p.z() > kNear_m)) return;
      const double u = p.x() / p.z() * k.fx_px + k.cx_px + 0.5, v = p.y() / p.z() * k.fy_px + k.cy_px + 0.5;
      if (!(u >= 0.0 && v >= 0.0 && u < k.width_px && v < k.height_px)) return;
      const std::uint16_t raw =
          frame.depth[static_cast<std::size_t>(v) * static_cast<std::size_t>(k.width_px) + static_cast<std::size_t>(u)];
      if (range.valid(raw)) line[static_cast<std::size_t>(i)] = raw * k.depth_unit_m - p.z();
    };
    // On the foot wherever it ends within half of the search; mostly a knee is there.
    constexpr int kProbe = kOnFoot + kSearch / 2;
    measure(kProbe);
    if (line[kProbe] < -params.most_off_m) continue;
    for (int i = 0; i < kSteps; ++i) measure(i);
    if (const std::optional<double> end = end_of_line(params, line)) {
      (void)ends_m.try_push_back(kStep_m * (*end - (kOnFoot + kSearch)));
    }
  }
  const std::int32_t least_lines = params.min_lines;
  if (static_cast<std::int32_t>(ends_m.size()) < least_lines) return std::nullopt;
  std::sort(ends_m.begin(), ends_m.end());
  const double median_m = ends_m[ends_m.size() / 2];
  double sum = 0.0, squares = 0.0;
  int inliers = 0;
  for (const double end_m : ends_m) {
    if (std::abs(end_m - median_m) > params.inlier_m) continue;
    sum += end_m;
    squares += end_m * end_m;
    ++inliers;
  }
  if (inliers < least_lines || 3 * inliers < 2 * static_cast<int>(ends_m.size())) return std::nullopt;
  const double mean_m = sum / inliers;
  const double variance_m2 = std::max(0.0, squares / inliers - mean_m * mean_m);
  return ToeSighting{mean_m, std::max(params.least_sigma_m, math::sqrt(variance_m2 / inliers))};
}

}  // namespace polygmap
