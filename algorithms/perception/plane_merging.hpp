// SPDX-License-Identifier: Apache-2.0
// Which planes of a frame are one: pieces that a leg, a hole or noise has split, and facets of one curved or rough
// surface.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/perception/frame_planes.hpp"
#include "algorithms/perception/plane_growing.hpp"
#include "algorithms/perception/surface_boundaries.hpp"

namespace polygmap {

class PlaneMerging {
 public:
  struct Params {
    double merge_m = 0.015;  // pieces whose planes are this close at each other's centre are one surface; large ones
                             // where a run of one could join the other, too
    double merge_tilt_rad = 0.12;
    double small_plane_px = 4000.0;  // smaller planes' tilt is known half as well
    double pieces_chi2 = 6.5;        // large pieces need not touch: 90 % of what noise does to three parameters
    double facet_chi2 = 8.0;         // neighbours are one surface unless their pixels contradict one plane for both by
                                     // this: 95 % of what noise does to three parameters
    double facet_floor_m = 0.002;    // what surfaces themselves are uneven by, added to the noise
    double facet_tilt_rad = 0.6;
    double facet_seam = 0.7;  // neighbours touch along this times the root of the smaller one's pixels
  };
  using PlaneIndex = std::array<std::uint8_t, FramePlanes::kMaxPlanes + 1>;  // of a plane that may have been merged

  // Pieces share the plane of the largest. measured: the planes' moments say what their pixels are worth; before, large
  // planes are one only where there is no doubt. Facets too small to be planes are left to join_facets.
  static void merge_pieces(const Params& params, const PlaneGrowing::Params& growing, const DepthSigma& noise,
                           FramePlanes& planes, PlaneIndex& to_plane, bool measured) noexcept;
  // Facets get a plane of their own, fitted to all of them; together they may be large enough to be one. columns: the
  // spans that the planes were fitted to.
  void join_facets(const Params& params, const PlaneGrowing::Params& growing, const DepthSigma& noise,
                   const SurfaceBoundaries::Columns& columns, std::int32_t column_count, FramePlanes& planes,
                   PlaneIndex& to_plane) noexcept;

 private:
  static constexpr std::int32_t kMaxGap_px = 24;  // rows between two surfaces that still touch
  static constexpr std::size_t kMaxFacets = 32;   // joined per frame

  static constexpr std::int32_t kUnlike = -1;
  void measure_seams(const SurfaceBoundaries::Columns& columns, std::int32_t column_count, const FramePlanes& planes,
                     double least_cosine, const PlaneIndex& to_plane) noexcept;
  // Along how many pixels two planes touch in the picture, the smaller index first; kUnlike: they face too different
  // ways; less: refused.
  std::array<std::array<std::int32_t, FramePlanes::kMaxPlanes + 1>, FramePlanes::kMaxPlanes + 1> seam_px_{};
};

}  // namespace polygmap
