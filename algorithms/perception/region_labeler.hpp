// SPDX-License-Identifier: Apache-2.0
// Third stage of a frame: planes and their spans -> regions of the picture, a label for every row of every column, and
// each region's extent per column.
#pragma once

#include <cstdint>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/planes/plane_set.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"
#include "algorithms/perception/regions/connected_components.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

class RegionLabeler {
 public:
  struct Params {
    ConnectedComponents::Params components;
    double inlier_check_px = 3000.0;
    double min_inlier_ratio = 0.6;
    double inlier_sigmas = 3.0;

    static void visit(auto& p, auto& field) {
      field("components", p.components);
      field("inlier_check_px", p.inlier_check_px, 0.0, 307200.0,
            "A larger region is wider than what columns mix, and is not looked at again.");
      field("min_inlier_ratio", p.min_inlier_ratio, 0.0, 1.0,
            "Of a smaller region, this share of single pixels lies on its plane.");
      field("inlier_sigmas", p.inlier_sigmas, 0.5, 20.0,
            "A single pixel that is nearer to a region's plane lies on it.");
    }
  };
  // What the next step begins with.
  enum class Part : std::uint8_t { kLinks, kNumbers, kComponents, kJoin, kLabels, kInliers, kDone };

  // All but params and noise are read until the stage is done. Each span of boundaries is given its component.
  void begin(const Params& params, const DepthNoiseModel& noise, const RawImage& raw, const FrameImage& image,
             const PlaneSet& planes, SpanBoundaries& boundaries) noexcept;
  // In place of begin and step, for a picture in which nothing was measured: no region.
  void clear() noexcept;
  Progress step(WorkBudget& budget) noexcept;

  [[nodiscard]] Part part() const noexcept { return part_; }
  // Writable: whoever makes surfaces of regions gives up those that become none.
  [[nodiscard]] Regions& result() noexcept { return regions_; }
  [[nodiscard]] const Regions& result() const noexcept { return regions_; }
  // Components that found no room; regions.
  [[nodiscard]] std::uint32_t component_overflow() const noexcept { return components_.overflow(); }
  [[nodiscard]] std::uint32_t region_overflow() const noexcept { return region_overflow_; }

 private:
  void do_piece() noexcept;
  // Visits some columns; then comes the next part.
  template <typename Visit>
  void each_column(Part next, const Visit& visit) noexcept;  // counts them, and goes on after the last
  void join() noexcept;
  void label_column() noexcept;
  void check_inliers() noexcept;

  Params params_;
  DepthNoiseModel noise_;
  const RawImage* raw_ = nullptr;
  const FrameImage* image_ = nullptr;
  const PlaneSet* planes_ = nullptr;
  SpanBoundaries* boundaries_ = nullptr;
  Part part_ = Part::kDone;
  std::int32_t column_ = 0;
  RegionId checked_ = kNoRegion;  // the last one that was
  WorkCount work_;
  ConnectedComponents components_;
  Regions regions_;
  std::uint32_t region_overflow_ = 0;
};

}  // namespace polygmap
