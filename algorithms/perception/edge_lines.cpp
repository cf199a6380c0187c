// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/edge_lines.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace polygmap {
namespace {

// Least squares y = a + b x with weights, over points.
struct LineSums {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  void add(double g, double px, double py) noexcept {
    n += g, x += g * px, y += g * py, xx += g * px * px, xy += g * px * py;
  }
  [[nodiscard]] bool try_solve(double& a, double& b) const noexcept {
    const double determinant = n * xx - x * x;
    if (!(n > 0.0) || !(determinant > 1e-12 * n * n)) return false;
    b = (n * xy - x * y) / determinant;
    a = (y - b * x) / n;
    return true;
  }
};

}  // namespace

void EdgeLineFinder::add_guess(std::int32_t column, std::int32_t row) noexcept {
  if (guess_count_ == guess_.size()) return;
  guess_[guess_count_++] = {static_cast<std::int16_t>(column), static_cast<std::int16_t>(row)};
}

bool EdgeLineFinder::try_guess(const Params& params, std::uint32_t seed) noexcept {
  constexpr int kTrials = 32;
  constexpr double kTolerance_px = 2.5;  // half resolution
  const auto n = static_cast<std::uint32_t>(guess_count_);
  if (guess_count_ * 2 < static_cast<std::size_t>(params.min_columns)) return false;
  double best_a = 0.0, best_b = 0.0;
  std::size_t best = 0;
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    const Guess& p = guess_[counter_random(seed, 2 * trial) % n];
    const Guess& q = guess_[counter_random(seed, 2 * trial + 1) % n];
    if (std::abs(p.column - q.column) < 4) continue;
    const double b = static_cast<double>(q.row - p.row) / (q.column - p.column);
    const double a = p.row - b * p.column;
    std::size_t inliers = 0;
    for (std::size_t i = 0; i < guess_count_; ++i) {
      inliers += std::abs(guess_[i].row - (a + b * guess_[i].column)) < kTolerance_px ? 1U : 0U;
    }
    if (inliers > best) {
      best = inliers;
      best_a = a;
      best_b = b;
    }
  }
  if (static_cast<double>(best) < params.min_inlier_share * static_cast<double>(guess_count_)) return false;
  LineSums sums;
  std::int32_t first = kHalfWidth_px, last = -1;
  for (std::size_t i = 0; i < guess_count_; ++i) {
    const Guess& g = guess_[i];
    if (std::abs(g.row - (best_a + best_b * g.column)) >= kTolerance_px) continue;
    sums.add(1.0, g.column, g.row);
    first = std::min<std::int32_t>(first, g.column);
    last = std::max<std::int32_t>(last, g.column);
  }
  if (!sums.try_solve(best_a, best_b)) return false;
  // Half-resolution pixel i lies at full-resolution 2i + 0.5.
  guess_slope_ = best_b;
  guess_row_ = 2.0 * best_a + 0.5 - best_b * 0.5;
  first_column_ = 2 * first;
  last_column_ = 2 * last + 1;
  return true;
}

void EdgeLineFinder::begin(const Params& params, const DepthSigma& noise, const RawPicture& picture,
                           const InversePlane& surface, const Beyond* other, bool surface_above) noexcept {
  params_ = params;
  params_.window_px = std::clamp(params.window_px, 4, kMaxWindow_px);
  params_.column_step_px = std::clamp(params.column_step_px, 1, 16);
  noise_ = noise;
  picture_ = picture;
  surface_ = surface;
  other_known_ = other != nullptr;
  if (other_known_) {
    other_ = other->plane;
    other_covariance_ = other->covariance;
  }
  surface_above_ = surface_above;
  face_tried_ = false;
  restart();
  const CameraIntrinsics& k = picture.intrinsics;
  const auto ray = [&](double column) {
    return Vec3{(column - k.cx_px) / k.fx_px, (guess_row_ + guess_slope_ * column - k.cy_px) / k.fy_px, 1.0};
  };
  const Vec3 a = ray(first_column_), b = ray(last_column_);
  origin_m_ = surface.inverse_depth(a) > 1e-3 ? surface.point(a) : Vec3{a};
  const Vec3 end_m = surface.inverse_depth(b) > 1e-3 ? surface.point(b) : Vec3{b};
  guess_a_m_ = origin_m_;
  guess_b_m_ = end_m;
  const Vec3 n = surface.normal();
  along_ = end_m - origin_m_;
  along_ -= n * n.dot(along_);
  along_ = along_.norm() > 1e-9 ? Vec3{along_.normalized()} : Vec3{n.unitOrthogonal()};
  across_ = n.cross(along_);
}

void EdgeLineFinder::restart() noexcept {
  next_column_ = first_column_;
  count_ = 0;
  segment_count_ = 0;
  segments_.fill(Segment{});
  face_.fill(0);
}

bool EdgeLineFinder::try_face_offset(double& offset_m) const noexcept {
  std::int32_t all = 0;
  for (const std::int32_t n : face_) all += n;
  if (all < 2 * params_.min_columns) return false;
  std::int32_t below = 0;
  std::size_t bin = 0;
  while (2 * (below + face_[bin]) < all) below += face_[bin++];
  offset_m = (static_cast<double>(bin) + 0.5) * kFaceBin_m;
  return true;
}

void EdgeLineFinder::search_column(std::int32_t column) noexcept {
  const CameraIntrinsics& k = picture_.intrinsics;
  const double guess = guess_row_ + guess_slope_ * column;
  const auto centre = static_cast<std::int32_t>(std::floor(guess + 0.5));
  // The picture's end is no edge.
  if (centre < params_.min_side_px + 1 || centre > k.height_px - 2 - params_.min_side_px) return;
  const std::int32_t first = std::max(centre - params_.window_px, 0);
  const std::int32_t last = std::min(centre + params_.window_px, k.height_px - 1);
  const std::int32_t steps = last - first + 1;
  const double x = (column - k.cx_px) / k.fx_px;
  const double truncation = math::square(params_.truncate_sigmas);
  // One sigma for both planes: with each its own, the boundary drifts towards the less noisy one.
  const double scale = other_known_ ? math::sqrt(surface_.m.norm() * other_.m.norm()) : surface_.m.norm();
  const double norm = scale * math::sqrt(x * x + math::square((guess - k.cy_px) / k.fy_px) + 1.0);

  // Walk from the surface's side to the other. Every row gains cost(surface) - cost(other), nothing where there is no
  // data; the change-point is where the running sum is least.
  std::array<float, 2 * kMaxWindow_px + 1> gain{};
  double sum = 0.0, best = 0.0;
  std::int32_t best_step = -1, surface_seen = 0, surface_at_best = 0, other_seen = 0, other_at_best = 0;
  std::int32_t usable_near = 0;
  for (std::int32_t s = 0; s < steps; ++s) {
    const std::int32_t row = surface_above_ ? first + s : last - s;
    const std::uint16_t raw = (*picture_.depth)(column, row);
    if (!picture_.range.valid(raw) || ((*picture_.flags)(column / 2, row / 2) & kPixelBody) != 0) continue;
    // Residual over sigma: (w - w_plane) / (sigma_z w |ray| |m|), times z above and below.
    const double y = (row - k.cy_px) / k.fy_px, z = raw * k.depth_unit_m;
    const double inverse_sigma = 1.0 / (noise_.sigma_m(z) * norm);
    const double w_surface = surface_.m.x() * x + surface_.m.y() * y + surface_.m.z();
    const double w_other = other_.m.x() * x + other_.m.y() * y + other_.m.z();
    const double cost_surface = std::min(math::square((1.0 - z * w_surface) * inverse_sigma), truncation);
    const double cost_other =
        other_known_ ? std::min(math::square((1.0 - z * w_other) * inverse_sigma), truncation) : 0.5 * truncation;
    surface_seen += cost_surface < truncation ? 1 : 0;
    other_seen += cost_other < truncation ? 1 : 0;
    usable_near += std::abs(row - centre) <= params_.max_gap_px / 2 ? 1 : 0;
    gain[static_cast<std::size_t>(s)] = static_cast<float>(cost_surface - cost_other);
    sum += cost_surface - cost_other;
    if (sum < best) {
      best = sum;
      best_step = s;
      surface_at_best = surface_seen;
      other_at_best = other_seen;
    }
  }
  if (best_step < 0 || usable_near == 0) return;
  if (surface_at_best < params_.min_side_px || other_seen - other_at_best < params_.min_side_px) return;

  const std::int32_t width = std::max(params_.segment_px, (last_column_ - first_column_ + kMaxSegments) / kMaxSegments);
  Segment& segment = segments_[static_cast<std::size_t>(std::min((column - first_column_) / width, kMaxSegments - 1))];
  segment_count_ = std::max(segment_count_, std::min((column - first_column_) / width, kMaxSegments - 1) + 1);
  if (other_known_ && surface_above_ && !face_tried_) add_face(column, first, best_step, steps);
  segment.columns += 1.0;
  segment.column_sum += column;
  ++count_;
  for (std::int32_t s = 0; s < steps; ++s) {
    const std::int32_t row = surface_above_ ? first + s : last - s;
    // A pixel's gain is spread over the bins that its square covers: from row - 0.5 to row + 0.5.
    const double offset = surface_above_ ? row - 0.5 - guess : guess - row - 0.5;
    const double place = (offset + kMaxWindow_px) * kBinsPerPixel;
    const auto bin = static_cast<std::int32_t>(std::floor(place));
    const auto part = static_cast<float>(place - bin);
    const float share = gain[static_cast<std::size_t>(s)] / kBinsPerPixel;
    for (std::int32_t b = 0; b <= kBinsPerPixel; ++b) {
      if (bin + b < 0 || bin + b >= 2 * kMaxReach_bins) continue;
      const float weight = b == 0 ? 1.0F - part : (b == kBinsPerPixel ? part : 1.0F);
      segment.gain[static_cast<std::size_t>(bin + b)] += weight * share;
    }
  }
}

void EdgeLineFinder::add_face(std::int32_t column, std::int32_t first, std::int32_t from, std::int32_t steps) noexcept {
  constexpr std::int32_t kPixels = 4;  // a face 30 mm high is 7 pixels high at 0.8 m
  constexpr std::int32_t kBefore_px = 6;
  const CameraIntrinsics& k = picture_.intrinsics;
  std::int32_t taken = 0;
  for (std::int32_t s = std::max(from - kBefore_px, 0); s < steps && taken < kPixels; ++s) {
    const std::int32_t row = first + s;
    const std::uint16_t raw = (*picture_.depth)(column, row);
    if (!picture_.range.valid(raw) || ((*picture_.flags)(column / 2, row / 2) & kPixelBody) != 0) continue;
    const Vec3 ray{(column - k.cx_px) / k.fx_px, (row - k.cy_px) / k.fy_px, 1.0};
    const double z = raw * k.depth_unit_m;
    const double off_surface_m = surface_.distance_m(z * ray);
    // Off the tread by more than its noise, along the tread's normal, and downwards.
    if (off_surface_m > -params_.truncate_sigmas * noise_.sigma_m(z)) continue;
    ++taken;
    const double bin = math::clamp(other_.distance_m(z * ray) / kFaceBin_m, 0.0, kFaceBins - 1.0);
    ++face_[static_cast<std::size_t>(bin)];
  }
}

bool EdgeLineFinder::try_segment_point(const Segment& segment, Vec2& point_m) const noexcept {
  double sum = 0.0, best = 0.0;
  std::int32_t at = -1;
  for (std::int32_t b = 0; b < 2 * kMaxReach_bins; ++b) {
    sum += static_cast<double>(segment.gain[static_cast<std::size_t>(b)]);
    if (sum < best) {
      best = sum;
      at = b;
    }
  }
  if (at < 1 || at + 2 >= 2 * kMaxReach_bins) return false;
  // The running sum's least value lies where the gain crosses zero: between the bins on both sides of the minimum.
  const auto g0 = static_cast<double>(segment.gain[static_cast<std::size_t>(at)]);
  const auto g1 = static_cast<double>(segment.gain[static_cast<std::size_t>(at + 1)]);
  const double fraction = g1 - g0 > 1e-9 ? math::clamp(-g0 / (g1 - g0), 0.0, 1.0) : 0.5;
  const double offset = (at + 0.5 + fraction) / kBinsPerPixel - kMaxWindow_px;
  const CameraIntrinsics& k = picture_.intrinsics;
  const double column = segment.column_sum / segment.columns;
  const double guess = guess_row_ + guess_slope_ * column;
  const double row = surface_above_ ? guess + offset : guess - offset;
  const Vec3 ray{(column - k.cx_px) / k.fx_px, (row - k.cy_px) / k.fy_px, 1.0};
  if (!(surface_.inverse_depth(ray) > 1e-3)) return false;
  const Vec3 from_origin = surface_.point(ray) - origin_m_;
  point_m = {from_origin.dot(along_), from_origin.dot(across_)};
  return true;
}

bool EdgeLineFinder::step(std::int32_t max_columns) noexcept {
  const std::int32_t last = std::min(last_column_, picture_.intrinsics.width_px - 1);
  for (std::int32_t i = 0; i < max_columns && next_column_ <= last; ++i) {
    search_column(next_column_);
    next_column_ += params_.column_step_px;
  }
  return next_column_ > last;
}

// How far across the surface one row of the picture reaches there.
double EdgeLineFinder::pixel_m(double along_m, double across_m) const noexcept {
  const Vec3 p = origin_m_ + along_m * along_ + across_m * across_;
  const double w = 1.0 / p.z(), dw = surface_.m.y() / picture_.intrinsics.fy_px;  // inverse depth, and of the next row
  const Vec3 next = (p * w + Vec3::UnitY() / picture_.intrinsics.fy_px) / (w + dw);
  return std::abs((next - p).dot(across_));
}

EdgeLineFinder::Outcome EdgeLineFinder::finish(EdgeLine& line) noexcept {
  constexpr int kRounds = 8;
  constexpr double kTukey = 4.685;
  constexpr double kLeastScale_m = 0.0008;
  line = {};
  if (count_ < params_.min_columns) return Outcome::kFewColumns;
  std::size_t n = 0;
  for (std::int32_t i = 0; i < segment_count_; ++i) {
    const Segment& segment = segments_[static_cast<std::size_t>(i)];
    if (segment.columns < 3.0 || !try_segment_point(segment, points_m_[n])) continue;
    weights_[n++] = segment.columns;
  }
  if (n < 3) return Outcome::kFewColumns;
  const auto middle = scratch_.begin() + static_cast<std::ptrdiff_t>(n / 2);
  const auto end = scratch_.begin() + static_cast<std::ptrdiff_t>(n);
  // Start at the median, along the guess: the guess defines the axis.
  for (std::size_t i = 0; i < n; ++i) scratch_[i] = points_m_[i].y();
  std::nth_element(scratch_.begin(), middle, end);
  double a = *middle, b = 0.0, limit = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < n; ++i) scratch_[i] = std::abs(points_m_[i].y() - (a + b * points_m_[i].x()));
    std::nth_element(scratch_.begin(), middle, end);
    limit = kTukey * std::max(1.4826 * *middle, kLeastScale_m);
    LineSums sums;
    for (std::size_t i = 0; i < n; ++i) {
      const double r = (points_m_[i].y() - (a + b * points_m_[i].x())) / limit;
      if (std::abs(r) < 1.0) sums.add(weights_[i] * math::square(1.0 - r * r), points_m_[i].x(), points_m_[i].y());
    }
    if (!sums.try_solve(a, b)) return Outcome::kNoLine;
  }
  double squares = 0.0, lo = 1e9, hi = -1e9, columns = 0.0, segments = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double r = points_m_[i].y() - (a + b * points_m_[i].x());
    if (std::abs(r) >= limit) continue;
    squares += weights_[i] * r * r;
    columns += weights_[i];
    segments += 1.0;
    lo = std::min(lo, points_m_[i].x());
    hi = std::max(hi, points_m_[i].x());
  }
  if (columns < params_.min_columns || segments < 3.0) return Outcome::kFewColumns;
  const double rms = math::sqrt(squares / columns);
  if (rms > params_.max_rms_m || columns < params_.min_inlier_share * count_) return Outcome::kNotStraight;
  // The outer segments' points are their middles: the line goes on for half a segment.
  const double half_segment_m = 0.5 * (hi - lo) / (segments - 1.0);
  lo -= half_segment_m;
  hi += half_segment_m;
  if (hi - lo < params_.min_length_m) return Outcome::kShort;
  // Sigmas are those at the line's ends: twice the one in the middle.
  line.sigma_m = 2.0 * math::sqrt((rms * rms + math::square(params_.slow_error_m)) / segments);
  double t_lo = a + b * lo, t_hi = a + b * hi;
  if (other_known_) {
    // On the surface's plane: m_other . (origin + s along + t across) = 1.
    const double slope = other_.m.dot(across_);
    const double meet_lo = (1.0 - other_.m.dot(origin_m_ + lo * along_)) / slope;
    const double meet_hi = (1.0 - other_.m.dot(origin_m_ + hi * along_)) / slope;
    const double apart = 0.5 * (meet_lo + meet_hi - t_lo - t_hi);
    const double limit_m =
        std::max(math::clamp(1.5 * line.sigma_m, params_.agree_m, params_.agree_max_m),
                 params_.agree_px * pixel_m(0.5 * (lo + hi), 0.25 * (t_lo + t_hi + meet_lo + meet_hi)));
    const bool agree = std::abs(apart) < limit_m;
    double face_m = 0.0;
    if (!agree && surface_above_ && !face_tried_ && try_face_offset(face_m) && face_m > params_.face_m &&
        face_m < params_.face_max_m) {
      // The face is taken as parallel to the riser: n . p + d - face = 0.
      other_.m *= other_.d_m() / (other_.d_m() - face_m);
      face_tried_ = true;
      line = {};
      restart();
      return Outcome::kAgain;
    }
    if (agree) {
      t_lo = meet_lo;
      t_hi = meet_hi;
      const auto sigma = [&](double s, double t) {
        const Vec3 p = origin_m_ + s * along_ + t * across_;
        return plane_sigma_m(other_, other_covariance_, p / p.z());
      };
      line.sigma_m = std::max(sigma(lo, t_lo), sigma(hi, t_hi));
    }
  }
  line.a_m = origin_m_ + lo * along_ + t_lo * across_;
  line.b_m = origin_m_ + hi * along_ + t_hi * across_;
  line.valid = true;
  return Outcome::kFound;
}

}  // namespace polygmap
