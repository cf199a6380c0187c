// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/side_lines.hpp"

#include <algorithm>
#include <bit>

#include "algorithms/perception/image/simd.hpp"
#include "algorithms/perception/polygons/line_sums.hpp"

namespace polygmap {
namespace {

constexpr std::int32_t kManyRows = 64;   // of more, every second one (third, ...) says the same
constexpr std::int32_t kInside_px = 8;   // of the outermost column and the one beside it
constexpr std::int32_t kOutside_px = 8;  // searched beyond
constexpr std::int32_t kReach_px = kInside_px + kOutside_px;

constexpr double kNowhere = -1e9;  // beyond the other end of any image

using simd::all, simd::Four, simd::Wide;
using Reach = std::array<float, kReach_px>;  // from inside outwards
using Raws = std::array<std::uint16_t, kReach_px>;

// The rays of one row: (x0 + pitch * column, y, 1).
struct RowRays {
  double x0, pitch, y;
};

// A plane in one row: inverse depth at + slope * column, and the tolerance of measured over expected depth.
struct RowPlane {
  float at, slope, per_sigma;
  bool valid;

  // Near one pixel of the row. most_slant: one over the least cosine of the incidence.
  void set(const InversePlane& plane, const DepthNoiseModel& noise, const RowRays& rays, double most_slant,
           std::int32_t column) noexcept {
    const double x = rays.x0 + rays.pitch * column, ray2 = x * x + rays.y * rays.y + 1.0;
    const double constant = plane.m.y() * rays.y + plane.m.z(), w = plane.m.x() * x + constant;
    valid = w > kLeastInverseDepth;
    if (!valid) return;
    // The cosine of the incidence is w over this.
    const double over = math::clamp(math::sqrt(plane.m.squaredNorm() * ray2), w, w * most_slant);
    at = static_cast<float>(constant + plane.m.x() * rays.x0);
    slope = static_cast<float>(plane.m.x() * rays.pitch);
    per_sigma = static_cast<float>(w * w / (over * noise.inverse_sigma(w)));
  }
  // Over sigma.
  [[nodiscard]] Wide residual(const Wide& column, const Wide& depth_m) const noexcept {
    return ((all(at) + all(slope) * column) * depth_m - all(1.0F)) * all(per_sigma);
  }
  // 2 ln(sigma over the other's), near enough: with residuals alone a crease moves towards the plane of less noise.
  [[nodiscard]] float wider_than(const RowPlane& other) const noexcept {
    return 4.0F * (other.per_sigma - per_sigma) / (other.per_sigma + per_sigma);
  }
};

struct PixelGains {
  Reach gain;
  std::uint32_t measured = 0, before = 0;  // a bit a pixel: it has data; it lies before the surface
};

// A bit for each step outwards at which the sum of the gains so far is least, or hardly more.
std::uint32_t least_costs(const Reach& gain) noexcept {
  constexpr float kTie = 1e-3F;  // of rounding
  constexpr std::size_t kFours = kReach_px / Four::nlanes;
  std::array<Four, kFours> cost;
  Four before = cv::v_setzero_f32(), least = cv::v_setall_f32(1e9F);
  for (std::size_t i = 0; i < kFours; ++i) {
    cost[i] = simd::running_sums(cv::v_load(gain.data() + i * Four::nlanes), before);
    least = cv::v_min(least, cost[i]);
  }
  const Four most = cv::v_setall_f32(cv::v_reduce_min(least) + kTie);
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < kFours; ++i) {
    bits |= simd::bits(cost[i] < most) << (i * Four::nlanes);
  }
  return bits;
}

// OpenCV's own of eight u16 holds a function-local static: a lock.
cv::v_uint16x8 reversed(const cv::v_uint16x8& a) noexcept {
  const cv::v_uint32x4 pairs = cv::v_reverse(cv::v_reinterpret_as_u32(a));
  return cv::v_reinterpret_as_u16(cv::v_shl<16>(pairs) | cv::v_shr<16>(pairs));
}

// What every pixel says for the plane beyond and against our own: twice the negative logarithms of the likelihoods, but
// for a constant. Nothing where there is no data.
PixelGains weigh(const SideLines::Params& params, const RawImage& image, const RowPlane& own, const RowPlane& other,
                 std::int32_t first, std::int32_t out, const Raws& raw) noexcept {
  PixelGains gains;
  static_assert(kReach_px % Wide::nlanes == 0);
  const Wide most = all(math::square(params.truncate_sigmas));
  const Wide leave = all(math::square(params.leave_sigmas));
  const Wide more = all(other.valid ? other.wider_than(own) : 0.0F);
  const Wide unit_m = all(image.intrinsics.depth_unit_m);
  const Wide least = all(image.range.min), largest = all(image.range.max);
  for (std::int32_t i = 0; i < kReach_px; i += Wide::nlanes) {
    const Wide depth = simd::load_u16(raw.data() + i), column = all(first) + all(out) * simd::steps_from(i);
    const Wide r = own.residual(column, depth * unit_m);
    Wide beyond = leave;
    if (other.valid) {
      const Wide o = other.residual(column, depth * unit_m);
      beyond = cv::v_min(o * o + more, most);
    }
    const Wide measured = (depth >= least) & (depth <= largest);
    cv::v_store(gains.gain.data() + i, (cv::v_min(r * r, most) - beyond) & measured);
    gains.measured |= simd::bits(measured) << i;
    gains.before |= simd::bits(r) << i;
  }
  return gains;
}

double outwards(bool right) noexcept { return right ? 1.0 : -1.0; }
// Of a column of pixels.
double outer_edge(std::int32_t g, bool right) noexcept { return kColumn_px * g + (right ? kColumn_px - 0.5 : -0.5); }

}  // namespace

void SideLines::begin(const Params& params, const DepthNoiseModel& noise, const RawImage& raw, const FrameImage& image,
                      const Regions& regions) noexcept {
  params_ = params;
  noise_ = noise;
  raw_ = &raw;
  image_ = &image;
  regions_ = &regions;
  pitch_ = 1.0 / raw.intrinsics.fx_px;
}

// From inside outwards.
struct SideLines::RowView {
  std::int32_t row, column;  // the outermost of the surface's columns
  Raws raw;
  RowPlane own, other;      // other: of what lies beyond, if that is known
  std::int32_t first, out;  // pixel, and step outwards
  Ending ending;            // kSeen: the pixels will tell
};
struct SideLines::Views {
  std::array<RowView, kMaxRows> of;
  std::size_t count = 0;
};

RegionId SideLines::plane_beyond(RegionId id, std::int32_t out, const RowView& view) const noexcept {
  RegionId beyond = kNoRegion;
  for (std::int32_t g = view.column + out; g != view.column + 3 * out; g += out) {
    if (g < 0 || g >= image_->column_rays.columns) break;
    const RegionId p = regions_->labels.at(g, view.row);
    if (p != kNoRegion && p != id) beyond = p;
  }
  return beyond;
}

std::int32_t SideLines::count_free(bool right, const RowView& view) const noexcept {
  const std::int32_t count = std::min(kReach_px, right ? raw_->intrinsics.width_px - view.first : view.first + 1);
  if (!image_->body_rows[static_cast<std::size_t>(view.row / 2)]) return count;
  const std::uint8_t* flags = image_->flags.row(view.row / 2);
  std::int32_t free = 0;
  while (free < count && (flags[(view.first + view.out * free) / 2] & kPixelBody) == 0) ++free;
  return free;
}

void SideLines::copy_pixels(bool right, std::int32_t count, RowView& view) const noexcept {
  const std::uint16_t* pixels = raw_->row(view.row);
  if (count < kReach_px) {
    view.raw.fill(0);
    for (std::int32_t i = 0; i < count; ++i) view.raw[static_cast<std::size_t>(i)] = pixels[view.first + view.out * i];
    return;
  }
  using Eight = cv::v_uint16x8;
  static_assert(kReach_px == 2 * Eight::nlanes);
  const std::uint16_t* leftmost = pixels + (right ? view.first : view.first - (kReach_px - 1));
  const Eight a = cv::v_load(leftmost), b = cv::v_load(leftmost + Eight::nlanes);
  cv::v_store(view.raw.data(), right ? a : reversed(b));
  cv::v_store(view.raw.data() + Eight::nlanes, right ? b : reversed(a));
}

void SideLines::look(RegionId id, bool right, RowView& view) const noexcept {
  const CameraIntrinsics& k = raw_->intrinsics;
  const std::int32_t out = right ? 1 : -1;
  const std::int32_t border = kColumn_px * view.column + (right ? kColumn_px - 1 : 0);  // the outermost column's last
  view.first = border - out * (kInside_px - 1);
  view.out = out;
  // The image's last columns hide what comes after them.
  view.ending = Ending::kHidden;
  if (border + 2 * out < 0 || border + 2 * out >= k.width_px) return;
  view.ending = Ending::kNone;
  if (view.first < 0 || view.first >= k.width_px) return;
  const RowRays rays{-k.cx_px * pitch_, pitch_,
                     static_cast<double>(image_->column_rays.y[static_cast<std::size_t>(view.row)])};
  const double most_slant = 1.0 / params_.least_incidence_cos;
  view.own.set((*regions_)[id].plane, noise_, rays, most_slant, border);
  if (!view.own.valid) return;
  const RegionId beyond = plane_beyond(id, out, view);
  view.other.valid = false;
  if (beyond != kNoRegion) view.other.set((*regions_)[beyond].plane, noise_, rays, most_slant, border);
  const std::int32_t count = count_free(right, view);
  copy_pixels(right, count, view);
  view.ending = count < kInside_px ? Ending::kHidden : Ending::kSeen;  // by the robot's own body
}

SideLines::Ending SideLines::end_of_row(const RowView& view, double& end_px) const noexcept {
  if (view.ending != Ending::kSeen) return view.ending;
  const PixelGains gains = weigh(params_, *raw_, view.own, view.other, view.first, view.out, view.raw);
  // The boundary with the least cost; between equally good ones (a pixel without data or of neither) in their middle.
  const std::uint32_t equal = least_costs(gains.gain);
  const auto from = std::countr_zero(equal);
  auto to = from + std::countr_one(equal >> from) - 1;
  if (from == 0) return Ending::kNone;
  if ((gains.measured >> to >> 1) == 0) return Ending::kHidden;
  // Pixels with data between from and to, those behind the surface less those before it.
  const std::uint32_t between = gains.measured & ((2U << to) - (2U << from));
  const std::int32_t of_neither = std::popcount(between) - 2 * std::popcount(between & gains.before);
  if (std::abs(of_neither) > params_.mixed_px) to = from;  // something narrow stands between: the surface ends at it
  end_px = view.first + view.out * (0.5 * (from + to) + 0.5);
  return Ending::kSeen;
}

bool SideLines::is_upright(const InversePlane& plane, const Line& line) const noexcept {
  const CameraIntrinsics& k = raw_->intrinsics;
  const Vec3 normal = plane.normal();
  const Vec3 along = (Vec3::UnitX() - normal * normal.x()).normalized(), across = normal.cross(along);
  const auto point = [&](double row) {
    return plane.point({(line.at + line.slope * row - k.cx_px) / k.fx_px, (row - k.cy_px) / k.fy_px, 1.0});
  };
  const Vec3 direction = point(seen_.back().row) - point(seen_.front().row);
  return std::abs(along.dot(direction)) <= params_.max_lean * std::abs(across.dot(direction));
}

// Of lines through two of the seen ends, the one nearest to all.
bool SideLines::try_propose(const InversePlane& plane, Line& line) const noexcept {
  const auto n = static_cast<std::int32_t>(seen_.size());
  double best = 1e9;
  for (const std::int32_t apart : {n / 2, n / 4}) {
    const std::int32_t stride = std::max(apart / 3, 1);
    for (std::int32_t i = 0; i + apart < n; i += stride) {
      const RowEnd &a = seen_[static_cast<std::size_t>(i)], &b = seen_[static_cast<std::size_t>(i + apart)];
      const double slope = (b.column - a.column) / (b.row - a.row);
      double cost = 0.0;
      for (const RowEnd& e : seen_) {
        const double off = e.column - a.column - slope * (e.row - a.row);
        cost += std::min(off * off, params_.inlier_px * params_.inlier_px);
      }
      const Line candidate{a.column - slope * a.row, slope};
      if (cost >= best || !is_upright(plane, candidate)) continue;
      best = cost;
      line = candidate;
    }
  }
  return best <= 1e8;
}

// The steep line that most of the seen ends lie on: pairs of them propose, least squares of those near by decide.
bool SideLines::try_line(const InversePlane& plane, Line& line) const noexcept {
  if (static_cast<std::int32_t>(seen_.size()) < params_.min_rows || !try_propose(plane, line)) return false;
  for (int round = 0; round < 3; ++round) {
    LineSums<double> sums{};
    for (const RowEnd& e : seen_) {
      if (std::abs(e.column - line.at - line.slope * e.row) <= params_.inlier_px) sums.add(1.0, e.row, e.column);
    }
    if (sums.n < params_.min_rows || !try_solve(sums, line.at, line.slope)) return false;
  }
  return is_upright(plane, line);
}

void SideLines::find_ends(RegionId id) noexcept {
  const ColumnExtents& profile = regions_->extents[id];
  using Bytes = cv::v_uint8;
  static_assert(kDepthHeight_px % Bytes::nlanes == 0);
  constexpr std::int32_t kCleared_rows = 32;  // at once, whatever the register's width: what is cleared is paid for
  static_assert(kCleared_rows % Bytes::nlanes == 0);
  const std::int32_t from = profile.first_row / kCleared_rows * kCleared_rows;
  std::uint8_t *left = left_.data() + kPad, *right = right_.data() + kPad;
  work_.add(260 + (profile.last_row - from) / 8);
  std::fill(left + from, left + profile.last_row + 1, kNoColumn);
  std::fill(right + from, right + profile.last_row + 1, kNoColumn);
  const Bytes wanted = cv::vx_setall_u8(id);
  std::int32_t rows = 0;
  for (std::int32_t g = profile.first_column; g <= profile.last_column; ++g) {
    const ColumnExtent& ends = profile.columns[static_cast<std::size_t>(g)];
    if (ends.empty()) continue;
    rows += ends.bottom - ends.top + 32;
    const RegionId* labels = regions_->labels.column(g);
    const Bytes here = cv::vx_setall_u8(static_cast<std::uint8_t>(g));
    for (std::int32_t r = ends.top / Bytes::nlanes * Bytes::nlanes; r <= ends.bottom; r += Bytes::nlanes) {
      // From left to right, and no column is more than none.
      const Bytes own = cv::vx_load(labels + r) == wanted;
      cv::v_store(left + r, cv::v_min(cv::vx_load(left + r), here | ~own));
      cv::v_store(right + r, cv::v_select(own, here, cv::vx_load(right + r)));
    }
  }
  work_.add(std::max(profile.last_column - profile.first_column + 1, 0) * 30 + 11 * rows / 16);
  const std::int32_t half = params_.flat_rows / 2;
  for (std::uint8_t* ends : {left, right}) {
    std::fill_n(ends + profile.first_row - half, half, ends[profile.first_row]);
    std::fill_n(ends + profile.last_row + 1, half, ends[profile.last_row]);
  }
}

// Where the surface's end runs off sideways from row to row it is a front or a back, no side: a bit for each row that
// may end at one.
struct SideLines::UprightRows {
  using Bytes = cv::v_uint8x16;
  std::int32_t first_row;
  std::int32_t count = 0;
  std::array<std::uint32_t, kDepthHeight_px / Bytes::nlanes + 1> bits;
};

SideLines::UprightRows SideLines::upright_rows(const ColumnExtents& profile, const std::uint8_t* ends) const noexcept {
  using Bytes = UprightRows::Bytes;
  UprightRows rows;
  rows.first_row = profile.first_row;
  const Bytes flat = cv::v_setall_u8(static_cast<std::uint8_t>(params_.flat_columns)),
              none = cv::v_setall_u8(kNoColumn);
  const std::int32_t half = params_.flat_rows / 2;
  std::size_t i = 0;
  for (std::int32_t r = profile.first_row; r <= profile.last_row; r += Bytes::nlanes, ++i) {
    const Bytes drift = cv::v_absdiff(cv::v_load(ends + r + half), cv::v_load(ends + r - half));
    const Bytes may = (cv::v_max(drift, flat) == flat) & (cv::v_load(ends + r) != none);
    rows.bits[i] = simd::bits(may) & ((2U << std::min(profile.last_row - r, Bytes::nlanes - 1)) - 1U);
    rows.count += std::popcount(rows.bits[i]);
  }
  return rows;
}

void SideLines::choose_rows(const UprightRows& rows, std::int32_t most, const std::uint8_t* ends,
                            Views& views) const noexcept {
  constexpr std::int32_t kBits = UprightRows::Bytes::nlanes;
  const std::int32_t stride = (rows.count + most - 1) / most;
  std::int32_t above = 0;  // such rows above r0
  for (std::int32_t i = stride / 2, r0 = rows.first_row; i < rows.count; i += stride) {
    const auto bits = [&] { return rows.bits[static_cast<std::size_t>((r0 - rows.first_row) / kBits)]; };
    for (; above + std::popcount(bits()) <= i; r0 += kBits) above += std::popcount(bits());
    std::uint32_t from_it = bits();
    for (std::int32_t before = above; before < i; ++before) from_it &= from_it - 1U;
    RowView& view = views.of[views.count++];
    view.row = r0 + std::countr_zero(from_it);
    view.column = ends[view.row];
    __builtin_prefetch(raw_->row(view.row) + kColumn_px * view.column);
  }
}

double SideLines::find_row_ends(const Views& views, bool right) noexcept {
  double outermost = kNowhere;
  seen_.clear();
  hidden_.clear();
  for (std::size_t i = 0; i < views.count; ++i) {
    double column = 0.0;
    const Ending ending = end_of_row(views.of[i], column);
    if (ending == Ending::kNone) continue;
    if (ending == Ending::kHidden) column = outer_edge(views.of[i].column, right);
    static_cast<void>(
        (ending == Ending::kSeen ? seen_ : hidden_).try_push_back({static_cast<double>(views.of[i].row), column}));
    outermost = std::max(outermost, outwards(right) * column);
  }
  return outermost;
}

bool SideLines::holds(const Line& line, double& first_row, double& last_row) const noexcept {
  std::int32_t on = 0, between = 0;
  first_row = 1e9;
  last_row = -1e9;
  for (const RowEnd& e : seen_) {
    if (std::abs(e.column - line.at - line.slope * e.row) > params_.inlier_px) continue;
    ++on;
    first_row = std::min(first_row, e.row);
    last_row = std::max(last_row, e.row);
  }
  for (const auto* ends : {&seen_, &hidden_}) {
    for (const RowEnd& e : *ends) between += e.row >= first_row && e.row <= last_row ? 1 : 0;
  }
  return on >= params_.min_rows && on >= params_.min_share * between;
}

double SideLines::count_outside(const Line& line, const ColumnExtents& profile, bool right) const noexcept {
  const std::uint8_t* ends = ends_of(right);
  double count_px = 0.0;
  const std::int32_t step = 1 + (profile.last_row - profile.first_row) / kManyRows;
  for (std::int32_t r = profile.first_row; r <= profile.last_row; r += step) {
    if (ends[r] == kNoColumn) continue;
    const double beyond_px = outwards(right) * (outer_edge(ends[r], right) - line.at - line.slope * r);
    count_px += step * std::max(beyond_px - params_.outside_px, 0.0);
  }
  return count_px;
}

OutlineSide SideLines::find(RegionId id, bool right) noexcept {
  const Region& plane = (*regions_)[id];
  const ColumnExtents& profile = regions_->extents[id];
  const std::uint8_t* ends = ends_of(right);
  // Rows are asked for, then looked at, then decided on: each step takes its time, and none waits for another row's.
  work_.add(250 + 42 * ((profile.last_row - profile.first_row) / 16 + 1));
  Views views;
  choose_rows(upright_rows(profile, ends), plane.kind == SurfaceKind::kTread ? kMaxRows : kOtherRows, ends, views);
  work_.add(views.count, 560);
  for (std::size_t i = 0; i < views.count; ++i) look(id, right, views.of[i]);
  double outermost = find_row_ends(views, right);
  work_.add(seen_.size(), 230);
  if (!(outermost > kNowhere)) {  // no row but flat ones
    work_.add(profile.last_row - profile.first_row + 1, 12);
    for (std::int32_t r = profile.first_row; r <= profile.last_row; ++r) {
      if (ends[r] != kNoColumn) outermost = std::max(outermost, outwards(right) * outer_edge(ends[r], right));
    }
  }
  // Half-resolution pixel i is where full-resolution 2 i + 0.5 is.
  OutlineSide side;
  side.column_px = 0.5 * (outwards(right) * outermost - 0.5);
  Line line;
  double first_row = 0.0, last_row = 0.0;
  if (!try_line(plane.plane, line) || !holds(line, first_row, last_row)) return side;
  work_.add(kManyRows, 16);
  if (count_outside(line, profile, right) > params_.max_cut * plane.area_px) return side;
  side.fitted = true;
  side.column_px = 0.5 * (line.at + 0.5 * line.slope - 0.5);
  side.slope = line.slope;
  side.top_px = 0.5 * (first_row - 1.0);
  side.bottom_px = 0.5 * last_row;
  return side;
}

}  // namespace polygmap
