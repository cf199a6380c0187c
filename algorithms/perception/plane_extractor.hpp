// SPDX-License-Identifier: Apache-2.0
// Second stage of a frame: straight segments -> planes, and the spans of every column that show them.
//
// Planes grow from segments and are sharpened within spans that end where they meet. Facets of curved surfaces are
// joined, and leaning planes that are a nosing's face and the riser behind it are split. Level and upright planes are
// found in what is left over, and all are measured within their final spans.
#pragma once

#include <cstdint>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/planes/overhang_split.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"
#include "algorithms/perception/planes/plane_growing.hpp"
#include "algorithms/perception/planes/plane_merging.hpp"
#include "algorithms/perception/planes/plane_set.hpp"
#include "algorithms/perception/planes/residual_planes.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"
#include "algorithms/perception/segments/scanline_segments.hpp"
#include "algorithms/perception/span_fit.hpp"

namespace polygmap {

class PlaneExtractor {
 public:
  struct Params {
    PlaneGrowing::Params growing;
    SpanBoundaries::Params boundaries;
    PlaneMerging::Params merging;
    OverhangSplit::Params overhangs;
    ResidualPlaneSearch::Params residual;
    PlaneFit::Params fit;
    double kind_tilt_rad = 0.21;
    double min_explained = 0.75;
    double min_explained_curved = 0.55;
    double min_fitted_px = 64.0;

    static void visit(auto& p, auto& field) {
      field("growing", p.growing);
      field("boundaries", p.boundaries);
      field("merging", p.merging);
      field("overhangs", p.overhangs);
      field("residual", p.residual);
      field("fit", p.fit);
      field("kind_tilt_rad", p.kind_tilt_rad, 0.01, 0.7,
            "A fitted plane as near to level is a tread, to upright a riser.");
      field("min_explained", p.min_explained, 0.0, 1.0,
            "A plane explains this share of its pixels, over that of all planes.");
      field("min_explained_curved", p.min_explained_curved, 0.0, 1.0,
            "A plane of several facets explains this share of its pixels, over that of all planes.");
      field("min_fitted_px", p.min_fitted_px, 3.0, 100000.0, "A plane is fitted to as many pixels.");
    }
  };
  // What the next step begins with; a benchmark charges time to it.
  enum class Part : std::uint8_t {
    kGrowing,
    kMergingGrown,
    kSharpening,
    kSolvingSharpened,
    kMergingSharpened,
    kFacets,
    kOverhangs,
    kResidual,
    kMeasuring,
    kSolvingMeasured,
    kPlacing,
    kDone
  };

  // All but params, noise, intrinsics and up are read until the stage is done. Each segment is given its grown plane.
  void begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics, const Vec3& up,
             const FrameImage& image, ScanlineSegmentation::Columns& segments) noexcept;
  Progress step(WorkBudget& budget) noexcept;
  [[nodiscard]] Part part() const noexcept { return part_; }
  // Of the fit that goes on, if part() is one.
  [[nodiscard]] SpanFit::Part fit_part() const noexcept { return fit_.part(); }

  [[nodiscard]] const PlaneSet& planes() const noexcept { return planes_; }
  // The planes' spans, and where they meet. Writable: whoever numbers connected components writes them into the spans.
  [[nodiscard]] SpanBoundaries& boundaries() noexcept { return boundaries_; }
  // The noise as the measured planes' rows show it.
  [[nodiscard]] const NoiseSamples& noise_samples() const noexcept { return boundaries_.noise_samples(); }
  // Planes that found no room; spans, and pairs of planes.
  [[nodiscard]] std::uint32_t plane_overflow() const noexcept { return plane_overflow_; }
  [[nodiscard]] std::uint32_t span_overflow() const noexcept {
    return boundaries_.overflow() + merging_.overflow() + overhangs_.overflow();
  }

 private:
  void do_piece() noexcept;
  std::int32_t take_units() noexcept;  // of what the piece did
  void grow() noexcept;
  void merge_grown() noexcept;
  void sharpen() noexcept;
  void solve_sharpened() noexcept;
  void merge_sharpened() noexcept;
  void join_facets() noexcept;
  void split_overhangs() noexcept;
  void search_residual() noexcept;
  void measure() noexcept;
  void solve_measured() noexcept;

  void begin_fit(const SpanFit::Pass& pass) noexcept;
  void take_grown_planes() noexcept;
  [[nodiscard]] bool merge_coplanar(bool measured) noexcept;  // some; true when all are merged
  void take_joined_planes() noexcept;
  void begin_search() noexcept;
  void take_split_planes() noexcept;
  void take_found_planes() noexcept;
  void add_plane(const InversePlane& plane) noexcept;
  // Of all planes' pixels, the share that they explain.
  [[nodiscard]] double explained_share() const noexcept;
  // Solves for some planes, and drops those that explain less than the least shares of their pixels, those of several
  // facets the second; true when all are solved.
  using Shares = std::array<double, 2>;
  [[nodiscard]] bool solve_some() noexcept;
  void solve(PlaneId plane) noexcept;
  void drop(PlaneId plane) noexcept;
  [[nodiscard]] SurfaceKind kind_of(const InversePlane& plane) const noexcept;

  Params params_;
  DepthNoiseModel noise_;
  CameraIntrinsics intrinsics_;
  Vec3 up_ = -Vec3::UnitY();
  const FrameImage* image_ = nullptr;
  ScanlineSegmentation::Columns* segments_ = nullptr;
  Part part_ = Part::kDone;
  std::int32_t next_ = 0;  // column, of facets, overhangs and the residual; plane to be solved, less one
  Shares least_share_{};
  WorkCount work_;
  PlaneGrowing growing_;
  SpanBoundaries boundaries_;
  SpanFit fit_;
  PlaneMerging merging_;
  OverhangSplit overhangs_;
  PlaneId first_new_ = 1;  // planes from here on did not grow: halves of others, and those found in the residual
  ResidualPlaneSearch search_;
  PlaneMerging::PlaneIndex to_plane_{};  // from a grown plane
  PlaneSet planes_;
  std::uint32_t plane_overflow_ = 0;
};

}  // namespace polygmap
