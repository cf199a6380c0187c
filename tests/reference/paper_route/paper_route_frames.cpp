// SPDX-License-Identifier: Apache-2.0
// paper_route_frames own|published CAMERA.toml UP_X UP_Y UP_Z FRAME.png LABELS.png PLANES.json: one depth frame through
// the paper's route, with this route's own parameters or the published ones; labels and planes as `polygmap perceive`
// writes them. The nosing of a tread is its polygon's longest edge on the near side, as the route knows no better.
#include <lodepng.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "firmware/config/camera_file.hpp"
#include "tests/reference/paper_route/paper_route.hpp"

namespace {

using polygmap::PaperPlane;
using polygmap::Vec3;
using Json = nlohmann::json;

Json vector(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

Json nosing(const PaperPlane& plane) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : plane.polygon) middle += p / static_cast<double>(plane.polygon.size());
  double longest_m = 0.0;
  Json ends;
  for (std::size_t i = 0; i < plane.polygon.size(); ++i) {
    const Vec3 &a = plane.polygon[i], &b = plane.polygon[(i + 1) % plane.polygon.size()];
    const Vec3 between = 0.5 * (a + b);
    const bool near_side = between.y() / between.z() > middle.y() / middle.z();
    const bool across = std::abs(a.x() / a.z() - b.x() / b.z()) > std::abs(a.y() / a.z() - b.y() / b.z());
    if (!near_side || !across || (b - a).norm() <= longest_m) continue;
    longest_m = (b - a).norm();
    ends = {vector(a), vector(b)};
  }
  return ends;
}

const char* name_of(polygmap::SurfaceKind kind) {
  return kind == polygmap::SurfaceKind::kTread ? "tread" : kind == polygmap::SurfaceKind::kRiser ? "riser" : "other";
}

int run(char** argv) {
  const auto camera = polygmap::config::read_camera(argv[2]);
  const Vec3 up{std::atof(argv[3]), std::atof(argv[4]), std::atof(argv[5])};
  std::vector<unsigned char> bytes;
  unsigned width = 0, height = 0;
  if (lodepng::decode(bytes, width, height, argv[6], LCT_GREY, 16) != 0U) return 2;
  std::vector<std::uint16_t> depth(static_cast<std::size_t>(width) * height);
  for (std::size_t i = 0; i < depth.size(); ++i) {
    depth[i] = static_cast<std::uint16_t>(bytes[2 * i] << 8 | bytes[2 * i + 1]);
  }
  auto params =
      std::string(argv[1]) == "published" ? polygmap::PaperRoute::published() : polygmap::PaperRoute::Params{};
  params.noise = camera.noise;
  const auto route = std::make_unique<polygmap::PaperRoute>(params);
  route->run(depth.data(), camera.intrinsics, up.normalized());

  std::vector<unsigned char> labels(depth.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const auto column = static_cast<std::int32_t>(i % width), row = static_cast<std::int32_t>(i / width);
    const std::size_t plane = route->plane_at(column, row);
    labels[i] = static_cast<unsigned char>(depth[i] > 0 && plane < route->planes().size() ? plane + 1 : 0);
  }
  Json planes = Json::array();
  for (const PaperPlane& p : route->planes()) {
    planes.push_back({{"id", planes.size() + 1},
                      {"kind", name_of(p.kind)},
                      {"normal", vector(p.plane.normal())},
                      {"d_m", p.plane.d_m()},
                      {"nosing", p.kind == polygmap::SurfaceKind::kTread ? nosing(p) : Json()}});
  }
  std::ofstream(argv[8]) << Json{{"planes", planes}};
  lodepng::State state;  // otherwise few labels make a palette, whose indices readers take for labels
  state.encoder.auto_convert = 0;
  state.info_raw.colortype = state.info_png.color.colortype = LCT_GREY;
  state.info_raw.bitdepth = state.info_png.color.bitdepth = 8;
  std::vector<unsigned char> png;
  return lodepng::encode(png, labels, width, height, state) == 0U && lodepng::save_file(png, argv[7]) == 0U ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 9) {
    std::fprintf(stderr,
                 "paper_route_frames own|published CAMERA.toml UP_X UP_Y UP_Z FRAME.png LABELS.png PLANES.json\n");
    return 2;
  }
  try {
    return run(argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "paper_route_frames: %s\n", error.what());
    return 2;
  }
}
