// SPDX-License-Identifier: Apache-2.0
// From one raw depth frame to the planar surfaces in it: polygons, nosings, back lines. Static memory, resumable.
//
// Route: self filter -> columns of eight pixels -> straight runs -> planes grown from runs -> boundaries where the
// planes meet, weighted least squares, facets of curved surfaces joined -> level and upright planes in what is left
// over, rows claimed beside them -> boundaries and least squares again -> connected pieces, small ones held against
// single pixels -> outlines, with sides fitted in the raw picture -> convex polygons, cut to nosing and back lines that
// are found in the columns.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/column_image.hpp"
#include "algorithms/perception/image/depth_image.hpp"
#include "algorithms/perception/image/depth_range.hpp"
#include "algorithms/perception/image/noise_tracker.hpp"
#include "algorithms/perception/image/self_filter.hpp"
#include "algorithms/perception/planes/overhang_split.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"
#include "algorithms/perception/planes/plane_growing.hpp"
#include "algorithms/perception/planes/plane_merging.hpp"
#include "algorithms/perception/planes/plane_set.hpp"
#include "algorithms/perception/planes/residual_planes.hpp"
#include "algorithms/perception/planes/scanline_segments.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"
#include "algorithms/perception/polygons/column_outline.hpp"
#include "algorithms/perception/polygons/edge_lines.hpp"
#include "algorithms/perception/polygons/polygon_builder.hpp"
#include "algorithms/perception/polygons/side_lines.hpp"
#include "algorithms/perception/regions/column_extents.hpp"
#include "algorithms/perception/regions/connected_components.hpp"
#include "algorithms/perception/regions/inlier_ratio.hpp"

namespace polygmap {

class SurfaceExtractor {
 public:
  struct Params {
    DepthNoiseModel noise;
    NoiseTracker::Params depth_noise;  // how it is followed from frame to frame
    DepthLimits limits;
    ScanlineSegmentation::Params runs;
    PlaneGrowing::Params growing;
    SpanBoundaries::Params boundaries;
    ResidualPlaneSearch::Params remainder;
    PlaneFit::Params planes;
    EdgeLineFinder::Params edge_lines;
    double kind_tilt_rad = 0.21;  // a fitted plane within this of level is a tread, of upright a riser
    PlaneMerging::Params merging;
    OverhangSplit::Params overhangs;
    double min_explained = 0.75;  // share of a surface's pixels that its plane explains, over that of all surfaces
    double min_explained_curved = 0.55;  // that of several facets
    double evidence_px = 3000.0;         // of a surface no larger than this are single pixels looked at ...
    double min_evidence = 0.6;           // ... and this share of them lies on its plane
    ConnectedComponents::Params pieces;
    SideLines::Params sides;
    PolygonBuilder::Params polygons;
  };
  // What the module knows about this frame, in the camera frame at the exposure.
  struct View {
    CameraIntrinsics intrinsics;
    Vec3 camera_up{0.0, -1.0, 0.0};            // unit, opposite to gravity
    std::array<LegShapes, kFootCount> body{};  // shapes of radius or size 0 are absent
    BodyMargin body_margin{0.025, 0.0};
  };
  struct Counters {
    std::uint32_t frames = 0;          // accepted
    std::uint32_t bad_view = 0;        // rejected: intrinsics, up or body not finite or out of range
    std::uint32_t bad_frame = 0;       // rejected: no data or a size other than the intrinsics'
    std::uint32_t bad_order = 0;       // rejected: not newer than the frame before
    std::uint32_t busy = 0;            // rejected: the frame before is not finished
    std::uint32_t blank_frames = 0;    // nothing measured at all
    std::uint32_t run_overflow = 0;    // runs, intervals and pairs of planes that found no room
    std::uint32_t plane_overflow = 0;  // planes or surfaces that found no room
    std::uint32_t no_polygon = 0;      // surfaces whose outline encloses no area
    std::uint32_t rejected_lines = 0;  // nosings and back lines that were looked for and not good enough
  };

  // One unit is a row of 80 columns through reduction and segmentation, or as much work (its cost:
  // firmware/schedule.hpp). Stairs take 2,300-2,900, a cluttered desk 3,550. With every capacity full a frame takes at
  // most kMaxUnitsPerFrame. No piece is larger than kMaxPieceUnits.
  static constexpr std::int32_t kMaxPieceUnits = 40;
  static constexpr std::int32_t kMaxUnitsPerFrame = 12000;

  SurfaceExtractor() noexcept = default;
  explicit SurfaceExtractor(const Params& params) noexcept : params_(params) {}
  void configure(const Params& params) noexcept { params_ = params; }

  // Validates the frame; its pixels stay in the driver's buffer, which must live until busy() is false. False, with a
  // counted reason, for a frame that cannot be used or while busy.
  [[nodiscard]] bool try_begin(const DepthFrameView& frame, const View& view) noexcept;
  // kDone exactly once per frame, then kIdle.
  Progress step(WorkBudget& budget) noexcept;
  [[nodiscard]] bool busy() const noexcept { return phase_ != Phase::kIdle; }
  // Of the last finished frame.
  [[nodiscard]] const SurfaceFrame& result() const noexcept { return frames_[done_]; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  // For the next frame.
  [[nodiscard]] DepthNoiseModel noise() const noexcept { return depth_noise_.of(params_.noise); }
  [[nodiscard]] std::int32_t units_spent() const noexcept { return units_spent_; }  // on the last frame

  // What a pixel was taken for: 1 + index in result().surfaces, 0 = none. For pictures and tests; valid until the next
  // try_begin. depth: the frame's pixels, if they are still there; with them the sides of surfaces are known to the
  // pixel.
  [[nodiscard]] std::size_t surface_at(std::int32_t column, std::int32_t row,
                                       const std::uint16_t* depth = nullptr) const noexcept;
  [[nodiscard]] bool body_at(std::int32_t column, std::int32_t row) const noexcept {
    return picture_.body(column, row);
  }

  // What the next step begins with; a benchmark charges time to it.
  enum class Phase : std::uint8_t {
    kIdle,
    kMask,
    kReduce,
    kGrow,
    kGather,
    kClaim,
    kMeet,
    kRefit,
    kFacets,
    kSplit,
    kSearch,
    kPieces,
    kProfile,
    kEvidence,
    kSides,
    kOutline,
    kNosing,
    kBack,
    kPolygon,
    kFinish,
  };
  [[nodiscard]] Phase phase() const noexcept { return phase_; }

 private:
  static constexpr std::int32_t kColumnsPerPiece = 48;

  [[nodiscard]] SurfaceFrame& next() noexcept { return frames_[1 - done_]; }
  void enter(Phase phase) noexcept;
  std::int32_t run_piece() noexcept;  // does one piece, returns its units

  void reduce_row() noexcept;
  void take_grown_planes() noexcept;
  std::int32_t split_step() noexcept;
  void split_overhangs() noexcept;
  void add_plane(const InversePlane& plane) noexcept;
  void begin_search() noexcept;
  void take_found_planes() noexcept;
  void merge_planes(bool measured) noexcept;
  std::int32_t facet_step() noexcept;
  void drop(std::size_t plane) noexcept;
  void solve_planes() noexcept;
  void pieces_step() noexcept;
  std::int32_t evidence_step() noexcept;
  std::int32_t side_step() noexcept;
  void outline() noexcept;
  [[nodiscard]] bool begin_line(bool nosing) noexcept;
  std::int32_t line_step(bool nosing) noexcept;
  void build_polygon() noexcept;
  void finish() noexcept;

  Params params_;
  DepthNoiseModel noise_;  // of this frame
  NoiseTracker depth_noise_;
  View view_;
  Counters counters_;
  std::array<SurfaceFrame, 2> frames_;  // the last finished one and the next
  std::size_t done_ = 0;

  Phase phase_ = Phase::kIdle;
  std::int32_t row_ = 0;
  std::size_t index_ = 0;
  std::int32_t round_ = 0;
  bool started_ = false;  // sub-step of a phase
  std::int32_t units_spent_ = 0;
  std::int64_t last_stamp_ns_ = 0;
  bool any_frame_ = false;
  std::int32_t measured_px_ = 0;
  std::int32_t outside_body_px_ = 0;

  SelfFilter self_filter_;
  RawImage raw_;
  FrameImage picture_;
  ScanlineSegmentation runs_;
  PlaneGrowing growing_;
  SpanBoundaries boundaries_;
  ResidualPlaneSearch search_;
  std::size_t first_found_ = 1;  // planes first_found_ .. planes_.count came from the search, or from another plane
  PlaneMerging::PlaneIndex to_plane_{};  // from a grown plane
  PlaneMerging merging_;
  OverhangSplit overhangs_;

  PlaneSet planes_;
  ConnectedComponents pieces_;
  SurfaceExtents profiles_;
  SideLines side_finder_;
  OutlineSides sides_;
  ColumnOutline column_outline_;
  Outline2 outline_;
  EdgeLineFinder line_finder_;
  SurfaceLines lines_;
  PolygonBuilder polygons_;
};

}  // namespace polygmap
