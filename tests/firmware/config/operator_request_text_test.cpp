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
  const auto any = operator_request_of("go_to=2,0");
  ASSERT_TRUE(any);
  EXPECT_FALSE(any->destination.has_turn);
}

TEST(OperatorRequestText, WhatIsNoRequest_IsRefused) {
  for (const std::string_view text :
       {"", "go_to", "go_to=", "go_to=1", "go_to=1,", "go_to=1,2,", "go_to=1,2,3,4", "go_to=1;2", "go_to=a,b",
        "go_to=nan,0", "go_to=inf,0", "go_to=51,0", "go_to=0,0,1000", "start=1,2", "go=1,2", "go_to=1,2 "}) {
    EXPECT_FALSE(operator_request_of(text)) << text;
  }
}

}  // namespace
}  // namespace polygmap
