// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/things/thing_finder.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {
namespace {

constexpr double kNearest_m = 0.05;       // nearer to the camera's plane nothing is projected
constexpr double kBeforeNosing_m = 0.01;  // as far before its nosing something still lies on the tread

}  // namespace

void ThingFinder::begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics,
                        const FrameImage& image, const Regions& regions, SurfaceFrame& frame) noexcept {
  params_ = params;
  noise_ = noise;
  intrinsics_ = intrinsics;
  image_ = &image;
  regions_ = &regions;
  frame_ = &frame;
  patch_ = 0;
  begun_ = false;
  knows_surfaces_ = false;
  ++turn_;
}

// Of the picture's regions, those that are too wide for a thing.
void ThingFinder::find_surfaces() noexcept {
  work_.add(200);
  is_surface_[kNoRegion] = false;
  for (std::size_t id = 1; id <= regions_->count; ++id) {
    work_.add(26);
    const Region& region = (*regions_)[id];
    const ColumnExtents& extents = regions_->extents[id];
    const double width_m =
        (extents.last_column - extents.first_column + 1) * (kColumn_px / intrinsics_.fx_px) * region.centre_m.z();
    is_surface_[id] = region.alive && region.kind != SurfaceKind::kOther && width_m > params_.surface_width_m;
  }
}

Progress ThingFinder::step(WorkBudget& budget) noexcept {
  constexpr std::int32_t kColumnsAtOnce = 8;
  while (!budget.exhausted()) {
    work_.add(60);
    if (patch_ >= frame_->surfaces.size()) {
      budget.spend(work_.take_units());
      return Progress::kDone;
    }
    if (!knows_surfaces_) {
      find_surfaces();
      knows_surfaces_ = true;
    } else if (!begun_) {
      work_.add(340);
      begun_ = begin_tread(frame_->surfaces[patch_]);
      const auto odd = static_cast<std::int32_t>(turn_ & 1U);  // every other column, in turn
      column_ = tread_.first_column + ((tread_.first_column & 1) != odd ? 1 : 0);
      if (!begun_) ++patch_;
    } else {
      const std::int32_t end = std::min(column_ + kColumnsAtOnce, tread_.last_column + 1);
      for (; column_ < end; column_ += 2) look_along(column_);
      if (column_ > tread_.last_column) {
        begun_ = false;
        ++patch_;
      }
    }
    budget.spend(work_.take_units());
  }
  return Progress::kBusy;
}

// Where a thing on the tread ends at the latest: at its back edge, or below the next tread's nosing, whichever is
// nearer. False where neither was seen.
bool ThingFinder::find_back(const SurfacePatch& patch, EdgeLine& back) const noexcept {
  constexpr double kNextNosing_m = 0.4;  // above this tread at most
  double nearest_m = std::numeric_limits<double>::infinity();
  const auto add = [&](const EdgeLine& line) {
    const double along_m = tread_.along.dot(0.5 * (line.a_m + line.b_m));
    if (along_m >= nearest_m) return;
    nearest_m = along_m;
    back = line;
  };
  if (patch.back.valid) add(patch.back);
  for (const SurfacePatch& other : frame_->surfaces) {
    if (!other.nosing.valid || &other == &patch) continue;
    const double width_m2 = (other.nosing.b_m - other.nosing.a_m).squaredNorm();
    if (width_m2 < math::square(params_.surface_width_m)) continue;  // the top of a thing
    const double above_m = tread_.plane.distance_m(0.5 * (other.nosing.a_m + other.nosing.b_m));
    if (above_m > params_.least_height_m && above_m < kNextNosing_m) add(other.nosing);
  }
  return std::isfinite(nearest_m);
}

// False where the tread is not one to look over.
bool ThingFinder::begin_tread(const SurfacePatch& patch) noexcept {
  tread_.first_column = 0;
  tread_.last_column = -1;
  if (patch.kind != SurfaceKind::kTread || !patch.nosing.valid || !(patch.d_m > kNearest_m)) return false;
  for (std::size_t i = 0; i < patch_; ++i) {  // its pieces are looked over together
    if (frame_->surfaces[i].plane == patch.plane && frame_->surfaces[i].nosing.valid) return false;
  }
  const Vec3 nosing_m = 0.5 * (patch.nosing.a_m + patch.nosing.b_m);
  if (nosing_m.squaredNorm() > math::square(params_.range_m) || nosing_m.z() < kNearest_m) return false;
  work_.add(600);
  work_.add(frame_->surfaces.size(), 12);
  tread_.own = patch.plane;
  tread_.d_m = patch.d_m;
  tread_.plane.m = -patch.normal / patch.d_m;
  tread_.along = patch.normal.cross(patch.nosing.b_m - patch.nosing.a_m).normalized();
  if (tread_.along.dot(patch.centroid_m - nosing_m) < 0.0) tread_.along = -tread_.along;
  tread_.nosing_m = tread_.along.dot(nosing_m);

  // A depth's error raises a row by its share along the normal.
  const double slant = -patch.normal.dot(patch.centroid_m) / std::max(patch.centroid_m.z(), kNearest_m);
  const double sigma_m = slant * noise_.sigma_m(patch.centroid_m.z()) * math::sqrt(noise_.mean_share(kColumn_px));
  const double height_m = std::max(params_.least_height_m, params_.sigmas * sigma_m);
  if (!(height_m < 0.5 * patch.d_m)) return false;
  tread_.bound = -patch.normal / (patch.d_m - height_m);

  double above_px = 0.0;
  tread_.back.setZero();
  if (EdgeLine back; find_back(patch, back)) {
    Vec3 inward = patch.normal.cross(back.b_m - back.a_m).normalized();
    if (inward.dot(tread_.along) < 0.0) inward = -inward;
    const double limit_m = inward.dot(back.a_m) - params_.before_back_m;
    if (!(limit_m > kNearest_m)) return false;
    tread_.back = inward / limit_m;
    const Vec3 middle_m = 0.5 * (back.a_m + back.b_m);
    const Vec3 foot_m = middle_m - tread_.plane.distance_m(middle_m) * patch.normal;
    const Vec3 top_m = foot_m + params_.seen_height_m * patch.normal;
    if (foot_m.z() > kNearest_m && top_m.z() > kNearest_m) {
      above_px = std::max(0.0, intrinsics_.fy_px * (foot_m.y() / foot_m.z() - top_m.y() / top_m.z()));
    }
  }
  rows_.fill(Rows{});
  tread_.first_column = image_->column_rays.columns;
  for (const SurfacePatch& piece : frame_->surfaces) {
    if (piece.plane == patch.plane) add_rows(piece, above_px);
  }
  fill_columns();
  return tread_.last_column >= tread_.first_column;
}

// What parts a tread's pieces may lie on it: a column between them is looked at from the one's rows to the other's.
void ThingFinder::fill_columns() noexcept {
  work_.add(std::max(tread_.last_column - tread_.first_column + 1, 0), 8);
  std::int32_t seen = -1;  // the last column with rows
  for (std::int32_t g = tread_.first_column; g <= tread_.last_column; ++g) {
    const Rows rows = rows_[static_cast<std::size_t>(g)];
    if (rows.last < rows.first) continue;
    for (std::int32_t between = seen + 1; seen >= 0 && between < g; ++between) {
      const Rows& before = rows_[static_cast<std::size_t>(seen)];
      rows_[static_cast<std::size_t>(between)] = {std::min(before.first, rows.first), std::max(before.last, rows.last)};
    }
    seen = g;
  }
}

// Adds to every column the rows in which the polygon lies, and as many above as a thing at its back would show in.
void ThingFinder::add_rows(const SurfacePatch& piece, double above_px) noexcept {
  const std::int32_t columns = image_->column_rays.columns, height_px = image_->column_rays.height_px;
  const std::size_t n = piece.polygon.size();
  const auto column_of = [&](const Vec3& p) {
    return (p.x() / p.z() * intrinsics_.fx_px + intrinsics_.cx_px - 0.5 * (kColumn_px - 1)) / kColumn_px;
  };
  const auto row_of = [&](const Vec3& p) { return p.y() / p.z() * intrinsics_.fy_px + intrinsics_.cy_px; };
  work_.add(250);
  work_.add(n, 60);
  for (const Vec3& v : piece.polygon) {
    if (v.z() < kNearest_m) return;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 &a = piece.polygon[i], &b = piece.polygon[i + 1 < n ? i + 1 : 0];
    const double from = column_of(a), to = column_of(b), from_px = row_of(a), to_px = row_of(b);
    const double slope = std::abs(to - from) > 1e-9 ? (to_px - from_px) / (to - from) : 0.0;
    const auto first = static_cast<std::int32_t>(std::ceil(math::clamp(std::min(from, to), 0.0, columns + 0.0)));
    const auto last = static_cast<std::int32_t>(std::floor(math::clamp(std::max(from, to), -1.0, columns - 1.0)));
    if (last < first) continue;
    tread_.first_column = std::min(tread_.first_column, first);
    tread_.last_column = std::max(tread_.last_column, last);
    work_.add(last - first + 1, 14);
    for (std::int32_t g = first; g <= last; ++g) {
      const double row = math::clamp(from_px + slope * (g - from), -1.0, height_px + 0.0);
      Rows& rows = rows_[static_cast<std::size_t>(g)];
      rows.first = std::min(rows.first, static_cast<std::int16_t>(std::max(row - above_px, 0.0)));
      rows.last = std::max(rows.last, static_cast<std::int16_t>(std::min(row, height_px - 1.0)));
    }
  }
}

void ThingFinder::look_along(std::int32_t column) noexcept {
  using simd::Four;
  const auto g = static_cast<std::size_t>(column);
  const Rows rows = rows_[g];
  work_.add(130);
  if (rows.last < rows.first) return;
  const ColumnRays& rays = image_->column_rays;
  const float* inverse_depth = image_->columns.by_column.row(column);
  const double x = rays.x[g], y_step = 1.0 / intrinsics_.fy_px;
  const auto at_row = [&](const Vec3& m, std::int32_t row) {
    return static_cast<float>(m.x() * x + m.y() * rays.y[static_cast<std::size_t>(row)] + m.z());
  };
  // Every other four rows, in turn from one of the columns to the next and from one of their frames to the next.
  constexpr std::int32_t kStride = 2 * kRows;
  const auto turn = static_cast<std::int32_t>(((static_cast<std::uint32_t>(column) + turn_) >> 1) & 1U);
  std::int32_t row = rows.first / kStride * kStride + turn * kRows;
  if (row + kRows <= rows.first) row += kStride;
  const auto four_from = [](float first, float step) {
    return Four(first, first + step, first + 2.0F * step, first + 3.0F * step);
  };
  const auto step = [&](const Vec3& m) { return static_cast<float>(m.y() * y_step); };
  Four bound = four_from(at_row(tread_.bound, row), step(tread_.bound));
  Four back = four_from(at_row(tread_.back, row), step(tread_.back));
  const Four bound_step = cv::v_setall_f32(kStride * step(tread_.bound));
  const Four back_step = cv::v_setall_f32(kStride * step(tread_.back));
  const std::int32_t last = std::min<std::int32_t>(rows.last, rays.height_px - kRows);
  Seen seen;
  for (; row <= last; row += kStride) {
    const Four w = cv::v_load(inverse_depth + row);
    const Four before = (w > bound) & (w > back);
    bound = bound + bound_step;
    back = back + back_step;
    if (!cv::v_check_any(before)) continue;
    const std::uint32_t hits = simd::bits(before);
    work_.add(40);
    for (std::int32_t k = 0; k < kRows; ++k) {
      if ((hits >> k & 1U) != 0 && row + k >= rows.first && row + k <= rows.last) take(column, row + k, seen);
    }
  }
  work_.add((last - rows.first) / kStride + 1, 12);
  if (seen.rows < params_.least_rows) return;
  (void)frame_->things.try_push_back({seen.near_p_m, seen.far_p_m, seen.height_m});
}

void ThingFinder::take(std::int32_t column, std::int32_t row, Seen& seen) noexcept {
  work_.add(80);
  const RegionId label = regions_->labels.at(column, row);
  if (is_surface_[label] && (*regions_)[label].coplanar != tread_.own) return;
  const Vec3 ray{image_->column_rays.x[static_cast<std::size_t>(column)],
                 image_->column_rays.y[static_cast<std::size_t>(row)], 1.0};
  const Vec3 p_m = ray / image_->columns.by_column(row, column);
  const double along_m = tread_.along.dot(p_m), height_m = tread_.plane.distance_m(p_m);
  if (along_m < tread_.nosing_m - kBeforeNosing_m || height_m > params_.most_height_m) return;
  const Vec3 below_m = p_m + height_m * tread_.d_m * tread_.plane.m;  // m d is the normal, downwards
  if (seen.rows == 0 || along_m < seen.near_m) {
    seen.near_m = along_m;
    seen.near_p_m = below_m;
  }
  if (seen.rows == 0 || along_m > seen.far_m) {
    seen.far_m = along_m;
    seen.far_p_m = below_m;
  }
  seen.height_m = std::max(seen.height_m, height_m);
  ++seen.rows;
}

}  // namespace polygmap
