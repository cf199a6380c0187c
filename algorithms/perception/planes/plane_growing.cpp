// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/plane_growing.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace polygmap {
namespace {

struct Middle {
  double y = 0.0;  // ray
  double w = 0.0;  // 1/m
};
Middle middle_of(const ColumnRays& rays, const ScanlineSegment& segment) noexcept {
  const double top = static_cast<double>(rays.y[static_cast<std::size_t>(segment.top)]);
  const double bottom = static_cast<double>(rays.y[static_cast<std::size_t>(segment.bottom)]);
  return {0.5 * (top + bottom),
          static_cast<double>(segment.inverse_depth) + 0.5 * (segment.rows() - 1) * static_cast<double>(segment.slope)};
}

}  // namespace

void PlaneGrowing::Sums::add(double ray_x, const ColumnRays& rays, const ScanlineSegment& segment) noexcept {
  const Middle middle = middle_of(rays, segment);
  const double rows = segment.rows(), pixels = rows * kColumn_px;
  const double pitch = static_cast<double>(rays.y[1] - rays.y[0]);
  const double variance = (rows * rows - 1.0) / 12.0 * pitch * pitch;
  const double slope = static_cast<double>(segment.slope) / pitch;
  m.one += pixels;
  m.x1 += pixels * ray_x;
  m.y1 += pixels * middle.y;
  m.xx += pixels * ray_x * ray_x;
  m.xy += pixels * ray_x * middle.y;
  m.yy += pixels * (middle.y * middle.y + variance);
  m.w1 += pixels * middle.w;
  m.xw += pixels * ray_x * middle.w;
  m.yw += pixels * (middle.y * middle.w + variance * slope);
  ww += pixels * (middle.w * middle.w + variance * slope * slope);
}

// About the mean, and without a prior: what grows has no covariance yet.
bool PlaneGrowing::Sums::try_solve(Vec3& plane) const noexcept {
  const double n = m.one, mx = m.x1 / n, my = m.y1 / n, mw = m.w1 / n;
  const double cxx = m.xx / n - mx * mx, cxy = m.xy / n - mx * my, cyy = m.yy / n - my * my;
  const double cxw = m.xw / n - mx * mw, cyw = m.yw / n - my * mw;
  const double determinant = cxx * cyy - cxy * cxy;
  if (!(determinant > 1e-14)) return false;
  const double a = (cxw * cyy - cyw * cxy) / determinant, b = (cyw * cxx - cxw * cxy) / determinant;
  const Vec3 solved{a, b, mw - a * mx - b * my};
  if (!(solved.squaredNorm() > kLeastInverseDepth * kLeastInverseDepth)) return false;
  plane = solved;
  return true;
}

double PlaneGrowing::Sums::mean_square(const Vec3& p) const noexcept {
  const double sum = ww - 2.0 * (p.x() * m.xw + p.y() * m.yw + p.z() * m.w1) + p.x() * p.x() * m.xx +
                     p.y() * p.y() * m.yy + p.z() * p.z() * m.one +
                     2.0 * (p.x() * p.y() * m.xy + p.x() * p.z() * m.x1 + p.y() * p.z() * m.y1);
  return std::max(sum / m.one, 0.0);
}

void PlaneGrowing::begin(const Params& params, const DepthNoiseModel& noise, const ColumnRays& rays,
                         ScanlineSegmentation::Columns& segments) noexcept {
  params_ = params;
  noise_ = noise;
  rays_ = &rays;
  segments_ = &segments;
  count_ = 0;
  overflow_ = 0;
  growing_ = false;
  seeds_.next = 0;
  pass_.part = Part::kCount;
  pass_.column = 0;
  pass_.start.fill(0);
}

// A column of clutter has dozens of segments, of which a neighbour overlaps one or two. Segments that end above a row
// are counted, not looked for.
void PlaneGrowing::count_column(std::int32_t column) noexcept {
  static_assert(ScanlineSegmentation::kMaxSegmentsPerColumn <= std::numeric_limits<std::uint8_t>::max());
  constexpr std::size_t kWord = sizeof(std::uint64_t);
  auto& out = first_near_[static_cast<std::size_t>(column)];
  std::array<std::uint8_t, (kDepthHeight_px / kIndexRows + 1 + kWord - 1) / kWord * kWord> first{};  // whole words
  for (const ScanlineSegment& segment : (*segments_)[static_cast<std::size_t>(column)]) {
    ++first[static_cast<std::size_t>(segment.bottom / kIndexRows + 1)];
    if (segment.rows() >= params_.min_rows) {
      ++pass_.start[static_cast<std::size_t>(kDepthHeight_px - segment.rows() + 1)];
    }
  }
  // Eight sums at once (the first byte is the lowest): a product with ones adds every byte to those after it, of which
  // none carries over.
  constexpr std::uint64_t kOnes = 0x0101'0101'0101'0101U;
  std::uint64_t before = 0;
  for (std::size_t i = 0; i < first.size(); i += kWord) {
    std::uint64_t sums = 0;
    std::memcpy(&sums, &first[i], kWord);
    sums = (sums + before) * kOnes;
    std::memcpy(&first[i], &sums, kWord);
    before = sums >> 56U;
  }
  std::copy_n(first.begin(), out.size(), out.begin());
}

// By length, longest first; equal lengths in the order of the image.
void PlaneGrowing::begin_sorting() noexcept {
  work_.add(pass_.start.size(), 5);
  for (std::size_t i = 1; i < pass_.start.size(); ++i)
    pass_.start[i] = static_cast<std::uint16_t>(pass_.start[i] + pass_.start[i - 1]);
  seeds_.size = pass_.start.back();
}
void PlaneGrowing::sort_seeds(std::int32_t column) noexcept {
  const ScanlineSegmentation::Column& segments = (*segments_)[static_cast<std::size_t>(column)];
  for (std::size_t k = 0; k < segments.size(); ++k) {
    if (segments[k].rows() < params_.min_rows) continue;
    seeds_.places[pass_.start[static_cast<std::size_t>(kDepthHeight_px - segments[k].rows())]++] = {
        static_cast<std::int16_t>(column), static_cast<std::int16_t>(k)};
  }
}
void PlaneGrowing::clear_tried(std::int32_t column) noexcept {
  for (ScanlineSegment& segment : (*segments_)[static_cast<std::size_t>(column)]) {
    segment.plane = segment.plane == kTried ? std::uint8_t{0} : segment.plane;
  }
}

bool PlaneGrowing::prepare_some() noexcept {
  const std::int32_t last = std::min(pass_.column + kColumnsAtOnce, rays_->columns);
  for (; pass_.column < last; ++pass_.column) {
    const std::size_t segments = (*segments_)[static_cast<std::size_t>(pass_.column)].size();
    switch (pass_.part) {
      case Part::kCount:
        work_.add(120 + 30 * static_cast<std::int32_t>(segments));
        count_column(pass_.column);
        break;
      case Part::kSort:
        work_.add(30 + 25 * static_cast<std::int32_t>(segments));
        sort_seeds(pass_.column);
        break;
      case Part::kGrow:
        break;
      case Part::kClear:
        work_.add(20 + 9 * static_cast<std::int32_t>(segments));
        clear_tried(pass_.column);
        break;
    }
  }
  return pass_.column == rays_->columns;
}

// The segment in the next column that shares most rows with this one, at least half of what both cover.
bool PlaneGrowing::try_neighbour(Place from, std::int32_t side, Place& best) noexcept {
  const std::int32_t g = from.column + side;
  if (g < 0 || g >= rays_->columns) return false;
  const ScanlineSegment& segment = at(from);
  const ScanlineSegmentation::Column& column = (*segments_)[static_cast<std::size_t>(g)];
  std::int32_t most = 0;
  for (std::size_t k = first_near(g, segment.top); k < column.size() && column[k].top <= segment.bottom; ++k) {
    work_.add(34);
    const ScanlineSegment& other = column[k];
    const std::int32_t shared = std::min(segment.bottom, other.bottom) - std::max(segment.top, other.top) + 1;
    const std::int32_t covered = std::max(segment.bottom, other.bottom) - std::min(segment.top, other.top) + 1;
    // Clutter has no habits that a branch could learn.
    const int free = static_cast<int>(other.plane == 0) | static_cast<int>(other.plane == kTried);
    if ((free & static_cast<int>(2 * shared > covered) & static_cast<int>(shared > most)) == 0) continue;
    most = shared;
    best = {static_cast<std::int16_t>(g), static_cast<std::int16_t>(k)};
  }
  return most > 0;
}

bool PlaneGrowing::try_seed(Place place) noexcept {
  work_.add(38);
  if (at(place).plane != 0) return false;
  work_.add(150);
  // Three segments beside one another: most seeds have no such neighbours.
  Place left, right;
  if (!try_neighbour(place, -1, left) || !try_neighbour(place, 1, right)) return false;
  work_.add(560);
  Sums sums;
  for (const Place& p : {place, left, right}) {
    sums.add(static_cast<double>(rays_->x[static_cast<std::size_t>(p.column)]), *rays_, at(p));
  }
  Vec3 m;
  if (!sums.try_solve(m)) return false;
  const double w = sums.m.w1 / sums.m.one;
  if (sums.mean_square(m) > math::square(tolerance_w(w)) * m.squaredNorm()) return false;
  m_ = m;
  norm2_ = m.squaredNorm();
  sums_ = Sums{};
  // The first fit waits until the plane itself has more than the seed had.
  next_fit_px_ = params_.refit_growth * sums.m.one;
  queue_.size = queue_.next = 0;
  first_column_ = last_column_ = place.column;
  growing_ = true;
  consider(place);
  if (queue_.size == 0) growing_ = false;
  return growing_;
}

void PlaneGrowing::consider(Place place) noexcept {
  ScanlineSegment& segment = at(place);
  if (segment.plane != 0) return work_.add(22);
  // Mean square distance of the segment's line from the plane.
  const double ray_x = static_cast<double>(rays_->x[static_cast<std::size_t>(place.column)]);
  const double pitch = static_cast<double>(rays_->y[1] - rays_->y[0]);
  const Middle middle = middle_of(*rays_, segment);
  const double offset = middle.w - (m_.x() * ray_x + m_.y() * middle.y + m_.z());
  const double tilt = static_cast<double>(segment.slope) - m_.y() * pitch;
  const double rows = segment.rows();
  const double off2 = offset * offset + tilt * tilt * (rows * rows - 1.0) * (1.0 / 12.0);
  if (!(middle.w > kLeastInverseDepth) || off2 > math::square(tolerance_w(middle.w)) * norm2_) {
    return work_.add(127);
  }
  work_.add(267);
  segment.plane = static_cast<std::uint8_t>(count_ + 1);
  sums_.add(ray_x, *rays_, segment);
  queue_.places[queue_.size++] = place;
  first_column_ = std::min<std::int32_t>(first_column_, place.column);
  last_column_ = std::max<std::int32_t>(last_column_, place.column);
  if (sums_.m.one > next_fit_px_ && sums_.try_solve(m_)) {
    work_.add(80);
    norm2_ = m_.squaredNorm();
    next_fit_px_ = params_.refit_growth * sums_.m.one;
  }
}

void PlaneGrowing::visit(Place place) noexcept {
  work_.add(100);
  const ScanlineSegment segment = at(place);
  for (const std::int32_t side : {-1, 1}) {
    const std::int32_t g = place.column + side;
    if (g < 0 || g >= rays_->columns) continue;
    const ScanlineSegmentation::Column& column = (*segments_)[static_cast<std::size_t>(g)];
    for (std::size_t k = first_near(g, segment.top); k < column.size() && column[k].top <= segment.bottom; ++k) {
      if (column[k].bottom < segment.top) continue;
      consider({static_cast<std::int16_t>(g), static_cast<std::int16_t>(k)});
    }
  }
  const auto column_size = static_cast<std::int16_t>((*segments_)[static_cast<std::size_t>(place.column)].size());
  if (place.index > 0) consider({place.column, static_cast<std::int16_t>(place.index - 1)});
  if (place.index + 1 < column_size) consider({place.column, static_cast<std::int16_t>(place.index + 1)});
}

void PlaneGrowing::close() noexcept {
  growing_ = false;
  work_.add(150);
  const bool kept = sums_.m.one >= params_.min_facet_px && last_column_ - first_column_ + 1 >= params_.min_columns &&
                    count_ < kMaxPlanes && sums_.try_solve(m_) && m_.dot(sums_.m.mean_ray()) > kLeastInverseDepth;
  if (!kept) {
    overflow_ += count_ == kMaxPlanes ? 1U : 0U;
    work_.add(queue_.size, 13);
    for (std::size_t i = 0; i < queue_.size; ++i) at(queue_.places[i]).plane = i == 0 ? kTried : std::uint8_t{0};
    return;
  }
  GrownPlane& plane = planes_[++count_];
  plane.plane.m = m_;
  plane.moments = sums_.m;
}

void PlaneGrowing::grow_some() noexcept {
  constexpr std::int32_t kPieceInstructions = 4000;
  const std::int32_t enough = work_.instructions() + kPieceInstructions;
  while (work_.instructions() < enough) {
    if (growing_) {
      if (queue_.next < queue_.size) {
        visit(queue_.places[queue_.next++]);
      } else {
        close();
      }
    } else if (seeds_.next < seeds_.size) {
      static_cast<void>(try_seed(seeds_.places[seeds_.next++]));
    } else {
      pass_.part = Part::kClear;
      pass_.column = 0;
      return;
    }
  }
}

bool PlaneGrowing::step() noexcept {
  if (pass_.part == Part::kGrow) {
    grow_some();
    return false;
  }
  if (!prepare_some()) return false;
  pass_.column = 0;
  switch (pass_.part) {
    case Part::kCount:
      begin_sorting();
      pass_.part = Part::kSort;
      return false;
    case Part::kSort:
      pass_.part = Part::kGrow;
      return false;
    case Part::kGrow:
    case Part::kClear:
      break;
  }
  return true;
}

}  // namespace polygmap
