// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/map/ground_map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace polygmap {
namespace {

constexpr int kClosings = 4;

[[nodiscard]] double middle_of_cell_m(std::int32_t cell) noexcept { return (cell + 0.5) * GroundView::kCell_m; }
[[nodiscard]] std::int32_t mm_of(double m) noexcept {
  return static_cast<std::int32_t>(std::floor(1e3 * math::clamp(m, -30.0, 30.0) + 0.5));
}

// Adds one to 64 counts, where the bit is set.
void count_up(std::uint64_t bits, std::uint64_t& ones, std::uint64_t& twos, std::uint64_t& fours,
              std::uint64_t& eights) noexcept {
  const std::uint64_t from_ones = ones & bits, from_twos = twos & from_ones;
  ones ^= bits;
  twos ^= from_ones;
  eights |= fours & from_twos;
  fours ^= from_twos;
}

}  // namespace

void GroundMap::each_cell_under(std::size_t foot, double grown_m, auto&& visit) const noexcept {
  const PlanFrame& plan = soles_[foot];
  const double reach_m = std::max(view_.sole.toe_x_m, -view_.sole.heel_x_m) + view_.sole.half_width_m + grown_m;
  const Vec2& p_m = plan.origin_m();
  for (std::int32_t y = GroundView::cell_of(p_m.y() - reach_m); y <= GroundView::cell_of(p_m.y() + reach_m); ++y) {
    for (std::int32_t x = GroundView::cell_of(p_m.x() - reach_m); x <= GroundView::cell_of(p_m.x() + reach_m); ++x) {
      const Vec2 in_sole_m = plan({middle_of_cell_m(x), middle_of_cell_m(y)});
      if (in_sole_m.x() > view_.sole.toe_x_m + grown_m || in_sole_m.x() < view_.sole.heel_x_m - grown_m) continue;
      if (std::abs(in_sole_m.y()) <= view_.sole.half_width_m + grown_m) visit(x, y);
    }
  }
}

void GroundMap::stand_on(std::size_t foot, double grown_m, std::int32_t count) noexcept {
  const auto sole_mm = static_cast<std::int16_t>(mm_of(view_.map_T_sole[foot].p_m.z()));
  work_.add(grown_m > 0.0 ? 30000 : 6000);
  each_cell_under(foot, grown_m, [&](std::int32_t x, std::int32_t y) {
    at(x, y) = {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), sole_mm, static_cast<std::uint8_t>(count)};
  });
}

void GroundMap::begin(const View& view) noexcept {
  view_ = view;
  work_.add(500);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) soles_[foot] = PlanFrame(view.map_T_sole[foot]);
  double lowest_m = std::min(view.map_T_sole[0].p_m.z(), view.map_T_sole[1].p_m.z());
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    if (view.stands[foot] && !view.stands[1 - foot]) lowest_m = view.map_T_sole[foot].p_m.z();
  }
  height_mm_ = mm_of(lowest_m);
  const Vec2 middle_m = 0.5 * (view_.map_T_sole[0].p_m + view_.map_T_sole[1].p_m).head<2>();
  first_x_ = GroundView::cell_of(middle_m.x()) - GroundView::kSide_cells / 2;
  first_y_ = GroundView::cell_of(middle_m.y()) - GroundView::kSide_cells / 2;
  const bool begins = !std::exchange(has_begun_, true);
  own_.fill(0);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    if (begins) stand_on(foot, params_.start_m, params_.sightings);
    each_cell_under(foot, params_.own_m, [&](std::int32_t x, std::int32_t y) { set(own_, x, y); });
    work_.add(7000);
  }
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    if (view.stands[foot]) stand_on(foot, 0.0, kMostCount);
  }
  row_ = kColumn_px + static_cast<std::int32_t>(view.number * 13U % kRowStep);
}

// Beside the robot's own legs, and where a picture has no depth, some of a column's pixels are of something else.
bool GroundMap::is_at_a_gap(std::int32_t column) const noexcept {
  constexpr std::uint8_t kMost_px = 6, kSome_px = 2;  // of a column's eight
  const auto& valid = view_.columns->valid;
  return valid(column, row_) < kMost_px || valid(column - 1, row_) < kSome_px || valid(column + 1, row_) < kSome_px ||
         valid(column, row_ - kColumn_px) < kSome_px || valid(column, row_ + kColumn_px) < kSome_px;
}

bool GroundMap::look() noexcept {
  const CameraIntrinsics& c = view_.intrinsics;
  work_.add(100);
  if (view_.columns == nullptr || row_ + kColumn_px >= c.height_px) {
    row_ = 0;
    return true;
  }
  const std::int32_t columns = c.width_px / kColumn_px;
  const auto first = 1 + static_cast<std::int32_t>(view_.number / 2 % kColumnStep);
  const Mat3& R = view_.map_T_camera.R;
  const Vec3 row_ray = R.col(1) * ((row_ - c.cy_px) / c.fy_px) + R.col(2);
  const float nearest = 1.0F / static_cast<float>(params_.range_m);
  const float* inverse_depths = view_.columns->inverse_depth.row(row_);
  for (std::int32_t g = first; g + 1 < columns; g += kColumnStep) {
    work_.add(20);
    const float inverse_depth = inverse_depths[g];
    if (!(inverse_depth > nearest) || is_at_a_gap(g)) continue;
    work_.add(105);
    const double x = (kColumn_px * g + 0.5 * (kColumn_px - 1) - c.cx_px) / c.fx_px;
    see(view_.map_T_camera.p_m + (row_ray + x * R.col(0)) / static_cast<double>(inverse_depth));
  }
  row_ += kRowStep;
  return false;
}

void GroundMap::see(const Vec3& map_p_m) noexcept {
  const std::int32_t x = GroundView::cell_of(map_p_m.x()), y = GroundView::cell_of(map_p_m.y());
  if (std::abs(x) > 30'000 || std::abs(y) > 30'000) return;
  // A foot is where the legs say within some centimetres, and so is the shin above it.
  if (GroundView::has(own_, x - first_x_, y - first_y_)) return;
  const std::int32_t seen_mm = mm_of(map_p_m.z());
  if (seen_mm < height_mm_ - mm_of(params_.tall_m)) look_through(map_p_m);
  Cell& cell = at(x, y);
  if (!knows(cell, x, y)) {
    cell = {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), static_cast<std::int16_t>(seen_mm), 1};
    return;
  }
  const std::int32_t higher_mm = seen_mm - cell.height_mm;
  if (std::abs(higher_mm) <= mm_of(params_.level_m)) {
    cell.height_mm = static_cast<std::int16_t>(cell.height_mm + higher_mm / (cell.count + 1));
    cell.count = std::min<std::uint8_t>(static_cast<std::uint8_t>(cell.count + 1), kMostCount);
    return;
  }
  // What is higher hides what was seen beneath it, from elsewhere: the floor under open stairs.
  if (cell.count > 1) {
    cell.count = static_cast<std::uint8_t>(higher_mm > 0 ? cell.count / 2 : cell.count - 1);
  } else {
    cell.height_mm = static_cast<std::int16_t>(seen_mm);
  }
}

// What is lower is seen through where level ground would be: behind an edge nothing else shows that there is none.
void GroundMap::look_through(const Vec3& map_p_m) noexcept {
  const Vec3& eye_m = view_.map_T_camera.p_m;
  const double share = (eye_m.z() - 1e-3 * height_mm_) / (eye_m.z() - map_p_m.z());
  if (!(share > 0.0)) return;
  work_.add(60);
  const Vec2 through_m = (eye_m + share * (map_p_m - eye_m)).head<2>();
  const std::int32_t x = GroundView::cell_of(through_m.x()), y = GroundView::cell_of(through_m.y());
  Cell& cell = at(x, y);
  const bool is_level = knows(cell, x, y) && std::abs(cell.height_mm - height_mm_) <= mm_of(params_.level_m);
  if (is_level && !GroundView::has(own_, x - first_x_, y - first_y_)) --cell.count;
}

bool GroundMap::tell(GroundView& out) noexcept {
  if (row_ < GroundView::kSide_cells) {
    out.corner_m = Vec2{first_x_, first_y_} * GroundView::kCell_m;
    out.height_m = 1e-3 * height_mm_;
    out.steepest = 0.0;
    tell_row(out);
    ++row_;
    return false;
  }
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    if (!view_.stands[foot] || std::abs(mm_of(view_.map_T_sole[foot].p_m.z()) - height_mm_) > mm_of(params_.level_m))
      continue;
    work_.add(7000);
    each_cell_under(foot, params_.beside_m, [&](std::int32_t x, std::int32_t y) {
      const bool is_other =
          GroundView::has(higher_, x - first_x_, y - first_y_) || GroundView::has(lower_, x - first_x_, y - first_y_);
      if (!is_other) set(out.level, x, y);
    });
  }
  for (int pass = 0; pass < kClosings; ++pass) close(out.level, pass + 1 == kClosings);
  return true;
}

void GroundMap::leave_out(const Transform& map_T_local, const ConvexPolygon& local, GroundView& out) noexcept {
  constexpr double kFar_m = 1e3, kStorey_m = 0.15;  // what begins farther above or below lies on another storey
  const auto corner = [&](std::size_t i) -> Vec3 {
    const Vec2& p_m = local[i % local.size()];
    return map_T_local * Vec3{p_m.x(), p_m.y(), 0.0} - Vec3{out.corner_m.x(), out.corner_m.y(), out.height_m};
  };
  double lowest_m = kFar_m, highest_m = -kFar_m;
  for (std::size_t i = 0; i < local.size(); ++i) {
    lowest_m = std::min(lowest_m, corner(i).z());
    highest_m = std::max(highest_m, corner(i).z());
  }
  const Vec3 up = map_T_local.R.col(2);
  const Vec2 slope = -up.head<2>() / up.z();
  const double rise = slope.norm();
  work_.add(local.size(), 30);
  if (lowest_m > kStorey_m || highest_m < -kStorey_m) return;
  // Near a crease pictures tell it from the ground before it late: it begins where the planes meet.
  constexpr double kMostBefore_m = 0.4;
  const double off_m = std::max(lowest_m, 0.0) + std::min(highest_m, 0.0);
  const Vec2 before_m =
      rise > 0.0 ? Vec2{-math::clamp(off_m / rise, -kMostBefore_m, kMostBefore_m) / rise * slope} : Vec2::Zero();
  std::array<double, GroundView::kSide_cells> first_m{}, last_m{};  // of a row's middle line
  first_m.fill(kFar_m);
  last_m.fill(-kFar_m);
  work_.add(2 * GroundView::kSide_cells, 30);
  const auto take_edge = [&](const Vec2& a_m, const Vec2& b_m) {
    const double low_m = std::min(a_m.y(), b_m.y()), high_m = std::max(a_m.y(), b_m.y());
    const std::int32_t last = std::min(GroundView::cell_of(high_m), GroundView::kSide_cells - 1);
    work_.add(100);
    for (std::int32_t y = std::max(GroundView::cell_of(low_m), 0); y <= last; ++y) {
      const double at_m = middle_of_cell_m(y);
      if (at_m < low_m || at_m > high_m || !(high_m > low_m)) continue;
      const double x_m = a_m.x() + (b_m.x() - a_m.x()) * (at_m - a_m.y()) / (b_m.y() - a_m.y());
      const auto row = static_cast<std::size_t>(y);
      first_m[row] = std::min(first_m[row], x_m);
      last_m[row] = std::max(last_m[row], x_m);
      work_.add(20);
    }
  };
  for (std::size_t i = 0; i < local.size(); ++i) {
    const Vec2 a_m = corner(i).head<2>(), b_m = corner(i + 1).head<2>();
    take_edge(a_m, b_m);
    take_edge(a_m + before_m, b_m + before_m);
    take_edge(a_m, a_m + before_m);
  }
  constexpr std::int32_t kAbout = 2;        // squares: where the planes meet is known so well
  constexpr double kLongestTread_m = 0.60;  // treads may be built askew
  const bool is_ramp = highest_m - lowest_m > kLongestTread_m * rise;
  for (std::int32_t y = 0; y < GroundView::kSide_cells; ++y) {
    const auto from = static_cast<std::size_t>(y);
    if (first_m[from] > last_m[from]) continue;
    const std::uint64_t bits =
        GroundView::bits_of(GroundView::cell_of(first_m[from]) - kAbout, GroundView::cell_of(last_m[from]) + kAbout);
    if (is_ramp && bits != 0) out.steepest = std::max(out.steepest, rise);
    const std::int32_t last = std::min(y + kAbout, GroundView::kSide_cells - 1);
    for (std::int32_t row = std::max(y - kAbout, 0); row <= last; ++row) {
      out.level[static_cast<std::size_t>(row)] &= ~bits;
      if (is_ramp) out.ramps[static_cast<std::size_t>(row)] |= bits;
    }
  }
}

void GroundMap::set(GroundView::Rows& rows, std::int32_t x, std::int32_t y) const noexcept {
  const std::int32_t column = x - first_x_, row = y - first_y_;
  if (column < 0 || row < 0 || column >= GroundView::kSide_cells || row >= GroundView::kSide_cells) return;
  rows[static_cast<std::size_t>(row)] |= std::uint64_t{1} << static_cast<std::uint32_t>(column);
}

void GroundMap::tell_row(GroundView& out) noexcept {
  std::uint64_t level = 0, tall = 0, lower = 0, higher = 0;
  work_.add(GroundView::kSide_cells, 12);
  for (std::int32_t i = 0; i < GroundView::kSide_cells; ++i) {
    const Cell& cell = at(first_x_ + i, first_y_ + row_);
    if (!knows(cell, first_x_ + i, first_y_ + row_) || cell.count < params_.sightings) continue;
    const std::int32_t above_mm = cell.height_mm - height_mm_;
    const std::uint64_t bit = std::uint64_t{1} << static_cast<std::uint32_t>(i);
    (std::abs(above_mm) <= mm_of(params_.level_m) ? level : above_mm < 0 ? lower : higher) |= bit;
    if (above_mm > mm_of(params_.tall_m)) tall |= bit;
  }
  const auto row = static_cast<std::size_t>(row_);
  out.level[row] = level;
  out.tall[row] = tall;
  out.ramps[row] = 0;
  lower_[row] = lower;
  higher_[row] = higher;
}

// A square that no picture has shown yet is level where five or more of the eight about it are: pictures are looked at
// in some of their pixels, and what lies before a foot that turned is hidden by the leg. Again and again that fills
// what is up to three squares wide, and nothing wider. A sole bridges one or two squares that are lower: as these were
// seen through open stairs.
void GroundMap::close(GroundView::Rows& level, bool bridges) noexcept {
  work_.add(GroundView::kSide_cells, 60);
  std::uint64_t above = 0;
  for (std::size_t row = 0; row < level.size(); ++row) {
    const std::uint64_t here = level[row], below = row + 1 < level.size() ? level[row + 1] : 0;
    std::uint64_t ones = 0, twos = 0, fours = 0, eights = 0;
    for (const std::uint64_t line : {above, below}) {
      for (const std::uint64_t neighbours : {line, line << 1U, line >> 1U})
        count_up(neighbours, ones, twos, fours, eights);
    }
    for (const std::uint64_t neighbours : {here << 1U, here >> 1U}) count_up(neighbours, ones, twos, fours, eights);
    above = here;
    const std::uint64_t many = eights | (fours & (twos | ones)), most = eights | (fours & twos & ones);
    level[row] |= ((many & ~lower_[row]) | (bridges ? most : 0)) & ~higher_[row];
  }
}

}  // namespace polygmap
