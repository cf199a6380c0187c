// SPDX-License-Identifier: Apache-2.0
// Fourth stage of a frame: regions -> surfaces. Sides are fitted in the raw picture, outlines become convex polygons,
// cut to nosing and back lines that are found in the columns.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/polygons/column_outline.hpp"
#include "algorithms/perception/polygons/edge_lines.hpp"
#include "algorithms/perception/polygons/polygon_builder.hpp"
#include "algorithms/perception/polygons/side_lines.hpp"
#include "algorithms/perception/regions/pixel_labels.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

class SurfaceBuilder {
 public:
  struct Params {
    SideLines::Params sides;
    EdgeLineFinder::Params edge_lines;
    PolygonBuilder::Params polygons;
    double least_back_share = 0.4;  // six posts along a landing are a tenth of its columns (2026-11)
    double least_step_m = 0.01;
    double corner_px = 4.0;

    static void visit(auto& p, auto& field) {
      field("sides", p.sides);
      field("edge_lines", p.edge_lines);
      field("polygons", p.polygons);
      field("least_back_share", p.least_back_share, 0.0, 1.0,
            "What ends a surface at its back is seen beyond it in this share of its columns.");
      field("least_step_m", p.least_step_m, 0.0, 0.1,
            "The middle of what ends a surface lies farther below its plane at the nosing and at an edge that drops, "
            "farther above it at another back.");
      field(
          "corner_px", p.corner_px, 0.0, 100.0,
          "A side that was seen to end as many pixels of half resolution from the columns beside it, or fewer, ends at "
          "the corner with them.");
    }
  };
  // What the next step begins with: for each region its sides, its outline, a tread's two lines, its polygon.
  enum class Part : std::uint8_t { kSideLeft, kSideRight, kOutline, kNosing, kBack, kPolygon, kDone };

  // All but params and noise are read until the stage is done. Surfaces are added to frame; regions that become none
  // are given up.
  void begin(const Params& params, const DepthNoiseModel& noise, const RawImage& raw, const FrameImage& image,
             Regions& regions, SurfaceFrame& frame) noexcept;
  // In place of begin and step, for a picture without regions.
  void clear() noexcept { published_[kNoRegion] = PublishedSurface{}; }
  Progress step(WorkBudget& budget) noexcept;

  [[nodiscard]] Part part() const noexcept { return part_; }
  [[nodiscard]] const PublishedSurfaces& published() const noexcept { return published_; }
  struct Counts {
    std::uint32_t overflow = 0;        // surfaces that found no room
    std::uint32_t no_polygon = 0;      // surfaces whose outline encloses no area
    std::uint32_t rejected_lines = 0;  // nosings and back lines that were looked for and not good enough
  };
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  enum class Edge : std::uint8_t { kNosing, kBack };  // a tread's end below and above in the picture
  // The regions beyond one of a surface's ends: by column, none where there is none, or the body or the picture's end
  // hides it; each region's columns; and all of the surface's but where the body is.
  struct Beyond {
    std::array<RegionId, kColumns> region{};
    std::array<std::int32_t, Regions::kMaxRegions + 1> columns{};
    std::int32_t all_columns = 0;
  };

  void do_piece() noexcept;
  std::int32_t take_units() noexcept;  // of what the piece did
  void find_left_side() noexcept;
  void find_right_side() noexcept;
  void build_outline() noexcept;
  void find_line(Edge edge) noexcept;
  // Gathers where the surface ends in each column and what lies beyond; false when there is too little to look for.
  [[nodiscard]] bool begin_line(Edge edge) noexcept;
  void look_beyond(Edge edge, Beyond& beyond) noexcept;
  enum class Lies : std::uint8_t { kBelow, kAbove, kAboveUpright };
  [[nodiscard]] RegionId most_beyond(Edge edge, const Beyond& beyond, Lies lies) const noexcept;
  void build_polygon() noexcept;
  // Where the surface ends in a column.
  [[nodiscard]] std::int32_t end_of(Edge edge, std::int32_t column) const noexcept {
    const ColumnExtent& extent = regions_->extents[id_].columns[static_cast<std::size_t>(column)];
    return edge == Edge::kNosing ? extent.bottom : extent.top;
  }

  Params params_;
  DepthNoiseModel noise_;
  const RawImage* raw_ = nullptr;
  const FrameImage* image_ = nullptr;
  Regions* regions_ = nullptr;
  SurfaceFrame* frame_ = nullptr;
  Part part_ = Part::kDone;
  RegionId id_ = 1;
  bool begun_ = false;  // the line or the polygon
  WorkCount work_;
  SideLines side_lines_;
  OutlineSides sides_;
  ColumnOutline column_outline_;
  Outline2 outline_;
  EdgeLineFinder edge_lines_;
  SurfaceLines lines_;
  PolygonBuilder polygons_;
  std::uint8_t first_patch_ = 0;  // number of the one that is built
  PublishedSurfaces published_{};
  Counts counts_;
};

}  // namespace polygmap
