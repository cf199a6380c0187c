// SPDX-License-Identifier: Apache-2.0
#include "firmware/config/camera_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <string_view>

#include "firmware/config/toml_reader.hpp"

namespace polygmap::config {
namespace {

// What a camera file may say: beyond these bounds the plane extraction refuses, or what it makes means nothing.
struct Key {
  std::string_view name;
  double least, most;
  double otherwise;  // NaN: required
};
constexpr double kRequired = std::numeric_limits<double>::quiet_NaN();
constexpr DepthNoiseModel kNoise;
constexpr Key kWidth{"width", kLeastSide_px, kMaxWidth_px, kRequired};
constexpr Key kHeight{"height", kLeastSide_px, kMaxHeight_px, kRequired};
constexpr Key kFx{"fx", 1.0, 1e5, kRequired};
constexpr Key kFy{"fy", 1.0, 1e5, kRequired};
constexpr Key kCx{"cx", -1e5, 1e5, kRequired};
constexpr Key kCy{"cy", -1e5, 1e5, kRequired};
constexpr Key kDepthUnit{"depth_unit_m", 1e-6, 0.1, kRequired};
constexpr Key kMinDepth{"min_depth_m", 0.001, 1000.0, 0.2};
constexpr Key kMaxDepth{"max_depth_m", 0.001, 1000.0, 6.0};
constexpr Key kNoiseBase{"noise_base_m", 1e-6, 1.0, kNoise.base_m};
constexpr Key kNoisePerMetre{"noise_per_metre", 0.0, 1.0, kNoise.per_metre};
constexpr Key kNoiseQuadratic{"noise_quadratic_per_m", 0.0, 1.0, kNoise.quadratic_per_m};
constexpr Key kCorrelatedShare{"noise_correlated_share", 0.0, 1.0, kNoise.correlated_share};
constexpr Key kCorrelated{"noise_correlated_px", 1.0, 1e6, kNoise.correlated_px};
constexpr std::array kKeys{kWidth,
                           kHeight,
                           kFx,
                           kFy,
                           kCx,
                           kCy,
                           kDepthUnit,
                           kMinDepth,
                           kMaxDepth,
                           kNoiseBase,
                           kNoisePerMetre,
                           kNoiseQuadratic,
                           kCorrelatedShare,
                           kCorrelated};

std::string text(double number) {
  std::ostringstream out;
  out << std::setprecision(10) << number;
  return out.str();
}

class CameraFile {
 public:
  CameraFile(FileName name, std::string_view text) : name_(std::move(name)), table_(parse_toml(name_, text)) {
    for (const auto& entry : table_) {
      const std::string_view key = entry.first.str();
      if (std::none_of(kKeys.begin(), kKeys.end(), [key](const Key& known) { return known.name == key; })) {
        name_.fail(entry.first.source().begin.line, "\"" + std::string(key) + "\" is no key of a camera");
      }
    }
  }
  [[noreturn]] void fail(const std::string& what) const { throw FileError(name_.text() + ": " + what + "."); }
  [[nodiscard]] double number(const Key& key) const {
    const std::string name(key.name);
    const toml::node* node = table_.get(key.name);
    if (node == nullptr && std::isnan(key.otherwise)) fail(name + " is missing");
    if (node == nullptr) return key.otherwise;
    const std::size_t line = node->source().begin.line;
    if (!node->is_number()) name_.fail(line, name + " must be a number");
    // A whole number that no double holds has no value<double>(), and is beyond every range here.
    const double value = node->is_integer() ? static_cast<double>(node->as_integer()->get()) : *node->value<double>();
    if (!(value >= key.least && value <= key.most)) {
      name_.fail(line, name + " must be from " + text(key.least) + " to " + text(key.most) + ", not " + text(value));
    }
    return value;
  }
  [[nodiscard]] std::int32_t whole(const Key& key) const {
    const double value = number(key);
    if (value != std::floor(value)) {
      name_.fail(table_.get(key.name)->source().begin.line,
                 std::string(key.name) + " must be a whole number, not " + text(value));
    }
    return static_cast<std::int32_t>(value);
  }

 private:
  FileName name_;
  toml::table table_;
};

}  // namespace

CameraProfile parse_camera(const std::string& path, std::string_view said) {
  const CameraFile file({"camera", path}, said);
  CameraProfile camera;
  camera.intrinsics = {file.whole(kWidth), file.whole(kHeight), file.number(kFx),       file.number(kFy),
                       file.number(kCx),   file.number(kCy),    file.number(kDepthUnit)};
  camera.min_depth_m = file.number(kMinDepth);
  camera.max_depth_m = file.number(kMaxDepth);
  camera.noise = {file.number(kNoiseBase), file.number(kNoisePerMetre), file.number(kNoiseQuadratic),
                  file.number(kCorrelatedShare), file.number(kCorrelated)};
  if (!(camera.min_depth_m < camera.max_depth_m)) {
    file.fail("min_depth_m, " + text(camera.min_depth_m) + ", must be less than max_depth_m, " +
              text(camera.max_depth_m));
  }
  if (const double most_m = 65534.0 * camera.intrinsics.depth_unit_m; camera.min_depth_m > most_m) {
    file.fail("16 bits of depth_unit_m reach " + text(most_m) + " m, less than min_depth_m");
  }
  return camera;
}
CameraProfile read_camera(const std::string& path) { return parse_camera(path, read_text({"camera", path})); }

}  // namespace polygmap::config
