// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/swing_timing.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace polygmap {
namespace {

constexpr std::int32_t kSwing_ticks = 450;
constexpr double kTurn_tick = 170.0;
constexpr SwingTiming::Params kParams;
constexpr double kToppling_m = kParams.falling_outward_m + 0.001;

// So many ticks under the same circumstances.
void advance(SwingTiming& pace, int ticks, const SwingTiming::Seen& seen) {
  for (int i = 0; i < ticks; ++i) pace.advance(kParams, seen, kSwing_ticks);
}
int ticks_to_the_end(SwingTiming pace, const SwingTiming::Seen& seen) {
  int ticks = 0;
  for (; pace.tick() < kSwing_ticks && ticks < 2 * kSwing_ticks; ++ticks) pace.advance(kParams, seen, kSwing_ticks);
  return ticks;
}

TEST(SwingTiming, BodyOnItsPlan_RunsAsPlanned) {
  SwingTiming pace;
  advance(pace, kSwing_ticks,
          {.falling_outward_m = 0.9 * kParams.falling_outward_m, .turn_until_tick = kTurn_tick, .drive_share = 0.95});
  EXPECT_EQ(pace.tick(), kSwing_ticks);
  EXPECT_EQ(pace.widened_m(), 0.0);
  EXPECT_FALSE(pace.goes_back());
}

TEST(SwingTiming, TopplesTowardsTheFreeFoot_HurriesAndLandsWider) {
  SwingTiming pace;
  const auto half = static_cast<int>(0.5 * kSwing_ticks);
  advance(pace, half, {});
  advance(pace, 1, {.falling_outward_m = kToppling_m, .turn_until_tick = kTurn_tick});
  EXPECT_FALSE(pace.goes_back());
  // Once it topples it hurries to the end, whatever the feedback makes of it; nothing leaps.
  EXPECT_LT(ticks_to_the_end(pace, {}), 1.1 * (kSwing_ticks - half) / kParams.speed_up);
  EXPECT_LT(pace.pace(), 1.1);
  advance(pace, 1, {});
  EXPECT_LE(pace.widened_m(), 2.0 * kParams.widen_mps * kTick_s + 1e-12);
  advance(pace, 200, {});
  EXPECT_EQ(pace.widened_m(), kParams.widen_m);
}

TEST(SwingTiming, FallsAhead_HurriesOnItsPath) {
  SwingTiming pace;
  advance(pace, 100, {.turn_until_tick = kTurn_tick});
  advance(pace, 1, {.falling_ahead_m = kParams.falling_ahead_m + 0.001, .turn_until_tick = kTurn_tick});
  EXPECT_FALSE(pace.goes_back()) << "where it stood is behind";
  EXPECT_LT(ticks_to_the_end(pace, {}), 1.1 * (kSwing_ticks - 100) / kParams.speed_up);
  advance(pace, 100, {});
  EXPECT_EQ(pace.widened_m(), 0.0);
  EXPECT_FALSE(pace.may_land_sooner()) << "the path stays: straight it would meet the nosing";
  SwingTiming behind;
  advance(behind, kSwing_ticks, {.falling_ahead_m = -1.0});
  EXPECT_EQ(behind.tick(), kSwing_ticks);
}

TEST(SwingTiming, Toppling_LandsNoWiderThanTheTread) {
  for (const double room_m : {0.02, 0.0, -0.01}) {
    SwingTiming pace;
    advance(pace, 200, {});
    advance(pace, 200, {.falling_outward_m = kToppling_m, .side_room_m = room_m});
    EXPECT_EQ(pace.widened_m(), std::max(room_m, 0.0));
  }
}

// The drives' share grows with the pace; the plan's own pace is proved.
TEST(SwingTiming, Hurrying_TakesNoMoreThanTheDrivesHave) {
  for (const double at_plan : {0.4, 0.7, 0.95, 1.2}) {
    SwingTiming pace;
    advance(pace, 200, {});
    double most = 0.0;
    for (int i = 0; i < 150; ++i) {
      pace.advance(kParams, {.falling_outward_m = kToppling_m, .drive_share = at_plan * pace.pace()}, kSwing_ticks);
      most = std::max(most, pace.pace());
    }
    EXPECT_NEAR(most, math::clamp(1.0 / at_plan, 1.0, kParams.speed_up), 1e-9) << at_plan;
  }
}

TEST(SwingTiming, StraightPath_AsFastAsTheDrivesAre) {
  for (const double at_pace_one : {0.4, 0.7, 1.0, 1.6, 3.0}) {
    for (const double outward_m : {0.0, kToppling_m}) {
      SwingTiming pace;
      advance(pace, 1, {.falling_outward_m = kToppling_m});
      pace.begin_straight();
      advance(pace, 50, {.falling_outward_m = kToppling_m});  // as fast as may be, before the drives tell
      for (int i = 0; i < 50; ++i) {
        pace.advance(kParams, {.falling_outward_m = outward_m, .drive_share = at_pace_one * pace.pace()}, kSwing_ticks);
      }
      const double most = outward_m > 0.0 ? kParams.speed_up : 1.0;  // as planned once it falls no more
      EXPECT_NEAR(pace.pace(), std::min(most, 1.0 / at_pace_one), 1e-9) << at_pace_one;
    }
  }
}

TEST(SwingTiming, TopplesEarly_TurnsBackWhereItMay) {
  for (const bool may : {true, false}) {
    SwingTiming pace;
    advance(pace, static_cast<int>(0.9 * kTurn_tick), {});
    advance(pace, 1, {.falling_outward_m = kToppling_m, .turn_until_tick = may ? kTurn_tick : 0.0});
    EXPECT_EQ(pace.goes_back(), may);
    const double before = pace.tick();
    advance(pace, 100, {});
    EXPECT_EQ(pace.tick() < before, may);
    EXPECT_EQ(pace.widened_m() == 0.0, may);  // back is where it stood
    EXPECT_FALSE(pace.no_ground());
  }
}

TEST(SwingTiming, MayTouchAboveItsTarget_StopsAtOnceAndGoesOnGently) {
  for (const bool straight : {false, true}) {
    SwingTiming pace;
    advance(pace, 300, {});
    if (straight) pace.begin_straight();
    const double at_tick = pace.tick();
    advance(pace, 10, {.stopped = true});
    EXPECT_EQ(pace.tick(), at_tick);
    EXPECT_EQ(pace.last_tick(), at_tick);
    advance(pace, 1, {});
    EXPECT_NEAR(pace.pace(), kParams.pace_per_tick, 1e-12);
    for (int i = 0; i < 100; ++i) pace.advance(kParams, {.drive_share = 0.3 * pace.pace()}, kSwing_ticks);
    EXPECT_NEAR(pace.pace(), 1.0, 1e-9) << (straight ? "straight" : "as planned");
  }
}

TEST(SwingTiming, GoesBack_IsNotStopped) {
  SwingTiming pace;
  advance(pace, 100, {});
  advance(pace, 200, {.wanted_back = true, .stopped = true});
  EXPECT_LT(pace.tick(), 0.0);
}

TEST(SwingTiming, GroundLate_GoesDownFaster) {
  SwingTiming pace;
  advance(pace, kSwing_ticks + kParams.late_ticks, {});
  EXPECT_EQ(pace.pace(), 1.0);
  advance(pace, 100, {});
  EXPECT_NEAR(pace.pace(), kParams.descend_search, 1e-9);
}

TEST(SwingTiming, NoGround_WaitsAndGoesBackSlowly) {
  SwingTiming pace;
  advance(pace, kSwing_ticks + 100, {});
  const double lowest = pace.tick();
  pace.retreat(kParams);
  EXPECT_TRUE(pace.goes_back() && pace.no_ground());
  advance(pace, kParams.pause_ticks, {.falling_outward_m = kToppling_m});
  EXPECT_EQ(pace.tick(), lowest);
  advance(pace, 100, {.falling_outward_m = kToppling_m});
  EXPECT_NEAR(pace.tick(), lowest - 100 * kParams.retreat, 1e-9);
  EXPECT_EQ(pace.widened_m(), 0.0);
  pace.begin();
  EXPECT_FALSE(pace.goes_back());
}

}  // namespace
}  // namespace polygmap
