// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/contacts.hpp"

#include <gtest/gtest.h>

#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kNaN;
using test::kTick_ns;

constexpr std::array<bool, kFootCount> kBothStand{true, true};

TEST(Contacts, Touchdown_ForceRises_BecomesCertainAfterTheBlankingOnly) {
  ContactEstimator contacts;
  contacts.reset({});
  std::int64_t t = 0;
  for (int i = 0; i < 50; ++i) contacts.update({500.0, 0.0}, {true, false}, t += kTick_ns);
  EXPECT_DOUBLE_EQ(contacts.feet()[0].probability, 1.0);
  EXPECT_DOUBLE_EQ(contacts.feet()[1].probability, 0.0);
  for (int i = 1; i <= 2; ++i) {
    contacts.update({400.0, 140.0}, {true, false}, t += kTick_ns);  // earlier than planned
    EXPECT_NEAR(contacts.feet()[1].probability, i / 3.0, 1e-12);
    EXPECT_FALSE(contacts.feet()[1].stands);
  }
  contacts.update({400.0, 140.0}, {true, false}, t += kTick_ns);
  EXPECT_NEAR(contacts.feet()[1].probability, 1.0, 1e-12);
  EXPECT_TRUE(contacts.feet()[1].landed);
  EXPECT_NEAR(contacts.feet()[1].load_share, 140.0 / 540.0, 1e-12);
  contacts.update({400.0, 140.0}, {true, false}, t += kTick_ns);
  EXPECT_TRUE(contacts.feet()[1].stands);
  EXPECT_FALSE(contacts.feet()[1].landed);
}

TEST(Contacts, LiftOff_ForceStillReported_FootIsReleasedAtOnce) {
  ContactEstimator contacts;
  contacts.reset({});
  std::int64_t t = 0;
  for (int i = 0; i < 50; ++i) contacts.update({270.0, 270.0}, kBothStand, t += kTick_ns);
  contacts.update({270.0, 270.0}, {true, false}, t += kTick_ns);
  EXPECT_DOUBLE_EQ(contacts.feet()[1].probability, 0.0);
}

TEST(Contacts, PlannedSwing_FootNeverUnloads_StandsAgainAfterTheTimeout) {
  ContactEstimator contacts;
  contacts.reset({});
  std::int64_t t = 0;
  for (int i = 0; i < 50; ++i) contacts.update({270.0, 270.0}, kBothStand, t += kTick_ns);
  for (int i = 0; i < 70; ++i) contacts.update({270.0, 270.0}, {true, false}, t += kTick_ns);
  EXPECT_DOUBLE_EQ(contacts.feet()[1].probability, 0.0);  // 0.14 s
  for (int i = 0; i < 30; ++i) contacts.update({270.0, 270.0}, {true, false}, t += kTick_ns);
  EXPECT_DOUBLE_EQ(contacts.feet()[1].probability, 1.0);
}

TEST(Contacts, ForcesFallSilent_FeetLandAndLiftAsPlanned) {
  ContactEstimator contacts;
  contacts.reset({});
  std::int64_t t = 0;
  const auto update = [&](const std::array<double, kFootCount>& force_n, const std::array<bool, kFootCount>& stance,
                          int ticks) {
    for (int i = 0; i < ticks; ++i) contacts.update(force_n, stance, t += kTick_ns);
  };
  update({540.0, 0.0}, {true, false}, 50);
  update({kNaN, kNaN}, {true, false}, 100);
  EXPECT_TRUE(contacts.feet()[0].stands);
  EXPECT_EQ(contacts.feet()[1].probability, 0.0);
  update({kNaN, kNaN}, kBothStand, 10);
  EXPECT_TRUE(contacts.feet()[1].stands) << "its last force was 0";
  update({270.0, 270.0}, kBothStand, 10);
  update({kNaN, kNaN}, {true, false}, 200);
  EXPECT_EQ(contacts.feet()[1].probability, 0.0) << "its last force is no foot that sticks";
  EXPECT_EQ(contacts.feet()[0].probability, 1.0);
  EXPECT_EQ(contacts.feet()[0].load_share, 0.5);
}

}  // namespace
}  // namespace polygmap
