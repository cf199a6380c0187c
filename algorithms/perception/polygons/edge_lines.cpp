// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/edge_lines.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "algorithms/perception/image/change_point.hpp"
#include "algorithms/perception/polygons/counter_random.hpp"
#include "algorithms/perception/polygons/line_sums.hpp"

namespace polygmap {
namespace {

using simd::all, simd::Wide;

}  // namespace

void EdgeLineFinder::add_guess(std::int32_t column, std::int32_t row) noexcept {
  static_cast<void>(guesses_.try_push_back({static_cast<std::int16_t>(column), static_cast<std::int16_t>(row)}));
}

bool EdgeLineFinder::try_guess(const Params& params, std::uint32_t seed) noexcept {
  const auto tolerance_px = static_cast<float>(params.guess.tolerance_px);
  const auto trials = static_cast<std::uint32_t>(params.guess.trials);
  const auto n = static_cast<std::uint32_t>(guesses_.size());
  if (guesses_.size() < static_cast<std::size_t>(params.min_columns)) return false;
  work_.add(150 + 24 * static_cast<std::int32_t>(n));
  float best_a = 0.0F, best_b = 0.0F;
  std::int32_t best = 0;
  const auto fits = [tolerance_px](const Guess& guess, float a, float b) {
    return std::abs(static_cast<float>(guess.row) - (a + b * static_cast<float>(guess.column))) < tolerance_px;
  };
  for (std::uint32_t trial = 0; trial < trials && best < params.guess.enough * n; ++trial) {
    const Guess& p = guesses_[counter_random(seed, 2 * trial) % n];
    const Guess& q = guesses_[counter_random(seed, 2 * trial + 1) % n];
    if (std::abs(p.column - q.column) < 2) continue;
    const float b = static_cast<float>(q.row - p.row) / static_cast<float>(q.column - p.column);
    const float a = static_cast<float>(p.row) - b * static_cast<float>(p.column);
    std::int32_t inliers = 0;
    work_.add(45 + 7 * static_cast<std::int32_t>(n));
    for (const Guess& guess : guesses_) inliers += fits(guess, a, b) ? 1 : 0;
    if (inliers > best) {
      best = inliers;
      best_a = a;
      best_b = b;
    }
  }
  if (best < params.min_inlier_share * n) return false;
  LineSums<double> sums{};
  guess_ = {};
  guess_.first_column = kColumns;
  for (const Guess& g : guesses_) {
    if (!fits(g, best_a, best_b)) continue;
    sums.add(1.0, middle_px(g.column), g.row);
    guess_.first_column = std::min<std::int32_t>(guess_.first_column, g.column);
    guess_.last_column = std::max<std::int32_t>(guess_.last_column, g.column);
  }
  return try_solve(sums, guess_.row, guess_.slope);
}

void EdgeLineFinder::begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics,
                           const ColumnRays& rays, const ColumnImage& image, const Measured& own, const Measured* other,
                           Kind kind) noexcept {
  params_ = params;
  params_.window_px = std::clamp(params.window_px, 4, kMaxWindow_px);
  noise_ = noise;
  intrinsics_ = intrinsics;
  rays_ = &rays;
  image_ = &image;
  const InversePlane& surface = own.plane;
  surface_ = surface;
  other_.known = other != nullptr;
  if (other_.known) {
    other_.plane = other->plane;
    other_.covariance = other->covariance;
    other_.both_covariance = own.covariance + other->covariance;
  }
  surface_above_ = kind == Kind::kNosing;
  drops_ = kind == Kind::kLip;
  face_.tried = false;
  gap_tried_ = false;
  restart();
  for (std::size_t i = 0; i < guess_ends_m_.size(); ++i) {
    const double x_px = middle_px(i == 0 ? guess_.first_column : guess_.last_column);
    const Vec3 ray = ray_at(x_px, guess_.at(x_px));
    guess_ends_m_[i] = surface.inverse_depth(ray) > 1e-3 ? surface.point(ray) : ray;
  }
  axes_.origin_m = guess_ends_m_[0];
  const Vec3 n = surface.normal();
  Vec3 along = guess_ends_m_[1] - guess_ends_m_[0];
  along -= n * n.dot(along);
  axes_.along = along.norm() > 1e-9 ? Vec3{along.normalized()} : Vec3{n.unitOrthogonal()};
  axes_.across = n.cross(axes_.along);
}

void EdgeLineFinder::restart() noexcept {
  work_.add(1100);
  next_column_ = guess_.first_column / kSlots * kSlots;
  groups_.of.fill(Group{});
  groups_.count = groups_.columns = groups_.refused = 0;
  face_.counts.fill(0);
}

bool EdgeLineFinder::try_face_offset(double& offset_m) const noexcept {
  std::int32_t all_px = 0;
  for (const std::int32_t n : face_.counts) all_px += n;
  if (all_px < 4 * params_.min_columns) return false;
  std::int32_t below = 0;
  std::size_t bin = 0;
  while (2 * (below + face_.counts[bin]) < all_px) below += face_.counts[bin++];
  offset_m = (static_cast<double>(bin) + 0.5) * Face::kBin_m;
  return true;
}

// By slot: both planes' lines w = a + b y, the scale of the noise, and the window's middle row and reach, negative for
// a column that is not searched. The rows of all windows.
struct EdgeLineFinder::Windows {
  Slots surface_a{}, other_a{}, inverse_norm{}, centre{}, reach{};
  std::int32_t first_column = 0;
  std::int32_t first_row = 0, last_row = -1;
};
// By slot: the last row on the surface's side, rows that fit their plane on both sides, and rows with data near the
// guess.
struct EdgeLineFinder::Found {
  Slots row{}, surface_side{}, other_side{}, near_rows{};
};

EdgeLineFinder::Windows EdgeLineFinder::windows_of(std::int32_t first_column) const noexcept {
  Windows windows;
  windows.first_column = first_column;
  std::int32_t first_row = intrinsics_.height_px, last_row = -1;
  // One sigma for both planes: with each its own, the boundary drifts towards the less noisy one.
  const double scale = other_.known ? math::sqrt(surface_.m.norm() * other_.plane.m.norm()) : surface_.m.norm();
  for (std::size_t k = 0; k < kSlots; ++k) {
    const std::int32_t g = first_column + static_cast<std::int32_t>(k);
    const double guess = guess_.at(middle_px(g));
    const Vec3 ray = ray_at(middle_px(g), guess);
    const auto row = static_cast<std::int32_t>(std::floor(guess + 0.5));
    windows.centre[k] = static_cast<float>(row);
    windows.surface_a[k] = static_cast<float>(surface_.m.x() * ray.x() + surface_.m.z());
    windows.other_a[k] = static_cast<float>(other_.plane.m.x() * ray.x() + other_.plane.m.z());
    windows.inverse_norm[k] =
        static_cast<float>(1.0 / (scale * math::sqrt(ray.x() * ray.x() + ray.y() * ray.y() + 1.0)));
    // The image's end is no edge.
    const bool searched = g >= guess_.first_column && g <= guess_.last_column && g < rays_->columns &&
                          row > params_.min_side_px && row < intrinsics_.height_px - 1 - params_.min_side_px;
    windows.reach[k] = searched ? static_cast<float>(params_.window_px) + 0.5F : -1.0F;
    if (!searched) continue;
    first_row = std::min(first_row, row - params_.window_px);
    last_row = std::max(last_row, row + params_.window_px);
  }
  windows.first_row = std::max(first_row, 0);
  windows.last_row = std::min(last_row, intrinsics_.height_px - 1);
  return windows;
}

// Walks from the surface's side to the other.
void EdgeLineFinder::weigh_rows(const Windows& windows, Found& found) noexcept {
  static_assert(kSlots % Wide::nlanes == 0 && kColumns % kSlots == 0);
  const Wide zero = all(0.0), one = all(1.0), truncation = all(math::square(params_.truncate_sigmas));
  const InverseSigma<Wide> sigma_of = all(noise_.inverse_sigma_f());
  const Wide half_gap = all(0.5 * (params_.max_gap_px + 1));
  const Wide surface_b = all(surface_.m.y()), other_b = all(other_.plane.m.y());
  for (std::int32_t k0 = 0; k0 < kSlots; k0 += Wide::nlanes) {
    const auto load = [k0](const Slots& x) { return cv::vx_load(x.data() + k0); };
    const Wide a_surface = load(windows.surface_a), a_other = load(windows.other_a);
    const Wide norm = load(windows.inverse_norm), middle = load(windows.centre), window = load(windows.reach);
    ChangePoint<Wide> point{zero, zero, all(-1.0)};
    Wide near = zero, surface_seen = zero, surface_at_best = zero, other_seen = zero, other_at_best = zero;
    const std::int32_t steps = windows.last_row - windows.first_row + 1;
    for (std::int32_t s = 0; s < steps; ++s) {
      const std::int32_t r = surface_above_ ? windows.first_row + s : windows.last_row - s;
      const Wide w = cv::vx_load(image_->inverse_depth.row(r) + windows.first_column + k0);
      const Wide off = cv::v_abs(all(r) - middle);
      const Wide used = (w > zero) & (off < window);
      const Wide y = all(rays_->y[static_cast<std::size_t>(r)]);
      // Residual over sigma, both times w: (w - w_plane) w / (sigma_w |ray| |m|).
      const Wide unit = w * norm / sigma_of(w);
      const Wide d_surface = (w - (a_surface + surface_b * y)) * unit;
      const Wide d_other = (w - (a_other + other_b * y)) * unit;
      const Wide cost_surface = cv::v_min(d_surface * d_surface, truncation);
      const Wide cost_other = other_.known ? cv::v_min(d_other * d_other, truncation) : all(0.5) * truncation;
      const Wide gain = cv::v_select(used, cost_surface - cost_other, zero);
      cv::v_store(gains_[static_cast<std::size_t>(r)].data() + k0, gain);
      surface_seen = surface_seen + cv::v_select(used & (cost_surface < truncation), one, zero);
      other_seen = other_seen + cv::v_select(used & (cost_other < truncation), one, zero);
      near = near + cv::v_select(used & (off < half_gap), one, zero);
      const Wide better = point.add(gain, all(r));
      surface_at_best = cv::v_select(better, surface_seen, surface_at_best);
      other_at_best = cv::v_select(better, other_seen, other_at_best);
    }
    cv::v_store(found.row.data() + k0, point.at);
    cv::v_store(found.surface_side.data() + k0, surface_at_best);
    cv::v_store(found.other_side.data() + k0, other_seen - other_at_best);
    cv::v_store(found.near_rows.data() + k0, near);
  }
}

void EdgeLineFinder::search_columns(std::int32_t first_column) noexcept {
  work_.add(750);
  const Windows windows = windows_of(first_column);
  if (windows.last_row < 0) return;
  work_.add(300 + 138 * (windows.last_row - windows.first_row + 1));
  Found found;
  weigh_rows(windows, found);
  const auto least = static_cast<float>(params_.min_side_px);
  for (std::size_t k = 0; k < kSlots; ++k) {
    if (windows.reach[k] < 0.0F) continue;
    ++groups_.refused;
    if (found.row[k] < 0.0F || (found.near_rows[k] < 0.5F && !gap_tried_)) continue;
    if (found.surface_side[k] < least || found.other_side[k] < least) continue;
    --groups_.refused;
    if (other_.known && surface_above_ && !face_.tried) {
      add_face(first_column + static_cast<std::int32_t>(k), static_cast<std::int32_t>(found.row[k]), windows.last_row);
    }
    take_column(windows, k, found.near_rows[k]);
  }
}

void EdgeLineFinder::take_column(const Windows& windows, std::size_t slot, float near_rows) noexcept {
  const std::int32_t column = windows.first_column + static_cast<std::int32_t>(slot);
  const auto centre = static_cast<std::int32_t>(windows.centre[slot]);
  const std::int32_t columns = guess_.last_column - guess_.first_column + 1;
  const std::int32_t width = std::max(params_.group_px / kColumn_px, (columns + kMaxGroups - 1) / kMaxGroups);
  const std::int32_t index = (column - guess_.first_column) / width;
  groups_.count = std::max(groups_.count, index + 1);
  ++groups_.columns;
  Group& group = groups_.of[static_cast<std::size_t>(index)];
  group.columns += 1.0;
  group.column_sum += middle_px(column);
  group.rounded_sum += guess_.at(middle_px(column)) - centre;
  group.seen_rows += near_rows;
  work_.add(70 + 18 * params_.window_px);
  const std::int32_t first = std::max(windows.first_row, centre - params_.window_px);
  const std::int32_t last = std::min(windows.last_row, centre + params_.window_px);
  for (std::int32_t r = first; r <= last; ++r) {
    const std::int32_t outwards = surface_above_ ? r - centre : centre - r;
    group.gain[static_cast<std::size_t>(outwards + kMaxWindow_px)] += gains_[static_cast<std::size_t>(r)][slot];
  }
}

void EdgeLineFinder::add_face(std::int32_t column, std::int32_t from_row, std::int32_t last_row) noexcept {
  const auto x = static_cast<double>(rays_->x[static_cast<std::size_t>(column)]);
  const double surface_a = surface_.m.x() * x + surface_.m.z(), other_a = other_.plane.m.x() * x + other_.plane.m.z();
  const double surface_d_m = surface_.d_m(), other_d_m = other_.plane.d_m();
  std::int32_t taken = 0;
  for (std::int32_t r = std::max(from_row - params_.face.before_px, 0); r <= last_row && taken < params_.face.rows;
       ++r) {
    work_.add(22);
    const auto w = static_cast<double>(image_->inverse_depth(column, r));
    if (!(w > 0.0)) continue;
    const auto y = static_cast<double>(rays_->y[static_cast<std::size_t>(r)]);
    const double z = 1.0 / w;
    // Off the tread by more than its noise, along the tread's normal, and downwards.
    const double off_surface_m = (1.0 - (surface_a + surface_.m.y() * y) * z) * surface_d_m;
    if (off_surface_m > -params_.truncate_sigmas * noise_.sigma_m(z)) continue;
    ++taken;
    const double off_other_m = (1.0 - (other_a + other_.plane.m.y() * y) * z) * other_d_m;
    ++face_.counts[static_cast<std::size_t>(math::clamp(off_other_m / Face::kBin_m, 0.0, Face::kBins - 1.0))];
  }
}

bool EdgeLineFinder::try_group_point(const Group& group, Vec2& point_m, double& half_gap_m) noexcept {
  ChangePoint<double> point{0.0, 0.0, -1.0};
  for (std::int32_t i = kMaxWindow_px - params_.window_px; i <= kMaxWindow_px + params_.window_px; ++i) {
    point.add(static_cast<double>(group.gain[static_cast<std::size_t>(i)]), i);
  }
  // At the window's ends nothing was compared.
  const auto at = static_cast<std::int32_t>(point.at);
  if (at <= kMaxWindow_px - params_.window_px || at + 2 > kMaxWindow_px + params_.window_px) return false;
  half_gap_m = 0.0;
  const std::int32_t near_rows = 2 * (params_.max_gap_px / 2);
  if (gap_tried_ || group.seen_rows <= static_cast<float>(group.columns * near_rows)) {
    Gap gap;
    const GapFound found = find_gap(group, at, gap);
    if (found == GapFound::kOutside) return false;
    if (found == GapFound::kInside) {
      Vec2 near_m, far_m;
      if (!try_on_surface(group, gap.from, near_m) || !try_on_surface(group, gap.to, far_m)) return false;
      point_m = 0.5 * (near_m + far_m);
      half_gap_m = 0.5 * (far_m - near_m).y();
      return true;
    }
  }
  // The running sum's least value lies where the gain crosses zero: between the rows on both sides of the minimum.
  const auto g0 = static_cast<double>(group.gain[static_cast<std::size_t>(at)]);
  const auto g1 = static_cast<double>(group.gain[static_cast<std::size_t>(at + 1)]);
  const double fraction = g1 - g0 > 1e-9 ? math::clamp(-g0 / (g1 - g0), 0.0, 1.0) : 0.5;
  return try_on_surface(group, at + fraction - kMaxWindow_px, point_m);
}

bool EdgeLineFinder::try_on_surface(const Group& group, double outwards, Vec2& point_m) const noexcept {
  const double column = group.column_sum / group.columns;
  const double centre = guess_.at(column) - group.rounded_sum / group.columns;
  const Vec3 ray = ray_at(column, surface_above_ ? centre + outwards : centre - outwards);
  if (!(surface_.inverse_depth(ray) > 1e-3)) return false;
  const Vec3 from_origin = surface_.point(ray) - axes_.origin_m;
  point_m = {from_origin.dot(axes_.along), from_origin.dot(axes_.across)};
  return true;
}

bool EdgeLineFinder::step(std::int32_t max_columns) noexcept {
  const std::int32_t last = std::min(guess_.last_column, rays_->columns - 1);
  for (std::int32_t i = 0; i < max_columns && next_column_ <= last; i += kSlots) {
    search_columns(next_column_);
    next_column_ += kSlots;
  }
  return next_column_ > last;
}

double EdgeLineFinder::below_m(double along_m, double across_m, double rows) const noexcept {
  const Vec3 p = axes_.point(along_m, across_m);
  const double down = rows / intrinsics_.fy_px, w = 1.0 / p.z(), dw = surface_.m.y() * down;
  return ((p * w + Vec3::UnitY() * down) / (w + dw) - axes_.origin_m).dot(axes_.across);
}

// How far across the surface one row of the image reaches there.
double EdgeLineFinder::pixel_m(double along_m, double across_m) const noexcept {
  return std::abs(below_m(along_m, across_m, 1.0) - across_m);
}

// Of kSlots columns from column on, whose first has its middle at x; the planes meet in it at meet_row, and from column
// to column slope rows lower. Rows from .. until are those near it; most: of a residual.
struct EdgeLineFinder::NearRows {
  std::int32_t column, from, until;
  double x, meet_row, slope, most;
};

// Over columns, each slot's own: of their place x in columns from start on, and the shift y, rows.
struct EdgeLineFinder::ShiftSums {
  static constexpr std::size_t kRegisters = kSlots / Wide::nlanes;
  std::int32_t start;
  std::array<LineSums<Wide>, kRegisters> line;
  std::array<Wide, kRegisters> yy;

  explicit ShiftSums(std::int32_t start_column) noexcept : start(start_column) {
    const Wide zero = all(0.0);
    line.fill({zero, zero, zero, zero, zero});
    yy.fill(zero);
  }
  template <typename Of>
  [[nodiscard]] double total(const Of& of) const noexcept {
    Slots slots;
    for (std::size_t i = 0; i < kRegisters; ++i) cv::v_store(slots.data() + i * Wide::nlanes, of(i));
    double sum = 0.0;
    for (const float slot : slots) sum += static_cast<double>(slot);
    return sum;
  }
};

void EdgeLineFinder::add_shifts(const NearRows& near, ShiftSums& sums) const noexcept {
  const ShiftParams& p = params_.shift;
  const Vec3 &upper = surface_.m, &lower = other_.plane.m;
  const Wide zero = all(0.0), one = all(1.0), from_px = all(p.from_px), to_px = all(p.to_px), least = all(p.min_rows);
  const Wide upper_b = all(upper.y()), lower_b = all(lower.y()), most = all(near.most);
  const Wide px = all(intrinsics_.fy_px / (upper.y() - lower.y())), most_px = all(p.max_px);
  const double dx = kColumn_px / intrinsics_.fx_px;
  for (std::size_t i = 0; i < ShiftSums::kRegisters; ++i) {
    const auto k = static_cast<std::int32_t>(i) * Wide::nlanes;
    const Wide step = simd::steps_from(k), meet = all(near.meet_row) + all(near.slope) * step;
    const Wide upper_a = all(upper.x() * near.x + upper.z()) + all(upper.x() * dx) * step;
    const Wide lower_a = all(lower.x() * near.x + lower.z()) + all(lower.x() * dx) * step;
    Wide sum_upper = zero, sum_lower = zero, n_upper = zero, n_lower = zero;
    for (std::int32_t r = near.from; r <= near.until; ++r) {
      const Wide w = cv::vx_load(image_->inverse_depth.row(r) + near.column + k), down = all(r) - meet;
      const Wide ray = all(rays_->y[static_cast<std::size_t>(r)]), away = cv::v_abs(down), above = down < zero;
      const Wide off = w - cv::v_select(above, upper_a + upper_b * ray, lower_a + lower_b * ray);
      const Wide used = (w > zero) & (away > from_px) & (away < to_px) & (cv::v_abs(off) < most);
      const Wide in_upper = used & above, in_lower = used & ~above;
      sum_upper = sum_upper + (off & in_upper), n_upper = n_upper + (one & in_upper);
      sum_lower = sum_lower + (off & in_lower), n_lower = n_lower + (one & in_lower);
    }
    const Wide column = all(near.column) + step, place = column - all(sums.start);
    const Wide enough = (n_upper > least) & (n_lower > least) & (column >= all(guess_.first_column)) &
                        (column <= all(guess_.last_column));
    const Wide rows = (sum_lower / cv::v_max(n_lower, one) - sum_upper / cv::v_max(n_upper, one)) * px;
    const Wide in = one & enough & (cv::v_abs(rows) < most_px);
    sums.line[i].add(in, place, rows);
    sums.yy[i] = sums.yy[i] + in * rows * rows;
  }
}

EdgeLineFinder::Shift EdgeLineFinder::local_shift() noexcept {
  Shift shift;
  const Vec3 apart = surface_.m - other_.plane.m;
  if (!(std::abs(apart.y()) > 1e-6)) return shift;
  const double dx = kColumn_px / intrinsics_.fx_px, meet_slope = -intrinsics_.fy_px * apart.x() / apart.y() * dx;
  const double limit = math::sqrt(surface_.m.norm() * other_.plane.m.norm()) * params_.truncate_sigmas;
  const std::int32_t start = guess_.first_column / kSlots * kSlots;
  ShiftSums sums(start);
  for (std::int32_t first = start; first <= guess_.last_column; first += kSlots) {
    const double x = (middle_px(first) - intrinsics_.cx_px) / intrinsics_.fx_px,
                 y = -(apart.x() * x + apart.z()) / apart.y();
    const double row = intrinsics_.cy_px + intrinsics_.fy_px * y, last_row = row + (kSlots - 1) * meet_slope;
    const auto from = static_cast<std::int32_t>(std::ceil(std::min(row, last_row) - params_.shift.to_px));
    const auto until = static_cast<std::int32_t>(std::floor(std::max(row, last_row) + params_.shift.to_px));
    const double w0 = surface_.inverse_depth({x, y, 1.0});
    work_.add(60);
    if (from < 0 || until >= intrinsics_.height_px || !(w0 > 0.0)) continue;
    work_.add(330 + 62 * (until - from + 1));
    add_shifts({first, from, until, x, row, meet_slope, limit * noise_.inverse_sigma(w0) / w0}, sums);
  }
  const auto of_line = [&sums](Wide LineSums<Wide>::*sum) {
    return sums.total([&](std::size_t i) { return sums.line[i].*sum; });
  };
  using Sums = LineSums<Wide>;
  const LineSums<double> line{of_line(&Sums::n), of_line(&Sums::x), of_line(&Sums::y), of_line(&Sums::xx),
                              of_line(&Sums::xy)};
  if (line.n < params_.min_columns || !try_solve(line, shift.at_px, shift.per_column)) return shift;
  shift.start_px = middle_px(start);
  const double squares = sums.total([&](std::size_t i) { return sums.yy[i]; });
  const double left = squares - shift.at_px * line.y - shift.per_column * line.xy;
  shift.sigma_px = 2.0 * math::sqrt(std::max(left, 0.0)) / line.n;
  shift.known = true;
  return shift;
}

double EdgeLineFinder::Points::median_of_scratch() noexcept {
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(scratch.begin(), middle, scratch.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

void EdgeLineFinder::gather_points() noexcept {
  points_.count = 0;
  for (std::int32_t i = 0; i < groups_.count; ++i) {
    const Group& group = groups_.of[static_cast<std::size_t>(i)];
    double& half_gap_m = points_.half_gap_m[points_.count];
    if (group.columns < 1.0 || !try_group_point(group, points_.at_m[points_.count], half_gap_m)) continue;
    double& weight = points_.weight[points_.count];
    weight = points_.columns[points_.count] = group.columns;
    ++points_.count;
    if (half_gap_m == 0.0) continue;
    // It is anywhere in the gap with the same right, beside the error that every change-point has.
    const double own_m2 = math::square(params_.slow_error_m);
    weight *= own_m2 / (own_m2 + math::square(half_gap_m) / 3.0);
  }
}

// Tukey's, from the median, along the guess: the guess defines the axis. limit_m: points farther off do not count.
bool EdgeLineFinder::try_robust_line(Fit& fit, double& limit_m) noexcept {
  constexpr int kRounds = 8;        // of a search that converges
  constexpr double kTukey = 4.685;  // 95 % as good as least squares where errors are normal
  Points& p = points_;
  for (std::size_t i = 0; i < p.count; ++i) p.scratch[i] = p.at_m[i].y();
  fit.a = p.median_of_scratch();
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < p.count; ++i) p.scratch[i] = std::abs(p.at_m[i].y() - fit.at(p.at_m[i].x()));
    limit_m = kTukey * std::max(1.4826 * p.median_of_scratch(), params_.least_scale_m);
    LineSums<double> sums{};
    for (std::size_t i = 0; i < p.count; ++i) {
      const double r = (p.at_m[i].y() - fit.at(p.at_m[i].x())) / limit_m;
      if (std::abs(r) < 1.0) sums.add(p.weight[i] * math::square(1.0 - r * r), p.at_m[i].x(), p.at_m[i].y());
    }
    if (!try_solve(sums, fit.a, fit.b)) return false;
  }
  return true;
}

EdgeLineFinder::Outcome EdgeLineFinder::measure(Fit& fit, double limit_m) const noexcept {
  double squares = 0.0, columns = 0.0, groups = 0.0, weight = 0.0, half_gap_m = 0.0;
  fit.lo_m = 1e9;
  fit.hi_m = -1e9;
  for (std::size_t i = 0; i < points_.count; ++i) {
    const Vec2& at_m = points_.at_m[i];
    const double r = at_m.y() - fit.at(at_m.x());
    if (std::abs(r) >= limit_m) continue;
    squares += points_.columns[i] * r * r;
    columns += points_.columns[i];
    groups += 1.0;
    weight += points_.weight[i];
    half_gap_m += points_.weight[i] * points_.half_gap_m[i];
    fit.lo_m = std::min(fit.lo_m, at_m.x());
    fit.hi_m = std::max(fit.hi_m, at_m.x());
  }
  if (columns < params_.min_columns || groups < 3.0) return Outcome::kFewColumns;
  const double rms = math::sqrt(squares / columns);
  if (rms > params_.max_rms_m || columns < params_.min_inlier_share * groups_.columns) return Outcome::kNotStraight;
  // The outer groups' points are their middles: the line goes on for half a group.
  const double half_group_m = 0.5 * (fit.hi_m - fit.lo_m) / (groups - 1.0);
  fit.lo_m -= half_group_m;
  fit.hi_m += half_group_m;
  if (fit.hi_m - fit.lo_m < params_.min_length_m) return Outcome::kShort;
  fit.sigma_m = 2.0 * math::sqrt((rms * rms + math::square(params_.slow_error_m)) / groups);
  fit.half_gap_m = half_gap_m / weight;
  return Outcome::kFound;
}

// On the surface's plane: m_other . (origin + s along + t across) = 1.
double EdgeLineFinder::meet_m(double along_m) const noexcept {
  const Vec3& m = other_.plane.m;
  return (1.0 - m.dot(axes_.origin_m + along_m * axes_.along)) / m.dot(axes_.across);
}

// All three by their information. Change-points are also skewed towards the less noisy plane, which their scatter
// hides. Errors of the three are correlated by .28 (meeting, change-points), .49 (meeting, local) and .17
// (generated stairs, the robot's camera, correlated noise).
double EdgeLineFinder::join(const Fit& fit, const Shift& shift, double along_m, double meet_m,
                            double& across_m) const noexcept {
  const double shared = params_.shared, seen = 1.0 / (params_.seen_variance_gain * math::square(fit.sigma_m));
  const Vec3 p = axes_.point(along_m, meet_m);
  const double met = 1.0 / math::square(plane_sigma_m(other_.plane, other_.covariance, p / p.z()));
  double local = 0.0, local_m = 0.0;
  if (shift.known) {
    const double column_px = p.x() / p.z() * intrinsics_.fx_px + intrinsics_.cx_px;
    local_m = below_m(along_m, meet_m, shift.at(column_px));
    local = 1.0 / (math::square(shift.sigma_px * pixel_m(along_m, meet_m)) + math::square(params_.least_local_m));
  }
  const double sum = met + seen + local;
  across_m = (met * meet_m + seen * fit.at(along_m) + local * local_m) / sum;
  const double roots = math::sqrt(met) + math::sqrt(seen) + math::sqrt(local);
  return math::sqrt((1.0 - shared) * sum + shared * roots * roots) / sum;
}

// The face is taken as parallel to the riser: n . p + d - face = 0.
bool EdgeLineFinder::begins_at_face() noexcept {
  double face_m = 0.0;
  if (!surface_above_ || face_.tried || !try_face_offset(face_m)) return false;
  const double d_m = other_.plane.d_m();
  if (!(face_m > params_.face.min_m && face_m < params_.face.max_m && d_m > 2.0 * face_m)) return false;
  other_.plane.m *= d_m / (d_m - face_m);
  face_.tried = true;
  restart();
  return true;
}

bool EdgeLineFinder::try_meet_other(Fit& fit, EdgeLine& line) noexcept {
  const double meet_lo = meet_m(fit.lo_m), meet_hi = meet_m(fit.hi_m);
  const double t_lo = fit.at(fit.lo_m), t_hi = fit.at(fit.hi_m), apart = 0.5 * (meet_lo + meet_hi - t_lo - t_hi);
  const double middle_s = 0.5 * (fit.lo_m + fit.hi_m), middle_t = 0.25 * (t_lo + t_hi + meet_lo + meet_hi);
  const Vec3 centre = axes_.point(middle_s, middle_t);
  const double met_sigma_m = plane_sigma_m(other_.plane, other_.both_covariance, centre / centre.z());
  const double apart_m =
      params_.agree.within_sigmas * math::sqrt(math::square(fit.sigma_m) + math::square(met_sigma_m));
  const double limit_m = std::max(math::clamp(apart_m, params_.agree.least_m, params_.agree.most_m),
                                  params_.agree.within_px * pixel_m(middle_s, middle_t));
  const bool agrees = fit.half_gap_m == 0.0 ? std::abs(apart) < limit_m : settle_gap(fit, apart, limit_m);
  if (!agrees && begins_at_face()) return false;
  line = seen_line(fit);
  if (!agrees) return true;
  const Shift shift = surface_above_ ? local_shift() : Shift{};
  double lo_m = 0.0, hi_m = 0.0;
  const double sigma_lo_m = join(fit, shift, fit.lo_m, meet_lo, lo_m);
  line.sigma_m = std::max(sigma_lo_m, join(fit, shift, fit.hi_m, meet_hi, hi_m));
  line.a_m = axes_.point(fit.lo_m, lo_m);
  line.b_m = axes_.point(fit.hi_m, hi_m);
  return true;
}

EdgeLine EdgeLineFinder::seen_line(const Fit& fit) const noexcept {
  return {axes_.point(fit.lo_m, fit.at(fit.lo_m)), axes_.point(fit.hi_m, fit.at(fit.hi_m)), fit.sigma_m, true};
}

EdgeLineFinder::Outcome EdgeLineFinder::finish(EdgeLine& line) noexcept {
  line = {};
  work_.add(200);
  if (groups_.refused > groups_.columns && begins_at_gap()) return Outcome::kAgain;
  if (groups_.columns < params_.min_columns) return Outcome::kFewColumns;
  work_.add(groups_.count, 160 + 7 * (2 * params_.window_px + 1));
  gather_points();
  if (points_.count < 3) return Outcome::kFewColumns;
  work_.add(1200);
  work_.add(points_.count, 570);
  Fit fit;
  double limit_m = 0.0;
  if (!try_robust_line(fit, limit_m)) return Outcome::kNoLine;
  const Outcome outcome = measure(fit, limit_m);
  if (outcome != Outcome::kFound) return outcome;
  if (other_.known) return try_meet_other(fit, line) ? Outcome::kFound : Outcome::kAgain;
  widen_by_gap(fit, -1.0);
  line = seen_line(fit);
  return Outcome::kFound;
}

}  // namespace polygmap
