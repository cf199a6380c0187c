// SPDX-License-Identifier: Apache-2.0
// Last stage of a frame: what lies on its treads, down to 20 mm high. Too small for a plane of its own, a thing is
// swallowed by the tread's polygon: here the rows over each tread are held against its plane.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

class ThingFinder {
 public:
  struct Params {
    double least_height_m = 0.012;
    double sigmas = 6.0;  // at 4.5 the warp of a picture's depths, twice as bad, makes things of a tread
    double most_height_m = 0.40;
    double before_back_m = 0.012;
    double seen_height_m = 0.06;
    double range_m = 1.3;
    double surface_width_m = 0.25;
    std::int32_t least_rows = 2;

    static void visit(auto& p, auto& field) {
      field("least_height_m", p.least_height_m, 0.002, 0.1, "What rises less above a tread is no thing on it.");
      field("sigmas", p.sigmas, 1.0, 20.0, "Nor is what rises by fewer sigmas of a row's height.");
      field("most_height_m", p.most_height_m, 0.02, 2.0, "Rows higher above a tread are no thing that lies on it.");
      field("before_back_m", p.before_back_m, 0.0, 0.1,
            "A thing's rows lie farther before the tread's back edge, or what overhangs it: noise of the riser does "
            "not.");
      field("seen_height_m", p.seen_height_m, 0.0, 0.5,
            "A thing of this height at the back edge is seen as a whole; what is higher, as high.");
      field("range_m", p.range_m, 0.1, 10.0, "Treads whose nosing is farther away are not looked over.");
      field("surface_width_m", p.surface_width_m, 0.05, 2.0,
            "A level or upright surface as wide in the picture is a surface of the map and no thing.");
      field("least_rows", p.least_rows, 1, 100, "A column shows a thing in as many of the rows that are looked at.");
    }
  };

  // All but params and noise are read until the stage is done; things are added to frame, whose surfaces are known.
  void begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics,
             const FrameImage& image, const Regions& regions, SurfaceFrame& frame) noexcept;
  Progress step(WorkBudget& budget) noexcept;

 private:
  static constexpr std::int32_t kRows = 4;  // next to each other, of every other column
  struct Rows {
    std::int16_t first = kDepthHeight_px, last = -1;
  };
  // What the rows over one tread are held against. A plane m is nearer than a row of inverse depth w at the ray r where
  // w > m . r.
  struct Tread {
    InversePlane plane;
    double d_m = 0.0;           // of the camera above it
    Vec3 bound = Vec3::Zero();  // the plane that things rise above
    Vec3 back = Vec3::Zero();   // the upright plane that things lie before; zero where none is known
    Vec3 along = Vec3::Zero();  // unit, into the tread
    double nosing_m = 0.0;      // along
    RegionId own = kNoRegion;
    std::int32_t first_column = 0, last_column = -1;
  };
  struct Seen {
    std::int32_t rows = 0;
    double near_m = 0.0, far_m = 0.0, height_m = 0.0;
    Vec3 near_p_m = Vec3::Zero(), far_p_m = Vec3::Zero();
  };

  void find_surfaces() noexcept;
  [[nodiscard]] bool begin_tread(const SurfacePatch& patch) noexcept;
  [[nodiscard]] bool find_back(const SurfacePatch& patch, EdgeLine& back) const noexcept;
  void add_rows(const SurfacePatch& piece, double above_px) noexcept;
  void fill_columns() noexcept;
  void look_along(std::int32_t column) noexcept;
  void take(std::int32_t column, std::int32_t row, Seen& seen) noexcept;

  Params params_;
  DepthNoiseModel noise_;
  CameraIntrinsics intrinsics_;
  const FrameImage* image_ = nullptr;
  const Regions* regions_ = nullptr;
  SurfaceFrame* frame_ = nullptr;
  std::array<bool, Regions::kMaxRegions + 1> is_surface_{};
  std::array<Rows, kColumns> rows_{};
  Tread tread_;
  std::size_t patch_ = 0;
  bool begun_ = false;  // the tread
  bool knows_surfaces_ = false;
  std::int32_t column_ = 0;
  std::uint32_t turn_ = 0;  // goes round with the pictures: which columns and rows are looked at
  WorkCount work_;
};

}  // namespace polygmap
