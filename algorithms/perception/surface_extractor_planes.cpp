// SPDX-License-Identifier: Apache-2.0
// The planes of a frame, from those that grew to their last fit: merged, joined, found in the remainder, solved.
#include <algorithm>

#include "algorithms/perception/surface_extractor.hpp"

namespace polygmap {
namespace {

SurfaceKind kind_of(const InversePlane& plane, const Vec3& up, double tilt_rad) noexcept {
  const double c = plane.normal().dot(up);
  if (c > math::cos(tilt_rad)) return SurfaceKind::kTread;
  if (std::abs(c) < math::sin(tilt_rad)) return SurfaceKind::kRiser;
  return SurfaceKind::kOther;
}

}  // namespace

void SurfaceExtractor::take_grown_planes() noexcept {
  boundaries_.begin(params_.boundaries, noise_, picture_.column_rays, view_.intrinsics.fy_px, view_.intrinsics.cy_px,
                    picture_.columns);
  counters_.plane_overflow += growing_.overflow();
  to_plane_.fill(0);
  planes_.count = std::min(growing_.count(), PlaneSet::kMaxPlanes);
  for (std::size_t i = 1; i <= planes_.count; ++i) {
    const GrownPlane& grown = growing_.plane(i);
    FramePlane& p = planes_[i];
    p = FramePlane{};
    p.plane = grown.plane;
    p.kind = kind_of(grown.plane, view_.camera_up, params_.kind_tilt_rad);
    p.pixels = grown.pixels;
    p.alive = true;
    p.facet = grown.pixels < params_.growing.min_plane_px;
    p.centre_m = grown.plane.point(grown.mean_ray);
    to_plane_[i] = static_cast<std::uint8_t>(i);
  }
  merge_planes(false);
  for (std::size_t i = 1; i <= planes_.count; ++i) boundaries_.set_plane(i, planes_[i].plane);
}

void SurfaceExtractor::merge_planes(bool measured) noexcept {
  PlaneMerging::merge_pieces(params_.merging, params_.growing, noise_, planes_, to_plane_, measured);
}

void SurfaceExtractor::drop(std::size_t plane) noexcept {
  planes_[plane].alive = false;
  for (std::uint8_t& p : to_plane_) p = p == plane ? std::uint8_t{0} : p;
}

std::int32_t SurfaceExtractor::facet_step() noexcept {
  const SpanBoundaries::Columns& columns = boundaries_.columns();
  if (row_ < picture_.column_rays.columns) {
    const auto g = static_cast<std::size_t>(row_++);
    merging_.add_column(columns[g], row_ < picture_.column_rays.columns ? &columns[g + 1] : nullptr, to_plane_);
    return 1;
  }
  if (!merging_.join_some(planes_, to_plane_)) return 4;
  counters_.run_overflow += merging_.overflow();
  for (std::size_t i = 1; i <= planes_.count; ++i) {
    FramePlane& p = planes_[i];
    if (p.alive && p.facet) drop(i);
    if (!p.alive || p.facets == 1) continue;
    if (p.low_parts) {
      static_cast<void>(try_solve_leaning(params_.planes, noise_, p.moments, view_.camera_up, p.plane, &p.covariance));
    }
    p.kind = kind_of(p.plane, view_.camera_up, params_.kind_tilt_rad);
    boundaries_.set_plane(i, p.plane);
  }
  overhangs_.begin(params_.overhangs, view_.camera_up, planes_);
  first_found_ = planes_.count + 1;
  enter(overhangs_.any() ? Phase::kSplit : Phase::kSearch);
  return 4;
}

std::int32_t SurfaceExtractor::split_step() noexcept {
  overhangs_.add_column(picture_, row_, boundaries_.columns()[static_cast<std::size_t>(row_)], to_plane_);
  if (++row_ < picture_.column_rays.columns) return 1;
  split_overhangs();
  enter(Phase::kSearch);
  return 4;
}

// The larger half keeps the plane and what is left of its runs when their ends are trimmed; the other claims the rest.
void SurfaceExtractor::split_overhangs() noexcept {
  counters_.run_overflow += overhangs_.overflow();
  for (std::size_t i = 1; i < first_found_; ++i) {
    FramePlane& p = planes_[i];
    OverhangSplit::Halves halves;
    if (!p.alive || !overhangs_.try_split(i, halves)) continue;
    p.plane = halves.larger;
    p.kind = SurfaceKind::kRiser;
    p.pixels -= halves.smaller_px;
    boundaries_.set_plane(i, p.plane);
    add_plane(halves.smaller);
  }
}

void SurfaceExtractor::add_plane(const InversePlane& plane) noexcept {
  if (planes_.count == PlaneSet::kMaxPlanes) {
    ++counters_.plane_overflow;
    return;
  }
  FramePlane& p = planes_[++planes_.count];
  p = FramePlane{};
  p.plane = plane;
  p.kind = kind_of(plane, view_.camera_up, params_.kind_tilt_rad);
  p.alive = true;
  boundaries_.set_plane(planes_.count, plane);
}

void SurfaceExtractor::begin_search() noexcept {
  search_.begin(params_.remainder, view_.camera_up);
  for (std::size_t i = 1; i <= planes_.count; ++i) {
    const FramePlane& p = planes_[i];
    if (!p.alive && p.facet && to_plane_[i] == 0 && p.kind != SurfaceKind::kOther) search_.give_back(i);
    if (!p.alive) continue;
    if (p.kind == SurfaceKind::kTread) search_.know_level(p.plane);
    if (p.kind == SurfaceKind::kRiser) search_.know_upright(p.plane, p.pixels);
  }
}

void SurfaceExtractor::take_found_planes() noexcept {
  search_.finish();
  for (const InversePlane& found : search_.found()) add_plane(found);
}

void SurfaceExtractor::solve_planes() noexcept {
  constexpr double kLeast_px = 64.0;
  double explained_px = 0.0, seen_px = 0.0;
  for (std::size_t i = 1; i <= planes_.count; ++i) {
    if (!planes_[i].alive) continue;
    explained_px += boundaries_.plane(i).moments.count;
    seen_px += boundaries_.plane(i).seen_px;
  }
  // While planes are rough, what they do not explain says little.
  const double all_share = round_ == 1 ? explained_px / std::max(seen_px, 1.0) : 0.0;
  const double least_share = params_.min_explained * all_share, least_curved = params_.min_explained_curved * all_share;
  for (std::size_t i = 1; i <= planes_.count; ++i) {
    FramePlane& p = planes_[i];
    if (!p.alive) continue;
    const SpanBoundaries::Plane& fitted = boundaries_.plane(i);
    p.moments = fitted.moments;
    p.residual2 = fitted.residual2;
    const double least = p.facets > 1 ? least_curved : least_share;
    if (p.moments.count < kLeast_px || p.moments.count < least * fitted.seen_px ||
        !try_solve_leaning(params_.planes, noise_, p.moments, view_.camera_up, p.plane, &p.covariance)) {
      drop(i);
      continue;
    }
    p.kind = kind_of(p.plane, view_.camera_up, params_.kind_tilt_rad);
    p.pixels = p.moments.count;
    p.centre_m = p.plane.point(p.moments.mean_ray());
    boundaries_.set_plane(i, p.plane);
    boundaries_.set_covariance(i, p.kind != SurfaceKind::kOther ? p.covariance : Mat3{Mat3::Zero()});
  }
}

}  // namespace polygmap
