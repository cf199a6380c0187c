// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/touch_evidence.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace polygmap {
namespace {

constexpr TouchEvidence::Params kParams;
constexpr double kSigma_n = 10.0, kEven_n = kParams.even_sigmas * kSigma_n;

// Samples of one force until it touches, at most 1000.
int samples_until_touch(double force_n, bool early, double sigma_n = kSigma_n) {
  TouchEvidence touch;
  int samples = 0;
  while (samples < 1000 && !touch.touches(kParams, early)) {
    touch.take(kParams, force_n, sigma_n);
    ++samples;
  }
  return samples;
}

TEST(TouchEvidence, HardTouchDown_CountsAtOnceWhereExpectedAndLaterWhereEarly) {
  EXPECT_EQ(samples_until_touch(200.0, false), 1);
  EXPECT_EQ(samples_until_touch(200.0, true), 5);
}

TEST(TouchEvidence, SofterTouchDown_TakesLonger) {
  const double soft_n = kEven_n + 2.0;
  EXPECT_GT(samples_until_touch(soft_n, false), samples_until_touch(kEven_n + 5.0, false));
  EXPECT_GT(samples_until_touch(soft_n, true), samples_until_touch(soft_n, false));
  EXPECT_LT(samples_until_touch(soft_n, true), 50);
}

TEST(TouchEvidence, ForceBelowEven_NeverTouches) { EXPECT_EQ(samples_until_touch(kEven_n - 2.0, false), 1000); }

TEST(TouchEvidence, ForceThatIsKnownBetter_IsFeltSooner) {
  EXPECT_EQ(samples_until_touch(25.0, false, 2.0), 1) << "a good sensor";
  EXPECT_EQ(samples_until_touch(25.0, false, 10.0), 1000) << "as much may be feigned";
  EXPECT_EQ(samples_until_touch(60.0, false, 100.0), 1) << "a foot that carries its leg is felt by the worst";
  for (const double unknown : {0.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(samples_until_touch(25.0, false, unknown), 1000);
    EXPECT_EQ(samples_until_touch(60.0, false, unknown), 1);
  }
}

TEST(TouchEvidence, ScrapesForAMoment_TouchesNotAndIsForgotten) {
  TouchEvidence touch;
  for (int i = 0; i < 4; ++i) touch.take(kParams, 150.0, kSigma_n);
  EXPECT_FALSE(touch.touches(kParams, true));
  for (int i = 0; i < 4; ++i) touch.take(kParams, 0.0, kSigma_n);
  EXPECT_TRUE(touch.hangs());
}

TEST(TouchEvidence, ScrapedAboveTheTargetAndIsFree_TouchesNotWhereTheGroundIsExpected) {
  TouchEvidence touch;
  for (int i = 0; i < 4; ++i) touch.take(kParams, 150.0, kSigma_n);
  touch.take(kParams, 0.0, kSigma_n);
  EXPECT_FALSE(touch.touches(kParams, false));
  touch.take(kParams, 150.0, kSigma_n);
  EXPECT_TRUE(touch.touches(kParams, false));
}

TEST(TouchEvidence, PressedForLong_HangsAsSoonAfterLiftOff) {
  TouchEvidence touch;
  for (int i = 0; i < 500; ++i) touch.take(kParams, 300.0, kSigma_n);
  for (int i = 0; i < 5; ++i) touch.take(kParams, 0.0, kSigma_n);
  EXPECT_TRUE(touch.hangs());
}

TEST(TouchEvidence, ForceIsNoNumber_IsNone) {
  TouchEvidence touch;
  touch.take(kParams, 150.0, kSigma_n);
  touch.take(kParams, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(touch.hangs());
}

}  // namespace
}  // namespace polygmap
