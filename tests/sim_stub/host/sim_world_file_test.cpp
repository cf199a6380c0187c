// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "firmware/config/file_error.hpp"
#include "sim_stub/host/world_file.hpp"
#include "sim_stub/world/clearance.hpp"

namespace polygmap::sim {
namespace {

constexpr const char* kStart = "[start]\nx = -0.5\ny = 0.1\nyaw_deg = 90\nsurface = \"floor\"\n";
constexpr const char* kBlock = "[[solid]]\nname = \"block\"\ncentre = [1, 0, 0.1]\nsize = [0.4, 1.0, 0.2]\n";

std::string refusal(const std::string& text) {
  try {
    static_cast<void>(parse_world("w.toml", text));
  } catch (const config::FileError& error) {
    return error.what();
  }
  return "";
}

TEST(WorldFile, StartGoalAndSolids_AreAsTheFileSays) {
  const WorldFile file =
      parse_world("w.toml", std::string(kStart) + "[goal]\nx = 1.1\ny = 0.2\nsurface = \"block\"\n" + kBlock +
                                "[[solid]]\nname = \"pane\"\ncentre = [0, 2, 1]\nsize = [1, 0.01, 2]\n"
                                "rpy_deg = [0, 0, 90]\nwalkable = false\ndepth = \"glass\"\n");
  EXPECT_NEAR(*file.start.yaw_rad, 0.5 * kPi, 1e-12);
  EXPECT_EQ(file.start.step, kFloorStep);
  EXPECT_EQ(file.start_height_m, 0.0);
  ASSERT_TRUE(file.world.goal);
  EXPECT_EQ(file.world.goal->step, 0);
  EXPECT_FALSE(file.world.goal->yaw_rad);
  EXPECT_FALSE(file.world.is_staircase);
  ASSERT_EQ(file.world.solids.size(), 2U);
  ASSERT_EQ(file.world.steps.size(), 2U);
  EXPECT_NEAR(file.world.steps[0].top_m(1.1, 0.2), 0.2, 1e-12);
  EXPECT_TRUE(file.world.solids[1].is_glass);
  EXPECT_EQ(file.world.solids[1].step, 1);
  EXPECT_FALSE(file.world.steps[1].is_walkable);
  EXPECT_NEAR(std::abs(file.world.solids[1].true_T_solid.R(1, 0)), 1.0, 1e-9);  // turned to the side
}

TEST(WorldFile, StartOnASolid_IsAsHighAsItsTop) {
  const std::string text =
      "[start]\nx = 1.0\ny = 0\nyaw_deg = 0\nsurface = \"stage\"\n"
      "[[solid]]\nname = \"stage\"\ncentre = [1, 0, 0.5]\nsize = [1, 1, 0.2]\n";
  EXPECT_NEAR(parse_world("w.toml", text).start_height_m, 0.6, 1e-9);
}

TEST(WorldFile, BoxOnItsSide_IsStoodOnWhereItIsUp) {
  const std::string text =
      std::string(kStart) +
      "[[solid]]\nname = \"plank\"\ncentre = [2, 0, 0.5]\nsize = [0.1, 1, 2]\nrpy_deg = [0, 90, 0]\n";
  const Step top = parse_world("w.toml", text).world.steps[0];
  EXPECT_TRUE(top.is_walkable);
  EXPECT_NEAR(top.top_m(2.9, 0.4), 0.55, 1e-9);
}

TEST(WorldFile, WhatItCannotBe_IsRefusedWithLineAndKey) {
  const std::string start(kStart), block(kBlock);
  const auto expect = [](const std::string& text, const char* words) {
    EXPECT_NE(refusal(text).find(words), std::string::npos) << refusal(text);
  };
  expect(block, "[start] is missing");
  expect("[start]\nx = 0\ny = 0\nsurface = \"floor\"\n", "yaw_deg is missing");
  expect(start + "[[solid]]\nname = \"a\"\ncentre = [0, 0]\nsize = [1, 1, 1]\n", "line 8: a: centre must be three");
  expect(start + block + "colour = 3\n", "line 10: \"colour\" is no key of a solid");
  expect(start + block + "depth = \"fog\"\n", "must be \"seen\" or \"glass\", not \"fog\"");
  expect(start + block + block, "\"block\" is the name of two solids");
  expect(start + "[[solid]]\nname = \"floor\"\ncentre = [0, 0, 0]\nsize = [1, 1, 1]\n", "no solid");
  expect(start + block + "[goal]\nx = 0\ny = 0\nsurface = \"roof\"\n", "\"roof\" is no walkable solid");
  expect(start + block + "[goal]\nx = 3\ny = 0\nsurface = \"block\"\n", "x and y are not on \"block\"");
  expect(start + "[[solid]]\nname = \"a\"\ncentre = [0, 0, 0]\nsize = [1, 1, -1]\n", "a: size must be from");
  expect(start + "[[solid]]\nname = \"a\"\ncentre = [nan, 0, 0]\nsize = [1, 1, 1]\n", "a: centre must be from");
  expect("solid = 3\n" + start, "each solid must be a table");
  expect(start + "[sun]\n", "\"sun\" is no key of a world");
  expect(start + "[[solid]]\nname = \"a\\u001b[2J\"\ncentre = [2, 0, 0]\nsize = [1, 1, 1]\n",
         "without control characters");
  expect(start + "[[solid]]\nname = \"a\"\ncentre = [-0.5, 0, 0.5]\nsize = [1, 1, 1]\n", "would stand in \"a\"");
  const std::string on_a = "[start]\nx = 0.05\ny = 0\nyaw_deg = 0\nsurface = \"a\"\n[[solid]]\nname = \"a\"\n";
  expect(on_a + "centre = [0.5, 0, 0]\nsize = [1, 1, 1]\n", "a sole would reach over an edge");
  expect(on_a + "centre = [0, 0, 0]\nsize = [3, 3, 1]\nrpy_deg = [0, 5, 0]\n", "\"a\" slopes");
}

TEST(WorldFile, SolidsOfIt_AreWhatIsCollidedWith) {
  const StairWorld world = parse_world("w.toml", std::string(kStart) + kBlock).world;
  const OrientedBox foot{{Mat3::Identity(), Vec3(1.0, 0.0, 0.25)}, Vec3(0.1, 0.05, 0.02)};
  EXPECT_NEAR(clearance_m(foot, solids_of(world)), 0.03, 1e-9);
}

}  // namespace
}  // namespace polygmap::sim
