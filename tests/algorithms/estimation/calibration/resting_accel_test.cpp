// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/resting_accel.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

const Vec3 kStill_mps2{0.0, 0.0, kGravity_mps2};
constexpr std::int64_t kStep_ns = 2 * kNsPerMs, kTime_ns = 100 * kNsPerMs;
RestingAccel listening(std::int64_t time_ns) {
  RestingAccel felt;
  felt.reset(time_ns);
  return felt;
}

TEST(RestingAccel, NoisySamples_TheMeanOfATenthOfASecondCounts) {
  RestingAccel felt = listening(kTime_ns);
  std::int64_t now_ns = 5;
  for (int i = 0; i < 50; ++i) {
    felt.add(now_ns += kStep_ns, kStill_mps2 + Vec3{i % 2 == 0 ? 1.0 : -1.0, 0.0, 0.0});
    EXPECT_FALSE(felt.is_settled()) << i;
  }
  EXPECT_NEAR((felt.mean_mps2() - kStill_mps2).norm(), 0.0, 0.03);
  for (int i = 0; i < 200; ++i) felt.add(now_ns += kStep_ns, 2.0 * kStill_mps2);
  EXPECT_TRUE(felt.is_settled());
  EXPECT_NEAR((felt.mean_mps2() - 2.0 * kStill_mps2).norm(), 0.0, 0.2) << "and only the last of them";
}

TEST(RestingAccel, Silence_BeginsAnew) {
  RestingAccel felt = listening(kTime_ns);
  std::int64_t now_ns = 0;
  for (int i = 0; i < 100; ++i) felt.add(now_ns += kStep_ns, 3.0 * kStill_mps2);
  felt.add(now_ns += kNsPerS, kStill_mps2);
  EXPECT_FALSE(felt.is_settled());
  EXPECT_EQ(felt.mean_mps2(), kStill_mps2);
}

TEST(RestingAccel, NoTime_TheLastSampleCountsAtOnce) {
  RestingAccel felt = listening(0);
  EXPECT_FALSE(felt.is_settled());
  felt.add(5, 3.0 * kStill_mps2);
  EXPECT_TRUE(felt.is_settled());
  felt.add(7, kStill_mps2);
  EXPECT_EQ(felt.mean_mps2(), kStill_mps2);
}

}  // namespace
}  // namespace polygmap
