// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "sim_stub/host/climb/climb_svg.hpp"
#include "sim_stub/host/climb/picture/world_picture.hpp"

namespace polygmap::sim::svg {
namespace {

constexpr const char* kStart = "[start]\nx = 0\ny = 0\nyaw_deg = 30\nsurface = \"floor\"\n";

WorldFile world_of(const std::string& more) { return parse_world("w.toml", kStart + more); }
std::string solid(const std::string& name, double z_m, const std::string& more = "") {
  return "[[solid]]\nname = \"" + name + "\"\ncentre = [2, 0, " + std::to_string(z_m) + "]\nsize = [1, 1, 0.1]\n" +
         more;
}
std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}
const View kAbove{1, 0.0, 0.0, 100.0, 0.0, 0.0};

TEST(WorldPicture, WayToTheGoal_GoesToTheRight) {
  const WorldFile file = world_of("[goal]\nx = -1\ny = 2\nsurface = \"floor\"\n");
  const Vec3 goal_m = view_turn(file) * Vec3(-1.0, 2.0, 0.0);
  EXPECT_NEAR(goal_m.x(), std::sqrt(5.0), 1e-9);
  EXPECT_NEAR(goal_m.y(), 0.0, 1e-9);
}

TEST(WorldPicture, WithoutAGoal_WhereItLooksIsToTheRight) {
  const Vec3 ahead = view_turn(world_of("")) * Vec3(std::cos(kPi / 6.0), 0.5, 0.0);
  EXPECT_NEAR(ahead.x(), 1.0, 1e-9);
}

TEST(WorldPicture, TurnedView_TurnsPointsAndFloorAlike) {
  View turned = kAbove;
  turned.view_R_true = rotation_z(-0.5 * kPi);
  const Vec3 true_p_m(0.0, 2.0, 0.3);
  EXPECT_NEAR(turned.x_px(true_p_m), 200.0, 1e-9);
  EXPECT_NEAR(turned.y_px(true_p_m), 0.0, 1e-9);
  std::string out;
  turned.up = 2;
  add_stairs_from_the_side(out, turned, world_of("").world, {-1.0, 3.0}, -1.0);
  EXPECT_NE(out.find("\"-100.0,100.0 -100.0,0.0 300.0,0.0 300.0,100.0 \""), std::string::npos) << out;
}

TEST(WorldPicture, Solids_TheHighestIsLastAndGlassAndThingsShowWhatIsBehind) {
  std::string out;
  add_solids(
      out, kAbove,
      world_of(solid("high", 1.0, "walkable = false\n") + solid("low", 0.2) + solid("pane", 0.5, "depth = \"glass\"\n"))
          .world);
  const std::size_t low = out.find("fill-opacity=\"1.00\""), pane = out.find("fill-opacity=\"0.20\""),
                    high = out.find("fill-opacity=\"0.50\"");
  EXPECT_LT(low, pane);
  EXPECT_LT(pane, high);
  EXPECT_NE(high, std::string::npos);
}

TEST(WorldPicture, Climb_HasStartAndGoalInBothViews) {
  ClimbSummary summary;
  summary.options.world = world_of(solid("top", 1.0) + "[goal]\nx = 2\ny = 0\nsurface = \"top\"\n");
  const std::string svg = climb_svg(summary.options.world->world, {}, summary);
  EXPECT_EQ(count(svg, ">start</text>"), 2U);
  EXPECT_EQ(count(svg, ">goal</text>"), 2U);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace polygmap::sim::svg
