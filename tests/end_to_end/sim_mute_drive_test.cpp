// SPDX-License-Identifier: Apache-2.0
// A drive or a bus falls silent during a climb under physics: the module stops, and the robot stands on both feet. What
// cannot be survived is in docs/vm.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "tests/support/bus_climb.hpp"

namespace polygmap::sim {
namespace {

BusClimb::Options climb_of(GaitPattern pattern) {
  return {.pattern = pattern, .bus_file = std::string(POLYGMAP_BUSES) + "/cubemars.toml"};
}
std::vector<SwingTimes> swings_of(const BusClimb::Options& options) {
  BusClimb reference(options);
  return swings_of(reference);
}
std::string text_of(const MuteMoment& moment, std::size_t mute) {
  return "swing " + std::to_string(moment.swing) + (moment.in_the_air ? ", in the air " : ", on both feet ") +
         std::to_string(moment.share) + ", fault " + std::to_string(mute);
}

// The first two steps onto a tread, a leading and a trailing one.
constexpr std::size_t kOnto = 4;
constexpr double kStopsOnTwoFeet_s = 0.12;

TEST(MuteDrive, OnBothFeet_StopsAtOnceAndStands) {
  const BusClimb::Options options = climb_of(GaitPattern::kDoubleStep);
  BusClimb climb(options);
  for (const MuteMoment& moment : moments_of(swings_of(options), kOnto, kOnto + 1)) {
    if (moment.in_the_air || moment.share > 0.6) continue;
    climb.run_until(moment.at_s);
    const auto mutes = mutes_of(moment.foot);
    for (const std::size_t n :
         {std::size_t{kKnee}, std::size_t{kAnklePitch}, kJointsPerLeg + kHipPitch, kJointCount, kJointCount + 1}) {
      const std::optional<MuteOutcome> copy = outcome_in_a_copy(climb, mutes[n]);
      ASSERT_TRUE(copy) << text_of(moment, n);
      const MuteOutcome& outcome = *copy;
      EXPECT_TRUE(outcome.stands()) << text_of(moment, n);
      EXPECT_LT(outcome.stop_s, kStopsOnTwoFeet_s) << text_of(moment, n);
    }
  }
}

TEST(MuteDrive, OfEitherLegInASwing_FootComesDownAndItStands) {
  const BusClimb::Options options = climb_of(GaitPattern::kDoubleStep);
  BusClimb climb(options);
  for (const MuteMoment& moment : moments_of(swings_of(options), kOnto, kOnto)) {
    if (!moment.in_the_air) continue;
    climb.run_until(moment.at_s);
    const auto mutes = mutes_of(moment.foot);
    for (const std::size_t n : {std::size_t{kHipRoll}, std::size_t{kKnee}, kJointsPerLeg + kAnklePitch}) {
      const std::optional<MuteOutcome> copy = outcome_in_a_copy(climb, mutes[n]);
      ASSERT_TRUE(copy) << text_of(moment, n);
      const MuteOutcome& outcome = *copy;
      EXPECT_TRUE(outcome.stands()) << text_of(moment, n);
      EXPECT_LT(outcome.stop_s, 1.0) << text_of(moment, n);
    }
  }
}

// A knee that stays folded keeps the foot in the air: the body comes down with it.
TEST(MuteDrive, KneeInTheMiddleOfASwing_BodyComesDownAndItStands) {
  const BusClimb::Options options = climb_of(GaitPattern::kDoubleStep);
  BusClimb climb(options);
  const std::vector<SwingTimes> swings = swings_of(options);
  const SwingTimes& swing = swings.at(kOnto);
  climb.run_until(0.5 * (swing.lift_off_s + swing.touch_down_s));
  const MuteOutcome outcome = outcome_of(climb, {false, joint_index(swing.foot, kKnee)});
  EXPECT_TRUE(outcome.stands());
  EXPECT_LT(outcome.stop_s, 2.0);
}

// No leg without a mute drive measures the base then, and by the IMU alone it would drift off.
TEST(MuteDrive, OneOfEachLeg_StandsOnForHalfAMinute) {
  const BusClimb::Options options = climb_of(GaitPattern::kDoubleStep);
  const std::vector<SwingTimes> swings = swings_of(options);
  BusClimb climb(options);
  climb.run_until(swings.at(kOnto).lift_off_s - 0.4);
  climb.set_mute({false, joint_index(Foot::kLeft, kHipYaw)}, true);
  const MuteOutcome outcome = outcome_of(climb, {false, joint_index(Foot::kRight, kHipYaw)}, 3.0, 30.0);
  EXPECT_TRUE(outcome.stands()) << climb.truth().fall_reason;
}

// In the shipped file that bus has the hip of the standing leg and the feet's board.
TEST(MuteDrive, FirstBusWhileTheRightFootIsInTheAir_StandsOnForHalfAMinute) {
  const BusClimb::Options options = climb_of(GaitPattern::kDoubleStep);
  BusClimb climb(options);
  const std::vector<SwingTimes> swings = swings_of(options);
  const auto swing = std::ranges::find_if(swings.begin() + kOnto, swings.end(),
                                          [](const SwingTimes& s) { return s.foot == Foot::kRight; });
  ASSERT_NE(swing, swings.end());
  climb.run_until(0.5 * (swing->lift_off_s + swing->touch_down_s));
  const MuteOutcome outcome = outcome_of(climb, {true, 0}, 3.0, 30.0);
  EXPECT_TRUE(outcome.stands()) << climb.truth().fall_reason;
}

// An ankle is mute for 60 ms from then on.
void expect_climbs_on(const BusClimb::Options& options, double at_s, Foot leg) {
  BusClimb climb(options);
  climb.run_until(at_s);
  const Mute mute{false, joint_index(leg, kAnklePitch)};
  climb.set_mute(mute, true);
  climb.run_on(0.06);
  climb.set_mute(mute, false);
  climb.run_until(60.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << at_s;
  EXPECT_EQ(climb.status().treads_climbed, 2U);
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
}

TEST(MuteDrive, ForSixtyMilliseconds_ClimbsOn) {
  const BusClimb::Options options = climb_of(GaitPattern::kDoubleStep);
  const std::vector<SwingTimes> swings = swings_of(options);
  const SwingTimes& swing = swings.at(kOnto);
  const double air_s = swing.touch_down_s - swing.lift_off_s;
  for (const double at_s : {swing.lift_off_s - 0.4, swing.lift_off_s + 0.4 * air_s}) {
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) expect_climbs_on(options, at_s, leg);
  }
}

// As when a cycle's frames are lost on all buses, again and again.
TEST(LongMuteDriveGap, AllDrivesForFiftyMilliseconds_ClimbsOn) {
  const BusClimb::Options options = climb_of(GaitPattern::kDoubleStep);
  const std::vector<SwingTimes> swings = swings_of(options);
  for (std::size_t n = kOnto; n < kOnto + 3; ++n) {
    const double air_s = swings.at(n).touch_down_s - swings.at(n).lift_off_s;
    for (const double share : {-0.3, 0.05, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95}) {
      BusClimb climb(options);
      climb.run_until(swings.at(n).lift_off_s + share * air_s);
      for (std::size_t j = 0; j < kJointCount; ++j) climb.set_mute({false, j}, true);
      climb.run_on(0.05);
      for (std::size_t j = 0; j < kJointCount; ++j) climb.set_mute({false, j}, false);
      climb.run_until(60.0);
      EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << n << ", " << share;
      EXPECT_EQ(climb.status().treads_climbed, 2U);
      EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    }
  }
}

TEST(LongMuteDriveGap, ForSixtyMillisecondsInEachPhaseOfASwing_ClimbsOn) {
  const BusClimb::Options options = climb_of(GaitPattern::kDoubleStep);
  const std::vector<SwingTimes> swings = swings_of(options);
  for (std::size_t n = kOnto; n < kOnto + 3; ++n) {
    const double air_s = swings.at(n).touch_down_s - swings.at(n).lift_off_s;
    for (const double share : {0.05, 0.2, 0.4, 0.6, 0.8}) {
      for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
        expect_climbs_on(options, swings.at(n).lift_off_s + share * air_s, leg);
      }
    }
  }
}

// Every moment and every fault of the table docs/measured/mute.md, a swing each.
class LongMuteDrive : public testing::TestWithParam<std::tuple<GaitPattern, std::size_t>> {};
TEST_P(LongMuteDrive, InEveryPhaseOfASwing_StandsInMostCases) {
  const auto [pattern, swing] = GetParam();
  const BusClimb::Options options = climb_of(pattern);
  const std::vector<MuteMoment> moments = moments_of(swings_of(options), swing, swing);
  ASSERT_FALSE(moments.empty());
  BusClimb climb(options);
  int all = 0, good = 0, lost_on_both = 0;
  for (const MuteMoment& moment : moments) {
    climb.run_until(moment.at_s);
    const auto mutes = mutes_of(moment.foot);
    for (std::size_t n = 0; n < kMutes; ++n) {
      const std::optional<MuteOutcome> copy = outcome_in_a_copy(climb, mutes[n]);
      ASSERT_TRUE(copy) << text_of(moment, n);
      const MuteOutcome& outcome = *copy;
      ++all;
      good += outcome.stands() ? 1 : 0;
      if (moment.in_the_air || moment.share > 0.6) continue;
      lost_on_both += outcome.stands() ? 0 : 1;
      EXPECT_TRUE(outcome.stopped) << text_of(moment, n);
      EXPECT_LT(outcome.stop_s, kStopsOnTwoFeet_s) << text_of(moment, n);
    }
  }
  std::printf("on both feet: %d of %d\n", good, all);
  EXPECT_GE(10 * good, 8 * all);
  EXPECT_LE(lost_on_both, 2);
}
INSTANTIATE_TEST_SUITE_P(Long, LongMuteDrive,
                         testing::Combine(testing::Values(GaitPattern::kDoubleStep, GaitPattern::kSingleStep),
                                          testing::Range(std::size_t{0}, std::size_t{7})));

}  // namespace
}  // namespace polygmap::sim
