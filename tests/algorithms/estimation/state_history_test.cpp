// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/state_history.hpp"

#include <gtest/gtest.h>

#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_ns;

StateEstimate state_at(std::int64_t stamp_ns) {
  StateEstimate state;
  state.stamp_ns = stamp_ns;
  state.odom_T_base = {rotation_z(1e-9 * static_cast<double>(stamp_ns)), Vec3{seconds(stamp_ns), 0, 0}};
  return state;
}

TEST(StateHistory, StampsAtItsEdges_OldestAndNewestAreFoundAndOneNanosecondBeyondIsNot) {
  static StateHistory ring;
  ring.clear();
  StateEstimate out = state_at(77);
  EXPECT_FALSE(ring.try_at(0, out));
  ring.push(state_at(kTick_ns));
  EXPECT_TRUE(ring.try_at(kTick_ns, out));  // a ring of one state
  EXPECT_FALSE(ring.try_at(kTick_ns + 1, out));
  constexpr auto kStates = static_cast<std::int64_t>(kStateRingCapacity) + 50;  // the first 50 are overwritten
  for (std::int64_t i = 2; i <= kStates; ++i) ring.push(state_at(i * kTick_ns));
  const std::int64_t oldest_ns = 51 * kTick_ns, newest_ns = kStates * kTick_ns;
  EXPECT_GE(newest_ns - oldest_ns, 300 * kNsPerMs);
  for (const std::int64_t stamp_ns : {oldest_ns, oldest_ns + 1, newest_ns - 1, newest_ns, newest_ns - kTick_ns / 2}) {
    ASSERT_TRUE(ring.try_at(stamp_ns, out)) << stamp_ns;
    EXPECT_EQ(out.stamp_ns, stamp_ns);
    EXPECT_NEAR(out.odom_T_base.p_m.x(), seconds(stamp_ns), 1e-12);
    EXPECT_NEAR(yaw_of(out.odom_T_base.R), seconds(stamp_ns), 1e-12);
  }
  out = state_at(77);
  EXPECT_FALSE(ring.try_at(oldest_ns - 1, out));
  EXPECT_FALSE(ring.try_at(newest_ns + 1, out));
  EXPECT_EQ(out.stamp_ns, 77);  // untouched
}

// Logs of 1 kHz: poses up to 0.4 s late still meet their state.
TEST(StateHistory, StatesFasterThanTheTick_AreThinnedOutButTheNewest) {
  static StateHistory ring;
  ring.clear();
  StateEstimate out;
  std::int64_t stamp_ns = 0;
  for (int i = 0; i < 2000; ++i) {
    stamp_ns += kNsPerMs / 2;
    ring.push(state_at(stamp_ns));
    ASSERT_TRUE(ring.try_at(stamp_ns, out));
  }
  ASSERT_TRUE(ring.try_at(stamp_ns - 380 * kNsPerMs, out));
  EXPECT_NEAR(out.odom_T_base.p_m.x(), seconds(stamp_ns - 380 * kNsPerMs), 1e-12);
}

TEST(StateHistory, GapsAndStampsThatGoBack_AreNeitherBridgedNorStored) {
  static StateHistory ring;
  ring.clear();
  StateEstimate out;
  ring.push(state_at(kNsPerS));
  ring.push(state_at(kNsPerS));
  ring.push(state_at(kNsPerS - 1));
  EXPECT_FALSE(ring.try_at(kNsPerS - 1, out));
  ring.push(state_at(kNsPerS + StateHistory::kMaxGap_ns));
  EXPECT_TRUE(ring.try_at(kNsPerS + 1, out));
  ring.push(state_at(kNsPerS + 2 * StateHistory::kMaxGap_ns + 1));
  EXPECT_FALSE(ring.try_at(kNsPerS + StateHistory::kMaxGap_ns + 1, out));
  EXPECT_TRUE(ring.try_at(kNsPerS + 2 * StateHistory::kMaxGap_ns + 1, out));  // its ends are known
}

}  // namespace
}  // namespace polygmap
