// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/plane_extractor.hpp"

#include <algorithm>
#include <utility>

#include "algorithms/perception/image/work_units.hpp"

namespace polygmap {
namespace {

constexpr std::int32_t kGrowUnits = 1;  // PlaneGrowing bounds its pieces by a row's work
// A join looks at eight seams, or at all of them once: as many columns' work.
constexpr std::int32_t kJoinUnits = 4 * kColumnUnits;

}  // namespace

void PlaneExtractor::begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics,
                           const Vec3& up, const FrameImage& image, ScanlineSegmentation::Columns& segments) noexcept {
  params_ = params;
  noise_ = noise;
  intrinsics_ = intrinsics;
  up_ = up;
  image_ = &image;
  segments_ = &segments;
  planes_.count = 0;
  plane_overflow_ = 0;
  growing_.begin(params_.growing, noise_, image.column_rays, segments);
  part_ = Part::kGrowing;
}

Progress PlaneExtractor::step(WorkBudget& budget) noexcept {
  while (part_ != Part::kDone && !budget.exhausted()) budget.spend(do_piece());
  return part_ == Part::kDone ? Progress::kDone : Progress::kBusy;
}

std::int32_t PlaneExtractor::do_piece() noexcept {
  switch (part_) {
    case Part::kGrowing:
      return grow();
    case Part::kSharpening:
      return sharpen();
    case Part::kFacets:
      return join_facets();
    case Part::kOverhangs:
      return split_overhangs();
    case Part::kResidual:
      return search_residual();
    case Part::kMeasuring:
      return measure();
    case Part::kDone:
      break;
  }
  return 0;
}

std::int32_t PlaneExtractor::grow() noexcept {
  if (!growing_.step()) return kGrowUnits;
  take_grown_planes();
  merge_coplanar(false);
  for (PlaneId i = 1; i <= planes_.count; ++i) boundaries_.set_plane(i, planes_[i].plane);
  fit_.begin(SpanFit::kSharpening, *segments_, to_plane_, 1, kNoPlane, image_->column_rays.columns, boundaries_);
  part_ = Part::kSharpening;
  return kMaxPieceUnits;
}

std::int32_t PlaneExtractor::sharpen() noexcept {
  const std::int32_t units = fit_.step();
  if (!fit_.done()) return units;
  // While planes are rough, what they do not explain says little.
  solve(0.0, 0.0);
  merge_coplanar(true);
  merging_.begin_facets(params_.merging, params_.growing, noise_, planes_);
  column_ = 0;
  part_ = Part::kFacets;
  return kMaxPieceUnits;
}

std::int32_t PlaneExtractor::join_facets() noexcept {
  const SpanBoundaries::Columns& columns = boundaries_.columns();
  const std::int32_t count = image_->column_rays.columns;
  if (column_ < count) {
    const auto g = static_cast<std::size_t>(column_++);
    merging_.add_column(columns[g], column_ < count ? &columns[g + 1] : nullptr, to_plane_);
    return kColumnUnits;
  }
  if (merging_.join_some(planes_, to_plane_)) {
    take_joined_planes();
    overhangs_.begin(params_.overhangs, up_, planes_);
    first_new_ = static_cast<PlaneId>(planes_.count + 1);
    column_ = 0;
    part_ = overhangs_.any() ? Part::kOverhangs : Part::kResidual;
  }
  return kJoinUnits;
}

std::int32_t PlaneExtractor::split_overhangs() noexcept {
  overhangs_.add_column(*image_, column_, boundaries_.columns()[static_cast<std::size_t>(column_)], to_plane_);
  if (++column_ < image_->column_rays.columns) return kColumnUnits;
  take_split_planes();
  column_ = 0;
  part_ = Part::kResidual;
  return kJoinUnits;
}

std::int32_t PlaneExtractor::search_residual() noexcept {
  if (column_ == 0) begin_search();
  search_.add_column(image_->column_rays, image_->columns, column_,
                     boundaries_.columns()[static_cast<std::size_t>(column_)]);
  if (++column_ < image_->column_rays.columns) return kColumnUnits;
  take_found_planes();
  fit_.begin(SpanFit::kMeasuring, *segments_, to_plane_, first_new_, planes_.count, image_->column_rays.columns,
             boundaries_);
  part_ = Part::kMeasuring;
  return kMaxPieceUnits;
}

std::int32_t PlaneExtractor::measure() noexcept {
  const std::int32_t units = fit_.step();
  if (!fit_.done()) return units;
  const double share = explained_share();
  solve(params_.min_explained * share, params_.min_explained_curved * share);
  boundaries_.reproject();
  part_ = Part::kDone;
  return kMaxPieceUnits;
}

void PlaneExtractor::take_grown_planes() noexcept {
  boundaries_.begin(params_.boundaries, noise_, image_->column_rays, intrinsics_.fy_px, intrinsics_.cy_px,
                    image_->columns);
  plane_overflow_ += growing_.overflow();
  to_plane_.fill(kNoPlane);
  planes_.count = static_cast<PlaneId>(std::min(growing_.count(), PlaneSet::kMaxPlanes));
  for (PlaneId i = 1; i <= planes_.count; ++i) {
    const GrownPlane& grown = growing_.plane(i);
    FittedPlane& p = planes_[i];
    p = FittedPlane{};
    p.plane = grown.plane;
    p.kind = kind_of(grown.plane);
    p.moments = grown.moments;
    p.pixels = grown.moments.one;
    p.alive = true;
    p.facet = p.pixels < params_.growing.min_plane_px;
    p.centre_m = grown.plane.point(grown.moments.mean_ray());
    to_plane_[i] = i;
  }
}

// Two halves of a tread, left and right of the legs, are each known to a centimetre: the plane of one of them would not
// explain the other.
void PlaneExtractor::merge_coplanar(bool measured) noexcept {
  PlaneMerging::merge_coplanar(params_.merging, params_.growing, noise_, planes_, to_plane_, measured);
  for (PlaneId i = 1; i <= planes_.count; ++i) {
    FittedPlane& p = planes_[i];
    if (!std::exchange(p.merged, false) || !p.alive) continue;
    // Pixels of grown segments all weigh 1, which says nothing of how well they know the plane.
    if (measured) static_cast<void>(try_solve_leaning(params_.fit, noise_, p.moments, up_, p.plane, &p.covariance));
    p.kind = kind_of(p.plane);
    p.centre_m = p.plane.point(p.moments.mean_ray());
    boundaries_.set_plane(i, p.plane);
  }
}

void PlaneExtractor::take_joined_planes() noexcept {
  for (PlaneId i = 1; i <= planes_.count; ++i) {
    FittedPlane& p = planes_[i];
    if (p.alive && p.facet) drop(i);
    if (!p.alive || p.facets == 1) continue;
    if (p.low_parts) {
      static_cast<void>(try_solve_leaning(params_.fit, noise_, p.moments, up_, p.plane, &p.covariance));
    }
    p.kind = kind_of(p.plane);
    boundaries_.set_plane(i, p.plane);
  }
}

void PlaneExtractor::begin_search() noexcept {
  search_.begin(params_.residual, up_);
  for (PlaneId i = 1; i <= planes_.count; ++i) {
    const FittedPlane& p = planes_[i];
    if (!p.alive && p.facet && to_plane_[i] == kNoPlane && p.kind != SurfaceKind::kOther) search_.release(i);
    if (!p.alive) continue;
    if (p.kind == SurfaceKind::kTread) search_.add_known_level(p.plane);
    if (p.kind == SurfaceKind::kRiser) search_.add_known_riser(p.plane, p.pixels);
  }
}

// The larger half keeps the plane and what is left of its spans when their ends are trimmed; the other claims the rest.
void PlaneExtractor::take_split_planes() noexcept {
  for (PlaneId i = 1; i < first_new_; ++i) {
    FittedPlane& p = planes_[i];
    OverhangSplit::Halves halves;
    if (!p.alive || !overhangs_.try_split(i, halves)) continue;
    if (planes_.count == PlaneSet::kMaxPlanes) {  // one leaning plane is better than half a riser
      ++plane_overflow_;
      continue;
    }
    p.plane = halves.larger;
    p.kind = SurfaceKind::kRiser;
    p.pixels -= halves.smaller_px;
    boundaries_.set_plane(i, p.plane);
    add_plane(halves.smaller);
  }
}

void PlaneExtractor::take_found_planes() noexcept {
  search_.finish();
  for (const InversePlane& found : search_.found()) add_plane(found);
}

void PlaneExtractor::add_plane(const InversePlane& plane) noexcept {
  if (planes_.count == PlaneSet::kMaxPlanes) {
    ++plane_overflow_;
    return;
  }
  FittedPlane& p = planes_[++planes_.count];
  p = FittedPlane{};
  p.plane = plane;
  p.kind = kind_of(plane);
  p.alive = true;
  boundaries_.set_plane(planes_.count, plane);
}

double PlaneExtractor::explained_share() const noexcept {
  double explained_px = 0.0, seen_px = 0.0;
  for (PlaneId i = 1; i <= planes_.count; ++i) {
    if (!planes_[i].alive) continue;
    explained_px += boundaries_.plane(i).moments.count;
    seen_px += boundaries_.plane(i).seen_px;
  }
  return explained_px / std::max(seen_px, 1.0);
}

void PlaneExtractor::solve(double least_share, double least_share_curved) noexcept {
  for (PlaneId i = 1; i <= planes_.count; ++i) {
    FittedPlane& p = planes_[i];
    if (!p.alive) continue;
    const SpanBoundaries::Plane& fitted = boundaries_.plane(i);
    p.moments = fitted.moments;
    p.residual2 = fitted.residual2;
    const double least = p.facets > 1 ? least_share_curved : least_share;
    if (p.moments.count < params_.min_fitted_px || p.moments.count < least * fitted.seen_px ||
        !try_solve_leaning(params_.fit, noise_, p.moments, up_, p.plane, &p.covariance)) {
      drop(i);
      continue;
    }
    p.kind = kind_of(p.plane);
    p.pixels = p.moments.count;
    p.centre_m = p.plane.point(p.moments.mean_ray());
    boundaries_.set_plane(i, p.plane);
    boundaries_.set_covariance(i, p.kind != SurfaceKind::kOther ? p.covariance : Mat3{Mat3::Zero()});
  }
}

void PlaneExtractor::drop(PlaneId plane) noexcept {
  planes_[plane].alive = false;
  for (PlaneId& p : to_plane_) p = p == plane ? kNoPlane : p;
}

SurfaceKind PlaneExtractor::kind_of(const InversePlane& plane) const noexcept {
  const double c = plane.normal().dot(up_);
  if (c > math::cos(params_.kind_tilt_rad)) return SurfaceKind::kTread;
  if (std::abs(c) < math::sin(params_.kind_tilt_rad)) return SurfaceKind::kRiser;
  return SurfaceKind::kOther;
}

}  // namespace polygmap
