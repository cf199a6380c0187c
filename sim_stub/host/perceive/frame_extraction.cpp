// SPDX-License-Identifier: Apache-2.0
// Compiled once for each size, see the header.
#include "sim_stub/host/perceive/frame_extraction.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <string_view>
#include <utility>

#include "algorithms/perception/surface_extractor.hpp"

namespace polygmap {
namespace {

using polygmap_frames::Camera;
using polygmap_frames::Kind;
using polygmap_frames::Surface;

Kind kind_of(SurfaceKind kind) {
  return kind == SurfaceKind::kTread ? Kind::kTread : (kind == SurfaceKind::kRiser ? Kind::kRiser : Kind::kOther);
}

// A file that says more noise than usual may be a guess: down to half of it, and to the usual, the picture decides.
double least_noise_scale(const DepthNoiseModel& noise) {
  constexpr double kDepth_m = 1.0;
  return math::clamp(DepthNoiseModel{}.sigma_m(kDepth_m) / noise.sigma_m(kDepth_m), 0.5, 1.0);
}

// Walks a field list of the parameters (firmware/config/param_table.hpp) and sets what is named.
class Assign {
 public:
  explicit Assign(const polygmap_frames::Values& values, std::string prefix = "")
      : values_(values), prefix_(std::move(prefix)) {}
  template <class T>
  void operator()(std::string_view name, T& field, double, double, std::string_view) {
    for (const auto& [key, value] : values_) {
      if (key == prefix_ + std::string(name)) field = static_cast<T>(value);
    }
  }
  template <class T>
  void operator()(std::string_view name, T& field) {
    Assign inner(values_, prefix_ + std::string(name) + ".");
    T::visit(field, inner);
  }
  void ordered(std::string_view, std::string_view) {}

 private:
  const polygmap_frames::Values& values_;
  std::string prefix_;
};

class FrameExtractor final : public polygmap_frames::Extractor {
 public:
  FrameExtractor(const Camera& c, const polygmap_frames::Values& values) {
    params_.noise = {c.noise_base_m, c.noise_per_metre, c.noise_quadratic_per_m, c.noise_correlated_share,
                     c.noise_correlated_px};
    params_.depth_noise.gain = 0.5;
    params_.depth_noise.min_scale = least_noise_scale(params_.noise);
    params_.limits = {c.min_depth_m, c.max_depth_m};
    // What fills an eighth of a picture is a surface, however few pixels the picture has.
    const std::int32_t eighth_px = c.width_px * c.height_px / 8;
    for (std::int32_t* least_px :
         {&params_.planes.growing.min_plane_px, &params_.planes.growing.min_facet_px,
          &params_.regions.components.min_surface_px, &params_.regions.components.min_other_px}) {
      *least_px = std::min(*least_px, eighth_px);
    }
    Assign assign(values);
    SurfaceExtractor::Params::visit(params_, assign);
    extractor_.configure(params_);
    view_.intrinsics = {c.width_px, c.height_px, c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.depth_unit_m};
    view_.body_margin = {};
  }

  std::optional<double> extract(const std::uint16_t* depth, const Eigen::Vector3d& up) override {
    view_.camera_up = up;
    depth_ = depth;
    const DepthFrameView frame{++stamp_, static_cast<std::uint32_t>(stamp_), view_.intrinsics.width_px,
                               view_.intrinsics.height_px, depth};
    const auto start = std::chrono::steady_clock::now();
    if (!extractor_.try_begin(frame, view_)) return {};
    for (Progress progress = Progress::kBusy; progress == Progress::kBusy;) {
      WorkBudget budget(SurfaceExtractor::kMaxUnitsPerFrame);
      progress = extractor_.step(budget);
    }
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
  }

  std::vector<Surface> surfaces() const override {
    std::vector<Surface> out;
    for (const SurfacePatch& patch : extractor_.result().surfaces) {
      Surface& s = out.emplace_back();
      s.kind = kind_of(patch.kind);
      s.plane = patch.plane;
      s.normal = patch.normal;
      s.centroid_m = patch.centroid_m;
      s.d_m = patch.d_m;
      s.area_m2 = patch.area_m2;
      s.rmse_m = patch.rmse_m;
      s.invalid_fraction = patch.invalid_fraction;
      s.covariance = patch.covariance;
      s.polygon_m.assign(patch.polygon.begin(), patch.polygon.end());
      if (patch.nosing.valid) s.nosing_m = {patch.nosing.a_m, patch.nosing.b_m};
    }
    return out;
  }
  std::size_t surface_at(std::int32_t column, std::int32_t row) const override {
    return extractor_.surface_at(column, row, depth_);
  }
  double noise_sigma_m(double z_m) const override { return extractor_.noise().sigma_m(z_m); }
  void hold_noise() override {
    params_.depth_noise.gain = 0.0;
    extractor_.configure(params_);
  }

 private:
  SurfaceExtractor::Params params_;
  SurfaceExtractor::View view_;
  const std::uint16_t* depth_ = nullptr;  // of the last picture
  std::int64_t stamp_ = 0;
  SurfaceExtractor extractor_;
};

}  // namespace

bool holds(const Camera& camera) { return camera.width_px <= kDepthWidth_px && camera.height_px <= kDepthHeight_px; }

std::unique_ptr<polygmap_frames::Extractor> make_extractor(const Camera& camera,
                                                           const polygmap_frames::Values& values) {
  return std::make_unique<FrameExtractor>(camera, values);
}

}  // namespace polygmap
