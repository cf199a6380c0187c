// SPDX-License-Identifier: Apache-2.0
// `polygmap perceive` on files: what it finds, and what it says about files that are none.
#include <gtest/gtest.h>
#include <lodepng.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "algorithms/perception/surface_extractor.hpp"
#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/perceive/perceive.hpp"
#include "sim_stub/robot_camera.hpp"
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
      arguments.insert(arguments.begin() + 1,
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

TEST_F(PerceiveCommand, GravityUpsideDown_GetsOneSentence_AndTheRightOneNone) {
  test::DepthPicture picture = test::render(scene_);
  test::add_noise(picture, {}, 3);
  write_depth("stairs.png", picture.raw(), 640, 480);
  for (const double sign : {1.0, -1.0}) {
    const Vec3 given = -sign * scene_.camera_up();
    ASSERT_EQ(
        call({"perceive", "--gravity", std::to_string(given.x()), std::to_string(given.y()), std::to_string(given.z()),
              at("stairs.png"), "--camera", at("camera.toml"), "--json", at("out.json")}),
        kExitPass);
    const bool wrong = sign < 0.0;
    EXPECT_EQ(err_.find("is a ceiling") != std::string::npos, wrong) << err_;
    const nlohmann::json json = nlohmann::json::parse(std::ifstream(at("out.json")));
    EXPECT_EQ(json["warnings"].size(), wrong ? 1U : 0U);
    EXPECT_EQ(json["up_source"], "given");
  }
}

TEST_F(PerceiveCommand, GravityOfAnotherFrame_IsToldWithBothDirections) {
  test::DepthPicture picture = test::render(scene_);
  test::add_noise(picture, {}, 3);
  write_depth("stairs.png", picture.raw(), 640, 480);
  for (const std::string z : {"-9.81", "1"}) {
    ASSERT_EQ(call({"perceive", "--gravity", "0", "0", z, at("stairs.png"), "--camera", at("camera.toml"), "--json",
                    at("out.json")}),
              kExitPass);
    EXPECT_NE(err_.find("By --gravity up is (0.00, 0.00, "), std::string::npos) << z << err_;
    EXPECT_NE(err_.find("largest level-looking plane says (0.0"), std::string::npos) << z << err_;
    EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 1) << err_;
    EXPECT_EQ(nlohmann::json::parse(std::ifstream(at("out.json")))["warnings"].size(), 1U);
  }
}

// Over all edges, whose white lies on the same pixels.
TEST_F(PerceiveCommand, Picture_EveryNosingIsYellowFromEndToEnd) {
  test::DepthPicture picture = test::render(scene_);
  test::add_noise(picture, {}, 3);
  write_depth("stairs.png", picture.raw(), 640, 480);
  const Vec3 down = -scene_.camera_up();
  ASSERT_EQ(
      call({"perceive", "--gravity", std::to_string(down.x()), std::to_string(down.y()), std::to_string(down.z()),
            at("stairs.png"), "--camera", at("camera.toml"), "--json", at("out.json"), "--picture", at("pic.png")}),
      kExitPass);
  std::vector<unsigned char> rgb;
  unsigned width = 0, height = 0;
  ASSERT_EQ(lodepng::decode(rgb, width, height, at("pic.png"), LCT_RGB, 8), 0U);
  int seen = 0, yellow = 0;
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(at("out.json")));
  for (const auto& plane : json["planes"]) {
    if (plane["nosing"].is_null()) continue;
    const auto end = [&](int i) {
      const auto& p = plane["nosing"][static_cast<std::size_t>(i)];
      return Vec3{p[0].get<double>(), p[1].get<double>(), p[2].get<double>()};
    };
    for (int i = 0; i <= 100; ++i) {
      const Vec3 p = end(0) + (end(1) - end(0)) * (i / 100.0);
      const auto u = std::lround(p.x() / p.z() * 366.7 + 322.7), v = std::lround(p.y() / p.z() * 366.7 + 242.3);
      if (u < 0 || v < 0 || u >= 640 || v >= 480) continue;
      ++seen;
      const unsigned char* pixel = &rgb[3 * static_cast<std::size_t>(v * 640 + u)];
      yellow += pixel[0] == 240 && pixel[1] == 228 && pixel[2] == 66 ? 1 : 0;
    }
  }
  EXPECT_GT(seen, 150);
  EXPECT_GE(yellow, seen * 95 / 100) << "of " << seen;
}

TEST_F(PerceiveCommand, Interrupted_LeavesNoFileOfThePicturesNotDone) {
  write_depth("a.png", std::vector<std::uint16_t>(640 * 480, 1000), 640, 480);
  write("out.json", "old");
  const std::atomic<int> signal{SIGTERM};
  std::ostringstream out, err;
  EXPECT_EQ(polygmap_main({"perceive", at("a.png"), "--camera", at("camera.toml"), "--json", at("out.json")}, {}, out,
                          err, false, &signal),
            kExitSignal + SIGTERM);
  EXPECT_EQ(err.str(), "polygmap: interrupted after 0 of 1 pictures: the others have no files.\n");
  EXPECT_FALSE(std::filesystem::exists(at("out.json")));
}

// docs/reference/planes-json.md names exactly the keys that are written.
TEST_F(PerceiveCommand, Json_HasTheKeysOfItsReferencePage) {
  write_depth("stairs.png", test::render(scene_).raw(), 640, 480);
  ASSERT_EQ(call({"perceive", at("stairs.png"), "--camera", at("camera.toml"), "--json", at("out.json")}), kExitPass);
  std::set<std::string> written, named;
  const std::function<void(const nlohmann::json&, const std::string&)> collect = [&](const nlohmann::json& value,
                                                                                     const std::string& path) {
    for (const auto& [key, inner] : value.items()) {
      const std::string name = path + key;
      written.insert(name);
      if (inner.is_array() && !inner.empty() && inner[0].is_object()) {
        for (const auto& one : inner) collect(one, name + "[].");
      }
    }
  };
  collect(nlohmann::json::parse(std::ifstream(at("out.json"))), "");
  std::ifstream page(std::string(POLYGMAP_CAMERAS) + "/../../docs/reference/planes-json.md");
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("| `")) continue;
    const std::string keys = line.substr(0, line.find('|', 1));
    for (std::size_t from = keys.find('`'); from != std::string::npos; from = keys.find('`', from)) {
      const std::size_t to = keys.find('`', from + 1);
      named.insert(keys.substr(from + 1, to - from - 1));
      from = to + 1;
    }
  }
  EXPECT_EQ(named, written);
}

// A wall alone: which way is up is not in the picture.
TEST_F(PerceiveCommand, UpAssumed_KindsAreUnknown) {
  write_depth("wall.png", std::vector<std::uint16_t>(640 * 480, 1000), 640, 480);
  const std::vector<std::string> call_it{"perceive",        at("wall.png"), "--camera",
                                         at("camera.toml"), "--json",       at("out.json")};
  ASSERT_EQ(call(call_it), kExitPass) << err_;
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(at("out.json")));
  EXPECT_EQ(json["up_source"], "assumed");
  ASSERT_FALSE(json["planes"].empty());
  for (const auto& plane : json["planes"]) EXPECT_EQ(plane["kind"], "unknown");
}

TEST_F(PerceiveCommand, RunThatFails_LeavesNoFormerOutput_AndRepeatIsDecimal) {
  write_depth("wall.png", std::vector<std::uint16_t>(640 * 480, 1000), 640, 480);
  write("out.json", "{}");
  write("text.png", "no picture");
  expect_refused({"perceive", at("text.png"), "--camera", at("camera.toml"), "--json", at("out.json")}, "text.png");
  EXPECT_FALSE(std::filesystem::exists(at("out.json")));
  write("out.json", "{}");
  expect_refused({"perceive", at("wall.png"), "--camera", at("none.toml"), "--json", at("out.json")}, "none.toml");
  EXPECT_FALSE(std::filesystem::exists(at("out.json")));
  EXPECT_EQ(call({"perceive", at("wall.png"), "--camera", at("camera.toml"), "--repeat", "08"}), kExitPass) << err_;
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
  write("cut_early.png", bytes.substr(0, 20));
  std::string flipped = bytes;
  flipped[bytes.size() / 2] = static_cast<char>(flipped[bytes.size() / 2] ^ 0x10);
  write("flipped.png", flipped);
  flipped = bytes;
  flipped[18] = static_cast<char>(flipped[18] ^ 1);  // of the width
  write("flipped_early.png", flipped);
  flipped = bytes;
  flipped[bytes.size() - 6] = static_cast<char>(flipped[bytes.size() - 6] ^ 4);  // of the last chunk's name
  write("flipped_late.png", flipped);
  write("text.png", "no picture");
  write("empty.png", "");
  write_depth("large.png", std::vector<std::uint16_t>(1025 * 32, 1000), 1025, 32);
  const std::string camera = at("camera.toml");
  expect_refused({"perceive", at("missing.png"), "--camera", camera}, "missing.png");
  expect_refused({"perceive", at("small.png"), "--camera", camera}, "64x48");
  expect_refused({"perceive", at("eight.png"), "--camera", camera}, "16 bits");
  expect_refused({"perceive", at("cut.png"), "--camera", camera}, "cut.png\" is cut off: its ");
  expect_refused({"perceive", at("cut_early.png"), "--camera", camera}, "cut_early.png\" is cut off: its 20 bytes end");
  expect_refused({"perceive", at("flipped.png"), "--camera", camera}, "flipped.png\" is damaged: bytes in it");
  expect_refused({"perceive", at("flipped_early.png"), "--camera", camera}, "flipped_early.png\" is damaged");
  expect_refused({"perceive", at("flipped_late.png"), "--camera", camera}, "flipped_late.png\" is damaged");
  expect_refused({"perceive", at("text.png"), "--camera", camera}, "text.png\" is no PNG");
  expect_refused({"perceive", at("empty.png"), "--camera", camera}, "is empty");
  expect_refused({"perceive", folder_, "--camera", camera}, "is a folder, not a picture");
  expect_refused({"perceive", at("large.png"), "--camera", camera}, "is 1025x32, more than the 1024x768 that are read");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--json", "/proc/none/x.json"}, "/proc/none");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--gravity", "0", "0", "0"}, "--gravity");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--picture", at("good.png")}, "overwritten");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--json", camera}, "overwritten");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--json", at("out"), "--labels", at("out")},
                 "overwritten");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--gravity", "nan", "0", "1"}, "--gravity");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--repeat", "0"}, "--repeat");
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--json", ""}, "--json");
  expect_refused({"perceive"}, "DEPTH.png");
  for (const std::string output : {"--labels", "--json", "--picture"}) {
    expect_refused({"perceive", at("good.png"), "--camera", camera, output, "/dev/full"}, "/dev/full");
  }
  const std::string here = std::filesystem::relative(at("new")).string();  // one file by two names
  expect_refused({"perceive", at("good.png"), "--camera", camera, "--json", here, "--labels", at("new")},
                 "overwritten");
}

TEST_F(PerceiveCommand, OneBadPictureAmongGoodOnes_IsNamedAndTheOthersAreWritten) {
  write_depth("one.png", std::vector<std::uint16_t>(640 * 480, 1000), 640, 480);
  write_depth("two.png", std::vector<std::uint16_t>(640 * 480, 1100), 640, 480);
  write_depth("small.png", std::vector<std::uint16_t>(64 * 48, 1000), 64, 48);
  const std::string out = at("several");
  std::filesystem::remove_all(out);
  EXPECT_EQ(call({"perceive", at("one.png"), at("small.png"), at("missing.png"), at("two.png"), "--camera",
                  at("camera.toml"), "--json", out, "--labels", out, "--picture", out}),
            kExitUsage);
  EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 2) << err_;
  EXPECT_NE(err_.find("small.png"), std::string::npos);
  EXPECT_NE(err_.find("missing.png"), std::string::npos);
  EXPECT_EQ(std::count(out_.begin(), out_.end(), '\n'), 2) << out_;
  for (const std::string name : {"one", "two"}) {
    for (const std::string suffix : {".planes.json", ".labels.png", ".picture.png"}) {
      EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(out) / (name + suffix))) << name << suffix;
    }
  }
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::path(out) / "small.planes.json"));
}

TEST_F(PerceiveCommand, PicturesOfOneName_WouldOverwriteEachOthersOutput) {
  std::filesystem::create_directories(at("other"));
  for (const char* name : {"one.png", "other/one.png"}) {
    write_depth(name, std::vector<std::uint16_t>(640 * 480, 1000), 640, 480);
  }
  const std::string camera = at("camera.toml");
  expect_refused({"perceive", at("one.png"), at("other/one.png"), "--camera", camera, "--json", at("several")},
                 "\"one\"");
  EXPECT_EQ(call({"perceive", at("one.png"), at("other/one.png"), "--camera", camera}), kExitPass) << err_;
}

TEST_F(PerceiveCommand, PlatformsWithAGapBetween_AreOnePlaneOfTwoPieces) {
  scene_.boxes.clear();
  scene_.boxes.push_back({{0.3, 0.08, 0.0}, {1.0, 0.6, 0.15}});
  scene_.boxes.push_back({{0.3, -0.4, 0.0}, {1.0, -0.08, 0.15}});
  test::DepthPicture picture = test::render(scene_);
  test::add_noise(picture, {}, 11);
  write_depth("gap.png", picture.raw(), 640, 480);
  ASSERT_EQ(call({"perceive", at("gap.png"), "--camera", at("camera.toml"), "--json", at("gap.json")}), kExitPass);
  const auto vertex = [this](const nlohmann::json& v) {
    return Vec3{scene_.world_T_camera * Vec3{v[0].get<double>(), v[1].get<double>(), v[2].get<double>()}};
  };
  const nlohmann::json planes = nlohmann::json::parse(std::ifstream(at("gap.json")))["planes"];
  int platforms = 0;
  for (const auto& plane : planes) {
    if (std::abs(vertex(plane["centroid"]).z() - 0.15) > 0.01) continue;
    ++platforms;
    const auto& pieces = plane["pieces"];
    ASSERT_EQ(pieces.size(), 2U);
    EXPECT_EQ(pieces[0]["polygon"], plane["polygon"]);  // the largest first
    EXPECT_GE(pieces[0]["area_m2"], pieces[1]["area_m2"]);
    EXPECT_NEAR(plane["area_m2"].get<double>(), pieces[0]["area_m2"].get<double>() + pieces[1]["area_m2"].get<double>(),
                1e-9);
    EXPECT_LT(vertex(pieces[0]["centroid"]).y() * vertex(pieces[1]["centroid"]).y(), 0.0);
    for (const auto& piece : pieces) {
      double nearest = 1e9;
      for (const auto& v : piece["polygon"]) nearest = std::min(nearest, std::abs(vertex(v).y()));
      EXPECT_NEAR(nearest, 0.08, 0.01);
      EXPECT_FALSE(piece["nosing"].is_null());
    }
  }
  EXPECT_EQ(platforms, 1);
}

// What `polygmap perceive` and `climb` are given.
TEST(CameraProfiles, OfTheProject_AreReadAndSayWhatTheyKnow) {
  const std::filesystem::path folder = POLYGMAP_CAMERAS;
  int count = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    const config::CameraProfile camera = config::read_camera(file.path().string());
    EXPECT_GT(camera.noise.sigma_m(1.0), 0.001) << file.path();
    EXPECT_LT(camera.noise.sigma_m(1.0), 0.02) << file.path();
    ++count;
  }
  EXPECT_EQ(count, 4);
  const config::CameraProfile stereo = config::read_camera((folder / "d435.toml").string());
  EXPECT_NEAR(stereo.noise.sigma_m(2.0) - stereo.noise.base_m, 4.0 * (stereo.noise.sigma_m(1.0) - stereo.noise.base_m),
              1e-12);
  // The robot's own is what module and simulation have built in.
  const config::CameraProfile own = config::read_camera((folder / "kuavo.toml").string());
  const SurfaceExtractor::Params built_in;
  EXPECT_EQ(own.intrinsics.fx_px, robot_camera_intrinsics().fx_px);
  EXPECT_EQ(own.intrinsics.cy_px, robot_camera_intrinsics().cy_px);
  EXPECT_EQ(own.intrinsics.depth_unit_m, robot_camera_intrinsics().depth_unit_m);
  EXPECT_EQ(own.noise.base_m, built_in.noise.base_m);
  EXPECT_EQ(own.noise.per_metre, built_in.noise.per_metre);
  EXPECT_EQ(own.noise.correlated_px, built_in.noise.correlated_px);
  EXPECT_EQ(own.max_depth_m, built_in.limits.max_depth_m);
}

TEST_F(PerceiveCommand, HardlyADepthInRange_IsTold) {
  // None; 0.1 m and 7 m, where 0.2 to 6 m are looked at.
  for (const std::uint16_t raw : std::initializer_list<std::uint16_t>{0, 100, 7000, 65535}) {
    write_depth("far.png", std::vector<std::uint16_t>(640 * 480, raw), 640, 480);
    EXPECT_EQ(call({"perceive", at("far.png"), "--camera", at("camera.toml"), "--json", at("out.json")}), kExitPass);
    EXPECT_NE(err_.find("depth_unit_m in its file those of this picture?"), std::string::npos) << raw << err_;
    EXPECT_EQ(nlohmann::json::parse(std::ifstream(at("out.json")))["warnings"].size(), 1U);
  }
  write_depth("near.png", std::vector<std::uint16_t>(640 * 480, 1000), 640, 480);
  EXPECT_EQ(call({"perceive", at("near.png"), "--camera", at("camera.toml")}), kExitPass);
  EXPECT_EQ(err_, "");
}

// What a camera file may say and what the extractor takes are the same.
TEST_F(PerceiveCommand, CamerasAtTheBoundsOfWhatIsAllowed_AreTaken) {
  const std::vector<std::uint16_t> depth(32 * 32, 1000);
  write_depth("least.png", depth, 32, 32);
  for (const std::string focal : {"1", "100000"}) {
    for (const std::string centre : {"-100000", "100000"}) {
      for (const std::string unit : {"1e-6", "0.1"}) {
        write("bound.toml", "width = 32\nheight = 32\nfx = " + focal + "\nfy = " + focal + "\ncx = " + centre +
                                "\ncy = " + centre + "\ndepth_unit_m = " + unit +
                                "\nmin_depth_m = 0.001\nmax_depth_m = 1000\nnoise_base_m = 1\n"
                                "noise_per_metre = 1\nnoise_quadratic_per_m = 1\nnoise_correlated_share = 0\n"
                                "noise_correlated_px = 1e6\n");
        EXPECT_EQ(call({"perceive", at("least.png"), "--camera", at("bound.toml")}), kExitPass) << err_;
      }
    }
  }
}

TEST_F(PerceiveCommand, CameraFilesThatAreNone_AreNamedInOneSentence) {
  write_depth("good.png", std::vector<std::uint16_t>(640 * 480, 1000), 640, 480);
  const auto refused = [this](const std::string& from, const std::string& to, const std::string& culprit) {
    std::string text = kCamera;
    text.replace(text.find(from), from.size(), to);
    write("bad.toml", text);
    expect_refused({"perceive", at("good.png"), "--camera", at("bad.toml")}, culprit);
  };
  for (const std::string key : {"fx", "fy"}) {
    const std::string good = key + " = 366.7";
    for (const std::string value : {"nan", "inf", "-inf", "0", "-1", "0.99", "1e9"}) {
      refused(good, key + " = " + value, key + " must be from 1 to 100000, not ");
    }
    for (const std::string value : {"\"a\"", "true", "[1]", "2020-01-01"}) {
      refused(good, key + " = " + value, key + " must be a number");
    }
    refused(good, "", key + " is missing");
  }
  refused("cx = 322.7\n", "", "cx is missing");
  refused("cx = 322.7", "cx = 100001", "cx");
  refused("cy = 242.3", "cy = -100001", "cy");
  refused("cy = 242.3", "cy = nan", "cy");
  refused("depth_unit_m = 0.001\n", "", "depth_unit_m is missing");
  refused("depth_unit_m", "depht_unit_m", "depht_unit_m");
  for (const std::string value : {"0", "-0.001", "0.11", "1e-7", "nan"}) {
    refused("= 0.001", "= " + value, "depth_unit_m must be");
  }
  refused("width = 640", "width = 640.5", "width must be a whole number, not 640.5");
  refused("width = 640", "width = 31", "width must be from 32 to 1024, not 31");
  refused("width = 640", "width = 1025", "width must be from 32 to 1024, not 1025");
  refused("height = 480", "height = 769", "height must be from 32 to 768, not 769");
  refused("height = 480", "height = 1e300", "height");
  refused("height = 480", "height = 424", "640x424");
  refused("height = 480", "height = = 480", "bad.toml");
  const auto refused_with = [&](const std::string& line, const std::string& culprit) {
    refused("depth_unit_m = 0.001", "depth_unit_m = 0.001\n" + line, culprit);
  };
  refused_with("noise_base_m = 0", "noise_base_m");
  refused_with("noise_base_m = 1e9", "noise_base_m");
  refused_with("noise_per_metre = -1", "noise_per_metre");
  refused_with("noise_quadratic_per_m = -1", "noise_quadratic_per_m");
  refused_with("noise_quadratic_per_m = 1e9", "noise_quadratic_per_m");
  refused_with("noise_correlated_share = 1.5", "noise_correlated_share");
  refused_with("noise_correlated_px = 0.5", "noise_correlated_px");
  refused_with("min_depth_m = 0", "min_depth_m");
  refused_with("max_depth_m = -1", "max_depth_m");
  refused_with("min_depth_m = 3\nmax_depth_m = 3", "min_depth_m, 3, must be less than max_depth_m, 3");
  refused_with("min_depth_m = 66\nmax_depth_m = 67", "16 bits");
  refused_with("depth_unit_m = 0.001", "bad.toml");  // twice
  expect_refused({"perceive", at("good.png"), "--camera", folder_}, "folder");
  expect_refused({"perceive", at("good.png"), "--camera", at("none.toml")}, "none.toml");
}

}  // namespace
}  // namespace polygmap::sim
