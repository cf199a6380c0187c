// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/edge_lines.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "algorithms/perception/image/simd.hpp"
#include "algorithms/perception/polygons/counter_random.hpp"

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
  constexpr float kTolerance_px = 5.0F;
  constexpr double kEnough = 0.9;
  const auto n = static_cast<std::uint32_t>(guess_count_);
  if (guess_count_ < static_cast<std::size_t>(params.min_columns)) return false;
  float best_a = 0.0F, best_b = 0.0F;
  std::int32_t best = 0;
  const auto fits = [](const Guess& guess, float a, float b) {
    return std::abs(static_cast<float>(guess.row) - (a + b * static_cast<float>(guess.column))) < kTolerance_px;
  };
  for (std::uint32_t trial = 0; trial < kTrials && best < kEnough * n; ++trial) {
    const Guess& p = guess_[counter_random(seed, 2 * trial) % n];
    const Guess& q = guess_[counter_random(seed, 2 * trial + 1) % n];
    if (std::abs(p.column - q.column) < 2) continue;
    const float b = static_cast<float>(q.row - p.row) / static_cast<float>(q.column - p.column);
    const float a = static_cast<float>(p.row) - b * static_cast<float>(p.column);
    std::int32_t inliers = 0;
    for (std::size_t i = 0; i < guess_count_; ++i) inliers += fits(guess_[i], a, b) ? 1 : 0;
    if (inliers > best) {
      best = inliers;
      best_a = a;
      best_b = b;
    }
  }
  if (best < params.min_inlier_share * n) return false;
  LineSums sums;
  first_column_ = kColumns;
  last_column_ = -1;
  for (std::size_t i = 0; i < guess_count_; ++i) {
    const Guess& g = guess_[i];
    if (!fits(g, best_a, best_b)) continue;
    sums.add(1.0, middle_px(g.column), g.row);
    first_column_ = std::min<std::int32_t>(first_column_, g.column);
    last_column_ = std::max<std::int32_t>(last_column_, g.column);
  }
  return sums.try_solve(guess_row_, guess_slope_);
}

void EdgeLineFinder::begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics,
                           const ColumnRays& rays, const ColumnImage& image, const Measured& own, const Measured* other,
                           bool surface_above) noexcept {
  params_ = params;
  params_.window_px = std::clamp(params.window_px, 4, kMaxWindow_px);
  noise_ = noise;
  intrinsics_ = intrinsics;
  rays_ = &rays;
  image_ = &image;
  const InversePlane& surface = own.plane;
  surface_ = surface;
  other_known_ = other != nullptr;
  if (other_known_) {
    other_ = other->plane;
    other_covariance_ = other->covariance;
    both_covariance_ = own.covariance + other->covariance;
  }
  surface_above_ = surface_above;
  face_tried_ = false;
  restart();
  const auto ray = [&](std::int32_t column) {
    const double x_px = middle_px(column);
    return Vec3{(x_px - intrinsics.cx_px) / intrinsics.fx_px, (guess_at(x_px) - intrinsics.cy_px) / intrinsics.fy_px,
                1.0};
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
  next_column_ = first_column_ / kLanes * kLanes;
  count_ = 0;
  segment_count_ = 0;
  segments_.fill(Segment{});
  face_.fill(0);
}

bool EdgeLineFinder::try_face_offset(double& offset_m) const noexcept {
  std::int32_t all = 0;
  for (const std::int32_t n : face_) all += n;
  if (all < 4 * params_.min_columns) return false;
  std::int32_t below = 0;
  std::size_t bin = 0;
  while (2 * (below + face_[bin]) < all) below += face_[bin++];
  offset_m = (static_cast<double>(bin) + 0.5) * kFaceBin_m;
  return true;
}

void EdgeLineFinder::search_columns(std::int32_t first_column) noexcept {
  using Wide = cv::v_float32;
  static_assert(kLanes % Wide::nlanes == 0 && kColumns % kLanes == 0);
  // Per lane: both planes' lines w = a + b y, the scale of the noise, and the rows of the window.
  Lanes surface_a{}, other_a{}, inverse_norm{}, centre{}, reach{};
  std::array<std::int32_t, kLanes> centre_row{};
  std::int32_t first_row = intrinsics_.height_px, last_row = -1;
  // One sigma for both planes: with each its own, the boundary drifts towards the less noisy one.
  const double scale = other_known_ ? math::sqrt(surface_.m.norm() * other_.m.norm()) : surface_.m.norm();
  for (std::size_t k = 0; k < kLanes; ++k) {
    const std::int32_t g = first_column + static_cast<std::int32_t>(k);
    const double guess = guess_at(middle_px(g)), x = (middle_px(g) - intrinsics_.cx_px) / intrinsics_.fx_px;
    const auto row = static_cast<std::int32_t>(std::floor(guess + 0.5));
    centre_row[k] = row;
    centre[k] = static_cast<float>(row);
    surface_a[k] = static_cast<float>(surface_.m.x() * x + surface_.m.z());
    other_a[k] = static_cast<float>(other_.m.x() * x + other_.m.z());
    const double y = (guess - intrinsics_.cy_px) / intrinsics_.fy_px;
    inverse_norm[k] = static_cast<float>(1.0 / (scale * math::sqrt(x * x + y * y + 1.0)));
    // The image's end is no edge.
    const bool searched = g >= first_column_ && g <= last_column_ && g < rays_->columns && row > params_.min_side_px &&
                          row < intrinsics_.height_px - 1 - params_.min_side_px;
    reach[k] = searched ? static_cast<float>(params_.window_px) + 0.5F : -1.0F;
    if (!searched) continue;
    first_row = std::min(first_row, row - params_.window_px);
    last_row = std::max(last_row, row + params_.window_px);
  }
  if (last_row < 0) return;
  first_row = std::max(first_row, 0);
  last_row = std::min(last_row, intrinsics_.height_px - 1);

  // Walk from the surface's side to the other. Every row gains cost(surface) - cost(other), nothing where there is no
  // data; the change-point is where the running sum is least.
  Lanes best_row{}, surface_side{}, other_side{}, near_rows{};
  const auto all = [](double x) { return cv::vx_setall_f32(static_cast<float>(x)); };
  const Wide zero = all(0.0), one = all(1.0), truncation = all(math::square(params_.truncate_sigmas));
  const Wide base = all(noise_.base_m), per_metre = all(noise_.per_metre), quadratic = all(noise_.quadratic_per_m);
  const Wide half_gap = all(0.5 * (params_.max_gap_px + 1));
  const Wide surface_b = all(surface_.m.y()), other_b = all(other_.m.y());
  for (std::int32_t k0 = 0; k0 < kLanes; k0 += Wide::nlanes) {
    const auto load = [k0](const Lanes& x) { return cv::vx_load(x.data() + k0); };
    const Wide a_surface = load(surface_a), a_other = load(other_a), norm = load(inverse_norm);
    const Wide middle = load(centre), window = load(reach);
    Wide sum = zero, best = zero, at = all(-1.0), near = zero;
    Wide surface_seen = zero, surface_at_best = zero, other_seen = zero, other_at_best = zero;
    const std::int32_t steps = last_row - first_row + 1;
    for (std::int32_t s = 0; s < steps; ++s) {
      const std::int32_t r = surface_above_ ? first_row + s : last_row - s;
      const Wide w = cv::vx_load(image_->inverse_depth.row(r) + first_column + k0);
      const Wide off = cv::v_abs(all(r) - middle);
      const Wide used = (w > zero) & (off < window);
      const Wide y = cv::vx_setall_f32(rays_->y[static_cast<std::size_t>(r)]);
      // Residual over sigma, both times w: (w - w_plane) w / ((base w^2 + per_metre w + quadratic) |ray| |m|).
      const Wide unit = w * norm / ((base * w + per_metre) * w + quadratic);
      const Wide d_surface = (w - (a_surface + surface_b * y)) * unit;
      const Wide d_other = (w - (a_other + other_b * y)) * unit;
      const Wide cost_surface = cv::v_min(d_surface * d_surface, truncation);
      const Wide cost_other = other_known_ ? cv::v_min(d_other * d_other, truncation) : all(0.5) * truncation;
      const Wide gain = cv::v_select(used, cost_surface - cost_other, zero);
      cv::v_store(gains_[static_cast<std::size_t>(r)].data() + k0, gain);
      surface_seen = surface_seen + cv::v_select(used & (cost_surface < truncation), one, zero);
      other_seen = other_seen + cv::v_select(used & (cost_other < truncation), one, zero);
      near = near + cv::v_select(used & (off < half_gap), one, zero);
      sum = sum + gain;
      const Wide better = sum < best;
      best = cv::v_min(sum, best);
      at = cv::v_select(better, all(r), at);
      surface_at_best = cv::v_select(better, surface_seen, surface_at_best);
      other_at_best = cv::v_select(better, other_seen, other_at_best);
    }
    cv::v_store(best_row.data() + k0, at);
    cv::v_store(surface_side.data() + k0, surface_at_best);
    cv::v_store(other_side.data() + k0, other_seen - other_at_best);
    cv::v_store(near_rows.data() + k0, near);
  }
  const auto least = static_cast<float>(params_.min_side_px);
  for (std::size_t k = 0; k < kLanes; ++k) {
    if (reach[k] < 0.0F || best_row[k] < 0.0F || near_rows[k] < 0.5F) continue;
    if (surface_side[k] < least || other_side[k] < least) continue;
    const std::int32_t g = first_column + static_cast<std::int32_t>(k);
    if (other_known_ && surface_above_ && !face_tried_) add_face(g, static_cast<std::int32_t>(best_row[k]), last_row);
    take_column(g, centre_row[k], first_row, last_row, k);
  }
}

void EdgeLineFinder::take_column(std::int32_t column, std::int32_t centre, std::int32_t first_row,
                                 std::int32_t last_row, std::size_t lane) noexcept {
  const std::int32_t all = last_column_ - first_column_ + 1;
  const std::int32_t width = std::max(params_.segment_px / kColumn_px, (all + kMaxSegments - 1) / kMaxSegments);
  const std::int32_t index = (column - first_column_) / width;
  segment_count_ = std::max(segment_count_, index + 1);
  Segment& segment = segments_[static_cast<std::size_t>(index)];
  segment.columns += 1.0;
  segment.column_sum += middle_px(column);
  segment.rounded_sum += guess_at(middle_px(column)) - centre;
  ++count_;
  const std::int32_t first = std::max(first_row, centre - params_.window_px);
  const std::int32_t last = std::min(last_row, centre + params_.window_px);
  for (std::int32_t r = first; r <= last; ++r) {
    const std::int32_t outwards = surface_above_ ? r - centre : centre - r;
    segment.gain[static_cast<std::size_t>(outwards + kMaxWindow_px)] += gains_[static_cast<std::size_t>(r)][lane];
  }
}

void EdgeLineFinder::add_face(std::int32_t column, std::int32_t from_row, std::int32_t last_row) noexcept {
  constexpr std::int32_t kRows = 4;  // a face 30 mm high is 7 pixels high at 0.8 m
  constexpr std::int32_t kBefore_px = 6;
  const auto x = static_cast<double>(rays_->x[static_cast<std::size_t>(column)]);
  const double surface_a = surface_.m.x() * x + surface_.m.z(), other_a = other_.m.x() * x + other_.m.z();
  const double surface_d_m = surface_.d_m(), other_d_m = other_.d_m();
  std::int32_t taken = 0;
  for (std::int32_t r = std::max(from_row - kBefore_px, 0); r <= last_row && taken < kRows; ++r) {
    const auto w = static_cast<double>(image_->inverse_depth(column, r));
    if (!(w > 0.0)) continue;
    const auto y = static_cast<double>(rays_->y[static_cast<std::size_t>(r)]);
    const double z = 1.0 / w;
    // Off the tread by more than its noise, along the tread's normal, and downwards.
    const double off_surface_m = (1.0 - (surface_a + surface_.m.y() * y) * z) * surface_d_m;
    if (off_surface_m > -params_.truncate_sigmas * noise_.sigma_m(z)) continue;
    ++taken;
    const double off_other_m = (1.0 - (other_a + other_.m.y() * y) * z) * other_d_m;
    ++face_[static_cast<std::size_t>(math::clamp(off_other_m / kFaceBin_m, 0.0, kFaceBins - 1.0))];
  }
}

bool EdgeLineFinder::try_segment_point(const Segment& segment, Vec2& point_m) const noexcept {
  double sum = 0.0, best = 0.0;
  std::int32_t at = -1;
  for (std::int32_t i = 0; i < kOffsets; ++i) {
    sum += static_cast<double>(segment.gain[static_cast<std::size_t>(i)]);
    if (sum < best) {
      best = sum;
      at = i;
    }
  }
  // At the window's ends nothing was compared.
  if (at <= kMaxWindow_px - params_.window_px || at + 2 > kMaxWindow_px + params_.window_px) return false;
  // The running sum's least value lies where the gain crosses zero: between the rows on both sides of the minimum.
  const auto g0 = static_cast<double>(segment.gain[static_cast<std::size_t>(at)]);
  const auto g1 = static_cast<double>(segment.gain[static_cast<std::size_t>(at + 1)]);
  const double fraction = g1 - g0 > 1e-9 ? math::clamp(-g0 / (g1 - g0), 0.0, 1.0) : 0.5;
  const double outwards = at + fraction - kMaxWindow_px;
  const double column = segment.column_sum / segment.columns;
  const double centre = guess_at(column) - segment.rounded_sum / segment.columns;
  const double row = surface_above_ ? centre + outwards : centre - outwards;
  const Vec3 ray{(column - intrinsics_.cx_px) / intrinsics_.fx_px, (row - intrinsics_.cy_px) / intrinsics_.fy_px, 1.0};
  if (!(surface_.inverse_depth(ray) > 1e-3)) return false;
  const Vec3 from_origin = surface_.point(ray) - origin_m_;
  point_m = {from_origin.dot(along_), from_origin.dot(across_)};
  return true;
}

bool EdgeLineFinder::step(std::int32_t max_columns) noexcept {
  const std::int32_t last = std::min(last_column_, rays_->columns - 1);
  for (std::int32_t i = 0; i < max_columns && next_column_ <= last; i += kLanes) {
    search_columns(next_column_);
    next_column_ += kLanes;
  }
  return next_column_ > last;
}

double EdgeLineFinder::below_m(double along_m, double across_m, double rows) const noexcept {
  const Vec3 p = origin_m_ + along_m * along_ + across_m * across_;
  const double down = rows / intrinsics_.fy_px, w = 1.0 / p.z(), dw = surface_.m.y() * down;
  return ((p * w + Vec3::UnitY() * down) / (w + dw) - origin_m_).dot(across_);
}

// How far across the surface one row of the image reaches there.
double EdgeLineFinder::pixel_m(double along_m, double across_m) const noexcept {
  return std::abs(below_m(along_m, across_m, 1.0) - across_m);
}

bool EdgeLineFinder::try_local_shift(Shift& shift) const noexcept {
  using Wide = cv::v_float32;
  constexpr double kFrom_px = 0.5, kTo_px = 4.5;  // of the rows that are asked, from where the planes meet
  constexpr double kLeastRows = 1.5, kMost_px = 3.0;
  static constexpr Lanes kSteps{0, 1, 2, 3, 4, 5, 6, 7};
  const Vec3 apart = surface_.m - other_.m;
  if (!(std::abs(apart.y()) > 1e-6)) return false;
  const InversePlane &upper = surface_, &lower = other_;
  const auto all = [](double x) { return cv::vx_setall_f32(static_cast<float>(x)); };
  const Wide zero = all(0.0), one = all(1.0), from_px = all(kFrom_px), to_px = all(kTo_px), least = all(kLeastRows);
  const Wide upper_b = all(upper.m.y()), lower_b = all(lower.m.y());
  const Wide px = all(intrinsics_.fy_px / (upper.m.y() - lower.m.y())), most_px = all(kMost_px);
  const double dx = kColumn_px / intrinsics_.fx_px, meet_slope = -intrinsics_.fy_px * apart.x() / apart.y() * dx;
  const double limit = math::sqrt(upper.m.norm() * lower.m.norm()) * params_.truncate_sigmas;
  // Of columns: their number, their place x in columns from the first, the shift, and products; each lane's for itself.
  enum Sum : std::size_t { kN, kX, kXx, kY, kXy, kYy, kSums };
  std::array<Lanes, kSums> sums{};
  const std::int32_t start = first_column_ / kLanes * kLanes;
  for (std::int32_t first = start; first <= last_column_; first += kLanes) {
    const double x = (middle_px(first) - intrinsics_.cx_px) / intrinsics_.fx_px,
                 y = -(apart.x() * x + apart.z()) / apart.y();
    const double row = intrinsics_.cy_px + intrinsics_.fy_px * y, last_row = row + (kLanes - 1) * meet_slope;
    const auto from = static_cast<std::int32_t>(std::ceil(std::min(row, last_row) - kTo_px));
    const auto until = static_cast<std::int32_t>(std::floor(std::max(row, last_row) + kTo_px));
    const double w0 = surface_.inverse_depth({x, y, 1.0});
    if (from < 0 || until >= intrinsics_.height_px || !(w0 > 0.0)) continue;
    const Wide most = all(limit * noise_.inverse_sigma(w0) / w0);
    for (std::int32_t k = 0; k < kLanes; k += Wide::nlanes) {
      const Wide step = cv::vx_load(kSteps.data() + k), meet = all(row) + all(meet_slope) * step;
      const Wide upper_a = all(upper.m.x() * x + upper.m.z()) + all(upper.m.x() * dx) * step;
      const Wide lower_a = all(lower.m.x() * x + lower.m.z()) + all(lower.m.x() * dx) * step;
      Wide sum_upper = zero, sum_lower = zero, n_upper = zero, n_lower = zero;
      for (std::int32_t r = from; r <= until; ++r) {
        const Wide w = cv::vx_load(image_->inverse_depth.row(r) + first + k), down = all(r) - meet;
        const Wide ray = cv::vx_setall_f32(rays_->y[static_cast<std::size_t>(r)]), away = cv::v_abs(down);
        const Wide above = down < zero;
        const Wide off = w - cv::v_select(above, upper_a + upper_b * ray, lower_a + lower_b * ray);
        const Wide used = (w > zero) & (away > from_px) & (away < to_px) & (cv::v_abs(off) < most);
        const Wide in_upper = used & above, in_lower = used & ~above;
        sum_upper = sum_upper + (off & in_upper), n_upper = n_upper + (one & in_upper);
        sum_lower = sum_lower + (off & in_lower), n_lower = n_lower + (one & in_lower);
      }
      const Wide column = all(first) + step, at = column - all(start);
      const Wide enough =
          (n_upper > least) & (n_lower > least) & (column >= all(first_column_)) & (column <= all(last_column_));
      const Wide rows = (sum_lower / cv::v_max(n_lower, one) - sum_upper / cv::v_max(n_upper, one)) * px;
      const Wide in = enough & (cv::v_abs(rows) < most_px), moved = rows & in, place = at & in;
      const auto add = [&](Sum sum, const Wide& value) {
        cv::v_store(sums[sum].data() + k, cv::vx_load(sums[sum].data() + k) + value);
      };
      add(kN, one & in), add(kX, place), add(kXx, place * at), add(kY, moved), add(kXy, moved * at),
          add(kYy, moved * rows);
    }
  }
  const auto total = [&sums](Sum sum) {
    double all_lanes = 0.0;
    for (const float lane : sums[sum]) all_lanes += static_cast<double>(lane);
    return all_lanes;
  };
  const LineSums line{total(kN), total(kX), total(kY), total(kXx), total(kXy)};
  if (line.n < params_.min_columns || !line.try_solve(shift.at_px, shift.per_column)) return false;
  shift.start_px = middle_px(start);
  const double left = total(kYy) - shift.at_px * line.y - shift.per_column * line.xy;
  shift.sigma_px = 2.0 * math::sqrt(std::max(left, 0.0)) / line.n;
  return true;
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
    if (segment.columns < 1.0 || !try_segment_point(segment, points_m_[n])) continue;
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
    const double middle_s = 0.5 * (lo + hi), middle_t = 0.25 * (t_lo + t_hi + meet_lo + meet_hi);
    const Vec3 centre = origin_m_ + middle_s * along_ + middle_t * across_;
    const double met_sigma_m = plane_sigma_m(other_, both_covariance_, centre / centre.z());
    const double apart_m = 1.5 * math::sqrt(math::square(line.sigma_m) + math::square(met_sigma_m));
    const double limit_m = std::max(math::clamp(apart_m, params_.agree_m, params_.agree_max_m),
                                    params_.agree_px * pixel_m(middle_s, middle_t));
    const bool agree = std::abs(apart) < limit_m;
    double face_m = 0.0;
    if (!agree && surface_above_ && !face_tried_ && try_face_offset(face_m) && face_m > params_.face_m &&
        face_m < params_.face_max_m && other_.d_m() > 2.0 * face_m) {
      // The face is taken as parallel to the riser: n . p + d - face = 0.
      other_.m *= other_.d_m() / (other_.d_m() - face_m);
      face_tried_ = true;
      line = {};
      restart();
      return Outcome::kAgain;
    }
    if (agree) {
      // All three by their information. Change-points are also skewed towards the less noisy plane, which their scatter
      // hides. Errors of the three are correlated by .28 (meeting, change-points), .49 (meeting, local) and .17
      // (generated stairs, the robot's camera, correlated noise).
      constexpr double kSeenLess = 2.0, kShared = 0.3;
      const double seen = 1.0 / (kSeenLess * math::square(line.sigma_m));
      Shift shift;
      const bool any_local = surface_above_ && try_local_shift(shift);
      const auto join = [&](double s, double meet, double& t) {
        const Vec3 p = origin_m_ + s * along_ + meet * across_;
        const double met = 1.0 / math::square(plane_sigma_m(other_, other_covariance_, p / p.z()));
        double local = 0.0, local_m = 0.0;
        if (any_local) {
          const double column_px = p.x() / p.z() * intrinsics_.fx_px + intrinsics_.cx_px;
          local_m = below_m(s, meet, shift.at(column_px));
          local = 1.0 / (math::square(shift.sigma_px * pixel_m(s, meet)) + math::square(params_.least_local_m));
        }
        const double all = met + seen + local;
        t = (met * meet + seen * t + local * local_m) / all;
        const double roots = math::sqrt(met) + math::sqrt(seen) + math::sqrt(local);
        return math::sqrt((1.0 - kShared) * all + kShared * roots * roots) / all;
      };
      line.sigma_m = std::max(join(lo, meet_lo, t_lo), join(hi, meet_hi, t_hi));
    }
  }
  line.a_m = origin_m_ + lo * along_ + t_lo * across_;
  line.b_m = origin_m_ + hi * along_ + t_hi * across_;
  line.valid = true;
  return Outcome::kFound;
}

}  // namespace polygmap
