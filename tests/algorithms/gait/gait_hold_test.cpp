// SPDX-License-Identifier: Apache-2.0
// Both feet stand: a body off its plan crouches, and rests between its feet before the next shift; before the stairs it
// stretches to see its toes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/support/gait_checks.hpp"

namespace polygmap {
namespace {

using test::ClimbSetup;
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
  EXPECT_LT(crouched_m([](int tick) { return tick % 8 >= 4; }), 0.001);  // four ticks at a time are none either
  const double lasting_m = crouched_m([](int tick) { return tick > 400; });
  EXPECT_GT(lasting_m, 0.025);
  EXPECT_LT(lasting_m, Gait::Params{}.crouch.max_m + 0.001);
}

// Ticks from the beginning of the hold to the first shift. off_m: ahead of the body and to its left.
int first_shift(const Vec2& off_m, int until_tick) {
  constexpr double kYaw_rad = 0.5;
  ClimbSetup turned;
  turned.odom_yaw_rad = kYaw_rad;
  Hold hold{.off_m = rotation_z(kYaw_rad).topLeftCorner<2, 2>() * off_m,
            .is_off = [until_tick](int tick) { return tick < until_tick; },
            .climb = IdealClimb{turned}};
  while (hold.climb.status().phase == GaitPhase::kStandstill && hold.ticks < 1000) hold.tick();
  return hold.ticks;
}

TEST(GaitHold, BodySwaysSidewaysOrBack_RestsBetweenTheFeetFirst_NoLongerThanThatTakes) {
  const int settle_ticks = Gait::Params{}.standing.settle_ticks;
  EXPECT_LT(first_shift({0.0, 0.03}, 0), 25);
  EXPECT_LT(first_shift({0.0, 0.012}, 500), 25);  // steady enough
  EXPECT_LT(first_shift({0.03, 0.0}, 500), 25);   // the next step goes there
  EXPECT_LT(first_shift({-0.012, 0.0}, 500), 25);
  EXPECT_NEAR(first_shift({-0.03, 0.0}, 120), 120, 5);
  EXPECT_NEAR(first_shift({-0.03, 0.0}, 500), settle_ticks, 5);
  EXPECT_NEAR(first_shift({0.0, 0.03}, 120), 120, 5);
  EXPECT_NEAR(first_shift({0.0, -0.03}, 120), 120, 5);
  EXPECT_NEAR(first_shift({0.0, 0.03}, 500), settle_ticks, 5);
}

// Height of the base over the higher sole, m.
double height_m(const IdealClimb& climb) {
  return climb.true_T_base().p_m.z() -
         std::max(climb.true_T_sole(Foot::kLeft).p_m.z(), climb.true_T_sole(Foot::kRight).p_m.z());
}
double step_between_m(const IdealClimb& climb) {
  return std::abs(climb.true_T_sole(Foot::kLeft).p_m.z() - climb.true_T_sole(Foot::kRight).p_m.z());
}
ClimbSetup from(double distance_m) {
  ClimbSetup setup;
  setup.distance_m = distance_m;
  return setup;
}
const double kTall_m = Gait::Params{}.standing.toe_calibration.height_m - 0.008;

// Ticks for which both feet stand level and the base is as high as it looks from, before each of the swings.
std::vector<int> looks(IdealClimb& climb) {
  std::vector<int> ticks{0};
  std::uint32_t swings = 0;
  while (climb.tick() && climb.tick_count() < 25000) {
    const GaitStatus& status = climb.status();
    if (std::exchange(swings, status.step.sequence) != status.step.sequence) ticks.push_back(0);
    if (status.phase != GaitPhase::kSwing && step_between_m(climb) < 0.02 && height_m(climb) > kTall_m) ++ticks.back();
  }
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  return ticks;
}

TEST(GaitLook, BeforeTheFirstStepOntoTheStairs_StandsTallForHalfASecond_OnceAndThenNoMore) {
  for (const double distance_m : {0.35, 0.6}) {
    IdealClimb climb(from(distance_m));
    const std::vector<int> ticks = looks(climb);
    EXPECT_EQ(std::count_if(ticks.begin(), ticks.end(), [](int n) { return n > 0; }), 1);
    EXPECT_GE(*std::max_element(ticks.begin(), ticks.end()), 200);
    EXPECT_LE(*std::max_element(ticks.begin(), ticks.end()), 450);
  }
}

TEST(GaitLook, NoTicksForIt_NeverLooks) {
  Gait::Params params;
  params.standing.toe_calibration.ticks = 0;
  IdealClimb climb(from(0.5), params);
  const std::vector<int> ticks = looks(climb);
  EXPECT_EQ(*std::max_element(ticks.begin(), ticks.end()), 0);
}

// What it sees of its toes tells where the stairs are: a correction may follow, another look not.
TEST(GaitLook, FootholdsMoveWhileItLooks_LooksToTheEnd_OnceAndClimbs) {
  IdealClimb climb(from(0.5));
  bool looked = false;
  climb.tamper = [&](StateEstimate&, FootholdSet& set, JointFeedback&) {
    looked = looked || (step_between_m(climb) < 0.02 && height_m(climb) > 0.82);
    if (!looked) return;
    for (auto* feet : {&set.p_star_feet, &set.p_star_star_feet}) {
      for (Foothold& foothold : *feet) foothold.position_m.x() += 0.008;
    }
    set.tread.nosing_a_m.x() += 0.008;
    set.tread.nosing_b_m.x() += 0.008;
  };
  const std::vector<int> ticks = looks(climb);
  EXPECT_TRUE(looked);
  EXPECT_EQ(std::count_if(ticks.begin(), ticks.end(), [](int n) { return n > 0; }), 1);
}

// Asked to stop, or blind, while it rises: it does not stay up there.
TEST(GaitLook, StopOrNoMoreSensorsMeanwhile_ComesDownAgain) {
  for (const bool blind : {false, true}) {
    IdealClimb climb(from(0.5));
    while (climb.tick() && !(step_between_m(climb) < 0.02 && height_m(climb) > 0.81)) {
    }
    ASSERT_EQ(climb.status().step.sequence > 0, true);
    if (blind) {
      climb.tamper = [oldest_ns = std::int64_t{-1}](StateEstimate& state, FootholdSet&, JointFeedback&) mutable {
        if (oldest_ns < 0) oldest_ns = state.oldest_input_ns;
        state.oldest_input_ns = oldest_ns;
      };
    } else {
      climb.gait().request_stop(StopReason::kOperator);
    }
    double highest_m = 0.0;
    for (int i = 0; i < 900; ++i) {
      (void)climb.tick();
      highest_m = std::max(highest_m, height_m(climb));
    }
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, blind ? StopReason::kStateStale : StopReason::kOperator);
    EXPECT_LT(highest_m, kTall_m) << blind;
    EXPECT_LT(height_m(climb), 0.80) << blind;
  }
}

}  // namespace
}  // namespace polygmap
