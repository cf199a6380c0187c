// SPDX-License-Identifier: Apache-2.0
// The picture and the pages that `perceive` and `estimate` write for people: what stands in them.
#include <gtest/gtest.h>
#include <lodepng.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/estimate/log_page.hpp"
#include "sim_stub/host/perceive/frame_page.hpp"
#include "sim_stub/host/perceive/perceived_picture.hpp"
#include "sim_stub/host/report/thinning.hpp"
#include "tests/support/depth_scene.hpp"

namespace polygmap::sim {
namespace {

using Rgb = std::array<unsigned, 3>;
constexpr Rgb kTread{0, 158, 115}, kRiser{86, 180, 233};

struct SeenStairs {
  config::CameraProfile camera;
  DepthPng picture;
  Perceived perceived;
};

SeenStairs seen_stairs() {
  test::DepthScene scene;
  scene.place_camera(0.77, 1.05);
  scene.intrinsics = {};
  scene.intrinsics.width_px = 640;
  scene.intrinsics.height_px = 480;
  scene.intrinsics.fx_px = scene.intrinsics.fy_px = 366.7;
  scene.intrinsics.cx_px = 322.7;
  scene.intrinsics.cy_px = 242.3;
  scene.intrinsics.depth_unit_m = 0.001;
  scene.add_stairs({});
  test::DepthPicture picture = test::render(scene);
  test::add_noise(picture, {}, 3);
  SeenStairs seen;
  seen.camera.intrinsics = scene.intrinsics;
  seen.picture = {640, 480, picture.raw()};
  seen.perceived = perceive(seen.camera, seen.picture, Vec3(-scene.camera_up()), 1);
  return seen;
}

struct Drawn {
  std::vector<unsigned char> rgb;
  unsigned width = 0, height = 0;
  [[nodiscard]] Rgb at(std::size_t u, std::size_t v) const {
    const std::size_t i = 3 * (v * width + u);
    return {rgb[i], rgb[i + 1], rgb[i + 2]};
  }
};

Drawn drawn(const SeenStairs& seen) {
  Drawn d;
  EXPECT_EQ(lodepng::decode(d.rgb, d.width, d.height, picture_png(seen.camera, seen.picture, seen.perceived), LCT_RGB),
            0U);
  return d;
}

double distance(const Rgb& a, const Rgb& b) {
  double squares = 0.0;
  for (std::size_t k = 0; k < 3; ++k) squares += std::pow(static_cast<double>(a[k]) - static_cast<double>(b[k]), 2.0);
  return std::sqrt(squares);
}

// Pixels that are farther than kClear_px from every drawn edge.
std::vector<bool> clear_of_edges(const SeenStairs& seen) {
  constexpr double kClear_px = 6.0;
  std::vector<bool> clear(640 * 480, true);
  const CameraIntrinsics& k = seen.camera.intrinsics;
  const auto pixel_of = [&k](const Vec3& p) {
    return Eigen::Vector2d(p.x() / p.z() * k.fx_px + k.cx_px, p.y() / p.z() * k.fy_px + k.cy_px);
  };
  for (const PerceivedPlane& pieces : seen.perceived.planes) {
    for (const Surface& s : pieces) {
      for (std::size_t i = 0; i < s.polygon_m.size(); ++i) {
        const Eigen::Vector2d from = pixel_of(s.polygon_m[i]);
        const Eigen::Vector2d along = pixel_of(s.polygon_m[(i + 1) % s.polygon_m.size()]) - from;
        for (std::size_t at = 0; at < clear.size(); ++at) {
          const Eigen::Vector2d p(static_cast<double>(at % 640), static_cast<double>(at / 640));
          const double share = std::clamp((p - from).dot(along) / std::max(along.squaredNorm(), 1e-9), 0.0, 1.0);
          if ((p - from - share * along).norm() < kClear_px) clear[at] = false;
        }
      }
    }
  }
  return clear;
}

TEST(PerceivedPicture, Stairs_EveryPlaneIsOfItsKindsColourAndHasItsNumber) {
  const SeenStairs seen = seen_stairs();
  const Drawn picture = drawn(seen);
  const std::vector<bool> clear = clear_of_edges(seen);
  ASSERT_GE(seen.perceived.planes.size(), 4U);
  std::vector<int> pixels(seen.perceived.planes.size() + 1, 0), own(pixels), bright(pixels);
  for (std::size_t at = 0; at < clear.size(); ++at) {
    const std::size_t id = seen.perceived.labels[at];
    if (id == 0 || !clear[at]) continue;
    const std::string kind = kind_name(seen.perceived.planes[id - 1].front(), seen.perceived.up_source);
    ASSERT_NE(kind, "unknown");
    const Rgb now = picture.at(at % 640, at / 640);
    const Rgb wanted = kind == "tread" ? kTread : kRiser, other = kind == "tread" ? kRiser : kTread;
    ++pixels[id];
    own[id] += distance(now, wanted) < distance(now, other) ? 1 : 0;
    bright[id] += *std::min_element(now.begin(), now.end()) > 210 ? 1 : 0;
  }
  for (std::size_t id = 1; id < pixels.size(); ++id) {
    if (pixels[id] < 1000) continue;  // what is narrow has its number across its edges
    EXPECT_GT(own[id], pixels[id] * 8 / 10) << "plane " << id << " of " << pixels[id] << " pixels";
    EXPECT_GT(bright[id], 3) << "no number in plane " << id;
  }
  EXPECT_GT(picture.height, 480U);  // the legend
}

TEST(PerceivedPicture, ColoursOfNeighboursOfOneKind_AreTheSameAndASeamIsBetween) {
  const SeenStairs seen = seen_stairs();
  const Drawn picture = drawn(seen);
  int seams = 0, dark = 0;
  for (std::size_t v = 1; v + 1 < 480; ++v) {
    for (std::size_t u = 0; u < 640; ++u) {
      const unsigned above = seen.perceived.labels[v * 640 + u], below = seen.perceived.labels[(v + 1) * 640 + u];
      if (above == 0 || below == 0 || above == below) continue;
      ++seams;
      const Rgb now = picture.at(u, v);
      const bool is_plain = distance(now, kTread) < 60.0 || distance(now, kRiser) < 60.0;
      dark += is_plain ? 0 : 1;
    }
  }
  EXPECT_GT(seams, 200);
  EXPECT_GT(dark, seams * 9 / 10) << "of " << seams;
}

TEST(PerceivedPicture, SmallPicture_IsDrawnLarger) {
  SeenStairs seen;
  seen.camera.intrinsics.width_px = 160;
  seen.camera.intrinsics.height_px = 120;
  seen.picture = {160, 120, std::vector<std::uint16_t>(160 * 120, 0)};
  seen.perceived.labels.assign(160 * 120, 0);
  const Drawn picture = drawn(seen);
  EXPECT_EQ(picture.width, 480U);
  EXPECT_GT(picture.height, 360U);
}

TEST(FramePage, Stairs_HaveTheirPlanesPointsAndPicture) {
  const SeenStairs seen = seen_stairs();
  const ReportJson json = frame_json("a/step.png", seen.camera, seen.picture, seen.perceived, "hash");
  EXPECT_EQ(json.begin().key(), "format");
  EXPECT_EQ(json["format"], "polygmap-frame");
  EXPECT_EQ(json["name"], "step.png");
  ASSERT_EQ(json["planes"].size(), seen.perceived.planes.size());
  int nosings = 0;
  for (const auto& plane : json["planes"]) {
    EXPECT_GT(plane["sigma_offset_mm"].get<double>(), 0.0);
    EXPECT_EQ(plane["pieces"][0]["vertices"].size() % 3, 0U);
    nosings += plane["pieces"][0].contains("nosing") ? 1 : 0;
  }
  EXPECT_GE(nosings, 2);
  EXPECT_LE(json["points"]["depth_and_plane"]["count"].get<int>(), 60000);
  EXPECT_GT(json["points"]["depth_and_plane"]["count"].get<int>(), 20000);
  EXPECT_GT(json["picture"].get<std::string>().size(), 1000U);
}

TEST(FramePage, AsAFile_StaysWithin2MegabytesAndEndsNoScript) {
  const SeenStairs seen = seen_stairs();
  const std::string path = testing::TempDir() + "polygmap_frame.html";
  write_frame_page(path, "<script>.png", seen.camera, seen.picture, seen.perceived, "hash");
  EXPECT_LE(std::filesystem::file_size(path), 2'000'000U);
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  EXPECT_EQ(text.str().find("<script>.png"), std::string::npos);
  EXPECT_NE(text.str().find("\\u003cscript>.png"), std::string::npos);
}

TEST(RowsWithExtremes, LongColumns_AreFewRowsAndKeepEverySpike) {
  std::vector<double> wave(100000), flat(wave.size(), 1.0),
      sparse(wave.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < wave.size(); ++i) wave[i] = std::sin(1e-3 * static_cast<double>(i));
  wave[31234] = 7.0;
  wave[77777] = -7.0;
  sparse[5005] = 2.0;
  const std::vector<std::size_t> kept = rows_with_extremes({wave, flat, sparse}, 3000);
  EXPECT_LE(kept.size(), 3002U);
  EXPECT_GT(kept.size(), 1000U);
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
  const std::set<std::size_t> rows(kept.begin(), kept.end());
  for (const std::size_t row : {0U, 31234U, 77777U, 5005U, 99999U}) EXPECT_TRUE(rows.contains(row)) << row;
}

TEST(RowsWithExtremes, ShortColumns_AreKeptWhole) {
  EXPECT_EQ(rows_with_extremes({{1.0, 2.0, 3.0}}, 3), (std::vector<std::size_t>{0, 1, 2}));
}

// Standing still at 100 Hz, with truth or without.
EstimateLog standing(bool has_truth) {
  EstimateLog log;
  log.has_truth = has_truth;
  for (int i = 0; i < 600; ++i) {
    LogRow row;
    row.stamp_ns = i * 10'000'000LL;
    row.accel_mps2 = {0, 0, kGravity_mps2};
    row.contact = {1.0, i < 300 ? 1.0 : 0.0};
    row.base_p_foot_m = {Vec3{0, 0.1, -0.8}, Vec3{0, -0.1, -0.8}};
    row.truth.true_T_base.p_m = {0, 0, 0.8};
    log.rows.push_back(row);
  }
  return log;
}

std::size_t count_of(const ReportJson& json, const std::string& group) {
  return static_cast<std::size_t>(std::count_if(json["charts"].begin(), json["charts"].end(),
                                                [&](const auto& chart) { return chart["group"] == group; }));
}

TEST(LogPage, LogWithTruth_HasErrorsValuesContactsAndScores) {
  const EstimateLog log = standing(true);
  const ReplayOptions options;
  const ReportJson json = log_json("a/walk.csv", log, {}, replay(log, {}, options), options, {"a doubt"});
  EXPECT_EQ(json.begin().key(), "format");
  EXPECT_EQ(json["name"], "walk.csv");
  EXPECT_EQ(count_of(json, "error"), 9U);
  EXPECT_EQ(count_of(json, "value"), 9U);
  EXPECT_EQ(count_of(json, "sigma"), 0U);
  EXPECT_TRUE(json["summary"].contains("position_rmse_mm"));
  EXPECT_EQ(json["summary"]["warnings"][0], "a doubt");
  ASSERT_EQ(json["contacts"]["right"].size(), 2U);
  EXPECT_NEAR(json["contacts"]["right"][1][0].get<double>(), 3.0, 1e-9);
  EXPECT_EQ(json["contacts"]["right"][1][1], "swings");
  const auto& chart = json["charts"][0];
  EXPECT_EQ(chart["table"]["columns"].get<std::size_t>(), chart["lines"].size() + 1);
}

TEST(LogPage, LogWithoutTruth_HasSigmasAndNoScore) {
  const EstimateLog log = standing(false);
  const ReplayOptions options;
  const ReportJson json = log_json("walk.csv", log, {}, replay(log, {}, options), options, {});
  EXPECT_EQ(count_of(json, "error"), 0U);
  EXPECT_EQ(count_of(json, "sigma"), 3U);
  EXPECT_FALSE(json["summary"].contains("position_rmse_mm"));
}

TEST(LogPage, GapsAndRefusedPoses_AreEventsOfTheirTime) {
  EstimateLog log = standing(true);
  for (std::size_t i = 400; i < log.rows.size(); ++i) log.rows[i].stamp_ns += 1'000'000'000LL;
  std::vector<LioRow> lio;
  for (int i = 0; i < 60; ++i)
    lio.push_back({i * 100'000'000LL, i * 100'000'000LL + 20'000'000LL, {Mat3::Identity(), {0, 0, 0.8}}});
  lio[30].pose.p_m.x() = 5.0;  // a jump
  const ReplayOptions options;
  const Replay result = replay(log, lio, options);
  const ReportJson json = log_json("walk.csv", log, lio, result, options, {});
  double gap_s = -1.0, refused_s = -1.0;
  for (const auto& event : json["events"]) {
    if (event["kind"] == "no rows") gap_s = event["t_s"];
    if (event["kind"] == "LIO refused" && event["text"] == "too far from the odometry") refused_s = event["t_s"];
  }
  EXPECT_NEAR(gap_s, 3.99, 1e-6);
  EXPECT_NEAR(refused_s, 3.02, 0.03);
}

TEST(PagesOfCommands, FilesThatCannotBeWritten_GetOneSentence) {
  const std::string folder = testing::TempDir() + "polygmap_pages_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/camera.toml")
      << "width = 64\nheight = 64\nfx = 60\nfy = 60\ncx = 32\ncy = 32\ndepth_unit_m = 0.001\n";
  std::vector<unsigned char> png;
  lodepng::State state;
  state.encoder.auto_convert = 0;
  state.info_raw.colortype = state.info_png.color.colortype = LCT_GREY;
  state.info_raw.bitdepth = state.info_png.color.bitdepth = 16;
  ASSERT_EQ(lodepng::encode(png, std::vector<unsigned char>(64 * 64 * 2, 4), 64, 64, state), 0U);
  ASSERT_EQ(lodepng::save_file(png, folder + "/depth.png"), 0U);
  std::ofstream log(folder + "/log.csv");
  log << "t_s,gyro_x_radps,gyro_y_radps,gyro_z_radps,accel_x_mps2,accel_y_mps2,accel_z_mps2,left_contact,right_contact,"
         "left_foot_x_m,left_foot_y_m,left_foot_z_m,right_foot_x_m,right_foot_y_m,right_foot_z_m\n";
  for (int i = 0; i < 100; ++i) log << 0.01 * i << ",0,0,0,0,0,9.81,1,1,0,0.1,-0.8,0,-0.1,-0.8\n";
  log.close();
  const auto call = [&](const std::vector<std::string>& arguments) {
    std::ostringstream out, err;
    EXPECT_EQ(polygmap_main(arguments, {}, out, err, false), kExitUsage) << err.str();
    const std::string said = err.str();
    EXPECT_NE(said.find("Cannot write \"" + folder + "/none/page.html\""), std::string::npos) << said;
  };
  call({"perceive", folder + "/depth.png", "--camera", folder + "/camera.toml", "--html", folder + "/none/page.html"});
  call({"estimate", folder + "/log.csv", "--html", folder + "/none/page.html"});
}

}  // namespace
}  // namespace polygmap::sim
