// SPDX-License-Identifier: Apache-2.0
// From a surface's outline in the picture to its polygon on the plane: cut where lines and neighbours say it ends,
// every edge judged.
#pragma once

#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/perception/planes/plane_set.hpp"
#include "algorithms/perception/polygons/column_outline.hpp"
#include "algorithms/perception/polygons/convex_outline.hpp"

namespace polygmap {

struct SurfaceLines {  // each only if valid
  EdgeLine nosing;
  EdgeLine back;
  EdgeLine occluder;  // where a nearer surface hides the rest: cuts the polygon, but is no end of it
};

class PolygonBuilder {
 public:
  struct Params {
    double snap_m = 0.015;               // corners this close to a nosing or back line go onto it
    double probe_px = 3.0;               // half-resolution pixels outside a polygon's edge where its end is judged
    double apart_m = 0.04;               // seen this far in front of a plane: something hides it
    double most_foreign = 0.05;          // of a polygon's pixels; more are cut off
    std::int32_t min_tread_columns = 3;  // of a tread that ends a riser
  };
  void configure(const Params& params) noexcept { params_ = params; }

  // The patch of planes[index]; false when its outline encloses no area.
  [[nodiscard]] bool try_build(const FrameImage& picture, const PlaneSet& planes, std::size_t index,
                               const ColumnExtents& profile, const Outline2& outline, const SurfaceLines& lines,
                               SurfacePatch& patch) const noexcept;

 private:
  // The tread that most columns of the surface show right below (or above) it in the picture; 0 = none.
  [[nodiscard]] std::size_t tread_beside(const FrameImage& picture, const PlaneSet& planes,
                                         const ColumnExtents& profile, bool below) const noexcept;
  // All in half-resolution pixels: the edge's ends, a point of the surface.
  [[nodiscard]] EdgeKind judge_edge(const FrameImage& picture, const InversePlane& plane, const Vec2& a, const Vec2& b,
                                    const Vec2& inside) const noexcept;

  Params params_;
};

}  // namespace polygmap
