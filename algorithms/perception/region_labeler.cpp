// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/region_labeler.hpp"

#include <algorithm>

#include "algorithms/perception/regions/inlier_ratio.hpp"

namespace polygmap {

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
  components_.begin_find();
  part_ = Part::kLinks;
}

void RegionLabeler::clear() noexcept {
  regions_.count = 0;
  regions_.labels.by_column.fill(kNoRegion);
}

Progress RegionLabeler::step(WorkBudget& budget) noexcept {
  while (part_ != Part::kDone && !budget.exhausted()) {
    do_piece();
    work_.add(components_.work());
    work_.add(150);
    budget.spend(work_.take_units());
  }
  return part_ == Part::kDone ? Progress::kDone : Progress::kBusy;
}

template <typename Visit>
void RegionLabeler::each_column(Part next, const Visit& visit) noexcept {
  constexpr std::int32_t kColumnsAtOnce = 4;
  const std::int32_t count = image_->column_rays.columns;
  for (const std::int32_t end = std::min(column_ + kColumnsAtOnce, count); column_ < end; ++column_) visit();
  if (column_ < count) return;
  column_ = 0;
  part_ = next;
}

void RegionLabeler::do_piece() noexcept {
  switch (part_) {
    case Part::kLinks:
      return each_column(Part::kNumbers, [this] { components_.link(boundaries_->columns(), column_); });
    case Part::kNumbers:
      if (components_.number_some()) part_ = Part::kComponents;
      return;
    case Part::kComponents:
      each_column(Part::kJoin, [this] { components_.measure(boundaries_->columns(), column_); });
      if (part_ == Part::kJoin) components_.begin_join(params_.components, *boundaries_, *image_, *planes_, regions_);
      return;
    case Part::kJoin:
      return join();
    case Part::kLabels:
      return each_column(Part::kInliers, [this] { label_column(); });
    case Part::kInliers:
      return check_inliers();
    case Part::kDone:
      return;
  }
}

void RegionLabeler::join() noexcept {
  if (!components_.join_some()) return;
  region_overflow_ += components_.region_overflow();
  for (RegionId id = 1; id <= regions_.count; ++id) {
    if (!regions_[id].alive) continue;
    work_.add(60);
    regions_.extents[id] = ColumnExtents{};
  }
  part_ = Part::kLabels;
}

void RegionLabeler::label_column() noexcept {
  RegionId* labels = regions_.labels.column(column_);
  work_.add(240);
  std::fill(labels, labels + kDepthHeight_px, kNoRegion);
  for (const ColumnSpan& span : boundaries_->columns()[static_cast<std::size_t>(column_)]) {
    work_.add(88);
    const RegionId region = span.component == 0 ? kNoRegion : components_.region_of(span.component);
    if (region == kNoRegion) continue;
    std::fill(labels + span.top, labels + span.bottom + 1, region);
    regions_.extents[region].add(column_, span.top, span.bottom);
  }
}

void RegionLabeler::check_inliers() noexcept {
  work_.add(350);
  if (checked_ == regions_.count) {
    work_.add(900);  // and what comes after, begins
    part_ = Part::kDone;
    return;
  }
  Region& region = regions_[++checked_];
  if (!region.alive || region.area_px > params_.inlier_check_px) return;
  const ColumnExtents& extents = regions_.extents[checked_];
  work_.add(500 + 12 * std::max(extents.last_column - extents.first_column, 0));
  work_.add(kInlierSamples_px, 45);
  const double ratio = inlier_ratio(*image_, *raw_, noise_, regions_, checked_, params_.inlier_sigmas);
  if (ratio < params_.min_inlier_ratio) region.alive = false;
}

}  // namespace polygmap
