// SPDX-License-Identifier: Apache-2.0
// A configuration means to the module what it means to the reader of parameter files, to the bit.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <random>
#include <sstream>
#include <string>

#include "firmware/config/camera_file.hpp"
#include "firmware/config/param_file.hpp"
#include "firmware/config/param_table.hpp"
#include "firmware/link/config/apply_config.hpp"
#include "firmware/robot_camera.hpp"
#include "tests/firmware/daemon/text_mutator.hpp"

namespace polygmap::link {
namespace {

// As `polygmap params list` has it.
std::string listed(const config::ParamTable& table) {
  std::string text, last;
  for (const config::Param& param : table.params) {
    const std::size_t dot = param.name.rfind('.');
    const std::string in = dot == std::string::npos ? "" : param.name.substr(0, dot);
    if (in != last) text += "[" + in + "]\n";
    last = in;
    text += param.name.substr(dot == std::string::npos ? 0 : dot + 1) + " = " + config::text_of(param) + "\n";
  }
  return text;
}
std::string by_files(const std::string& text, Params& params) {
  try {
    config::parse_params({"parameter", "p"}, text, config::param_table(params));
  } catch (const config::FileError& error) {
    return error.what();
  }
  return "";
}
std::string by_link(const std::string& text, Params& params) {
  CameraIntrinsics camera = robot_camera_intrinsics();
  Sentence wrong;
  return apply_config(text, params, camera, wrong) ? "" : std::string(wrong.view());
}

TEST(LinkConfigAndFiles, TheListOfAllDefaults_ChangesNothing) {
  const auto params = std::make_unique<Params>();
  const std::string before = config::hash_of(*params);
  EXPECT_EQ(by_link(listed(config::param_table(*params)), *params), "");
  EXPECT_EQ(config::hash_of(*params), before);
}

TEST(LinkConfigAndFiles, RandomValues_AreReadAlike) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 20; ++i) {
    const auto drawn = std::make_unique<Params>(), a = std::make_unique<Params>(), b = std::make_unique<Params>();
    for (const config::Param& param : config::param_table(*drawn).params) {
      // Between the bounds, with all the digits that a double has; whatever a pair of them may not be is refused by
      // both.
      const double share = std::uniform_real_distribution<double>(0.0, 1.0)(random);
      const double value = param.least + share * (param.most - param.least);
      std::visit(
          [&](auto to) {
            if constexpr (std::is_same_v<decltype(to), double*>) *to = value;
            if constexpr (std::is_same_v<decltype(to), std::int32_t*>) *to = static_cast<std::int32_t>(value);
            if constexpr (std::is_same_v<decltype(to), std::int64_t*>) *to = static_cast<std::int64_t>(value);
            if constexpr (std::is_same_v<decltype(to), std::span<double>>) std::fill(to.begin(), to.end(), value);
          },
          param.value);
    }
    const std::string text = listed(config::param_table(*drawn));
    EXPECT_EQ(by_files(text, *a).empty(), by_link(text, *b).empty()) << by_link(text, *b);
    EXPECT_EQ(config::hash_of(*a), config::hash_of(*b)) << i;
  }
}

// Whatever is done to a file: what this reader takes the other one takes, and makes the same of it.
TEST(LinkConfigAndFiles, MutatedTexts_AreRefusedOrMeanTheSame) {
  const auto good = std::make_unique<Params>();
  const std::string whole = listed(config::param_table(*good));
  const std::string text = whole.substr(0, whole.find("[estimator"));
  test::TextMutator mutator(4);
  int taken = 0, refused = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::string mutated = mutator.mutated(text);
    if (mutated.find('\0') != std::string::npos) continue;  // no text of C
    const auto a = std::make_unique<Params>(), b = std::make_unique<Params>();
    const std::string wrong = by_link(mutated, *b);
    if (!wrong.empty()) {
      ++refused;
      EXPECT_TRUE(wrong.starts_with("config") && wrong.ends_with(".")) << wrong;
      continue;
    }
    ++taken;
    const std::string by_other = by_files(mutated, *a);
    if (by_other.find("UTF-8") != std::string::npos) continue;  // in a comment or a text, where it harms nobody here
    EXPECT_EQ(by_other, "") << mutated;
    const config::ParamTable of_a = config::param_table(*a), of_b = config::param_table(*b);
    for (std::size_t n = 0; n < of_a.params.size(); ++n) {
      EXPECT_TRUE(config::same_value(of_a.params[n], of_b.params[n]))
          << of_a.params[n].name << " is " << config::text_of(of_b.params[n]) << ", not "
          << config::text_of(of_a.params[n]);
    }
  }
  EXPECT_GT(taken, 300);
  EXPECT_GT(refused, 300);
}

TEST(LinkConfigAndFiles, CameraFiles_AreReadAlike) {
  for (const char* name : {"d435", "kinect2", "kuavo", "l515"}) {
    const std::string path = std::string(POLYGMAP_CAMERAS) + "/" + name + ".toml";
    const config::CameraProfile expected = config::read_camera(path);
    std::stringstream text;
    text << "[camera]\n" << std::ifstream(path).rdbuf();
    const auto params = std::make_unique<Params>();
    CameraIntrinsics camera;
    Sentence wrong;
    ASSERT_TRUE(apply_config(text.str(), *params, camera, wrong)) << wrong.view();
    EXPECT_EQ(camera.width_px, expected.intrinsics.width_px);
    EXPECT_EQ(camera.height_px, expected.intrinsics.height_px);
    EXPECT_EQ(camera.fx_px, expected.intrinsics.fx_px);
    EXPECT_EQ(camera.cy_px, expected.intrinsics.cy_px);
    EXPECT_EQ(camera.depth_unit_m, expected.intrinsics.depth_unit_m);
    EXPECT_EQ(params->surfaces.limits.max_depth_m, expected.max_depth_m);
    EXPECT_EQ(params->surfaces.noise.quadratic_per_m, expected.noise.quadratic_per_m);
    EXPECT_EQ(params->surfaces.noise.correlated_px, expected.noise.correlated_px);
  }
}

}  // namespace
}  // namespace polygmap::link
