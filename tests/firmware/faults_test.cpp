// SPDX-License-Identifier: Apache-2.0
// The numbers that logs and manuals have, and where an executive's own events are counted.
#include "firmware/faults.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace polygmap {
namespace {

// A line that is put in or taken out moves no other number.
static_assert(static_cast<int>(Fault::kCycleOverrun) == 1 && static_cast<int>(Fault::kDepthMissing) == 11);
static_assert(static_cast<int>(Fault::kGaitStopped) == 18 && static_cast<int>(Fault::kLaneBehind) == 19);
static_assert(static_cast<int>(Limit::kRowShed) == 101 && static_cast<int>(Limit::kStateRingMissed) == 106);
static_assert(static_cast<int>(Limit::kFrameLost) == 114 && static_cast<int>(Limit::kHandOverLost) == 115);
static_assert(static_cast<int>(Fault::kDriveSilent) == 30 && static_cast<int>(Fault::kFeetSilent) == 37);
static_assert(static_cast<int>(Fault::kJointOutOfRange) == 39);
static_assert(static_cast<int>(Fault::kDriveHot) == 40);
static_assert(static_cast<int>(Limit::kPictureBad) == 118);
static_assert(static_cast<int>(Limit::kFrameLost) == 114 && static_cast<int>(Limit::kDriveClamped) == 130);
static_assert(kFaultTable.front().code == Fault::kCycleOverrun && kLimitTable.back().code == Limit::kDriveClamped);

TEST(Faults, NameOf_EachCode_IsItsTables) {
  for (const auto& line : kFaultTable) EXPECT_EQ(name_of(line.code), line.name);
  for (const auto& line : kLimitTable) EXPECT_EQ(name_of(line.code), line.name);
  EXPECT_EQ(name_of(Fault::kJointFeedbackRejected), "joint_feedback_rejected");
  EXPECT_EQ(name_of(static_cast<Fault>(0)), "unknown");
  EXPECT_EQ(name_of(static_cast<Limit>(99)), "unknown");
}

TEST(Health, Raise_AnExecutivesEvent_CountsItsFaultOrLimitAlone) {
  const std::pair<ExecutiveEvent, Fault> faults[] = {{ExecutiveEvent::kCycleOverrun, Fault::kCycleOverrun},
                                                     {ExecutiveEvent::kRowOverrun, Fault::kRowOverrun},
                                                     {ExecutiveEvent::kCycleSlip, Fault::kCycleSlip},
                                                     {ExecutiveEvent::kClockRate, Fault::kClockRate}};
  const std::pair<ExecutiveEvent, Limit> limits[] = {{ExecutiveEvent::kRowShed, Limit::kRowShed},
                                                     {ExecutiveEvent::kRowDeferred, Limit::kRowDeferred},
                                                     {ExecutiveEvent::kCycleCaughtUp, Limit::kCycleCaughtUp}};
  static_assert(std::size(faults) + std::size(limits) == kEventTable<ExecutiveEvent>.size());
  for (const auto& [event, fault] : faults) {
    Health health;
    health.raise(event, 5, 3);
    EXPECT_EQ(health.count(fault).count, 3U);
    EXPECT_EQ(health.count(fault).first_ns, 5);
    EXPECT_FALSE(health.any_limit());
    health.clear(fault);
    EXPECT_FALSE(health.any_fault());
  }
  for (const auto& [event, limit] : limits) {
    Health health;
    health.raise(event, 5, 3);
    EXPECT_EQ(health.count(limit).count, 3U);
    EXPECT_FALSE(health.any_fault());
    health.clear(limit);
    EXPECT_FALSE(health.any_limit());
  }
}

}  // namespace
}  // namespace polygmap
