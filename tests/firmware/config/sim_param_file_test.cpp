// SPDX-License-Identifier: Apache-2.0
// Parameter files: what they may say, and the one sentence about what they may not.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "firmware/config/param_file.hpp"
#include "firmware/params.hpp"

namespace polygmap::config {
namespace {

std::string write(const std::string& text) {
  const std::string path =
      testing::TempDir() + "polygmap_params_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml";
  std::ofstream(path) << text;
  return path;
}

Params read(const std::string& text) {
  Params params;
  read_params(write(text), params);
  return params;
}

// Refused in one sentence that names the file and says this.
void expect_refused(const std::string& text, const std::string& what) {
  const std::string path = write(text);
  Params params;
  const std::string before = hash_of(params);
  try {
    read_params(path, params);
    ADD_FAILURE() << "taken: " << text;
  } catch (const FileError& error) {
    const std::string sentence = error.what();
    EXPECT_NE(sentence.find(path), std::string::npos) << sentence;
    EXPECT_NE(sentence.find(what), std::string::npos) << sentence;
    EXPECT_TRUE(sentence.ends_with(".")) << sentence;
    EXPECT_EQ(std::count(sentence.begin(), sentence.end(), '\n'), 0) << sentence;
  }
  EXPECT_EQ(hash_of(params), before) << text;
}

TEST(ParamFile, Part_ChangesThatAlone) {
  const Params params = read("[estimator.fusion]\ntau_s = 2\nrealign_count = 7\n[map.drift]\nsettle_s = 0.5\n");
  Params expected;
  expected.estimator.fusion.tau_s = 2.0;
  expected.estimator.fusion.realign_count = 7;
  expected.map.drift.settle_s = 0.5;
  EXPECT_EQ(hash_of(params), hash_of(expected));
  EXPECT_NE(hash_of(params), hash_of(Params{}));
}

TEST(ParamFile, EveryKind_IsRead) {
  const Params params = read(
      "self_filter = false\nestimator.max_lead_ns = 20_000_000\n"
      "gait.planner.pattern = \"ss\"\nrobot.drives.kp_nmprad = [1, 2, 3, 4, 5, 6.5]\n"
      "robot.mounts.base_T_camera.p_m = [0.1, 0, -0.01]\nrobot.mounts.base_T_camera.rpy_rad = [0.1, 0.2, 0.3]\n");
  EXPECT_FALSE(params.self_filter);
  EXPECT_EQ(params.estimator.max_lead_ns, 20'000'000);
  EXPECT_EQ(params.gait.planner.pattern, GaitPattern::kSingleStep);
  EXPECT_EQ(params.robot.drives.kp_nmprad[5], 6.5);
  EXPECT_TRUE(params.robot.mounts.base_T_camera.p_m.isApprox(Vec3(0.1, 0.0, -0.01)));
  EXPECT_TRUE(params.robot.mounts.base_T_camera.R.isApprox(rotation_zyx(0.3, 0.2, 0.1)));
}

TEST(ParamFile, Empty_ChangesNothing) { EXPECT_EQ(hash_of(read("# nothing\n")), hash_of(Params{})); }

TEST(ParamFile, UnknownKey_NamesTheNearest) {
  expect_refused("[estimator]\n[estimator.fusion]\ntau = 2.0\n",
                 "line 3: estimator.fusion.tau is no parameter; the nearest is estimator.fusion.tau_s.");
  expect_refused("[estmator]\nimu_of_moments = true\n",
                 "line 1: estmator is no table of parameters; the nearest is estimator.");
  expect_refused("tau_spm = 1.0\n", "the nearest is estimator.fusion.tau_spm.");
}

TEST(ParamFile, UnknownKeyLikeNone_NamesNone) {
  const std::string list = "`polygmap params list` names all.";
  expect_refused("speed = 2.0\n", "line 1: speed is no parameter; " + list);
  expect_refused("[estimator.fusion]\ncolour = 2.0\n", "line 2: estimator.fusion.colour is no parameter; " + list);
  expect_refused("[robot_arm]\n", "line 1: robot_arm is no table of parameters; " + list);
}

TEST(ParamFile, WrongType_IsRefused) {
  expect_refused("estimator.fusion.tau_s = \"2\"\n", "line 1: estimator.fusion.tau_s must be a number, not a text.");
  expect_refused("estimator.fusion.tau_s = [2.0]\n", "must be a number, not an array.");
  expect_refused("estimator.fusion.tau_s = 1979-05-27\n", "must be a number, not a date or time.");
  expect_refused("estimator.imu_of_moments = 1\n",
                 "estimator.imu_of_moments must be true or false, not a whole number.");
  expect_refused("estimator.fusion.realign_count = 2.5\n", "must be a whole number, not 2.5.");
  expect_refused("estimator.fusion = 3\n", "estimator.fusion is a table of parameters, not a whole number.");
  expect_refused("robot.mounts.base_T_camera.p_m = [0.1, 0.2]\n",
                 "robot.mounts.base_T_camera.p_m must be 3 numbers in brackets.");
  expect_refused("robot.mounts.base_T_camera.p_m = [0.1, 0.2, \"x\"]\n", "must be a number, not a text.");
  expect_refused("gait.planner.pattern = \"hop\"\n", "gait.planner.pattern must be \"ds\" or \"ss\".");
}

TEST(ParamFile, OutOfRange_SaysTheRange) {
  expect_refused("estimator.fusion.max_age_s = 0.6\n", "estimator.fusion.max_age_s must be from 0 to 0.5 s, not 0.6.");
  expect_refused("estimator.fusion.max_age_s = -0.1\n", "not -0.1.");
  expect_refused("estimator.fusion.max_age_s = nan\n", "from 0 to 0.5 s, not nan.");
  expect_refused("estimator.fusion.max_age_s = inf\n", "from 0 to 0.5 s, not inf.");
  expect_refused("estimator.fusion.realign_count = -1\n", "must be from 1 to ");
  expect_refused("estimator.fusion.realign_count = 4294967297\n", "must be from 1 to ");
  expect_refused("estimator.fusion.realign_count = 1e300\n", "must be from 1 to ");
  expect_refused("estimator.fusion.realign_count = 99999999999999999999\n", "line 1: ");
  expect_refused("robot.mounts.base_T_camera.p_m = [0.1, 0.2, nan]\n", "from -2 to 2 m, not nan.");
}

TEST(ParamFile, LessAboveMore_IsRefused) {
  expect_refused("[estimator.contacts]\nforce_air_n = 30\n",
                 "line 2: estimator.contacts.force_air_n, 30, must not be more than "
                 "estimator.contacts.force_standing_n, 25.");
  EXPECT_EQ(read("[estimator.contacts]\nforce_air_n = 30\nforce_standing_n = 40\n").estimator.contacts.force_air_n,
            30.0);
}

TEST(ParamFile, NoToml_IsRefused) {
  expect_refused("estimator.fusion.tau_s = 1\nestimator.fusion.tau_s = 2\n", "line 2: ");
  expect_refused("[estimator.fusion]\n[estimator.fusion]\n", "line 2: ");
  expect_refused("tau_s = \n", "line 1: ");
  expect_refused("\x01\xff", "line 1: ");
}

TEST(ParamFile, NoFile_IsSaid) {
  Params params;
  try {
    read_params("/nowhere/params.toml", params);
    ADD_FAILURE();
  } catch (const FileError& error) {
    EXPECT_STREQ(error.what(), "Cannot read the parameter file \"/nowhere/params.toml\": No such file or directory.");
  }
  EXPECT_THROW(read_params(testing::TempDir(), params), FileError);
}

}  // namespace
}  // namespace polygmap::config
