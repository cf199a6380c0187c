// SPDX-License-Identifier: Apache-2.0
// `polygmap perceive` on files: what it finds, and what it says about files that are none.
#include <gtest/gtest.h>
#include <lodepng.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "algorithms/robot/model.hpp"
#include "sim_stub/cli/climb_command.hpp"
#include "sim_stub/perceive.hpp"
#include "tests/support/depth_scene.hpp"

namespace polygmap::sim {
namespace {

class PerceiveCommand : public testing::Test {
 protected:
  PerceiveCommand() {
    std::filesystem::create_directories(folder_);
    scene_.place_camera(0.77, 1.05);
    scene_.intrinsics = {};
    scene_.intrinsics.width_px = 640;
    scene_.intrinsics.height_px = 480;
    scene_.intrinsics.fx_px = scene_.intrinsics.fy_px = 366.7;
    scene_.intrinsics.cx_px = 322.7;
    scene_.intrinsics.cy_px = 242.3;
    scene_.intrinsics.depth_unit_m = 0.001;
    scene_.add_stairs({});
    write("camera.toml", kCamera);
  }
  [[nodiscard]] std::string at(const std::string& name) const { return folder_ + "/" + name; }
  void write(const std::string& name, const std::string& text) const { std::ofstream(at(name)) << text; }
  void write_depth(const std::string& name, const std::vector<std::uint16_t>& depth, unsigned width, unsigned height,
                   unsigned bits = 16) const {
    std::vector<unsigned char> bytes;
    for (const std::uint16_t z : depth) {
      if (bits == 16) bytes.push_back(static_cast<unsigned char>(z >> 8U));
      bytes.push_back(static_cast<unsigned char>(z & 0xFFU));
    }
    lodepng::State state;
    state.encoder.auto_convert = 0;
    state.info_raw.colortype = state.info_png.color.colortype = LCT_GREY;
    state.info_raw.bitdepth = state.info_png.color.bitdepth = bits;
    std::vector<unsigned char> file;
    ASSERT_EQ(lodepng::encode(file, bytes, width, height, state), 0U);
    ASSERT_EQ(lodepng::save_file(file, at(name)), 0U);
  }
  int call(const std::vector<std::string>& arguments) {
    std::ostringstream out, err;
    const int code = polygmap_main(arguments, {}, out, err, false);
    out_ = out.str();
    err_ = err.str();
    return code;
  }
  // Exit 2 and one sentence that names the culprit.
  void expect_refused(const std::vector<std::string>& arguments, const std::string& culprit) {
    EXPECT_EQ(call(arguments), kExitUsage) << culprit;
    EXPECT_NE(err_.find(culprit), std::string::npos) << err_;
    EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 1) << err_;
  }
  static constexpr const char* kCamera =
      "width = 640\nheight = 480\nfx = 366.7\nfy = 366.7\ncx = 322.7\ncy = 242.3\ndepth_unit_m = 0.001\n";
  std::string folder_ = testing::TempDir() + "polygmap_perceive_test";
  test::DepthScene scene_;
  std::string out_, err_;
};

TEST_F(PerceiveCommand, Stairs_AreTreadsAndRisersWithNosings_GravityGivenOrNot) {
  test::DepthPicture picture = test::render(scene_);
  test::add_noise(picture, {}, 3);
  write_depth("stairs.png", picture.raw(), 640, 480);
  const Vec3 down = -scene_.camera_up();
  for (const bool given : {true, false}) {
    std::vector<std::string> arguments{"perceive",  at("stairs.png"), "--camera", at("camera.toml"),
                                       "--json",    at("out.json"),   "--labels", at("out.png"),
                                       "--picture", at("pic.png"),    "--repeat", "2"};
    if (given) {
      arguments.insert(arguments.end(),
                       {"--gravity", std::to_string(down.x()), std::to_string(down.y()), std::to_string(down.z())});
    }
    ASSERT_EQ(call(arguments), kExitPass) << err_;
    const nlohmann::json planes = nlohmann::json::parse(std::ifstream(at("out.json")))["planes"];
    int treads = 0, risers = 0, nosings = 0;
    for (const auto& plane : planes) {
      treads += plane["kind"] == "tread" ? 1 : 0;
      risers += plane["kind"] == "riser" ? 1 : 0;
      nosings += plane["nosing"].is_null() ? 0 : 1;
      EXPECT_EQ(plane["covariance"].size(), 4U);
      EXPECT_GT(plane["covariance"][3][3].get<double>(), 0.0);
      EXPECT_GE(plane["polygon"].size(), 3U);
    }
    EXPECT_GE(treads, 3);  // with the floor
    EXPECT_GE(risers, 2);
    EXPECT_GE(nosings, 2);
    std::vector<unsigned char> labels;
    unsigned width = 0, height = 0;
    ASSERT_EQ(lodepng::decode(labels, width, height, at("out.png"), LCT_GREY, 8), 0U);
    EXPECT_EQ(width, 640U);
    for (const unsigned char label : labels) ASSERT_LE(label, planes.size());
    EXPECT_NE(out_.find("median"), std::string::npos);
    EXPECT_GT(std::filesystem::file_size(at("pic.png")), 1000U);
  }
}

TEST_F(PerceiveCommand, NothingMeasured_IsAnEmptyResult) {
  write_depth("blank.png", std::vector<std::uint16_t>(640 * 480, 0), 640, 480);
  ASSERT_EQ(call({"perceive", at("blank.png"), "--camera", at("camera.toml"), "--json", at("out.json")}), kExitPass);
  EXPECT_TRUE(nlohmann::json::parse(std::ifstream(at("out.json")))["planes"].empty());
  EXPECT_NE(out_.find("assumed"), std::string::npos) << out_;
}

TEST_F(PerceiveCommand, FilesThatAreNone_AreNamedInOneSentence) {
  const std::vector<std::uint16_t> depth(64 * 48, 1000);
  write_depth("small.png", depth, 64, 48);
  write_depth("eight.png", std::vector<std::uint16_t>(640 * 480, 100), 640, 480, 8);
  write_depth("good.png", std::vector<std::uint16_t>(640 * 480, 1000), 640, 480);
  std::ifstream good(at("good.png"), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(good), {}};
  write("cut.png", bytes.substr(0, bytes.size() / 2));
  write("text.png", "no picture");
  const std::string camera = at("camera.toml");
  expect_refused({"perceive", at("missing.png"), "--camera", camera}, "missing.png");
  expect_refused({"perceive", at("small.png"), "--camera", camera}, "64x48");
  expect_refused({"perceive", at("eight.png"), "--camera", camera}, "16 bits");
  expect_refused({"perceive", at("cut.png"), "--camera", camera}, "cut.png");
  expect_refused({"perceive", at("text.png"), "--camera", camera}, "text.png");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--json", "/proc/none/x.json"}, "/proc/none");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--gravity", "0", "0", "0"}, "--gravity");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--gravity", "nan", "0", "1"}, "--gravity");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--repeat", "0"}, "--repeat");
}

// What `polygmap perceive` and `climb` are given.
TEST(CameraProfiles, OfTheProject_AreReadAndSayWhatTheyKnow) {
  const std::filesystem::path folder = POLYGMAP_CAMERAS;
  int count = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    const CameraProfile camera = read_camera(file.path().string());
    EXPECT_GT(camera.noise.sigma_m(1.0), 0.001) << file.path();
    EXPECT_LT(camera.noise.sigma_m(1.0), 0.02) << file.path();
    ++count;
  }
  EXPECT_EQ(count, 4);
  const CameraProfile stereo = read_camera((folder / "d435.toml").string());
  EXPECT_NEAR(stereo.noise.sigma_m(2.0) - stereo.noise.base_m, 4.0 * (stereo.noise.sigma_m(1.0) - stereo.noise.base_m),
              1e-12);
  // The robot's own is what module and simulation have built in.
  const CameraProfile own = read_camera((folder / "kuavo.toml").string());
  const SurfaceExtractor::Params built_in;
  EXPECT_EQ(own.intrinsics.fx_px, robot_camera_intrinsics().fx_px);
  EXPECT_EQ(own.intrinsics.cy_px, robot_camera_intrinsics().cy_px);
  EXPECT_EQ(own.intrinsics.depth_unit_m, robot_camera_intrinsics().depth_unit_m);
  EXPECT_EQ(own.noise.base_m, built_in.noise.base_m);
  EXPECT_EQ(own.noise.per_metre, built_in.noise.per_metre);
  EXPECT_EQ(own.noise.correlated_px, built_in.noise.correlated_px);
  EXPECT_EQ(own.max_depth_m, built_in.limits.max_depth_m);
}

TEST_F(PerceiveCommand, CameraFilesThatAreNone_AreNamedInOneSentence) {
  write_depth("good.png", std::vector<std::uint16_t>(640 * 480, 1000), 640, 480);
  const auto refused = [this](const std::string& from, const std::string& to, const std::string& culprit) {
    std::string text = kCamera;
    text.replace(text.find(from), from.size(), to);
    write("bad.toml", text);
    expect_refused({"perceive", at("good.png"), "--camera", at("bad.toml")}, culprit);
  };
  refused("fx = 366.7", "fx = nan", "fx");
  refused("fx = 366.7", "fx = -1", "positive");
  refused("cx = 322.7\n", "", "cx");
  refused("depth_unit_m = 0.001\n", "", "depth_unit_m");
  refused("depth_unit_m", "depht_unit_m", "depht_unit_m");
  refused("cy = 242.3", "cy = \"a\"", "cy");
  refused("width = 640", "width = 0", "0x480");
  refused("width = 640", "width = 4096", "4096x480");
  refused("height = 480", "height = = 480", "bad.toml");
  refused("depth_unit_m = 0.001", "depth_unit_m = 0.001\nnoise_quadratic_per_m = -1", "positive");
  refused("depth_unit_m = 0.001", "depth_unit_m = 0.001\nnoise_correlated_share = 1.5", "noise_correlated_share");
  expect_refused({"perceive", at("good.png"), "--camera", at("none.toml")}, "none.toml");
}

}  // namespace
}  // namespace polygmap::sim
