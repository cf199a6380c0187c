// SPDX-License-Identifier: Apache-2.0
// The paper's way from a depth frame to polygons, whole: what the module's own way is measured against.
//
// Half-resolution reduction -> diffusion (13) -> normals (11, 12) -> Canny edges -> regions between the edges -> RANSAC
// planes -> contours -> convex polygons. Gravity classes the normals and leans the planes, as in SurfaceExtractor;
// there is no self filter, no second fit and no nosing line here.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "tests/reference/paper_route/anisotropic_diffusion.hpp"
#include "tests/reference/paper_route/contour.hpp"
#include "tests/reference/paper_route/depth_reduction.hpp"
#include "tests/reference/paper_route/edges.hpp"
#include "tests/reference/paper_route/normals.hpp"
#include "tests/reference/paper_route/plane_ransac.hpp"
#include "tests/reference/paper_route/regions.hpp"

namespace polygmap {

struct PaperPlane {
  InversePlane plane;
  SurfaceKind kind = SurfaceKind::kOther;  // of the region's normals
  PolygonVertices polygon;                 // camera frame, m; convex, on the plane
};

class PaperRoute {
 public:
  struct Params {
    DepthNoiseModel noise;
    DepthReduction::Params reduction;
    AnisotropicDiffusion::Params diffusion;
    NormalEstimation::Params normals;
    EdgeDetection::Params edges;
    PlaneRansac::Params planes;
    double seed_tilt_rad = 0.44;  // a pixel's normal within this of level or upright belongs to a region
    double join_jump_m = 0.015;   // neighbours within join_jump_m + join_jump_per_m2 z^2 in depth are one region
    double join_jump_per_m2 = 0.02;
    std::uint32_t min_region_px = 110;  // half-resolution pixels
    double min_inlier_share = 0.5;
  };
  using Planes = StaticVector<PaperPlane, RegionLabelling::kMaxRegions>;

  // What the paper's code is published with, as far as this route has it: 60 iterations with a kappa of 33.5 mm,
  // regions of 5000 full-resolution pixels, 20 draws with 10 mm and at most 5 % outliers, a tilt of 25 degrees. Edges
  // keep this route's own thresholds: those published are of an 8-bit picture that it never makes.
  [[nodiscard]] static Params published() noexcept;

  explicit PaperRoute(const Params& params) noexcept : params_(params) {}

  // depth: row-major, the size of the intrinsics (even, at most the robot's camera); camera_up: unit, camera frame.
  void run(const std::uint16_t* depth, const CameraIntrinsics& intrinsics, const Vec3& camera_up) noexcept;

  [[nodiscard]] const Planes& planes() const noexcept { return planes_; }
  // Which of planes() a full-resolution pixel belongs to; none: 1 beyond the last.
  [[nodiscard]] std::size_t plane_at(std::int32_t column, std::int32_t row) const noexcept {
    const std::uint16_t region = regions_.labels()(column / 2, row / 2);
    return region == 0 ? planes_.size() : plane_of_[region];
  }

 private:
  enum PixelClass : std::uint8_t { kNeither, kLevel, kUpright };
  static constexpr std::size_t kSamplesPerRegion = 256;

  void smooth(const std::uint16_t* depth, std::int32_t width_px) noexcept;
  void find_edges() noexcept;
  void classify_row(std::int32_t row, const Vec3& camera_up) noexcept;
  void find_regions() noexcept;
  void sample_row(std::int32_t row) noexcept;
  [[nodiscard]] bool try_fit(std::size_t region, const Vec3& camera_up, PaperPlane& found) noexcept;
  void outline(std::size_t region, PaperPlane& found) noexcept;

  Params params_;
  Planes planes_;
  HalfRays rays_;
  DepthReduction reduction_;
  InverseDepthImage measured_;
  InverseDepthImage smoothed_;
  HalfImage<std::uint8_t> flags_;
  NormalImage normal_image_;
  HalfImage<std::uint8_t> classes_;  // PixelClass
  AnisotropicDiffusion diffusion_;
  NormalEstimation normals_;
  EdgeDetection edges_;
  RegionLabelling regions_;
  // A thinned list of every region's pixels.
  std::array<std::array<PlaneSample, kSamplesPerRegion>, RegionLabelling::kMaxRegions + 1> samples_{};
  std::array<std::uint16_t, RegionLabelling::kMaxRegions + 1> sample_count_{};
  std::array<std::int32_t, RegionLabelling::kMaxRegions + 1> sample_wait_px_{};
  std::array<std::uint8_t, RegionLabelling::kMaxRegions + 1> region_class_{};
  std::array<std::size_t, RegionLabelling::kMaxRegions + 1> plane_of_{};
  PlaneRansac ransac_;
  Contour contour_;
  ConvexOutline convex_;
  Outline2 outline_;
};

}  // namespace polygmap
