// SPDX-License-Identifier: Apache-2.0
// From one raw depth frame to the planar surfaces in it: polygons, nosings, back lines. Static memory, resumable.
//
// A frame goes through five stages, each a class with begin(inputs), step(budget) and its results:
//   Segmenter       raw depths        -> columns of eight pixels, straight segments in them
//   PlaneExtractor  segments          -> planes, and the spans of the columns that show them
//   RegionLabeler   planes and spans  -> regions of the picture, a label for every row of every column
//   SurfaceBuilder  regions           -> surfaces
//   ThingFinder     surfaces, regions -> what lies on treads
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/depth_range.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/image/noise_tracker.hpp"
#include "algorithms/perception/image/work_units.hpp"
#include "algorithms/perception/plane_extractor.hpp"
#include "algorithms/perception/region_labeler.hpp"
#include "algorithms/perception/segmenter.hpp"
#include "algorithms/perception/surface_builder.hpp"
#include "algorithms/perception/things/thing_finder.hpp"

namespace polygmap {

class SurfaceExtractor {
 public:
  struct Params {
    DepthNoiseModel noise;
    NoiseTracker::Params depth_noise;
    DepthLimits limits;
    ScanlineSegmentation::Params segments;
    PlaneExtractor::Params planes;
    RegionLabeler::Params regions;
    SurfaceBuilder::Params surfaces;
    ThingFinder::Params things;

    static void visit(auto& p, auto& field) {
      field("noise", p.noise);
      field("depth_noise", p.depth_noise);
      field("limits", p.limits);
      field("segments", p.segments);
      field("planes", p.planes);
      field("regions", p.regions);
      field("surfaces", p.surfaces);
      field("things", p.things);
    }
  };
  // What the module knows about this frame, in the camera frame at the exposure.
  struct View {
    CameraIntrinsics intrinsics;
    Vec3 camera_up{0.0, -1.0, 0.0};            // unit, opposite to gravity
    std::array<LegShapes, kFootCount> body{};  // shapes of radius or size 0 are absent
    BodyMargin body_margin{0.025, 0.0};
  };
  struct Counters {
    std::uint32_t frames = 0;            // accepted
    std::uint32_t bad_view = 0;          // rejected: intrinsics, up or body not finite or out of range
    std::uint32_t bad_frame = 0;         // rejected: no data or a size other than the intrinsics'
    std::uint32_t bad_order = 0;         // rejected: not newer than the frame before
    std::uint32_t busy = 0;              // rejected: the frame before is not finished
    std::uint32_t blank_frames = 0;      // nothing measured at all
    std::uint32_t segment_overflow = 0;  // segments, spans, components and pairs of planes that found no room
    std::uint32_t plane_overflow = 0;    // planes or surfaces that found no room
    std::uint32_t no_polygon = 0;        // surfaces whose outline encloses no area
    std::uint32_t rejected_lines = 0;    // nosings and back lines that were looked for and not good enough
    std::uint32_t things = 0;            // columns that showed something on a tread
  };

  // Stairs take some 45,000 units, a cluttered desk 70,000. With every capacity full a frame takes at most
  // kMaxUnitsPerFrame.
  static constexpr std::int32_t kMaxPieceUnits = polygmap::kMaxPieceUnits;
  static constexpr std::int32_t kMaxUnitsPerFrame = 400'000;

  SurfaceExtractor() noexcept = default;
  explicit SurfaceExtractor(const Params& params) noexcept : params_(params) {}
  void configure(const Params& params) noexcept { params_ = params; }

  // Validates the frame; its pixels stay in the driver's buffer, which must live until busy() is false. False, with a
  // counted reason, for a frame that cannot be used or while busy.
  [[nodiscard]] bool try_begin(const DepthFrameView& frame, const View& view) noexcept;
  // kDone exactly once per frame, then kIdle.
  Progress step(WorkBudget& budget) noexcept;
  [[nodiscard]] bool busy() const noexcept { return stage_ != Stage::kIdle; }
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
    return segmenter_.image().body(column, row);
  }

  // What the next step begins with; a benchmark charges time to it.
  enum class Stage : std::uint8_t { kIdle, kSegments, kPlanes, kRegions, kSurfaces, kThings, kFinish };
  [[nodiscard]] Stage stage() const noexcept { return stage_; }
  [[nodiscard]] const Segmenter& segmenter() const noexcept { return segmenter_; }
  [[nodiscard]] const PlaneExtractor& plane_extractor() const noexcept { return planes_; }
  [[nodiscard]] const RegionLabeler& region_labeler() const noexcept { return regions_; }
  [[nodiscard]] const SurfaceBuilder& surface_builder() const noexcept { return surfaces_; }

 private:
  [[nodiscard]] SurfaceFrame& next() noexcept { return frames_[1 - done_]; }
  void begin_frame(const DepthFrameView& frame) noexcept;
  void run_stage(WorkBudget& budget) noexcept;
  void finish() noexcept;

  Params params_;
  DepthNoiseModel noise_;  // of this frame
  NoiseTracker depth_noise_;
  View view_;
  Counters counters_;
  std::array<SurfaceFrame, 2> frames_;  // the last finished one and the next
  std::size_t done_ = 0;

  Stage stage_ = Stage::kIdle;
  std::int32_t units_spent_ = 0;
  std::int64_t last_stamp_ns_ = 0;
  bool any_frame_ = false;

  RawImage raw_;
  Segmenter segmenter_;
  PlaneExtractor planes_;
  RegionLabeler regions_;
  SurfaceBuilder surfaces_;
  ThingFinder things_;
};

}  // namespace polygmap
