// SPDX-License-Identifier: Apache-2.0
// The connected components of every plane's pixels, and which of them are one region.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/planes/plane_set.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

class ConnectedComponents {
 public:
  struct Params {
    double apart_m = 0.04;
    std::int32_t min_component_px = 160;
    std::int32_t min_surface_px = 440;
    std::int32_t min_other_px = 1500;
    double min_step_columns = 2.0;
    std::int32_t apart_probes = 24;
    std::int32_t min_apart_probes = 3;

    static void visit(auto& p, auto& field) {
      field("apart_m", p.apart_m, 0.001, 0.5, "What is seen as far from a plane is something else.");
      field("min_component_px", p.min_component_px, 1, 100000, "A connected component has as many pixels.");
      field("min_surface_px", p.min_surface_px, 1, 100000,
            "A tread that meets a riser, or the reverse, has as many pixels.");
      field("min_other_px", p.min_other_px, 1, 100000,
            "Any other surface has as many pixels: curved things have facets of this size.");
      field("min_step_columns", p.min_step_columns, 1.0, 80.0,
            "A tread meets a riser, or the reverse, in as many columns of eight pixels.");
      field("apart_probes", p.apart_probes, 1, 200,
            "As many steps on the straight way from one connected component of a plane to another tell whether they "
            "are one surface.");
      field("min_apart_probes", p.min_apart_probes, 1, 200,
            "Two connected components of a plane are two surfaces when something else is seen in as many places on "
            "that way.");
    }
  };

  // Numbers the components that the planes' spans form, and writes each span's number into it: 0 for those without
  // room.
  // Column by column, from left to right, then some numbers at a time until that is done, then column by column.
  void begin_find() noexcept;
  void link(SpanBoundaries::Columns& columns, std::int32_t column) noexcept;
  [[nodiscard]] bool number_some() noexcept;
  void measure(SpanBoundaries::Columns& columns, std::int32_t column) noexcept;
  // Begins regions with the planes. All is read until joined.
  void begin_join(const Params& params, const SpanBoundaries& boundaries, const FrameImage& image,
                  const PlaneSet& planes, Regions& regions) noexcept;
  // Gives some components a region, and regions without enough of them up; true when all is done.
  [[nodiscard]] bool join_some() noexcept;
  // Regions that found no room in the last join.
  [[nodiscard]] std::uint32_t region_overflow() const noexcept { return region_overflow_; }
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid
  // Of a component, after join: a region that is kept, or none.
  [[nodiscard]] RegionId region_of(std::uint16_t component) const noexcept { return components_[component].region; }
  // Components that found no room.
  [[nodiscard]] std::uint32_t overflow() const noexcept { return overflow_; }

 private:
  static constexpr std::size_t kMaxComponents = 255;
  struct Component {
    PlaneId plane = kNoPlane;
    RegionId region = kNoRegion;
    double area_px = 0.0;
    double sum_column = 0.0, sum_row = 0.0;                 // half resolution
    std::int32_t left = 0, right = 0, top = 0, bottom = 0;  // columns and rows, inclusive
    [[nodiscard]] Vec2 centre() const noexcept { return Vec2{sum_column, sum_row} / area_px; }
  };
  using Order = StaticVector<std::uint8_t, kMaxComponents>;

  // Those of living planes that are large enough, by area.
  [[nodiscard]] Order large_ones() noexcept;
  [[nodiscard]] bool apart(const Component& a, const Component& b, const InversePlane& plane) noexcept;
  // Of the regions of one fitted plane, that of the nearest which the component belongs to.
  [[nodiscard]] RegionId coplanar_region(const Component& component) noexcept;
  // A region for a component: that of its plane, one of later numbers that a component of that plane has become, or a
  // new one; none for a small component, or without room.
  [[nodiscard]] RegionId find_region(const Component& component) noexcept;
  void join(std::uint8_t number) noexcept;
  void give_up_small_ones() noexcept;

  Params params_;
  const SpanBoundaries* boundaries_ = nullptr;
  const FrameImage* image_ = nullptr;
  const PlaneSet* planes_ = nullptr;
  Regions* regions_ = nullptr;
  Order order_;
  std::uint16_t span_count_ = 0;
  std::size_t next_ = 0;  // span to be numbered, less one; of order_, to be joined
  WorkCount work_;
  std::array<Component, kMaxComponents + 1> components_{};
  std::size_t component_count_ = 0;
  // Union-find over all spans.
  std::array<std::uint16_t, static_cast<std::size_t>(kColumns) * SpanBoundaries::kMaxSpans + 1> parent_{};
  std::uint32_t overflow_ = 0;         // components
  std::uint32_t region_overflow_ = 0;  // of the last join
};

}  // namespace polygmap
