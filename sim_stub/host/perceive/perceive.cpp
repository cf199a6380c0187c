// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/perceive/perceive.hpp"

#include <lodepng.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>

#include "algorithms/perception/image/depth_range.hpp"
#include "sim_stub/host/output_file.hpp"

namespace polygmap::sim {
namespace {

using Json = nlohmann::ordered_json;
using polygmap_frames::Kind;
constexpr double kMinLevelArea_m2 = 0.02;
constexpr std::uintmax_t kMostFile_bytes = 16U << 20U;  // ten times what the largest picture takes unpacked

[[noreturn]] void fail(const std::string& sentence) { throw config::FileError(sentence); }

Json point(const Vec3& p) { return Json::array({p.x(), p.y(), p.z()}); }

// What is a surface's own; the rest is its plane's.
Json piece(const Surface& surface) {
  Json j;
  j["centroid"] = point(surface.centroid_m);
  j["area_m2"] = surface.area_m2;
  j["invalid_fraction"] = surface.invalid_fraction;
  j["polygon"] = Json::array();
  for (const Vec3& v : surface.polygon_m) j["polygon"].push_back(point(v));
  j["nosing"] = surface.nosing_m ? Json::array({point((*surface.nosing_m)[0]), point((*surface.nosing_m)[1])}) : Json();
  return j;
}

void save(const std::string& path, const std::vector<unsigned char>& bytes) {
  write_output(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

class Extraction {
 public:
  Extraction(const config::CameraProfile& profile, const DepthPng& picture, const polygmap_frames::Values& values) {
    const CameraIntrinsics& k = profile.intrinsics;
    const DepthNoiseModel& noise = profile.noise;
    // Whole columns of eight pixels and pairs of rows: what is left over at the right and below is not looked at.
    camera_ = {k.width_px / 8 * 8,
               k.height_px / 2 * 2,
               k.fx_px,
               k.fy_px,
               k.cx_px,
               k.cy_px,
               k.depth_unit_m,
               profile.min_depth_m,
               profile.max_depth_m,
               noise.base_m,
               noise.per_metre,
               noise.quadratic_per_m,
               noise.correlated_share,
               noise.correlated_px};
    for (std::int32_t r = 0; r < camera_.height_px; ++r) {
      const auto row = picture.depth.begin() + static_cast<std::ptrdiff_t>(r) * picture.width_px;
      depth_.insert(depth_.end(), row, row + camera_.width_px);
    }
    extractor_ = holds(camera_) ? make_extractor(camera_, values) : polygmap_1024x768::make_extractor(camera_, values);
  }
  // A camera delivers many frames; here one has to say by itself how noisy it is.
  void settle_noise(const Vec3& up) {
    constexpr int kMostRounds = 6;
    constexpr double kSettled = 0.03;
    const auto settled = [this](double z_m, double before_m) {
      return std::abs(extractor_->noise_sigma_m(z_m) - before_m) < kSettled * before_m;
    };
    for (int i = 0; i < kMostRounds; ++i) {
      const double near_m = extractor_->noise_sigma_m(1.0), far_m = extractor_->noise_sigma_m(3.0);
      static_cast<void>(run(up));
      if (settled(1.0, near_m) && settled(3.0, far_m)) break;
    }
    extractor_->hold_noise();
  }
  double run(const Vec3& up) {
    const std::optional<double> microseconds = extractor_->extract(depth_.data(), up);
    if (!microseconds) fail("The plane extraction refuses this camera or gravity.");
    return *microseconds;
  }
  [[nodiscard]] std::vector<Surface> surfaces() const { return extractor_->surfaces(); }
  [[nodiscard]] std::size_t surface_at(std::int32_t column, std::int32_t row) const {
    return column < camera_.width_px && row < camera_.height_px ? extractor_->surface_at(column, row) : 0U;
  }

 private:
  polygmap_frames::Camera camera_;
  std::vector<std::uint16_t> depth_;
  std::unique_ptr<polygmap_frames::Extractor> extractor_;
};

// The normal of the largest surface that faces upwards in the picture.
std::optional<Vec3> find_up(const std::vector<Surface>& surfaces) {
  std::optional<Vec3> up;
  double most_m2 = kMinLevelArea_m2;
  for (const Surface& surface : surfaces) {
    if (surface.normal.y() > -0.35 || std::abs(surface.normal.x()) > 0.5 || surface.area_m2 < most_m2) continue;
    most_m2 = surface.area_m2;
    up = surface.normal;
  }
  return up;
}

constexpr std::array<unsigned char, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr std::array<unsigned char, 12> kPngEnd{0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xAE, 0x42, 0x60, 0x82};

// It has neither its last chunk nor a whole chunk at its end.
bool is_cut_off(const std::vector<unsigned char>& png) {
  if (std::search(png.begin(), png.end(), kPngEnd.begin(), kPngEnd.end()) != png.end()) return false;
  constexpr std::size_t kAround_bytes = 12;  // length and kind before a chunk, checksum after it
  std::size_t at = kPngSignature.size(), chunks = 0;
  for (; at + kAround_bytes <= png.size(); ++chunks) {
    const std::size_t length = std::size_t{png[at]} << 24U | std::size_t{png[at + 1]} << 16U |
                               std::size_t{png[at + 2]} << 8U | std::size_t{png[at + 3]};
    at += kAround_bytes + length;
  }
  return at != png.size() || chunks == 0;
}

// Of a file that the PNG reader refuses, which speaks of its own stages only.
[[noreturn]] void fail_broken(const std::string& path, const std::vector<unsigned char>& file, unsigned error) {
  const std::string words = std::string(" (the PNG reader: ") + lodepng_error_text(error) + ").";
  const std::size_t first = std::min(file.size(), kPngSignature.size());
  if (!std::equal(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(first), kPngSignature.begin())) {
    fail("\"" + path + "\" is no PNG" + words);
  }
  if (is_cut_off(file)) {
    fail("The picture \"" + path + "\" is cut off: its " + std::to_string(file.size()) +
         " bytes end before the PNG does" + words);
  }
  fail("The picture \"" + path + "\" is damaged: bytes in it are not as they were written" + words);
}

}  // namespace

std::string size_text(std::int64_t width, std::int64_t height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

DepthPng read_depth(const std::string& path) {
  std::error_code none;
  if (std::filesystem::is_directory(path, none)) fail("\"" + path + "\" is a folder, not a picture.");
  if (const auto bytes = std::filesystem::file_size(path, none); !none && bytes > kMostFile_bytes) {
    fail("\"" + path + "\" has " + std::to_string(bytes) + " bytes, more than any depth picture that is read.");
  }
  std::vector<unsigned char> file;
  errno = 0;
  if (lodepng::load_file(file, path) != 0) config::fail_to_read("the picture", path);
  if (file.empty()) fail("The picture \"" + path + "\" is empty.");
  lodepng::State state;
  unsigned width = 0, height = 0;
  if (const unsigned error = lodepng_inspect(&width, &height, &state, file.data(), file.size()); error != 0) {
    fail_broken(path, file, error);
  }
  if (state.info_png.color.colortype != LCT_GREY || state.info_png.color.bitdepth != 16) {
    fail("\"" + path + "\" is no depth picture: it must be a PNG of one channel of 16 bits.");
  }
  if (width > polygmap_frames::kMaxWidth_px || height > polygmap_frames::kMaxHeight_px) {  // before memory is taken
    fail("\"" + path + "\" is " + size_text(width, height) + ", more than the " +
         size_text(polygmap_frames::kMaxWidth_px, polygmap_frames::kMaxHeight_px) + " that are read.");
  }
  // Pixels and a filter byte a row: a stream that holds more is broken, and is not unpacked. Texts are not looked at.
  state.decoder.zlibsettings.max_output_size = 2 * std::size_t{width} * height + height + 64;
  state.decoder.read_text_chunks = 0;
  state.info_raw.colortype = LCT_GREY;
  state.info_raw.bitdepth = 16;
  std::vector<unsigned char> bytes;
  if (const unsigned error = lodepng::decode(bytes, width, height, state, file); error != 0) {
    fail_broken(path, file, error);
  }
  DepthPng picture{static_cast<std::int32_t>(width), static_cast<std::int32_t>(height), {}};
  picture.depth.resize(std::size_t{width} * height);
  for (std::size_t i = 0; i < picture.depth.size(); ++i) {
    picture.depth[i] = static_cast<std::uint16_t>(256 * bytes[2 * i] + bytes[2 * i + 1]);
  }
  return picture;
}

Perceived perceive(const config::CameraProfile& camera, const DepthPng& picture, const std::optional<Vec3>& gravity,
                   int repeat, const polygmap_frames::Values& values, const std::atomic<int>* interrupt) {
  const Vec3 along_the_picture{0.0, -1.0, 0.0};
  Extraction extraction(camera, picture, values);
  Perceived out;
  RawRange range;
  range.set({camera.min_depth_m, camera.max_depth_m}, camera.intrinsics.depth_unit_m);
  const auto in_range = std::ranges::count_if(picture.depth, [&](std::uint16_t raw) { return range.valid(raw); });
  out.in_range_share = static_cast<double>(in_range) / static_cast<double>(picture.depth.size());
  if (gravity) {
    out.camera_up = -gravity->normalized();
    out.up_source = UpSource::kGiven;
    Extraction other(camera, picture, values);  // what is found from --gravity must not depend on this look
    static_cast<void>(other.run(along_the_picture));
    out.found_up = find_up(other.surfaces());
  } else {
    static_cast<void>(extraction.run(along_the_picture));
    out.found_up = find_up(extraction.surfaces());
    out.up_source = out.found_up ? UpSource::kFound : UpSource::kAssumed;
    out.camera_up = out.found_up.value_or(along_the_picture);
  }
  extraction.settle_noise(out.camera_up);
  for (int i = 0; i < std::max(repeat, 1); ++i) {
    throw_if_interrupted(interrupt);
    out.microseconds.push_back(extraction.run(out.camera_up));
  }

  std::map<std::uint8_t, std::size_t> index_of_plane;
  std::vector<std::uint8_t> label_of_surface{0};
  for (Surface& surface : extraction.surfaces()) {
    const auto [place, fresh] = index_of_plane.try_emplace(surface.plane, out.planes.size());
    label_of_surface.push_back(static_cast<std::uint8_t>(place->second + 1));
    if (fresh) out.planes.emplace_back();
    out.planes[place->second].push_back(std::move(surface));
  }
  for (PerceivedPlane& plane : out.planes) {
    std::stable_sort(plane.begin(), plane.end(),
                     [](const Surface& a, const Surface& b) { return a.area_m2 > b.area_m2; });
  }
  out.labels.reserve(picture.depth.size());
  for (std::int32_t r = 0; r < picture.height_px; ++r) {
    for (std::int32_t c = 0; c < picture.width_px; ++c) {
      out.labels.push_back(label_of_surface[extraction.surface_at(c, r)]);
    }
  }
  return out;
}

Eigen::Matrix4d plane_covariance(const Surface& surface) {
  const Vec3& n = surface.normal;
  Eigen::Matrix<double, 4, 3> jacobian;
  jacobian.topRows<3>() = -surface.d_m * (Mat3::Identity() - n * n.transpose());
  jacobian.bottomRows<1>() = surface.d_m * surface.d_m * n.transpose();
  return jacobian * surface.covariance * jacobian.transpose();
}

const char* kind_name(const Surface& surface, UpSource up) {
  if (up == UpSource::kAssumed) return "unknown";
  return surface.kind == Kind::kTread ? "tread" : (surface.kind == Kind::kRiser ? "riser" : "other");
}

const char* name_of(UpSource source) {
  switch (source) {
    case UpSource::kGiven:
      return "given";
    case UpSource::kFound:
      return "found";
    case UpSource::kAssumed:
      return "assumed";
  }
  return "?";
}

std::string doubt_of(const Perceived& perceived) {
  constexpr double kLevel = 0.97;  // cosine of 14 degrees
  constexpr double kLeastInRange_share = 0.001;
  if (perceived.in_range_share < kLeastInRange_share) {
    return "Less than one pixel in a thousand has a depth in the camera's range: are min_depth_m, max_depth_m and "
           "depth_unit_m in its file those of this picture?";
  }
  if (perceived.up_source != UpSource::kGiven) return {};
  double upright_m2 = 0.0, upside_down_m2 = 0.0, all_m2 = 0.0, level_looking_m2 = 0.0;
  for (const PerceivedPlane& pieces : perceived.planes) {
    for (const Surface& s : pieces) {
      const double cosine = s.normal.dot(perceived.camera_up);
      all_m2 += s.area_m2;
      if (cosine > kLevel) upright_m2 += s.area_m2;
      if (cosine < -kLevel) upside_down_m2 += s.area_m2;
      if (perceived.found_up && s.normal.dot(*perceived.found_up) > kLevel) level_looking_m2 += s.area_m2;
    }
  }
  if (upright_m2 <= 0.05 * upside_down_m2 && upside_down_m2 >= std::max(kMinLevelArea_m2, 0.1 * all_m2)) {
    return "By --gravity every level surface in view is a ceiling: does it point down, x right, y down, z forward?";
  }
  if (!perceived.found_up) return {};
  const Vec3 &given = perceived.camera_up, &found = *perceived.found_up;
  const double cosine = given.dot(found);
  if (cosine > kLevel || upright_m2 >= level_looking_m2) return {};
  const auto tidy = [](double x) { return std::round(100.0 * x) / 100.0 + 0.0; };  // no -0.00
  char line[256];
  std::snprintf(
      line, sizeof line,
      "By --gravity up is (%.2f, %.2f, %.2f), but the largest level-looking plane says (%.2f, %.2f, %.2f), %.0f "
      "degrees apart: does it point down in the camera frame, x right, y down, z forward?",
      tidy(given.x()), tidy(given.y()), tidy(given.z()), tidy(found.x()), tidy(found.y()), tidy(found.z()),
      std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / kPi);
  return line;
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

void write_planes(const std::string& path, const Perceived& perceived, const std::string& params_hash) {
  Json planes = Json::array();
  for (std::size_t i = 0; i < perceived.planes.size(); ++i) {
    const PerceivedPlane& pieces = perceived.planes[i];
    const Surface& largest = pieces.front();
    Json j;
    j["id"] = i + 1;
    j["kind"] = kind_name(largest, perceived.up_source);
    j["normal"] = point(largest.normal);
    j["d_m"] = largest.d_m;
    j["covariance"] = Json::array();
    const Eigen::Matrix4d covariance = plane_covariance(largest);
    for (int r = 0; r < 4; ++r) {
      j["covariance"].push_back({covariance(r, 0), covariance(r, 1), covariance(r, 2), covariance(r, 3)});
    }
    j["rmse_mm"] = 1e3 * largest.rmse_m;
    j.update(piece(largest));
    j["area_m2"] = std::accumulate(pieces.begin(), pieces.end(), 0.0,
                                   [](double sum, const Surface& s) { return sum + s.area_m2; });
    j["pieces"] = Json::array();
    for (const Surface& s : pieces) j["pieces"].push_back(piece(s));
    planes.push_back(j);
  }
  Json warnings = Json::array();
  if (const std::string doubt = doubt_of(perceived); !doubt.empty()) warnings.push_back(doubt);
  const Json json{{"planes", planes},
                  {"up", point(perceived.camera_up)},
                  {"up_source", name_of(perceived.up_source)},
                  {"warnings", warnings},
                  {"params_hash", params_hash}};
  write_output(path, json.dump(1) + "\n");
}

}  // namespace polygmap::sim
