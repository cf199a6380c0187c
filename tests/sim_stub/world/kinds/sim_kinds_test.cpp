// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

#include "sim_stub/host/world_file.hpp"
#include "sim_stub/world/clearance.hpp"
#include "sim_stub/world/kinds/kinds.hpp"
#include "sim_stub/world/tops.hpp"

namespace polygmap::sim {
namespace {

constexpr std::uint64_t kSeeds = 30;
constexpr double kMargin_m = 0.003;

// Each kind and seed.
template <typename Look>
void for_each_world(const Look& look) {
  for (const WorldKind& kind : world_kinds()) {
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const WorldPlan plan = draw_world(kind, seed);
      SCOPED_TRACE(plan.what);
      look(plan);
    }
  }
}
const WorldKind& kind_of(const std::string& name) { return *std::ranges::find(world_kinds(), name, &WorldKind::name); }

int step_named(const StairWorld& world, const std::string& name) {
  return static_cast<int>(std::ranges::find(world.steps, name, &Step::name) - world.steps.begin());
}

// The sole whose contact rectangle has its middle there, flat on the top.
Transform sole_at(const PlannedPlace& at, const Step& top) {
  const Vec3 up = top.true_T_step.R.col(2);
  const double yaw_rad = *at.yaw_deg * kPi / 180.0;
  const Vec3 left = up.cross(Vec3(std::cos(yaw_rad), std::sin(yaw_rad), 0.0)).normalized();
  Transform true_T_sole;
  true_T_sole.R << left.cross(up), left, up;
  const Vec3 middle_m{at.x_m, at.y_m, top.top_m(at.x_m, at.y_m)};
  const SoleRectangle& contact = nominal_robot().sole.contact;
  true_T_sole.p_m = middle_m - 0.5 * (contact.toe_x_m + contact.heel_x_m) * true_T_sole.R.col(0);
  return true_T_sole;
}

OrientedBox foot_of(const Transform& true_T_sole) {
  const SoleModel& sole = nominal_robot().sole;
  const SoleRectangle& box = sole.collision;
  const Vec3 middle_m{0.5 * (box.toe_x_m + box.heel_x_m), 0.0, 0.5 * sole.collision_height_m};
  return {{true_T_sole.R, true_T_sole * middle_m},
          {0.5 * (box.toe_x_m - box.heel_x_m), box.half_width_m, 0.5 * sole.collision_height_m}};
}

TEST(WorldKinds, EverySeed_IsAWorldThatItsFileReads) {
  for_each_world([](const WorldPlan& plan) {
    const WorldFile file = parse_world("drawn", to_toml(plan));  // throws where it is none
    EXPECT_EQ(file.world.steps.size(), plan.solids.size());
    EXPECT_EQ(file.world.goal.has_value(), plan.goal.has_value());
    if (file.world.goal && file.world.goal->step >= 0) {
      const Step& top = file.world.steps[static_cast<std::size_t>(file.world.goal->step)];
      EXPECT_GT(top.true_T_step.R(2, 2), 0.9998);
    }
  });
}

TEST(WorldKinds, EverySurfaceOfTheWay_TakesTheFoot) {
  for_each_world([](const WorldPlan& plan) {
    const StairWorld world = parse_world("drawn", to_toml(plan)).world;
    for (const PlannedPlace& at : plan.way) {
      SCOPED_TRACE(at.surface);
      const int step = step_named(world, at.surface);
      ASSERT_LT(step, static_cast<int>(world.steps.size()));
      const Transform true_T_sole = sole_at(at, world.steps[static_cast<std::size_t>(step)]);
      EXPECT_GE(margin_on_tops_m(true_T_sole, world, step, nominal_robot().sole), kMargin_m);
      EXPECT_GE(clearance_m(foot_of(true_T_sole), world.solids, std::array{step, kFloorStep}), kMargin_m);
    }
  });
}

TEST(WorldKinds, SeedTwice_IsTheSameTextAndAnotherOneIsNot) {
  for (const WorldKind& kind : world_kinds()) {
    const std::string text = to_toml(draw_world(kind, 7));
    EXPECT_EQ(text, to_toml(draw_world(kind, 7))) << kind.name;
    EXPECT_NE(text, to_toml(draw_world(kind, 8))) << kind.name;
  }
}

// What is drawn covers what the kind's sentence says.
TEST(WorldKinds, Up_HasAllThatMayStandBesideIt) {
  std::set<std::string> beside;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const std::string what = draw_world(kind_of("up"), seed).what;
    for (const char* words : {"rails beside", "rails on", "wall", "newels", "boxes", "nothing"}) {
      if (what.find(words) != std::string::npos) beside.insert(words);
    }
  }
  EXPECT_EQ(beside.size(), 6U);
}

TEST(WorldKinds, Trap_HasEveryTrap) {
  std::set<std::string> traps;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const std::string what = draw_world(kind_of("trap"), seed).what;
    for (const char* words : {"a hole", "missing tread", "stool", "table", "glass", "stairwell", "overhead"}) {
      if (what.find(words) != std::string::npos) traps.insert(words);
    }
  }
  EXPECT_EQ(traps.size(), 7U);
}

TEST(WorldKinds, Down_StartsOnTopAndLooksToTheFloor) {
  for (const char* name : {"down", "down-high", "down-open", "spiral-down", "ramp-down", "curb-down"}) {
    const WorldPlan plan = draw_world(kind_of(name), 3);
    SCOPED_TRACE(plan.what);
    EXPECT_EQ(plan.start.surface, "landing");
    ASSERT_TRUE(plan.goal);
    EXPECT_EQ(plan.goal->surface, "floor");
  }
}

TEST(WorldPlan, ItsText_IsWhatThePlanSays) {
  WorldPlan plan;
  plan.what = "a plank.";
  plan.start = {0.1, -0.0, 370.0, "floor"};
  plan.goal = PlannedPlace{2.00004, 1.0, {}, "plank"};
  plan.solids = {{"plank", {2.0, 1.0, 0.05}, {1.0, 0.4, 0.1}, {0.0, -3.0, 90.0}},
                 {"pane", {1.0, 0.0, 1.0}, {0.01, 1.0, 2.0}, Vec3::Zero(), false, true}};
  EXPECT_EQ(to_toml(plan),
            "# a plank.\n"
            "\n[start]\nx = 0.1\ny = 0\nyaw_deg = 10\nsurface = \"floor\"\n"
            "\n[goal]\nx = 2\ny = 1\nsurface = \"plank\"\n"
            "\n[[solid]]\nname = \"plank\"\ncentre = [2, 1, 0.05]\nsize = [1, 0.4, 0.1]\nrpy_deg = [0, -3, 90]\n"
            "\n[[solid]]\nname = \"pane\"\ncentre = [1, 0, 1]\nsize = [0.01, 1, 2]\nwalkable = false\n"
            "depth = \"glass\"\n");
}

}  // namespace
}  // namespace polygmap::sim
