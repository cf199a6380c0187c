// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/perceive/frame_page.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>

#include "sim_stub/host/perceive/perceived_picture.hpp"
#include "sim_stub/host/report/report_page.hpp"

namespace polygmap::sim {
namespace {

constexpr std::int64_t kMostPoints = 60000;  // with the picture and the page itself, below 2 MB

// Every stride-th column and row: depth and plane of each, row by row. What has no depth in range is missing.
ReportJson points_json(const config::CameraProfile& camera, const DepthPng& picture, const Perceived& perceived) {
  std::int32_t stride = 1;
  const auto across = [&stride](std::int32_t side_px) { return (side_px + stride - 1) / stride; };
  while (std::int64_t{across(picture.width_px)} * across(picture.height_px) > kMostPoints) ++stride;
  ReportTable table({0.0005, 0.5});
  for (std::int32_t r = 0; r < picture.height_px; r += stride) {
    for (std::int32_t c = 0; c < picture.width_px; c += stride) {
      const auto at =
          static_cast<std::size_t>(r) * static_cast<std::size_t>(picture.width_px) + static_cast<std::size_t>(c);
      const double z_m = picture.depth[at] * camera.intrinsics.depth_unit_m;
      const bool is_in_range = z_m >= camera.min_depth_m && z_m <= camera.max_depth_m;
      table.add(std::array{is_in_range ? z_m : std::numeric_limits<double>::quiet_NaN(),
                           static_cast<double>(perceived.labels[at])});
    }
  }
  return {{"stride", stride},
          {"columns", across(picture.width_px)},
          {"rows", across(picture.height_px)},
          {"depth_and_plane", table.json()}};
}

ReportJson plane_json(std::size_t id, const PerceivedPlane& plane, UpSource up) {
  const Surface& largest = plane.front();
  const Eigen::Matrix4d covariance = plane_covariance(largest);
  const Eigen::SelfAdjointEigenSolver<Mat3> normal(covariance.topLeftCorner<3, 3>());
  ReportJson pieces = ReportJson::array();
  for (const Surface& s : plane) {
    ReportJson vertices = ReportJson::array();
    for (const Vec3& p : s.polygon_m) {
      for (const double c : p) vertices.push_back(rounded(c));
    }
    ReportJson piece{
        {"vertices", vertices}, {"area_m2", rounded(s.area_m2)}, {"invalid_fraction", rounded(s.invalid_fraction)}};
    if (s.nosing_m) {
      const std::array<double, 6> ends{(*s.nosing_m)[0].x(), (*s.nosing_m)[0].y(), (*s.nosing_m)[0].z(),
                                       (*s.nosing_m)[1].x(), (*s.nosing_m)[1].y(), (*s.nosing_m)[1].z()};
      piece["nosing"] = rounded(ends);
    }
    pieces.push_back(piece);
  }
  return {{"id", id},
          {"kind", kind_name(largest, up)},
          {"normal", rounded(largest.normal, 5)},
          {"d_m", rounded(largest.d_m, 5)},
          {"rmse_mm", rounded(1e3 * largest.rmse_m, 2)},
          {"sigma_offset_mm", rounded(1e3 * std::sqrt(std::max(covariance(3, 3), 0.0)), 2)},
          {"sigma_angle_deg", rounded(std::sqrt(std::max(normal.eigenvalues()[2], 0.0)) * 180.0 / kPi, 3)},
          {"pieces", pieces}};
}

}  // namespace

ReportJson frame_json(const std::string& name, const config::CameraProfile& camera, const DepthPng& picture,
                      const Perceived& perceived, const std::string& params_hash) {
  const CameraIntrinsics& k = camera.intrinsics;
  ReportJson planes = ReportJson::array(), warnings = ReportJson::array();
  for (std::size_t i = 0; i < perceived.planes.size(); ++i) {
    planes.push_back(plane_json(i + 1, perceived.planes[i], perceived.up_source));
  }
  if (const std::string doubt = doubt_of(perceived); !doubt.empty()) warnings.push_back(doubt);
  std::vector<double> times_us = perceived.microseconds;
  std::sort(times_us.begin(), times_us.end());
  return {{"format", "polygmap-frame"},
          {"version", 1},
          {"name", std::filesystem::path(name).filename().string()},
          {"camera",
           {{"width_px", k.width_px},
            {"height_px", k.height_px},
            {"fx_px", k.fx_px},
            {"fy_px", k.fy_px},
            {"cx_px", k.cx_px},
            {"cy_px", k.cy_px},
            {"min_depth_m", camera.min_depth_m},
            {"max_depth_m", camera.max_depth_m}}},
          {"up", rounded(perceived.camera_up, 5)},
          {"up_source", name_of(perceived.up_source)},
          {"in_range_share", rounded(perceived.in_range_share)},
          {"params_hash", params_hash},
          {"warnings", warnings},
          {"cost",
           {{"repeats", times_us.size()},
            {"median_us", rounded(times_us[times_us.size() / 2], 0)},
            {"most_us", rounded(times_us.back(), 0)}}},
          {"planes", planes},
          {"points", points_json(camera, picture, perceived)},
          {"picture", base64_of(picture_png(camera, picture, perceived))}};
}

void write_frame_page(const std::string& path, const std::string& name, const config::CameraProfile& camera,
                      const DepthPng& picture, const Perceived& perceived, const std::string& params_hash) {
  write_page(path, frame_json(name, camera, picture, perceived, params_hash));
}

}  // namespace polygmap::sim
