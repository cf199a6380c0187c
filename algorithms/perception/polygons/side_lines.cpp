// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/side_lines.hpp"

#include <algorithm>
#include <bit>

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {
namespace {

constexpr double kLeastCosine = 0.26;                    // of the incidence; the noise model ends there
constexpr std::int32_t kFlatRows = 4, kFlatColumns = 2;  // more columns in these rows: too flat
constexpr std::int32_t kManyRows = 64;                   // of more, every second one (third, ...) says the same
constexpr std::int32_t kMixed_px = 2;                    // of neither plane, where one pixel sees both
constexpr std::int32_t kInside_px = 8;                   // of the outermost column and the one beside it
constexpr std::int32_t kOutside_px = 8;                  // searched beyond
constexpr std::int32_t kReach_px = kInside_px + kOutside_px;

using Wide = cv::v_float32;
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

  // Near one pixel of the row.
  void set(const InversePlane& plane, const DepthNoiseModel& noise, const RowRays& rays, std::int32_t column) noexcept {
    const double x = rays.x0 + rays.pitch * column, ray2 = x * x + rays.y * rays.y + 1.0;
    const double constant = plane.m.y() * rays.y + plane.m.z(), w = plane.m.x() * x + constant;
    valid = w > 0.05;
    if (!valid) return;
    // The cosine of the incidence is w over this.
    const double over = math::clamp(math::sqrt(plane.m.squaredNorm() * ray2), w, w * (1.0 / kLeastCosine));
    at = static_cast<float>(constant + plane.m.x() * rays.x0);
    slope = static_cast<float>(plane.m.x() * rays.pitch);
    per_sigma = static_cast<float>(w * w / (over * noise.inverse_sigma(w)));
  }
  // Over sigma.
  [[nodiscard]] Wide residual(const Wide& column, const Wide& depth_m) const noexcept {
    const auto all = [](float x) { return cv::vx_setall_f32(x); };
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
  using Four = cv::v_float32x4;  // the same order of summing for every register width
  constexpr float kTie = 1e-3F;
  constexpr std::size_t kFours = kReach_px / Four::nlanes;
  std::array<Four, kFours> cost;
  Four before = cv::v_setzero_f32(), least = cv::v_setall_f32(1e9F);
  for (std::size_t i = 0; i < kFours; ++i) {
    Four sum = cv::v_load(gain.data() + i * Four::nlanes);
    sum = sum + cv::v_rotate_left<1>(sum);
    sum = sum + cv::v_rotate_left<2>(sum) + before;
    before = cv::v_broadcast_element<3>(sum);
    least = cv::v_min(least, sum);
    cost[i] = sum;
  }
  const Four most = cv::v_setall_f32(cv::v_reduce_min(least) + kTie);
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < kFours; ++i) {
    bits |= static_cast<std::uint32_t>(cv::v_signmask(cost[i] < most)) << (i * Four::nlanes);
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
PixelGains weigh(const SideLines::Params& params, const RawImage& picture, const RowPlane& own, const RowPlane& other,
                 std::int32_t first, std::int32_t out, const Raws& raw) noexcept {
  PixelGains gains;
  static_assert(kReach_px % Wide::nlanes == 0);
  const auto all = [](float x) { return cv::vx_setall_f32(x); };
  static constexpr Reach kSteps = [] {
    Reach steps{};
    for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = static_cast<float>(i);
    return steps;
  }();
  const Wide most = all(static_cast<float>(math::square(params.truncate_sigmas)));
  const Wide leave = all(static_cast<float>(math::square(params.leave_sigmas)));
  const Wide more = all(other.valid ? other.wider_than(own) : 0.0F);
  const Wide unit_m = all(static_cast<float>(picture.intrinsics.depth_unit_m));
  const Wide least = all(static_cast<float>(picture.range.min)), largest = all(static_cast<float>(picture.range.max));
  for (std::int32_t i = 0; i < kReach_px; i += Wide::nlanes) {
    const Wide depth = cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::vx_load_expand(raw.data() + i)));
    const Wide column = all(static_cast<float>(first)) + all(static_cast<float>(out)) * cv::vx_load(kSteps.data() + i);
    const Wide r = own.residual(column, depth * unit_m);
    Wide beyond = leave;
    if (other.valid) {
      const Wide o = other.residual(column, depth * unit_m);
      beyond = cv::v_min(o * o + more, most);
    }
    const Wide measured = (depth >= least) & (depth <= largest);
    cv::v_store(gains.gain.data() + i, (cv::v_min(r * r, most) - beyond) & measured);
    gains.measured |= static_cast<std::uint32_t>(cv::v_signmask(measured)) << i;
    gains.before |= static_cast<std::uint32_t>(cv::v_signmask(r)) << i;
  }
  return gains;
}

}  // namespace

void SideLines::begin(const Params& params, const DepthNoiseModel& noise, const RawImage& raw,
                      const FrameImage& picture, const Regions& regions) noexcept {
  params_ = params;
  noise_ = noise;
  raw_ = &raw;
  picture_ = &picture;
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

void SideLines::look(RegionId id, bool right, RowView& view) const noexcept {
  const CameraIntrinsics& k = raw_->intrinsics;
  const Regions& regions = *regions_;
  const std::int32_t row = view.row, column = view.column, out = right ? 1 : -1;
  const std::int32_t border = kColumn_px * column + (right ? kColumn_px - 1 : 0);  // the outermost column's last pixel
  const std::int32_t first = border - out * (kInside_px - 1);
  view.first = first;
  view.out = out;
  // The picture's last columns hide what comes after them.
  view.ending = Ending::kHidden;
  if (border + 2 * out < 0 || border + 2 * out >= k.width_px) return;
  view.ending = Ending::kNone;
  if (first < 0 || first >= k.width_px) return;
  const RowRays rays{-k.cx_px * pitch_, pitch_,
                     static_cast<double>(picture_->column_rays.y[static_cast<std::size_t>(row)])};
  view.own.set(regions[id].plane, noise_, rays, border);
  if (!view.own.valid) return;
  // The plane beyond, if there is one.
  RegionId beyond = kNoRegion;
  for (std::int32_t g = column + out; g != column + 3 * out; g += out) {
    if (g < 0 || g >= picture_->column_rays.columns) break;
    const RegionId p = regions.labels.at(g, row);
    if (p != kNoRegion && p != id) beyond = p;
  }
  view.other.valid = false;
  if (beyond != kNoRegion) view.other.set(regions[beyond].plane, noise_, rays, border);
  const std::uint16_t* pixels = raw_->row(row);
  std::int32_t count = std::min(kReach_px, right ? k.width_px - first : first + 1);
  if (picture_->body_rows[static_cast<std::size_t>(row / 2)]) {
    const std::uint8_t* flags = picture_->flags.row(row / 2);
    std::int32_t free = 0;
    while (free < count && (flags[(first + out * free) / 2] & kPixelBody) == 0) ++free;
    count = free;
  }
  if (count == kReach_px) {
    using Eight = cv::v_uint16x8;
    static_assert(kReach_px == 2 * Eight::nlanes);
    const std::uint16_t* leftmost = pixels + (right ? first : first - (kReach_px - 1));
    const Eight a = cv::v_load(leftmost), b = cv::v_load(leftmost + Eight::nlanes);
    cv::v_store(view.raw.data(), right ? a : reversed(b));
    cv::v_store(view.raw.data() + Eight::nlanes, right ? b : reversed(a));
  } else {
    view.raw.fill(0);
    for (std::int32_t i = 0; i < count; ++i) view.raw[static_cast<std::size_t>(i)] = pixels[first + out * i];
  }
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
  if (std::abs(of_neither) > kMixed_px) to = from;  // something narrow stands between: the surface ends at it
  end_px = view.first + view.out * (0.5 * (from + to) + 0.5);
  return Ending::kSeen;
}

// The steep line that most of the seen ends lie on: pairs of them propose, least squares of those near by decide.
bool SideLines::try_line(const InversePlane& plane, Line& line) const noexcept {
  const CameraIntrinsics& k = raw_->intrinsics;
  const auto n = static_cast<std::int32_t>(seen_.size());
  if (n < params_.min_rows) return false;
  const Vec3 normal = plane.normal();
  const Vec3 along = (Vec3::UnitX() - normal * normal.x()).normalized(), across = normal.cross(along);
  const double first_row = seen_.front().row, last_row = seen_.back().row;
  const auto upright = [&](const Line& l) {
    const auto point = [&](double row) {
      return plane.point({(l.at + l.slope * row - k.cx_px) / k.fx_px, (row - k.cy_px) / k.fy_px, 1.0});
    };
    const Vec3 direction = point(last_row) - point(first_row);
    return std::abs(along.dot(direction)) <= params_.max_lean * std::abs(across.dot(direction));
  };
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
      if (cost >= best || !upright(candidate)) continue;
      best = cost;
      line = candidate;
    }
  }
  if (best > 1e8) return false;
  for (int round = 0; round < 3; ++round) {
    double count = 0.0, row = 0.0, column = 0.0, row2 = 0.0, both = 0.0;
    for (const RowEnd& e : seen_) {
      if (std::abs(e.column - line.at - line.slope * e.row) > params_.inlier_px) continue;
      count += 1.0, row += e.row, column += e.column, row2 += e.row * e.row, both += e.row * e.column;
    }
    const double spread = count * row2 - row * row;
    if (count < params_.min_rows || !(spread > 0.0)) return false;
    line.slope = (count * both - row * column) / spread;
    line.at = (column - line.slope * row) / count;
  }
  return upright(line);
}

void SideLines::find_ends(RegionId id) noexcept {
  const ColumnExtents& profile = regions_->extents[id];
  using Bytes = cv::v_uint8;
  static_assert(kDepthHeight_px % Bytes::nlanes == 0);
  const std::int32_t from = profile.first_row / Bytes::nlanes * Bytes::nlanes;
  std::uint8_t *left = left_.data() + kPad, *right = right_.data() + kPad;
  std::fill(left + from, left + profile.last_row + 1, kNoColumn);
  std::fill(right + from, right + profile.last_row + 1, kNoColumn);
  const Bytes wanted = cv::vx_setall_u8(id);
  for (std::int32_t g = profile.first_column; g <= profile.last_column; ++g) {
    const ColumnExtent& ends = profile.columns[static_cast<std::size_t>(g)];
    if (ends.empty()) continue;
    const RegionId* labels = regions_->labels.column(g);
    const Bytes here = cv::vx_setall_u8(static_cast<std::uint8_t>(g));
    for (std::int32_t r = ends.top / Bytes::nlanes * Bytes::nlanes; r <= ends.bottom; r += Bytes::nlanes) {
      // From left to right, and no column is more than none.
      const Bytes own = cv::vx_load(labels + r) == wanted;
      cv::v_store(left + r, cv::v_min(cv::vx_load(left + r), here | ~own));
      cv::v_store(right + r, cv::v_select(own, here, cv::vx_load(right + r)));
    }
  }
  for (std::uint8_t* ends : {left, right}) {
    std::fill_n(ends + profile.first_row - kFlatRows / 2, kFlatRows / 2, ends[profile.first_row]);
    std::fill_n(ends + profile.last_row + 1, kFlatRows / 2, ends[profile.last_row]);
  }
}

OutlineSide SideLines::find(RegionId id, bool right) noexcept {
  const Region& plane = (*regions_)[id];
  const ColumnExtents& profile = regions_->extents[id];
  const double out = right ? 1.0 : -1.0;
  const auto outer_edge = [right](std::int32_t g) { return kColumn_px * g + (right ? kColumn_px - 0.5 : -0.5); };
  seen_.clear();
  hidden_.clear();
  const std::uint8_t* ends = (right ? right_ : left_).data() + kPad;
  // Where the surface's end runs off sideways from row to row it is a front or a back, no side: a bit for each row that
  // may end at one.
  using Bytes = cv::v_uint8x16;
  std::array<std::uint32_t, kDepthHeight_px / Bytes::nlanes + 1> upright;
  std::int32_t count = 0;
  const std::int32_t first_row = profile.first_row, last_row = profile.last_row;
  const Bytes flat = cv::v_setall_u8(kFlatColumns), none = cv::v_setall_u8(kNoColumn);
  for (std::int32_t r = first_row, i = 0; r <= last_row; r += Bytes::nlanes, ++i) {
    const Bytes drift = cv::v_absdiff(cv::v_load(ends + r + kFlatRows / 2), cv::v_load(ends + r - kFlatRows / 2));
    const Bytes may = (cv::v_max(drift, flat) == flat) & (cv::v_load(ends + r) != none);
    const std::uint32_t rows = (2U << std::min(last_row - r, Bytes::nlanes - 1)) - 1U;
    upright[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(cv::v_signmask(may)) & rows;
    count += std::popcount(upright[static_cast<std::size_t>(i)]);
  }
  const std::int32_t most = plane.kind == SurfaceKind::kTread ? kMaxRows : kOtherRows;
  const std::int32_t stride = (count + most - 1) / most;
  // Rows are asked for, then looked at, then decided on: each step takes its time, and none waits for another row's.
  std::array<RowView, kMaxRows> views;
  std::size_t row_count = 0;
  std::int32_t above = 0;  // such rows above r0
  for (std::int32_t i = stride / 2, r0 = first_row; i < count; i += stride) {
    const auto bits = [&] { return upright[static_cast<std::size_t>((r0 - first_row) / Bytes::nlanes)]; };
    for (; above + std::popcount(bits()) <= i; r0 += Bytes::nlanes) above += std::popcount(bits());
    std::uint32_t from_it = bits();
    for (std::int32_t before = above; before < i; ++before) from_it &= from_it - 1U;
    const std::int32_t r = r0 + std::countr_zero(from_it);
    views[row_count].row = r;
    views[row_count++].column = ends[r];
    __builtin_prefetch(raw_->row(r) + kColumn_px * ends[r]);
  }
  for (std::size_t i = 0; i < row_count; ++i) look(id, right, views[i]);
  double outermost = -1e9;
  for (std::size_t i = 0; i < row_count; ++i) {
    double column = 0.0;
    const Ending ending = end_of_row(views[i], column);
    if (ending == Ending::kNone) continue;
    if (ending == Ending::kHidden) column = outer_edge(views[i].column);
    static_cast<void>(
        (ending == Ending::kSeen ? seen_ : hidden_).try_push_back({static_cast<double>(views[i].row), column}));
    outermost = std::max(outermost, out * column);
  }
  // Half-resolution pixel i is where full-resolution 2 i + 0.5 is.
  OutlineSide side;
  if (outermost < -1e8) {  // no row but flat ones
    for (std::int32_t r = first_row; r <= last_row; ++r) {
      const std::uint8_t g = ends[r];
      if (g != kNoColumn) outermost = std::max(outermost, out * outer_edge(g));
    }
  }
  side.column_px = 0.5 * (out * outermost - 0.5);
  Line line;
  if (!try_line(plane.plane, line)) return side;
  std::int32_t on = 0, between = 0;
  double first = 1e9, last = -1e9;
  const auto beyond = [&](double row, double column) { return out * (column - line.at - line.slope * row); };
  for (const RowEnd& e : seen_) {
    if (std::abs(beyond(e.row, e.column)) > params_.inlier_px) continue;
    ++on;
    first = std::min(first, e.row);
    last = std::max(last, e.row);
  }
  for (const auto* all : {&seen_, &hidden_}) {
    for (const RowEnd& e : *all) between += e.row >= first && e.row <= last ? 1 : 0;
  }
  double cut_px = 0.0;
  const std::int32_t step = 1 + (last_row - first_row) / kManyRows;
  for (std::int32_t r = first_row; r <= last_row; r += step) {
    const std::uint8_t g = ends[r];
    if (g != kNoColumn) cut_px += step * std::max(beyond(r, outer_edge(g)) - params_.outside_px, 0.0);
  }
  if (on < params_.min_rows || on < params_.min_share * between) return side;
  if (cut_px > params_.max_cut * plane.area_px) return side;
  side.fitted = true;
  side.column_px = 0.5 * (line.at + 0.5 * line.slope - 0.5);
  side.slope = line.slope;
  side.top_px = 0.5 * (first - 1.0);
  side.bottom_px = 0.5 * last;
  return side;
}

}  // namespace polygmap
