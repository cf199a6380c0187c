// SPDX-License-Identifier: Apache-2.0
// From a surface's outline in the picture to its polygon on the plane: cut where lines and neighbours say it ends,
// every edge judged.
#pragma once

#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/polygons/column_outline.hpp"
#include "algorithms/perception/polygons/convex_outline.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

struct SurfaceLines {  // each only if valid
  EdgeLine nosing;
  EdgeLine back;
  EdgeLine occluder;  // where a nearer surface hides the rest: cuts the polygon, but is no end of it
};

class PolygonBuilder {
 public:
  struct Params {
    double snap_m = 0.015;
    double probe_px = 3.0;
    double apart_m = 0.04;
    double most_foreign = 0.05;
    std::int32_t min_tread_columns = 3;

    static void visit(auto& p, auto& field) {
      field("snap_m", p.snap_m, 0.0, 0.1, "Corners as close to a nosing or back line go onto it.");
      field("probe_px", p.probe_px, 0.0, 20.0,
            "A polygon's end is judged as many pixels of half resolution outside its edge.");
      field("apart_m", p.apart_m, 0.001, 0.5, "What is seen as far in front of a plane hides it.");
      field("most_foreign", p.most_foreign, 0.0, 1.0,
            "A polygon of which a larger share of pixels is another plane's is cut back.");
      field("min_tread_columns", p.min_tread_columns, 1, 80, "A tread that ends a riser has as many columns.");
    }
  };
  void configure(const Params& params) noexcept { params_ = params; }

  // The patch of regions[id]; false when its outline encloses no area.
  [[nodiscard]] bool try_build(const FrameImage& picture, const Regions& regions, RegionId id, const Outline2& outline,
                               const SurfaceLines& lines, SurfacePatch& patch) const noexcept;

 private:
  // The tread that most columns of the surface show right below (or above) it in the picture.
  [[nodiscard]] RegionId tread_beside(const FrameImage& picture, const Regions& regions, RegionId id,
                                      bool below) const noexcept;
  // All in half-resolution pixels: the edge's ends, a point of the surface.
  [[nodiscard]] EdgeKind judge_edge(const FrameImage& picture, const InversePlane& plane, const Vec2& a, const Vec2& b,
                                    const Vec2& inside) const noexcept;

  Params params_;
};

}  // namespace polygmap
