// SPDX-License-Identifier: Apache-2.0
// From one raw depth frame to the planar surfaces in it: polygons, nosings, back lines. Static memory, resumable.
//
// Route: self filter and half-resolution reduction -> diffusion (13) -> normals (11, 12), classed by gravity -> edges
// -> regions between them -> RANSAC planes, coplanar pieces merged -> every pixel to its best plane, least-squares
// refit (twice) -> contours -> convex polygons, cut to nosing and back lines that are found in the raw picture.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/anisotropic_diffusion.hpp"
#include "algorithms/perception/contour.hpp"
#include "algorithms/perception/depth_reduction.hpp"
#include "algorithms/perception/edge_lines.hpp"
#include "algorithms/perception/edges.hpp"
#include "algorithms/perception/images.hpp"
#include "algorithms/perception/normals.hpp"
#include "algorithms/perception/plane_fit.hpp"
#include "algorithms/perception/regions.hpp"
#include "algorithms/perception/self_filter.hpp"

namespace polygmap {

class SurfaceExtractor {
 public:
  struct Params {
    DepthSigma noise;
    DepthReduction::Params reduction;
    AnisotropicDiffusion::Params diffusion;
    NormalEstimation::Params normals;
    EdgeDetection::Params edges;
    PlaneFit::Params planes;
    EdgeLineFinder::Params edge_lines;
    double seed_tilt_rad = 0.44;  // a pixel's normal within this of level or upright starts a surface
    double kind_tilt_rad = 0.21;  // a fitted plane within this of level is a tread, of upright a riser
    double join_jump_m = 0.015;   // neighbours within join_jump_m + join_jump_per_m2 z^2 in depth are one surface
    double join_jump_per_m2 = 0.02;
    double merge_m = 0.012;  // pieces whose planes are this close at each other's centre are one surface
    double merge_tilt_rad = 0.12;
    double apart_m = 0.04;       // seen this far from a plane: something else is there
    double assign_sigmas = 3.0;  // a pixel within assign_sigmas sigma + assign_floor_m belongs to a plane
    double assign_floor_m = 0.003;
    std::int32_t reach_px = 32;          // and no farther than this from where it was seen the round before
    std::int32_t min_region_px = 60;     // half-resolution pixels of a seed region
    std::int32_t min_component_px = 40;  // of a piece of a surface
    std::int32_t min_surface_px = 110;   // of a surface
    std::int32_t min_leftover_px = 120;  // of a region that no plane explained
    double snap_m = 0.015;               // polygon corners this close to a nosing or back line go onto it
    double probe_px = 3.0;               // half-resolution pixels outside a polygon's edge where its end is judged
  };
  // What the module knows about this frame, in the camera frame at the exposure.
  struct View {
    CameraIntrinsics intrinsics;
    Vec3 camera_up{0.0, -1.0, 0.0};            // unit, opposite to gravity
    std::array<LegShapes, kFootCount> body{};  // shapes of radius or size 0 are absent
    double body_margin_m = 0.025;
  };
  struct Counters {
    std::uint32_t frames = 0;           // accepted
    std::uint32_t bad_view = 0;         // rejected: intrinsics, up or body not finite or out of range
    std::uint32_t bad_frame = 0;        // rejected: no data or a size other than the intrinsics'
    std::uint32_t bad_order = 0;        // rejected: not newer than the frame before
    std::uint32_t busy = 0;             // rejected: the frame before is not finished
    std::uint32_t blank_frames = 0;     // nothing measured at all
    std::uint32_t region_overflow = 0;  // pixels and regions that found no room
    std::uint32_t plane_overflow = 0;   // planes or surfaces that found no room
    std::uint32_t no_plane = 0;         // regions without a plane
    std::uint32_t no_polygon = 0;       // surfaces whose outline encloses no area
    std::uint32_t contour_overflow = 0;
    std::uint32_t rejected_lines = 0;  // nosings and back lines that were looked for and not good enough
  };

  // One unit is one row of 320 half-resolution pixels through one light pass, or as much work (its cost:
  // firmware/schedule.hpp). A staircase takes 13,000; with every capacity full a frame takes at most kMaxUnitsPerFrame.
  // No piece is larger than kMaxPieceUnits.
  static constexpr std::int32_t kMaxPieceUnits = 40;
  static constexpr std::int32_t kMaxUnitsPerFrame = 60000;

  SurfaceExtractor() noexcept = default;
  explicit SurfaceExtractor(const Params& params) noexcept : params_(params) {}
  void configure(const Params& params) noexcept { params_ = params; }

  // Validates and copies the frame (the driver's buffer may go back at once). False, with a counted reason, for a frame
  // that cannot be used or while busy.
  [[nodiscard]] bool try_begin(const DepthFrameView& frame, const View& view) noexcept;
  // kDone exactly once per frame, then kIdle.
  Progress step(WorkBudget& budget) noexcept;
  [[nodiscard]] bool busy() const noexcept { return phase_ != Phase::kIdle; }
  // Of the last finished frame.
  [[nodiscard]] const SurfaceFrame& result() const noexcept { return result_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] std::int32_t units_spent() const noexcept { return units_spent_; }  // on the last frame

  // What a half-resolution pixel was taken for: 1 + index in result().surfaces, 0 = none. For pictures and tests; valid
  // until the next try_begin.
  [[nodiscard]] std::size_t surface_at(std::int32_t column, std::int32_t row) const noexcept;
  [[nodiscard]] bool body_at(std::int32_t column, std::int32_t row) const noexcept {
    return (flags_(column, row) & kPixelBody) != 0;
  }

 private:
  enum class Phase : std::uint8_t {
    kIdle,
    kMask,
    kReduce,
    kFill,
    kDiffuse,
    kNormals,
    kGradient,
    kSuppress,
    kGrow,
    kSeedScan,
    kSeedResolve,
    kSeedLabel,
    kRansac,
    kMerge,
    kAssign,
    kRefit,
    kLeftoverScan,
    kLeftoverResolve,
    kLeftoverLabel,
    kClean,
    kPieceScan,
    kPieceResolve,
    kPieceLabel,
    kPieceJoin,
    kProfile,
    kOutline,
    kNosing,
    kBack,
    kPolygon,
    kFinish,
  };
  enum PixelClass : std::uint8_t { kNeither, kLevel, kUpright };

  static constexpr std::size_t kMaxPlanes = 32;
  static constexpr std::size_t kSamplesPerRegion = 256;
  static constexpr std::int32_t kColumnsPerPiece = 48;

  struct Box {  // half-resolution pixels, inclusive
    std::int16_t left = kHalfWidth_px, top = kHalfHeight_px, right = -1, bottom = -1;
    void add(std::int32_t column, std::int32_t row) noexcept;
    void add(const Box& other) noexcept;
    void grow(std::int32_t by_px) noexcept;
  };
  struct Plane {
    InversePlane plane;
    double d_m = 1.0;  // plane.d_m() of this round
    Lean lean = Lean::kAny;
    SurfaceKind kind = SurfaceKind::kOther;
    Box box;
    Vec3 centre_m = Vec3::Zero();
    Mat3 covariance = Mat3::Zero();
    PlaneMoments moments;
    double residual2 = 0.0;  // sum of squared normal distances of the fitted pixels
    double pixels = 0.0;
    bool alive = false;
    std::uint8_t surface = 0;  // 1 + index in the result
    std::uint8_t source = 0;   // the plane whose pixels these are
    std::uint16_t main_piece = 0;
    std::uint32_t piece_px = 0;
  };
  struct Piece {             // a connected piece of a plane's pixels
    std::uint8_t plane = 0;  // 1-based; 0: dropped
    std::uint32_t area_px = 0;
    double sum_column = 0.0, sum_row = 0.0;
  };

  void enter(Phase phase) noexcept;
  std::int32_t run_piece() noexcept;  // does one piece, returns its units
  [[nodiscard]] bool next_row() noexcept;

  void reduce_row() noexcept;
  void classify_row() noexcept;
  void seed_row() noexcept;
  void label_seed_row() noexcept;
  std::int32_t ransac_step() noexcept;
  void add_plane(const InversePlane& plane, Lean lean, std::size_t region) noexcept;
  void merge_planes() noexcept;
  std::int32_t assign_row() noexcept;
  void refit() noexcept;
  void start_round() noexcept;
  void leftover_row() noexcept;
  void clean_row() noexcept;
  void piece_row() noexcept;
  void label_piece_row() noexcept;
  void join_pieces() noexcept;
  [[nodiscard]] bool apart(const Piece& a, const Piece& b, const InversePlane& plane) const noexcept;
  void profile_row() noexcept;
  void outline_piece() noexcept;
  [[nodiscard]] bool begin_line(bool nosing) noexcept;
  std::int32_t line_step(bool nosing) noexcept;
  // Share of the polygon's pixels without data.
  [[nodiscard]] double invalid_share(const PolygonVertices& polygon) const noexcept;
  void build_polygon() noexcept;
  [[nodiscard]] EdgeKind judge_edge(const InversePlane& plane, const Vec3& a_m, const Vec3& b_m,
                                    const Vec3& inside_m) const noexcept;
  void finish() noexcept;
  [[nodiscard]] std::uint8_t plane_at(std::int32_t column, std::int32_t row) const noexcept;

  Params params_;
  View view_;
  Counters counters_;
  SurfaceFrame result_;
  SurfaceFrame next_;

  Phase phase_ = Phase::kIdle;
  std::int32_t row_ = 0;
  std::int32_t repeat_ = 0;
  std::size_t index_ = 0;
  std::int32_t round_ = 0;
  std::size_t seed_planes_ = 0;
  bool started_ = false;  // sub-step of a phase
  std::int32_t units_spent_ = 0;
  std::int64_t last_stamp_ns_ = 0;
  bool any_frame_ = false;
  std::int32_t measured_px_ = 0;
  std::int32_t outside_body_px_ = 0;

  FullDepthImage full_;
  HalfRays rays_;
  SelfFilter self_filter_;
  RawPicture raw_;
  InverseDepthImage measured_;
  InverseDepthImage smoothed_;
  HalfImage<std::uint8_t> flags_;
  NormalImage normal_image_;
  // PixelClass of each pixel until the seed regions are labelled, then its plane, 0 = none.
  HalfImage<std::uint8_t> assigned_;
  AnisotropicDiffusion diffusion_;
  NormalEstimation normal_estimation_;
  EdgeDetection edge_detection_;
  RegionLabelling regions_;

  // Seed regions: a thinned list of pixels each.
  std::array<std::array<PlaneSample, kSamplesPerRegion>, RegionLabelling::kMaxRegions + 1> samples_;
  std::array<std::uint16_t, RegionLabelling::kMaxRegions + 1> sample_count_{};
  std::array<std::int32_t, RegionLabelling::kMaxRegions + 1> sample_wait_px_{};
  std::array<Box, RegionLabelling::kMaxRegions + 1> region_box_{};
  std::array<std::uint8_t, RegionLabelling::kMaxRegions + 1> region_class_{};
  PlaneRansac ransac_;
  struct Draw {
    InversePlane plane;
    Lean lean = Lean::kAny;
    std::int32_t inliers = 0;
    bool found = false;
  };
  Draw best_draw_;

  std::array<Plane, kMaxPlanes + 1> planes_;  // 1-based
  std::size_t plane_count_ = 0;
  struct RowScratch {
    std::array<float, kHalfWidth_px> best, second, ray_norm, tolerance, plane;
    std::array<std::uint8_t, kHalfWidth_px> above, here;  // rows as they were before cleaning
  };
  RowScratch scratch_;

  std::array<Piece, RegionLabelling::kMaxRegions + 1> pieces_{};
  // Lowest and highest row of each plane per half-resolution column, -1 = none.
  std::array<std::array<std::int16_t, kHalfWidth_px>, kMaxPlanes + 1> lowest_{};
  std::array<std::array<std::int16_t, kHalfWidth_px>, kMaxPlanes + 1> highest_{};
  Contour contour_;
  ConvexOutline convex_outline_;
  Outline2 outline_;
  EdgeLineFinder line_finder_;
  EdgeLine nosing_;
  EdgeLine back_;
  EdgeLine occluder_;  // where a nearer surface hides the rest: cuts the polygon, but is no end of it
};

}  // namespace polygmap
