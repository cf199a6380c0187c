// SPDX-License-Identifier: Apache-2.0
// A body off its plan while both feet stand: it crouches, and rests between its feet before the next shift.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/gait_checks.hpp"

namespace polygmap {
namespace {

using test::IdealClimb;

constexpr double kOmega_radps = 3.6;  // of the pendulum, about: an error of the speed over it is one of the component

// The body seems to move by that much while is_off(ticks since the gait began to hold).
struct Hold {
  Vec2 off_m = Vec2::Zero();  // of the divergent component, odometry
  std::function<bool(int)> is_off = {};
  int footholds_from_tick = 20;
  IdealClimb climb{{}};
  int ticks = 0;

  bool tick() {
    climb.tamper = [this](StateEstimate& state, FootholdSet& set, JointFeedback&) {
      if (ticks < footholds_from_tick) set = {};
      if (!state.initialised || !is_off || !is_off(ticks)) return;
      state.odom_v_base_mps.head<2>() += kOmega_radps * off_m;
    };
    const bool goes_on = climb.tick();
    if (climb.record().ticks > 252) ++ticks;
    return goes_on;
  }
};

// How much lower than at the start the torso is at the most within a second and a half.
double crouched_m(const std::function<bool(int)>& is_off) {
  Hold hold{.off_m = {0.03, 0.0}, .is_off = is_off, .footholds_from_tick = 1000};
  Hold calm{.footholds_from_tick = 1000};
  double most_m = 0.0;
  while (hold.ticks < 750) {
    hold.tick();
    calm.tick();
    most_m = std::max(most_m, calm.climb.true_T_base().p_m.z() - hold.climb.true_T_base().p_m.z());
  }
  return most_m;
}

TEST(GaitCrouch, BodyOffItsPlan_CrouchesByAsMuch_NotForOneTick) {
  EXPECT_LT(crouched_m([](int tick) { return tick == 400; }), 0.001);
  EXPECT_LT(crouched_m([](int tick) { return tick % 8 < 4; }), 0.001);  // four ticks at a time are none either
  const double lasting_m = crouched_m([](int tick) { return tick > 400; });
  EXPECT_GT(lasting_m, 0.025);
  EXPECT_LT(lasting_m, Gait::Params{}.crouch_max_m + 0.001);
}

// Ticks from the beginning of the hold to the first shift.
int first_shift(const Vec2& off_m, int until_tick) {
  Hold hold{.off_m = off_m, .is_off = [until_tick](int tick) { return tick < until_tick; }};
  while (hold.climb.status().phase == GaitPhase::kStandstill && hold.ticks < 1000) hold.tick();
  return hold.ticks;
}

TEST(GaitHold, BodySwaysSideways_RestsBetweenTheFeetFirst_NoLongerThanThatTakes) {
  const int settle_ticks = Gait::Params{}.settle_ticks;
  EXPECT_LT(first_shift({0.0, 0.03}, 0), 25);
  EXPECT_LT(first_shift({0.0, 0.012}, 500), 25);  // steady enough
  EXPECT_LT(first_shift({0.03, 0.0}, 500), 25);   // ahead the soles are long
  EXPECT_NEAR(first_shift({0.0, 0.03}, 120), 120, 5);
  EXPECT_NEAR(first_shift({0.0, -0.03}, 120), 120, 5);
  EXPECT_NEAR(first_shift({0.0, 0.03}, 500), settle_ticks, 5);
}

}  // namespace
}  // namespace polygmap
