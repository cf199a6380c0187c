// SPDX-License-Identifier: Apache-2.0
// Worlds of a file, under physics, perception in the loop.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "sim_stub/host/climb/climb.hpp"
#include "sim_stub/host/report/report_run.hpp"
#include "sim_stub/host/world_file.hpp"

namespace polygmap::sim {
namespace {

ClimbOptions in_world(const std::string& world, std::uint64_t seed) {
  ClimbOptions options;
  options.seed = seed;
  options.world = parse_world("world.toml", world);
  return options;
}
ClimbSummary climb(const std::string& world, std::uint64_t seed, const std::string& recording = "") {
  ClimbOptions options = in_world(world, seed);
  options.recording = recording;
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

// Without a reset: at its goal it is sent on.
TEST(WorldClimb, SentBackFromItsGoal_TurnsAndGoesDownTheSameStairs) {
  ClimbOptions options = in_world(kOnTheFloor + solid("low", 0.0, 0.3, 0.13) + solid("high", 0.3, 1.6, 0.26) +
                                      "[goal]\nx = 0.8\ny = 0\nsurface = \"high\"\n",
                                  3);
  options.comes_back = true;
  const ClimbSummary s = run_climb(options, {});
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_EQ(s.route.goal_reached, true);
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"floor", "low", "high", "low", "floor"}));
  EXPECT_GT(s.sole_margin_min_m, 0.004);
}

TEST(WorldClimb, GoalBehindAPlatform_GoesUpAndDownAgain) {
  const ClimbSummary s = climb(kOnTheFloor + solid("up", 0.0, 0.3, 0.13) + solid("top", 0.3, 1.1, 0.26) +
                                   solid("down", 1.1, 1.4, 0.13) + "[goal]\nx = 2.4\ny = 0\nsurface = \"floor\"\n",
                               1);
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"floor", "up", "top", "down", "floor"}));
  EXPECT_GT(s.sole_margin_min_m, 0.004);
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

TEST(WorldClimb, GoalBelowAnEdge_IsReachedDownTheStep) {
  const ClimbSummary s =
      climb(kOnTheFloor + solid("block", 0.0, 1.5, 0.13) + "[goal]\nx = 2.5\ny = 0\nsurface = \"floor\"\n", 2);
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"floor", "block", "floor"}));
  EXPECT_GT(s.sole_margin_min_m, 0.004);
}

TEST(WorldClimb, TwoHighStepsDown_GoalIsReached) {
  const ClimbSummary s =
      climb("[start]\nx = 0.8\ny = 0\nyaw_deg = 2\nsurface = \"high\"\n" + solid("high", 0.0, 1.2, 0.34) +
                solid("low", 1.2, 1.5, 0.17) + "[goal]\nx = 2.2\ny = 0\nsurface = \"floor\"\n",
            1);
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"high", "low", "floor"}));
  EXPECT_GT(s.sole_margin_min_m, 0.004);
  EXPECT_LT(s.foothold_error_m.max, 0.010);
}

// From a block down to a place on the floor; stop_s: 0, nobody stops it.
ClimbSummary climb_down(double stop_s) {
  std::vector<TimedRequest> asked{{1.0, OperatorCommand::kArm},
                                  {3.0, OperatorCommand::kStart},
                                  {4.0, OperatorRequest{Destination{.ahead_m = 1.8}}}};
  if (stop_s > 0.0) asked.push_back({stop_s, OperatorCommand::kStop});
  std::ostringstream said;
  ScriptedOperator script(asked, said);
  ClimbOptions options = in_world("[start]\nx = 0.7\ny = 0\nyaw_deg = 0\nsurface = \"block\"\n" +
                                      solid("block", 0.0, 1.5, 0.13) + "[goal]\nx = 2.5\ny = 0\nsurface = \"floor\"\n",
                                  2);
  options.climb_operator = &script;
  options.asked = asked;
  return run_climb(options, {});
}
TEST(WorldClimb, StoppedOnTheWayDownAStep_StandsOnBothFeet) {
  const ClimbSummary whole = climb_down(0.0);
  ASSERT_TRUE(whole.pass) << whole.reason;
  const auto lifts = std::find_if(whole.states.begin(), whole.states.end(),
                                  [](const StateChange& change) { return change.state == ModuleState::kClimbing; });
  ASSERT_NE(lifts, whole.states.end());
  // In the leading swing, after which an ankle has not the range for a body amid both feet; with the heel of the rear
  // foot up; and as it swings.
  for (const double after_s : {0.5, 1.7, 2.1}) {
    const ClimbSummary s = climb_down(lifts->at_s + after_s);
    EXPECT_FALSE(s.fell) << after_s << ": " << s.reason;
    EXPECT_EQ(s.states.back().state, ModuleState::kSafeStop) << after_s;
    EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"block", "floor"})) << after_s;
    EXPECT_GT(s.swing_clearance_min_m, 0.005) << after_s;
    const double landed_m = s.footsteps.back().true_T_landed.p_m.z();
    const double before_m = s.footsteps[s.footsteps.size() - 2].true_T_landed.p_m.z();
    if (after_s < 1.0) {
      EXPECT_NEAR(before_m - landed_m, 0.13, 0.02) << "between two levels";
    }
  }
}

TEST(WorldClimb, GoalBehindADeepDrop_StopsBeforeTheEdgeAndSaysWhy) {
  const ClimbSummary s = climb("[start]\nx = 0.4\ny = 0\nyaw_deg = 0\nsurface = \"block\"\n" +
                                   solid("block", 0.0, 1.5, 0.45) + "[goal]\nx = 2.5\ny = 0\nsurface = \"floor\"\n",
                               2);
  EXPECT_FALSE(s.pass);
  EXPECT_FALSE(s.fell);
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"block"}));
  EXPECT_GT(s.sole_margin_min_m, 0.005);
  // The floor below is seen from some places only.
  EXPECT_TRUE(s.stop_sentence.starts_with(text_of(StopReason::kDropTooDeep)) ||
              s.stop_sentence == text_of(StopReason::kGroundEnds))
      << s.reason;
}

// It turns on the spot, having seen nothing of what is behind it, and goes there.
TEST(WorldClimb, GoalBehindItOnTheFloor_IsReachedInItsHeading) {
  const ClimbSummary s = climb(
      kOnTheFloor + solid("far", 5.0, 6.0, 0.13) + "[goal]\nx = -1.6\ny = 0.2\nyaw_deg = 90\nsurface = \"floor\"\n", 3);
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"floor"}));
}

// Up the stairs that lie on the way, which it does not see from where it is; on the landing it turns round.
TEST(WorldClimb, StairsBehindIt_AreFoundAndClimbedAndTheGoalIsReachedInItsHeading) {
  const ClimbSummary s =
      climb("[start]\nx = -1.2\ny = -0.4\nyaw_deg = 120\nsurface = \"floor\"\n" + solid("low", 0.0, 0.28, 0.13) +
                solid("high", 0.28, 2.2, 0.26) + "[goal]\nx = 1.2\ny = 0\nyaw_deg = 180\nsurface = \"high\"\n",
            4);
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_EQ(s.route.surfaces_stood_on, (std::vector<std::string>{"floor", "low", "high"}));
}

// A polygon of the deck would span it.
TEST(WorldClimb, HoleInTheDeckOnTheWay_GoesRoundIt) {
  const auto deck = [](const std::string& name, double x_m, double y_m, double length_m, double width_m) {
    return "[[solid]]\nname = \"" + name + "\"\ncentre = [" + std::to_string(x_m) + ", " + std::to_string(y_m) +
           ", 0.3]\nsize = [" + std::to_string(length_m) + ", " + std::to_string(width_m) + ", 0.6]\n";
  };
  const ClimbSummary s =
      climb("[start]\nx = 0.3\ny = 0\nyaw_deg = 0\nsurface = \"near\"\n" + deck("near", 0.5, 0.0, 1.4, 2.0) +
                deck("left", 1.45, 0.65, 0.5, 0.7) + deck("right", 1.45, -0.65, 0.5, 0.7) +
                deck("far", 2.4, 0.0, 1.4, 2.0) + "[goal]\nx = 2.6\ny = 0\nsurface = \"far\"\n",
            5);
  EXPECT_TRUE(s.pass) << s.reason;
  EXPECT_EQ(s.route.goal_reached, true);
  EXPECT_GT(s.sole_margin_min_m, 0.005);
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
