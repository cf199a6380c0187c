// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/early_touch.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace polygmap {
namespace {

constexpr EarlyTouch::Params kEarly;
constexpr TouchEvidence::Params kTouch;
constexpr double kKnown_n = 4.0, kLeast_n = kTouch.least_even_n;

class EarlyTouchTest : public testing::Test {
 protected:
  void take(double force_n) {
    touch.take(kTouch, force_n, kKnown_n);
    early.take(kEarly, kTouch, touch, force_n);
    stopped += early.stops() ? 1 : 0;
  }
  // At most 500 samples.
  int samples_until_it_lands(double force_n, double other_n) {
    int samples = 0;
    for (; samples < 500 && !early.lands(); ++samples) take(samples % 2 == 0 ? force_n : other_n);
    return samples;
  }
  TouchEvidence touch;
  EarlyTouch early;
  int stopped = 0;
};

TEST_F(EarlyTouchTest, PressesAsNoAccelerationFeigns_LandsWithoutAStop) {
  EXPECT_EQ(samples_until_it_lands(kEarly.certain_n, kEarly.certain_n), 5);
  EXPECT_EQ(stopped, 0);
}

TEST_F(EarlyTouchTest, PressesLess_LandsWhenItIsStillFeltAtRest) {
  EXPECT_EQ(samples_until_it_lands(60.0, 60.0), 5 + kEarly.samples);
  EXPECT_EQ(stopped, kEarly.samples);
}

TEST_F(EarlyTouchTest, GoneOnceTheFootStandsStill_GoesOn) {
  for (int i = 0; i < 8; ++i) take(60.0);
  EXPECT_TRUE(early.stops());
  for (int i = 0; i < 5; ++i) take(0.0);
  EXPECT_FALSE(early.stops() || early.lands());
  take(60.0);
  EXPECT_FALSE(early.stops()) << "that is evidence of one sample";
}

TEST_F(EarlyTouchTest, ForceAroundTheEvenOne_EndsSoon) {
  for (int i = 0; i < 5; ++i) take(60.0);
  EXPECT_LE(samples_until_it_lands(kLeast_n - 5.0, kLeast_n + 5.0), kEarly.samples + 2);
  EXPECT_LE(stopped, kEarly.samples + 2);
}

// A scrape that is there only while the foot moves lands it nowhere, and ends stopping it.
TEST_F(EarlyTouchTest, GoneAtEveryStop_StopsNoMoreAfterSome_AndLandsOnlyWhereItPresses) {
  for (int i = 0; i < 200; ++i) {
    take(early.stops() ? 0.0 : 60.0);
    ASSERT_FALSE(early.lands()) << "sample " << i;
  }
  EXPECT_FALSE(early.stops());
  EXPECT_EQ(stopped, 3 * kEarly.samples);
  take(kEarly.certain_n);
  EXPECT_TRUE(early.lands());
}

TEST_F(EarlyTouchTest, NoNumber_IsNoTouch) {
  for (int i = 0; i < 8; ++i) take(60.0);
  for (int i = 0; i < 8; ++i) take(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(early.stops() || early.lands());
}

}  // namespace
}  // namespace polygmap
