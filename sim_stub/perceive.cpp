// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/perceive.hpp"

#include <lodepng.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

namespace polygmap::sim {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kMinLevelArea_m2 = 0.02;

[[noreturn]] void fail(const std::string& sentence) { throw FileError(sentence); }

Json point(const Vec3& p) { return Json::array({p.x(), p.y(), p.z()}); }

void save(const std::string& path, const std::vector<unsigned char>& bytes) {
  if (lodepng::save_file(bytes, path) != 0) fail("Cannot write \"" + path + "\".");
}

// Of the normal and d of m = -normal / d, from that of m.
Eigen::Matrix4d plane_covariance(const SurfacePatch& surface) {
  const Vec3& n = surface.normal;
  Eigen::Matrix<double, 4, 3> jacobian;
  jacobian.topRows<3>() = -surface.d_m * (Mat3::Identity() - n * n.transpose());
  jacobian.bottomRows<1>() = surface.d_m * surface.d_m * n.transpose();
  return jacobian * surface.covariance * jacobian.transpose();
}

class Extraction {
 public:
  Extraction(const CameraProfile& camera, const DepthPng& picture) : picture_(picture) {
    params_.noise = camera.noise;
    params_.noise_gain = 0.5;
    params_.limits.min_depth_m = camera.min_depth_m;
    params_.limits.max_depth_m = camera.max_depth_m;
    extractor_->configure(params_);
    view_.intrinsics = camera.intrinsics;
    view_.body_margin = {};
  }
  // A camera delivers many frames; here one has to say by itself how noisy it is.
  void settle_noise(const Vec3& up) {
    constexpr int kMostRounds = 6;
    constexpr double kSettled = 0.03;
    for (int i = 0; i < kMostRounds; ++i) {
      const double before = extractor_->noise_scale();
      static_cast<void>(run(up));
      if (std::abs(extractor_->noise_scale() - before) < kSettled * before) break;
    }
    params_.noise_gain = 0.0;
    extractor_->configure(params_);
  }
  double run(const Vec3& up) {
    view_.camera_up = up;
    const DepthFrameView frame{++stamp_, static_cast<std::uint32_t>(stamp_), picture_.width_px, picture_.height_px,
                               picture_.depth.data()};
    const auto start = std::chrono::steady_clock::now();
    if (!extractor_->try_begin(frame, view_)) {
      fail("The camera file's intrinsics are out of range: focal lengths must be above 1 px, the size from 32x32 to " +
           std::to_string(kDepthWidth_px) + "x" + std::to_string(kDepthHeight_px) + " and even.");
    }
    for (Progress progress = Progress::kBusy; progress == Progress::kBusy;) {
      WorkBudget budget(SurfaceExtractor::kMaxUnitsPerFrame);
      progress = extractor_->step(budget);
    }
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
  }
  [[nodiscard]] const SurfaceExtractor& extractor() const { return *extractor_; }

 private:
  const DepthPng& picture_;
  SurfaceExtractor::Params params_;
  SurfaceExtractor::View view_;
  std::int64_t stamp_ = 0;
  std::unique_ptr<SurfaceExtractor> extractor_ = std::make_unique<SurfaceExtractor>();
};

// The normal of the largest surface that faces upwards in the picture.
std::optional<Vec3> find_up(const SurfaceFrame& frame) {
  std::optional<Vec3> up;
  double most_m2 = kMinLevelArea_m2;
  for (const SurfacePatch& surface : frame.surfaces) {
    if (surface.normal.y() > -0.35 || std::abs(surface.normal.x()) > 0.5 || surface.area_m2 < most_m2) continue;
    most_m2 = surface.area_m2;
    up = surface.normal;
  }
  return up;
}

}  // namespace

DepthPng read_depth(const std::string& path) {
  std::vector<unsigned char> file;
  if (lodepng::load_file(file, path) != 0) fail("Cannot read the picture \"" + path + "\".");
  lodepng::State state;
  unsigned width = 0, height = 0;
  if (const unsigned error = lodepng_inspect(&width, &height, &state, file.data(), file.size()); error != 0) {
    fail("\"" + path + "\" is no PNG: " + lodepng_error_text(error) + ".");
  }
  if (state.info_png.color.colortype != LCT_GREY || state.info_png.color.bitdepth != 16) {
    fail("\"" + path + "\" is no depth picture: it must be a PNG of one channel of 16 bits.");
  }
  state.info_raw.colortype = LCT_GREY;
  state.info_raw.bitdepth = 16;
  std::vector<unsigned char> bytes;
  if (const unsigned error = lodepng::decode(bytes, width, height, state, file); error != 0) {
    fail("\"" + path + "\" is broken: " + lodepng_error_text(error) + ".");
  }
  DepthPng picture{static_cast<std::int32_t>(width), static_cast<std::int32_t>(height), {}};
  picture.depth.resize(std::size_t{width} * height);
  for (std::size_t i = 0; i < picture.depth.size(); ++i) {
    picture.depth[i] = static_cast<std::uint16_t>(256 * bytes[2 * i] + bytes[2 * i + 1]);
  }
  return picture;
}

Perceived perceive(const CameraProfile& camera, const DepthPng& picture, const std::optional<Vec3>& gravity,
                   int repeat) {
  Extraction extraction(camera, picture);
  Perceived out;
  if (gravity) {
    out.camera_up = -gravity->normalized();
  } else {
    const Vec3 along_the_picture{0.0, -1.0, 0.0};
    static_cast<void>(extraction.run(along_the_picture));
    const std::optional<Vec3> found = find_up(extraction.extractor().result());
    out.up_assumed = !found;
    out.camera_up = found.value_or(along_the_picture);
  }
  extraction.settle_noise(out.camera_up);
  for (int i = 0; i < std::max(repeat, 1); ++i) out.microseconds.push_back(extraction.run(out.camera_up));

  const SurfaceExtractor& extractor = extraction.extractor();
  std::map<std::uint8_t, std::size_t> index_of_plane;
  std::vector<std::uint8_t> label_of_surface{0};
  std::vector<double> largest_m2;
  for (const SurfacePatch& surface : extractor.result().surfaces) {
    const auto [place, fresh] = index_of_plane.try_emplace(surface.plane, out.planes.size());
    label_of_surface.push_back(static_cast<std::uint8_t>(place->second + 1));
    if (fresh) {
      out.planes.emplace_back();
      largest_m2.push_back(0.0);
    }
    PerceivedPlane& plane = out.planes[place->second];
    plane.area_m2 += surface.area_m2;
    if (surface.area_m2 <= largest_m2[place->second]) continue;
    largest_m2[place->second] = surface.area_m2;
    plane.kind = surface.kind;
    plane.normal = surface.normal;
    plane.d_m = surface.d_m;
    plane.covariance = plane_covariance(surface);
    plane.centroid_m = surface.centroid_m;
    plane.rmse_m = surface.rmse_m;
    plane.invalid_fraction = surface.invalid_fraction;
    plane.polygon_m.assign(surface.polygon.begin(), surface.polygon.end());
    plane.nosing = surface.nosing;
  }
  out.labels.resize(picture.depth.size());
  for (std::int32_t r = 0; r < picture.height_px; ++r) {
    for (std::int32_t c = 0; c < picture.width_px; ++c) {
      out.labels[static_cast<std::size_t>(r * picture.width_px + c)] = label_of_surface[extractor.surface_at(c, r)];
    }
  }
  return out;
}

void write_labels(const std::string& path, const DepthPng& picture, const Perceived& perceived) {
  lodepng::State state;
  state.encoder.auto_convert = 0;  // it would turn labels into a palette
  state.info_raw.colortype = state.info_png.color.colortype = LCT_GREY;
  state.info_raw.bitdepth = state.info_png.color.bitdepth = 8;
  std::vector<unsigned char> bytes;
  const unsigned error = lodepng::encode(bytes, perceived.labels, static_cast<unsigned>(picture.width_px),
                                         static_cast<unsigned>(picture.height_px), state);
  if (error != 0) fail("Cannot encode \"" + path + "\": " + lodepng_error_text(error) + ".");
  save(path, bytes);
}

void write_planes(const std::string& path, const Perceived& perceived) {
  Json planes = Json::array();
  for (std::size_t i = 0; i < perceived.planes.size(); ++i) {
    const PerceivedPlane& p = perceived.planes[i];
    Json j;
    j["id"] = i + 1;
    j["kind"] = p.kind == SurfaceKind::kTread ? "tread" : (p.kind == SurfaceKind::kRiser ? "riser" : "other");
    j["normal"] = point(p.normal);
    j["d_m"] = p.d_m;
    j["covariance"] = Json::array();
    for (int r = 0; r < 4; ++r) {
      j["covariance"].push_back({p.covariance(r, 0), p.covariance(r, 1), p.covariance(r, 2), p.covariance(r, 3)});
    }
    j["centroid"] = point(p.centroid_m);
    j["area_m2"] = p.area_m2;
    j["rmse_mm"] = 1e3 * p.rmse_m;
    j["invalid_fraction"] = p.invalid_fraction;
    j["polygon"] = Json::array();
    for (const Vec3& v : p.polygon_m) j["polygon"].push_back(point(v));
    j["nosing"] = p.nosing.valid ? Json::array({point(p.nosing.a_m), point(p.nosing.b_m)}) : Json();
    planes.push_back(j);
  }
  std::ofstream file(path);
  file << Json{{"planes", planes}, {"up", point(perceived.camera_up)}}.dump(1) << "\n";
  file.close();
  if (!file) fail("Cannot write \"" + path + "\".");
}

void write_picture(const std::string& path, const CameraProfile& camera, const DepthPng& picture,
                   const Perceived& perceived) {
  const auto width = static_cast<std::size_t>(picture.width_px);
  std::vector<unsigned char> rgb(3 * picture.depth.size());
  for (std::size_t i = 0; i < picture.depth.size(); ++i) {
    const double z_m = picture.depth[i] * camera.intrinsics.depth_unit_m;
    const double grey = picture.depth[i] == 0 ? 0.0 : 60.0 + 140.0 * std::max(0.0, 1.0 - z_m / camera.max_depth_m);
    const unsigned label = perceived.labels[i];
    const std::array<unsigned, 3> hue{(label * 67U) % 200U + 55U, (label * 131U + 80U) % 200U + 55U,
                                      (label * 29U + 160U) % 200U + 55U};
    for (std::size_t k = 0; k < 3; ++k) {
      rgb[3 * i + k] = static_cast<unsigned char>(label == 0 ? grey : 0.5 * grey + 0.5 * hue[k]);
    }
  }
  const CameraIntrinsics& intrinsics = camera.intrinsics;
  const auto draw = [&](const Vec3& a, const Vec3& b, const std::array<unsigned char, 3>& colour) {
    constexpr int kSteps = 800;
    for (int s = 0; s <= kSteps; ++s) {
      const Vec3 p = a + (b - a) * (static_cast<double>(s) / kSteps);
      if (!(p.z() > 0.01)) continue;
      const auto u = static_cast<std::int64_t>(std::lround(p.x() / p.z() * intrinsics.fx_px + intrinsics.cx_px));
      const auto v = static_cast<std::int64_t>(std::lround(p.y() / p.z() * intrinsics.fy_px + intrinsics.cy_px));
      if (u < 0 || v < 0 || u >= picture.width_px || v >= picture.height_px) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        rgb[3 * (static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u)) + k] = colour[k];
      }
    }
  };
  for (const PerceivedPlane& plane : perceived.planes) {
    for (std::size_t i = 0; i < plane.polygon_m.size(); ++i) {
      draw(plane.polygon_m[i], plane.polygon_m[(i + 1) % plane.polygon_m.size()], {255, 255, 255});
    }
    if (plane.nosing.valid) draw(plane.nosing.a_m, plane.nosing.b_m, {255, 40, 40});
  }
  std::vector<unsigned char> bytes;
  const unsigned error = lodepng::encode(bytes, rgb, static_cast<unsigned>(picture.width_px),
                                         static_cast<unsigned>(picture.height_px), LCT_RGB, 8);
  if (error != 0) fail("Cannot encode \"" + path + "\": " + lodepng_error_text(error) + ".");
  save(path, bytes);
}

}  // namespace polygmap::sim
