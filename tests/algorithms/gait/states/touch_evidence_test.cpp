// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/touch_evidence.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace polygmap {
namespace {

constexpr TouchEvidence::Params kParams;

// Samples of one force until it touches, at most 1000.
int samples_until_touch(double force_n, bool early) {
  TouchEvidence touch;
  int samples = 0;
  while (samples < 1000 && !touch.touches(kParams, early)) {
    touch.take(kParams, force_n);
    ++samples;
  }
  return samples;
}

TEST(TouchEvidence, HardTouchDown_CountsAtOnceWhereExpectedAndLaterWhereEarly) {
  EXPECT_EQ(samples_until_touch(200.0, false), 1);
  EXPECT_EQ(samples_until_touch(200.0, true), 5);
}

TEST(TouchEvidence, SofterTouchDown_TakesLonger) {
  EXPECT_GT(samples_until_touch(42.0, false), samples_until_touch(45.0, false));
  EXPECT_GT(samples_until_touch(42.0, true), samples_until_touch(42.0, false));
  EXPECT_LT(samples_until_touch(42.0, true), 50);
}

TEST(TouchEvidence, ForceBelowEven_NeverTouches) { EXPECT_EQ(samples_until_touch(38.0, false), 1000); }

TEST(TouchEvidence, ScrapesForAMoment_TouchesNotAndIsForgotten) {
  TouchEvidence touch;
  for (int i = 0; i < 4; ++i) touch.take(kParams, 150.0);
  EXPECT_FALSE(touch.touches(kParams, true));
  for (int i = 0; i < 4; ++i) touch.take(kParams, 0.0);
  EXPECT_TRUE(touch.hangs());
}

TEST(TouchEvidence, ScrapedAboveTheTargetAndIsFree_TouchesNotWhereTheGroundIsExpected) {
  TouchEvidence touch;
  for (int i = 0; i < 4; ++i) touch.take(kParams, 150.0);
  touch.take(kParams, 0.0);
  EXPECT_FALSE(touch.touches(kParams, false));
  touch.take(kParams, 150.0);
  EXPECT_TRUE(touch.touches(kParams, false));
}

TEST(TouchEvidence, PressedForLong_HangsAsSoonAfterLiftOff) {
  TouchEvidence touch;
  for (int i = 0; i < 500; ++i) touch.take(kParams, 300.0);
  for (int i = 0; i < 5; ++i) touch.take(kParams, 0.0);
  EXPECT_TRUE(touch.hangs());
}

TEST(TouchEvidence, ForceIsNoNumber_IsNone) {
  TouchEvidence touch;
  touch.take(kParams, 150.0);
  touch.take(kParams, std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(touch.hangs());
}

}  // namespace
}  // namespace polygmap
