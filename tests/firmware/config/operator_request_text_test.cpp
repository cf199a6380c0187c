// SPDX-License-Identifier: Apache-2.0
#include "firmware/config/operator_request_text.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

TEST(OperatorRequestText, EveryCommandByItsName_IsThatRequest) {
  for (const std::string_view name : kOperatorCommandNames) {
    if (name == "go_to") continue;
    const auto request = operator_request_of(name);
    ASSERT_TRUE(request) << name;
    EXPECT_EQ(name_of(request->command), name);
  }
}

TEST(OperatorRequestText, PlaceWithAndWithoutAHeading_IsReadInMetresAndDegrees) {
  const auto there = operator_request_of("go_to=1.5,-0.25,90");
  ASSERT_TRUE(there);
  EXPECT_EQ(there->command, OperatorCommand::kGoTo);
  EXPECT_DOUBLE_EQ(there->destination.ahead_m, 1.5);
  EXPECT_DOUBLE_EQ(there->destination.left_m, -0.25);
  EXPECT_NEAR(there->destination.turn_rad, kPi / 2.0, 1e-12);
  EXPECT_TRUE(there->destination.has_turn);
  EXPECT_FALSE(there->destination.has_height);
  const auto any = operator_request_of("go_to=2,0");
  ASSERT_TRUE(any);
  EXPECT_FALSE(any->destination.has_turn);
  const auto up = operator_request_of("go_to=2,0,,2.7");
  ASSERT_TRUE(up);
  EXPECT_FALSE(up->destination.has_turn);
  EXPECT_TRUE(up->destination.has_height);
  EXPECT_DOUBLE_EQ(up->destination.up_m, 2.7);
}

TEST(OperatorRequestText, Printed_IsWhatCanBeTypedAgain) {
  for (const std::string_view text :
       {"arm", "hand_over", "go_to=1.2,0.5,90", "go_to=0,-50", "go_to=0.1,1e-05,30", "go_to=1.5,0,-183",
        "go_to=12.345678901234567,-0.3333333333333333,57.295779513082", "go_to=0,0,0", "go_to=1,2,90,2.7",
        "go_to=1,2,,-0.15"}) {
    const auto request = operator_request_of(text);
    ASSERT_TRUE(request) << text;
    EXPECT_EQ(text_of(*request), text);
  }
  for (const double turn_rad : {kPi, -1.0, 1e-9, 3.2 / 7.0}) {
    const auto again = operator_request_of(text_of(OperatorRequest(Destination{0.0, 0.0, turn_rad, true})));
    ASSERT_TRUE(again) << turn_rad;
    EXPECT_DOUBLE_EQ(again->destination.turn_rad, turn_rad);
  }
}

// --ask tells them to who asked for too much.
TEST(OperatorRequestText, WhatMayBeAsked_NamesBoundsThatHold) {
  EXPECT_NE(kWhatMayBeAsked.find("metres (50 at most) and degrees (183 at most)"), std::string_view::npos);
  EXPECT_TRUE(operator_request_of("go_to=50,-50,183,-50"));
  EXPECT_FALSE(operator_request_of("go_to=50,-50,184"));
}

TEST(OperatorRequestText, WhatIsNoRequest_IsRefused) {
  for (const std::string_view text :
       {"", "go_to", "go_to=", "go_to=1", "go_to=1,", "go_to=1,2,", "go_to=1,2,3,4,5", "go_to=1,2,,", "go_to=1,2,,51",
        "go_to=1,2,3,", "go_to=1;2", "go_to=a,b", "go_to=nan,0", "go_to=inf,0", "go_to=51,0", "go_to=0,0,1000",
        "start=1,2", "go=1,2", "go_to=1,2 "}) {
    EXPECT_FALSE(operator_request_of(text)) << text;
  }
}

}  // namespace
}  // namespace polygmap
