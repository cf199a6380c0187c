// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/pixel_cover.hpp"

#include <algorithm>
#include <cmath>

namespace polygmap {
namespace {

constexpr std::int32_t kColumnStride = 4, kRowStride = 12;  // 800 pixels of a whole picture
constexpr std::int32_t kGridColumns = kColumns / kColumnStride, kGridRows = kDepthHeight_px / kRowStride;

// In half-resolution pixels: of a column of eight pixels, and of a full-resolution row.
double middle_px(std::int32_t column) noexcept { return 0.5 * kColumn_px * column + 0.25 * kColumn_px - 0.5; }
double half_row(std::int32_t row) noexcept { return 0.5 * row - 0.25; }

}  // namespace

Vec3 PixelCover::ray_of(std::int32_t column, std::int32_t row) const noexcept {
  return {static_cast<double>(picture_.column_rays.x[static_cast<std::size_t>(column)]),
          static_cast<double>(picture_.column_rays.y[static_cast<std::size_t>(row)]), 1.0};
}

PixelCover::Owner PixelCover::owner_of(std::int32_t column, std::int32_t row) const noexcept {
  const RegionId owner = regions_.labels.at(column, row);
  if (owner != kNoRegion) {
    if (regions_[owner].coplanar == regions_[id_].coplanar) return Owner::kOwn;
    return regions_[owner].alive ? Owner::kForeign : Owner::kNobody;
  }
  const auto w = static_cast<double>(picture_.columns.inverse_depth(column, row));
  const double expected = regions_[id_].plane.inverse_depth(ray_of(column, row));
  return w > 0.0 && expected - w > apart_m_ * expected * w ? Owner::kForeign : Owner::kNobody;
}

template <typename Visit>
void PixelCover::for_each_pixel(const Outline2& polygon, const Visit& visit) const noexcept {
  const std::size_t n = polygon.size();
  double left = 1e9, right = -1e9;
  for (const Vec2& p : polygon) left = std::min(left, p.x()), right = std::max(right, p.x());
  std::int32_t columns = 0, pixels = 0;
  for (std::int32_t g = kColumnStride / 2; g < picture_.column_rays.columns; g += kColumnStride) {
    const double x = middle_px(g);
    if (x < left || x > right) continue;
    ++columns;
    double top = 1e9, bottom = -1e9;  // where two edges of the convex polygon cross the column
    for (std::size_t i = 0; i < n; ++i) {
      const Vec2 &a = polygon[i], &b = polygon[i + 1 < n ? i + 1 : 0];
      if ((a.x() <= x) == (b.x() <= x)) continue;
      const double y = a.y() + (x - a.x()) / (b.x() - a.x()) * (b.y() - a.y());
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
    const double last = std::min(2.0 * bottom + 0.5, picture_.column_rays.height_px - 1.0);
    const double first = std::max(2.0 * top + 0.5, 0.0) / kRowStride;
    if (!(first * kRowStride <= last)) continue;
    const auto last_row = static_cast<std::int32_t>(last);
    for (auto r = kRowStride * static_cast<std::int32_t>(std::ceil(first)); r <= last_row; r += kRowStride) {
      ++pixels;
      const Owner owner = owner_of(g, r);
      if (owner != Owner::kNobody) visit(g, r, owner == Owner::kOwn);
    }
  }
  const auto corners = static_cast<std::int32_t>(n);
  work_.add(40 + 4 * corners + picture_.column_rays.columns / kColumnStride * 8 + columns * (45 + 13 * corners));
  work_.add(pixels, 58);
}

PixelCover::Count PixelCover::count(const Outline2& polygon) const noexcept {
  Count count;
  for_each_pixel(polygon, [&](std::int32_t, std::int32_t, bool own) { ++(own ? count.own : count.foreign); });
  return count;
}

PixelCover::Sides PixelCover::own_by_side(const Outline2& polygon, const Vec3& line) const noexcept {
  Sides sides;
  for_each_pixel(polygon, [&](std::int32_t g, std::int32_t r, bool own) {
    if (own) ++(line.dot(ray_of(g, r)) > 0.0 ? sides.positive : sides.negative);
  });
  return sides;
}

std::int32_t PixelCover::worth_beyond(const Outline2& polygon, const Vec3& line) const noexcept {
  const std::int32_t foreign_worth = -params_.foreign_cost;
  std::int32_t worth = 0;
  for_each_pixel(polygon, [&](std::int32_t g, std::int32_t r, bool own) {
    if (line.dot(ray_of(g, r)) > 0.0) worth += own ? 1 : foreign_worth;
  });
  return worth;
}

void PixelCover::begin_cut(const Outline2& polygon, Cut& cut) const noexcept {
  cut = Cut{};
  work_.add(1500);
  // What a pixel is worth: its own are to be kept, the others to be cut off.
  std::array<std::int32_t, kGridColumns> by_column{};
  std::array<std::int32_t, kGridRows + 1> by_row{};
  const std::int32_t foreign_worth = -params_.foreign_cost;
  std::int32_t& total = cut.total;
  for_each_pixel(polygon, [&](std::int32_t g, std::int32_t r, bool own) {
    const std::int32_t worth = own ? 1 : foreign_worth;
    by_column[static_cast<std::size_t>(g / kColumnStride)] += worth;
    by_row[static_cast<std::size_t>(r / kRowStride)] += worth;
    total += worth;
    if (!own) ++cut.votes[regions_.labels.at(g, r)];
  });
  cut.votes[kNoRegion] = 0;
  std::int32_t& best = cut.best = total;
  Vec3& line = cut.line;
  // Columns from .. on the right, or up to the one before on the left; the same for rows.
  const auto scan = [&](const auto& sums, const auto& line_before) {
    std::int32_t before = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      if (before > best) best = before, line = -line_before(static_cast<std::int32_t>(i));
      if (total - before > best) best = total - before, line = line_before(static_cast<std::int32_t>(i));
      before += sums[i];
    }
  };
  const HalfRays& rays = picture_.rays;
  scan(by_column, [&](std::int32_t i) {
    const double x = middle_px(kColumnStride * i + kColumnStride / 2) - 0.25 * kColumnStride * kColumn_px;
    return Vec3{1.0, 0.0, -(x - rays.cx_px) / rays.fx_px};
  });
  scan(by_row, [&](std::int32_t i) {
    return Vec3{0.0, 1.0, -(half_row(kRowStride * i) - 0.25 * kRowStride - rays.cy_px) / rays.fy_px};
  });
}

bool PixelCover::try_neighbour(const Outline2& polygon, Cut& cut) const noexcept {
  work_.add(cut.votes.size(), 4);
  const auto most = std::max_element(cut.votes.begin(), cut.votes.end());
  if (*most == 0 || cut.tried == params_.neighbours) return false;
  ++cut.tried;
  *most = 0;
  const Vec3 meeting = regions_[id_].plane.m - regions_[static_cast<std::size_t>(most - cut.votes.begin())].plane.m;
  const std::int32_t positive = worth_beyond(polygon, meeting);
  if (positive > cut.best) cut.best = positive, cut.line = meeting;
  if (cut.total - positive > cut.best) cut.best = cut.total - positive, cut.line = -meeting;
  return true;
}

}  // namespace polygmap
