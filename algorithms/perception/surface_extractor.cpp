// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_extractor.hpp"

#include "algorithms/perception/regions/pixel_labels.hpp"

namespace polygmap {
namespace {

constexpr std::int32_t kMinSide_px = 32;  // a picture of less shows nothing

bool finite(const LegShapes& s) noexcept {
  return math::all_finite(s.thigh.a_m) && math::all_finite(s.thigh.b_m) && std::isfinite(s.thigh.radius_m) &&
         math::all_finite(s.shank.a_m) && math::all_finite(s.shank.b_m) && std::isfinite(s.shank.radius_m) &&
         math::all_finite(s.foot.centre.R) && math::all_finite(s.foot.centre.p_m) && math::all_finite(s.foot.half_m);
}

bool usable(const CameraIntrinsics& k) noexcept {
  const auto positive = [](double x) { return x >= 1.0 && x <= 1e5; };
  return k.width_px >= kMinSide_px && k.width_px <= kDepthWidth_px && k.height_px >= kMinSide_px &&
         k.height_px <= kDepthHeight_px && k.width_px % 2 == 0 && k.height_px % 2 == 0 && positive(k.fx_px) &&
         positive(k.fy_px) && std::abs(k.cx_px) <= 1e5 && std::abs(k.cy_px) <= 1e5 && k.depth_unit_m >= 1e-6 &&
         k.depth_unit_m <= 0.1;
}

}  // namespace

bool SurfaceExtractor::try_begin(const DepthFrameView& frame, const View& view) noexcept {
  if (busy()) {
    ++counters_.busy;
    return false;
  }
  const double up_norm = view.camera_up.norm();
  if (!usable(view.intrinsics) || !(std::abs(up_norm - 1.0) < 0.01) || !(view.body_margin.fixed_m >= 0.0) ||
      !(view.body_margin.fixed_m < 0.5) || !(view.body_margin.turn_rad >= 0.0) || !(view.body_margin.turn_rad < 0.5) ||
      !finite(view.body[0]) || !finite(view.body[1])) {
    ++counters_.bad_view;
    return false;
  }
  if (frame.depth == nullptr || frame.width_px != view.intrinsics.width_px ||
      frame.height_px != view.intrinsics.height_px) {
    ++counters_.bad_frame;
    return false;
  }
  if (any_frame_ && frame.stamp_ns <= last_stamp_ns_) {
    ++counters_.bad_order;
    return false;
  }
  any_frame_ = true;
  last_stamp_ns_ = frame.stamp_ns;
  ++counters_.frames;
  view_ = view;
  view_.camera_up /= up_norm;
  begin_frame(frame);
  return true;
}

void SurfaceExtractor::begin_frame(const DepthFrameView& frame) noexcept {
  noise_ = depth_noise_.of(params_.noise);
  raw_.depth = frame.depth;
  raw_.intrinsics = view_.intrinsics;
  raw_.range.set(params_.limits, view_.intrinsics.depth_unit_m);
  next().stamp_ns = frame.stamp_ns;
  next().sequence = frame.sequence;
  next().surfaces.clear();
  next().things.clear();
  next().dropped = 0;
  units_spent_ = 0;
  segmenter_.begin(params_.segments, noise_, raw_, view_.body, view_.body_margin);
  stage_ = Stage::kSegments;
}

Progress SurfaceExtractor::step(WorkBudget& budget) noexcept {
  if (!busy()) return Progress::kIdle;
  const std::int32_t left = budget.left();
  while (busy() && !budget.exhausted()) run_stage(budget);
  units_spent_ += left - budget.left();
  return busy() ? Progress::kBusy : Progress::kDone;
}

// Runs the stage until it is done, and begins the next, or until the budget is spent.
void SurfaceExtractor::run_stage(WorkBudget& budget) noexcept {
  constexpr std::int32_t kFinishUnits = 2200 / kInstructionsPerUnit;
  switch (stage_) {
    case Stage::kIdle:
      return;
    case Stage::kSegments:
      if (segmenter_.step(budget) != Progress::kDone) return;
      counters_.segment_overflow += segmenter_.overflow();
      if (segmenter_.blank()) {
        ++counters_.blank_frames;
        regions_.clear();
        surfaces_.clear();
        stage_ = Stage::kFinish;
        return;
      }
      planes_.begin(params_.planes, noise_, view_.intrinsics, view_.camera_up, segmenter_.image(),
                    segmenter_.segments());
      stage_ = Stage::kPlanes;
      return;
    case Stage::kPlanes:
      if (planes_.step(budget) != Progress::kDone) return;
      counters_.segment_overflow += planes_.span_overflow();
      counters_.plane_overflow += planes_.plane_overflow();
      regions_.begin(params_.regions, noise_, raw_, segmenter_.image(), planes_.planes(), planes_.boundaries());
      stage_ = Stage::kRegions;
      return;
    case Stage::kRegions:
      if (regions_.step(budget) != Progress::kDone) return;
      counters_.segment_overflow += regions_.component_overflow();
      counters_.plane_overflow += regions_.region_overflow();
      surfaces_.begin(params_.surfaces, noise_, raw_, segmenter_.image(), regions_.result(), next());
      stage_ = Stage::kSurfaces;
      return;
    case Stage::kSurfaces:
      if (surfaces_.step(budget) != Progress::kDone) return;
      counters_.plane_overflow += surfaces_.counts().overflow;
      counters_.no_polygon += surfaces_.counts().no_polygon;
      counters_.rejected_lines += surfaces_.counts().rejected_lines;
      things_.begin(params_.things, noise_, view_.intrinsics, segmenter_.image(), regions_.result(), next());
      stage_ = Stage::kThings;
      return;
    case Stage::kThings:
      if (things_.step(budget) != Progress::kDone) return;
      counters_.things += static_cast<std::uint32_t>(next().things.size());
      stage_ = Stage::kFinish;
      return;
    case Stage::kFinish:
      finish();
      budget.spend(kFinishUnits);
      return;
  }
}

void SurfaceExtractor::finish() noexcept {
  if (!segmenter_.blank()) depth_noise_.follow(params_.depth_noise, params_.noise, planes_.noise_samples());
  next().invalid_fraction = segmenter_.invalid_fraction();
  done_ = 1 - done_;
  raw_.depth = nullptr;  // the driver's again
  stage_ = Stage::kIdle;
}

std::size_t SurfaceExtractor::surface_at(std::int32_t column, std::int32_t row,
                                         const std::uint16_t* depth) const noexcept {
  if (column / kColumn_px >= segmenter_.image().column_rays.columns) return 0;
  RawImage raw = raw_;
  raw.depth = depth;
  const PublishedSurfaces& published = surfaces_.published();
  return published[pixel_label(segmenter_.image(), raw, noise_, regions_.result(), published, column, row)].number;
}

}  // namespace polygmap
