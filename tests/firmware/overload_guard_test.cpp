// SPDX-License-Identifier: Apache-2.0
#include "firmware/overload_guard.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

constexpr OverloadGuard::Params kParams;

TEST(OverloadGuard, LateCyclesUpToTheMost_TimeIsShortFromThereOn) {
  OverloadGuard guard;
  guard.count_cycle(kParams, kParams.most_late_cycles - 1);
  EXPECT_FALSE(guard.time_is_short(kParams));
  guard.count_cycle(kParams, 1);
  EXPECT_TRUE(guard.time_is_short(kParams));
}

TEST(OverloadGuard, EveryCycleIsLate_TimeIsShortWithinATenthOfASecond) {
  OverloadGuard guard;
  std::uint32_t cycles = 0;
  for (; !guard.time_is_short(kParams); ++cycles) guard.count_cycle(kParams, 1);
  EXPECT_EQ(cycles, 50U);
}

TEST(OverloadGuard, OneCycleOfSeventeenIsLate_IsForgottenForEver) {
  OverloadGuard guard;
  for (std::uint32_t cycle = 0; cycle < 100'000; ++cycle) {
    guard.count_cycle(kParams, cycle % (kParams.recovery_cycles + 1) == 0 ? 1 : 0);
    ASSERT_FALSE(guard.time_is_short(kParams)) << cycle;
  }
}

TEST(OverloadGuard, MoreCyclesSkippedThanANumberHolds_StaysBounded) {
  OverloadGuard guard;
  guard.count_cycle(kParams, UINT64_MAX);
  guard.count_cycle(kParams, UINT64_MAX);
  EXPECT_TRUE(guard.time_is_short(kParams));
  for (std::uint32_t i = 0; i < kParams.recovery_cycles; ++i) guard.count_cycle(kParams, 0);
  EXPECT_FALSE(guard.time_is_short(kParams)) << "one is forgotten";
}

TEST(OverloadGuard, CommandsRefused_OnlyInARow) {
  OverloadGuard guard;
  for (std::uint32_t i = 1; i < kParams.most_refused; ++i) guard.count_command(kParams, false);
  EXPECT_FALSE(guard.commands_are_refused(kParams));
  guard.count_command(kParams, true);
  for (std::uint32_t i = 1; i < kParams.most_refused; ++i) guard.count_command(kParams, false);
  EXPECT_FALSE(guard.commands_are_refused(kParams));
  guard.count_command(kParams, false);
  EXPECT_TRUE(guard.commands_are_refused(kParams));
}

}  // namespace
}  // namespace polygmap
