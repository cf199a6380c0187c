// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/region_labeler.hpp"

#include <algorithm>

#include "algorithms/perception/image/work_units.hpp"
#include "algorithms/perception/regions/inlier_ratio.hpp"

namespace polygmap {
namespace {

constexpr std::int32_t kSkipUnits = 1;     // of a region that is not looked at
constexpr std::int32_t kInliersUnits = 3;  // kInlierSamples_px single pixels, each in a cache line of its own

}  // namespace

void RegionLabeler::begin(const Params& params, const DepthNoiseModel& noise, const RawImage& raw,
                          const FrameImage& image, const PlaneSet& planes, SpanBoundaries& boundaries) noexcept {
  params_ = params;
  noise_ = noise;
  raw_ = &raw;
  image_ = &image;
  planes_ = &planes;
  boundaries_ = &boundaries;
  column_ = 0;
  checked_ = kNoRegion;
  region_overflow_ = 0;
  part_ = Part::kComponents;
}

void RegionLabeler::clear() noexcept {
  regions_.count = 0;
  regions_.labels.by_column.fill(kNoRegion);
}

Progress RegionLabeler::step(WorkBudget& budget) noexcept {
  while (part_ != Part::kDone && !budget.exhausted()) budget.spend(do_piece());
  return part_ == Part::kDone ? Progress::kDone : Progress::kBusy;
}

std::int32_t RegionLabeler::do_piece() noexcept {
  switch (part_) {
    case Part::kComponents:
      components_.find(boundaries_->columns(), image_->column_rays.columns);
      part_ = Part::kJoin;
      return kMaxPieceUnits;
    case Part::kJoin:
      join();
      part_ = Part::kLabels;
      return kMaxPieceUnits;
    case Part::kLabels:
      label_column();
      if (++column_ == image_->column_rays.columns) part_ = Part::kInliers;
      return kColumnUnits;
    case Part::kInliers:
      return check_inliers();
    case Part::kDone:
      break;
  }
  return 0;
}

void RegionLabeler::join() noexcept {
  region_overflow_ += components_.join(params_.components, *boundaries_, *image_, *planes_, regions_);
  for (RegionId id = 1; id <= regions_.count; ++id) {
    if (regions_[id].alive) regions_.extents[id] = ColumnExtents{};
  }
}

void RegionLabeler::label_column() noexcept {
  RegionId* labels = regions_.labels.column(column_);
  std::fill(labels, labels + kDepthHeight_px, kNoRegion);
  for (const ColumnSpan& span : boundaries_->columns()[static_cast<std::size_t>(column_)]) {
    const RegionId region = span.component == 0 ? kNoRegion : components_.region_of(span.component);
    if (region == kNoRegion) continue;
    std::fill(labels + span.top, labels + span.bottom + 1, region);
    regions_.extents[region].add(column_, span.top, span.bottom);
  }
}

std::int32_t RegionLabeler::check_inliers() noexcept {
  if (checked_ == regions_.count) {
    part_ = Part::kDone;
    return kSkipUnits;
  }
  Region& region = regions_[++checked_];
  if (!region.alive || region.area_px > params_.inlier_check_px) return kSkipUnits;
  const double ratio = inlier_ratio(*image_, *raw_, noise_, regions_, checked_, params_.inlier_sigmas);
  if (ratio < params_.min_inlier_ratio) region.alive = false;
  return kInliersUnits;
}

}  // namespace polygmap
