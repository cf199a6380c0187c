// SPDX-License-Identifier: Apache-2.0
// Worlds of a file, under physics, perception in the loop.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "sim_stub/host/climb/climb.hpp"
#include "sim_stub/host/report/report_run.hpp"
#include "sim_stub/host/world_file.hpp"

namespace polygmap::sim {
namespace {

ClimbSummary climb(const std::string& world, std::uint64_t seed, const std::string& recording = "") {
  ClimbOptions options;
  options.seed = seed;
  options.recording = recording;
  options.world = parse_world("world.toml", world);
  return run_climb(options, {});
}

std::string solid(const std::string& name, double from_x_m, double to_x_m, double height_m) {
  return "[[solid]]\nname = \"" + name + "\"\ncentre = [" + std::to_string(0.5 * (from_x_m + to_x_m)) + ", 0, " +
         std::to_string(0.5 * height_m) + "]\nsize = [" + std::to_string(to_x_m - from_x_m) + ", 1.2, " +
         std::to_string(height_m) + "]\n";
}
constexpr const char* kOnTheFloor = "[start]\nx = -0.5\ny = 0\nyaw_deg = 2\nsurface = \"floor\"\n";

TEST(WorldClimb, TwoBoxesThatAreStairs_GoalIsReachedAndWhatItStoodOnIsTold) {
  const ClimbSummary s = climb(kOnTheFloor + solid("low", 0.0, 0.28, 0.13) + solid("high", 0.28, 1.5, 0.26) +
                                   "[goal]\nx = 0.5\ny = 0\nsurface = \"high\"\n",
                               1);
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_EQ(s.route.goal_reached, true);
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"floor", "low", "high"}));
  EXPECT_GT(s.sole_margin_min_m, 0.0);
  EXPECT_LT(s.foothold_error_m.max, 0.0124);
  EXPECT_GT(s.route.body_clearance_min_m, 0.0);
}

// The page lays the lidar's own world on the true one: its way lies where the base's does.
TEST(WorldClimb, Recorded_ReportHasTheSolidsAndTheLidarsWay) {
  const std::string path = testing::TempDir() + "/polygmap_world_" + std::to_string(::getpid()) + ".mcap";
  EXPECT_TRUE(climb(kOnTheFloor + solid("step one", 0.0, 1.5, 0.13), 5, path).pass);
  ReportRun run(path);
  ASSERT_EQ(run.read(), "");
  const ReportJson json = run.json();
  EXPECT_EQ(json["stairs"]["boxes"].size(), 1U);
  for (std::size_t axis = 0; axis < 3; ++axis) {  // the middle of what the column has
    const double middle_m = json["series"]["base_true"]["offset"][axis].get<double>();
    EXPECT_NEAR(json["series"]["lio"]["offset"][axis].get<double>(), middle_m, 0.1) << axis;
  }
  std::filesystem::remove(path);
}

TEST(WorldClimb, GoalSomewhereElse_IsNotReached) {
  const ClimbSummary s =
      climb(kOnTheFloor + solid("block", 0.0, 1.5, 0.13) + "[goal]\nx = 1.4\ny = 0\nsurface = \"block\"\n", 2);
  EXPECT_FALSE(s.pass);
  EXPECT_FALSE(s.fell);
  EXPECT_EQ(s.route.goal_reached, false);
  EXPECT_EQ(s.route.surfaces_stood_on.back(), "block");
}

TEST(WorldClimb, StairsOfGlass_AreNoneToTheModule) {
  const ClimbSummary s = climb(kOnTheFloor + solid("pane", 0.0, 1.5, 0.13) + "depth = \"glass\"\n", 3);
  EXPECT_FALSE(s.pass);
  EXPECT_FALSE(s.fell) << s.reason;
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"floor"}));
  EXPECT_FALSE(s.stop_sentence.empty());
}

TEST(WorldClimb, StartOnATop_StandsThere) {
  const ClimbSummary s =
      climb("[start]\nx = 0.5\ny = 0\nyaw_deg = 0\nsurface = \"top\"\n" + solid("top", 0.0, 3.0, 0.30), 4);
  EXPECT_FALSE(s.fell) << s.reason;
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"top"}));
}

}  // namespace
}  // namespace polygmap::sim
