// SPDX-License-Identifier: Apache-2.0
// Which planes of a frame are one: planes that a leg, a hole or noise has split, and facets of one curved or rough
// surface.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/planes/plane_growing.hpp"
#include "algorithms/perception/planes/plane_set.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"

namespace polygmap {

class PlaneMerging {
 public:
  struct Params {
    double merge_m = 0.015;  // of large planes also where a segment of one could join the other
    double merge_tilt_rad = 0.12;
    double small_plane_px = 4000.0;
    double apart_chi2 = 6.5;
    double facet_chi2 = 8.0;
    double facet_floor_m = 0.002;
    double facet_tilt_rad = 0.6;
    // Neighbours touch along this times the root of the smaller one's pixels. Of a tread or a riser that is low in the
    // picture two planes cannot: side by side, along this times the lower one's height.
    double facet_seam = 0.7;
    double between_rad = 0.1;

    static void visit(auto& p, auto& field) {
      field("merge_m", p.merge_m, 0.0, 0.1, "Planes that are this close at each other's centre are one surface.");
      field("merge_tilt_rad", p.merge_tilt_rad, 0.0, 1.5,
            "Planes that are one surface are turned no farther against each other.");
      field("small_plane_px", p.small_plane_px, 1.0, 100000.0, "The tilt of a smaller plane is known half as well.");
      field("apart_chi2", p.apart_chi2, 0.1, 100.0,
            "Large planes need not touch: 6.5 holds 91 % of what noise does to three parameters.");
      field("facet_chi2", p.facet_chi2, 0.1, 100.0,
            "Neighbours are one surface unless their pixels contradict one plane by this: 8 holds 95 % of what noise "
            "does.");
      field("facet_floor_m", p.facet_floor_m, 0.0, 0.1,
            "Surfaces themselves are uneven by this, which adds to the noise.");
      field("facet_tilt_rad", p.facet_tilt_rad, 0.0, 1.5,
            "Facets of one surface are turned no farther against each other.");
      field("facet_seam", p.facet_seam, 0.01, 10.0,
            "Neighbours touch along this times the root of the smaller one's pixels.");
      field("between_rad", p.between_rad, 0.0, 1.0, "The plane through two facets may lie as far from between theirs.");
    }
  };
  using PlaneIndex = std::array<PlaneId, PlaneSet::kMaxPlanes + 1>;  // of a plane that may have been merged

  // Those that are one share the plane of the largest. measured: the planes' moments say what their pixels are worth;
  // before, large planes are one only where there is no doubt. Facets too small to be planes are left to join_facets.
  // begin_coplanar, then merge_some until it is done.
  void begin_coplanar(const Params& params, const PlaneGrowing::Params& growing, const DepthNoiseModel& noise,
                      const PlaneSet& planes, bool measured) noexcept;
  // Holds some pairs of planes against each other; true when nothing is left to merge.
  [[nodiscard]] bool merge_some(PlaneSet& planes, PlaneIndex& to_plane) noexcept;
  // Facets get a plane of their own, fitted to all of them, and may together be large enough to be one: begin_facets,
  // the columns of spans that the planes were fitted to, from left to right, then join_some until it is done.
  void begin_facets(const Params& params, const PlaneGrowing::Params& growing, const DepthNoiseModel& noise,
                    const PlaneSet& planes) noexcept;
  // right: the next column, null for the last.
  void add_column(const SpanBoundaries::Column& spans, const SpanBoundaries::Column* right,
                  const PlaneIndex& to_plane) noexcept;
  // Looks at kSeamsAtOnce seams, or joins two planes; true when nothing is left to join.
  [[nodiscard]] bool join_some(PlaneSet& planes, PlaneIndex& to_plane) noexcept;
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid
  // Seams that found no room.
  [[nodiscard]] std::uint32_t overflow() const noexcept { return overflow_; }

 private:
  static constexpr std::int32_t kMaxGap_px = 24;  // rows between facets of one bent surface
  static constexpr std::size_t kMaxFacets = 32;   // joined per frame
  static constexpr std::size_t kMaxSeams = 512;
  static constexpr std::size_t kSeamsAtOnce = 8;

  // Where two planes that face much the same way touch in the picture. What was said of them holds until either plane
  // changes.
  struct Seam {
    enum class Verdict : std::uint8_t { kOpen, kShort, kContradicted, kOne, kGone };
    std::uint8_t a = 0, b = 0;
    Verdict verdict = Verdict::kOpen;
    bool low = false;  // touch along no more than the lower one's height
    std::int32_t length_px = 0;
    std::int32_t beside_px = 0;  // of that, side by side
    double chi2 = 0.0;           // if kOne
  };
  struct Candidate {
    Vec3 normal;
    std::size_t plane;
  };
  using SeamIndex = std::uint16_t;  // 0 = none
  [[nodiscard]] SeamIndex& seam_of(std::size_t a, std::size_t b) noexcept {
    return seam_of_[a < b ? a : b][a < b ? b : a];
  }
  [[nodiscard]] bool alike(std::size_t a, std::size_t b) const noexcept {
    return normals_[a].dot(normals_[b]) >= least_cosine_;
  }
  void touch(std::uint8_t a, std::uint8_t b, std::int32_t length_px, bool beside) noexcept;
  void judge(const PlaneSet& planes, Seam& seam) noexcept;
  // Whether a plane is part of one with as many pixels or more; cosine: of the angle between them.
  [[nodiscard]] bool part_of(const FittedPlane& p, const FittedPlane& q, double cosine) noexcept;
  [[nodiscard]] bool try_join(PlaneSet& planes, PlaneIndex& to_plane, Seam& best) noexcept;

  Params params_;
  PlaneGrowing::Params growing_;
  bool measured_ = false;
  StaticVector<Candidate, PlaneSet::kMaxPlanes> candidates_;  // to be merged with one another
  std::size_t first_ = 0, second_ = 1;                        // of them, the next pair
  WorkCount work_;
  DepthNoiseModel noise_;
  double least_cosine_ = 1.0;
  std::array<std::int32_t, PlaneSet::kMaxPlanes + 1> spans_of_{};  // columns of a plane
  std::array<Vec3, PlaneSet::kMaxPlanes + 1> normals_{};           // before any were joined; zero: no plane
  std::array<std::array<SeamIndex, PlaneSet::kMaxPlanes + 1>, PlaneSet::kMaxPlanes + 1> seam_of_{};
  std::array<Seam, kMaxSeams + 1> seams_{};  // 1-based
  std::size_t seam_count_ = 0;
  std::size_t next_open_ = 1;  // none before it is open
  std::size_t joined_ = 0;
  std::uint32_t overflow_ = 0;
};

}  // namespace polygmap
