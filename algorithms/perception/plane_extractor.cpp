// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/plane_extractor.hpp"

#include <algorithm>
#include <utility>

namespace polygmap {
namespace {

// In instructions.
constexpr std::int32_t kSolve = 1150;     // with and without a lean
constexpr std::int32_t kTakePlane = 110;  // a plane that comes from another stage
constexpr std::int32_t kDrop = 60;

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
  while (part_ != Part::kDone && !budget.exhausted()) {
    do_piece();
    budget.spend(take_units());
  }
  return part_ == Part::kDone ? Progress::kDone : Progress::kBusy;
}

std::int32_t PlaneExtractor::take_units() noexcept {
  for (WorkCount* part :
       {&growing_.work(), &boundaries_.work(), &merging_.work(), &overhangs_.work(), &search_.work()}) {
    work_.add(*part);
  }
  work_.add(150);
  return work_.take_units();
}

void PlaneExtractor::do_piece() noexcept {
  switch (part_) {
    case Part::kGrowing:
      return grow();
    case Part::kMergingGrown:
      return merge_grown();
    case Part::kSharpening:
      return sharpen();
    case Part::kSolvingSharpened:
      return solve_sharpened();
    case Part::kMergingSharpened:
      return merge_sharpened();
    case Part::kFacets:
      return join_facets();
    case Part::kOverhangs:
      return split_overhangs();
    case Part::kResidual:
      return search_residual();
    case Part::kMeasuring:
      return measure();
    case Part::kSolvingMeasured:
      return solve_measured();
    case Part::kPlacing:
      if (boundaries_.reproject_some()) part_ = Part::kDone;
      return;
    case Part::kDone:
      return;
  }
}

void PlaneExtractor::begin_fit(const SpanFit::Pass& pass) noexcept {
  const bool any_new = part_ == Part::kResidual;
  fit_.begin(pass, *segments_, to_plane_, any_new ? first_new_ : PlaneId{1}, any_new ? planes_.count : kNoPlane,
             image_->column_rays.columns, boundaries_);
}

void PlaneExtractor::grow() noexcept {
  if (!growing_.step()) return;
  take_grown_planes();
  merging_.begin_coplanar(params_.merging, params_.growing, noise_, planes_, false);
  part_ = Part::kMergingGrown;
}

void PlaneExtractor::merge_grown() noexcept {
  if (!merge_coplanar(false)) return;
  for (PlaneId i = 1; i <= planes_.count; ++i) boundaries_.set_plane(i, planes_[i].plane);
  work_.add(planes_.count, 30);
  begin_fit(SpanFit::kSharpening);
  part_ = Part::kSharpening;
}

void PlaneExtractor::sharpen() noexcept {
  fit_.step();
  if (!fit_.done()) return;
  // While planes are rough, what they do not explain says little.
  least_share_ = {0.0, 0.0};
  next_ = 0;
  part_ = Part::kSolvingSharpened;
}

void PlaneExtractor::solve_sharpened() noexcept {
  if (!solve_some()) return;
  merging_.begin_coplanar(params_.merging, params_.growing, noise_, planes_, true);
  part_ = Part::kMergingSharpened;
}

void PlaneExtractor::merge_sharpened() noexcept {
  if (!merge_coplanar(true)) return;
  merging_.begin_facets(params_.merging, params_.growing, noise_, planes_);
  next_ = 0;
  part_ = Part::kFacets;
}

void PlaneExtractor::join_facets() noexcept {
  const SpanBoundaries::Columns& columns = boundaries_.columns();
  const std::int32_t count = image_->column_rays.columns;
  if (next_ < count) {
    constexpr std::int32_t kColumnsAtOnce = 8;
    for (const std::int32_t end = std::min(next_ + kColumnsAtOnce, count); next_ < end;) {
      const auto g = static_cast<std::size_t>(next_++);
      merging_.add_column(columns[g], next_ < count ? &columns[g + 1] : nullptr, to_plane_);
    }
    return;
  }
  if (!merging_.join_some(planes_, to_plane_)) return;
  take_joined_planes();
  overhangs_.begin(params_.overhangs, up_, planes_);
  first_new_ = static_cast<PlaneId>(planes_.count + 1);
  next_ = 0;
  part_ = overhangs_.any() ? Part::kOverhangs : Part::kResidual;
}

void PlaneExtractor::split_overhangs() noexcept {
  overhangs_.add_column(*image_, next_, boundaries_.columns()[static_cast<std::size_t>(next_)], to_plane_);
  if (++next_ < image_->column_rays.columns) return;
  take_split_planes();
  next_ = 0;
  part_ = Part::kResidual;
}

void PlaneExtractor::search_residual() noexcept {
  if (next_ == 0) begin_search();
  constexpr std::int32_t kColumnsAtOnce = 2;
  const std::int32_t count = image_->column_rays.columns;
  for (const std::int32_t end = std::min(next_ + kColumnsAtOnce, count); next_ < end; ++next_) {
    search_.add_column(image_->column_rays, image_->columns, next_,
                       boundaries_.columns()[static_cast<std::size_t>(next_)]);
  }
  if (next_ < count) return;
  take_found_planes();
  begin_fit(SpanFit::kMeasuring);
  part_ = Part::kMeasuring;
}

void PlaneExtractor::measure() noexcept {
  fit_.step();
  if (!fit_.done()) return;
  const double share = explained_share();
  work_.add(planes_.count, 16);
  least_share_ = {params_.min_explained * share, params_.min_explained_curved * share};
  next_ = 0;
  part_ = Part::kSolvingMeasured;
}

void PlaneExtractor::solve_measured() noexcept {
  if (!solve_some()) return;
  boundaries_.begin_reprojecting();
  part_ = Part::kPlacing;
}

void PlaneExtractor::take_grown_planes() noexcept {
  boundaries_.begin(params_.boundaries, noise_, image_->column_rays, intrinsics_.fy_px, intrinsics_.cy_px,
                    image_->columns);
  plane_overflow_ += growing_.overflow();
  to_plane_.fill(kNoPlane);
  planes_.count = static_cast<PlaneId>(std::min(growing_.count(), PlaneSet::kMaxPlanes));
  work_.add(2500 + planes_.count * kTakePlane);
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
bool PlaneExtractor::merge_coplanar(bool measured) noexcept {
  if (!merging_.merge_some(planes_, to_plane_)) return false;
  work_.add(planes_.count, 8);
  for (PlaneId i = 1; i <= planes_.count; ++i) {
    FittedPlane& p = planes_[i];
    if (!std::exchange(p.merged, false) || !p.alive) continue;
    work_.add(measured ? kSolve : kTakePlane);
    // Pixels of grown segments all weigh 1, which says nothing of how well they know the plane.
    if (measured) static_cast<void>(try_solve_leaning(params_.fit, noise_, p.moments, up_, p.plane, &p.covariance));
    p.kind = kind_of(p.plane);
    p.centre_m = p.plane.point(p.moments.mean_ray());
    boundaries_.set_plane(i, p.plane);
  }
  return true;
}

void PlaneExtractor::take_joined_planes() noexcept {
  work_.add(planes_.count, 60);
  for (PlaneId i = 1; i <= planes_.count; ++i) {
    FittedPlane& p = planes_[i];
    if (p.alive && p.facet) drop(i);
    if (!p.alive || p.facets == 1) continue;
    work_.add(kTakePlane);
    if (p.low_parts) {
      work_.add(kSolve);
      static_cast<void>(try_solve_leaning(params_.fit, noise_, p.moments, up_, p.plane, &p.covariance));
    }
    p.kind = kind_of(p.plane);
    boundaries_.set_plane(i, p.plane);
  }
}

void PlaneExtractor::begin_search() noexcept {
  work_.add(900 + planes_.count * 45);
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
    work_.add(12);
    if (!p.alive || !overhangs_.try_split(i, halves)) continue;
    work_.add(2 * kTakePlane);
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
  work_.add(search_.found().size(), kTakePlane);
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

bool PlaneExtractor::solve_some() noexcept {
  constexpr std::int32_t kPieceInstructions = 4000;
  const std::int32_t enough = work_.instructions() + kPieceInstructions;
  while (next_ < planes_.count && work_.instructions() < enough) {
    work_.add(12);
    if (planes_[static_cast<std::size_t>(++next_)].alive) solve(static_cast<PlaneId>(next_));
  }
  return next_ == planes_.count;
}

void PlaneExtractor::solve(PlaneId plane) noexcept {
  FittedPlane& p = planes_[plane];
  const SpanBoundaries::Plane& fitted = boundaries_.plane(plane);
  p.moments = fitted.moments;
  p.residual2 = fitted.residual2;
  work_.add(kTakePlane);
  if (p.moments.count < params_.min_fitted_px ||
      p.moments.count < least_share_[p.facets > 1 ? 1 : 0] * fitted.seen_px) {
    return drop(plane);
  }
  work_.add(kSolve);
  if (!try_solve_leaning(params_.fit, noise_, p.moments, up_, p.plane, &p.covariance)) return drop(plane);
  p.kind = kind_of(p.plane);
  p.pixels = p.moments.count;
  p.centre_m = p.plane.point(p.moments.mean_ray());
  boundaries_.set_plane(plane, p.plane);
  boundaries_.set_covariance(plane, p.kind != SurfaceKind::kOther ? p.covariance : Mat3{Mat3::Zero()});
}

void PlaneExtractor::drop(PlaneId plane) noexcept {
  work_.add(kDrop);
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
