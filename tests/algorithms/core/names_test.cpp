// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <set>
#include <string_view>

#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/gait_status.hpp"

namespace polygmap {
namespace {

TEST(Names, EveryPhase_HasOneOfItsOwnWithoutSpaces) {
  std::set<std::string_view> names;
  for (std::uint8_t i = 0; i <= static_cast<std::uint8_t>(GaitPhase::kStopped); ++i) {
    const std::string_view name = name_of(static_cast<GaitPhase>(i));
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_EQ(name.find(' '), std::string_view::npos) << name;
  }
  EXPECT_EQ(name_of(GaitPhase::kDoubleSupport), "double_support");
  EXPECT_EQ(name_of(static_cast<GaitPhase>(99)), "unknown");
}

TEST(Names, EveryStopReason_HasANameAndAClauseOfItsOwn) {
  std::set<std::string_view> texts;
  for (const StopReasonInfo& info : kStopReasonTable) {
    EXPECT_TRUE(texts.insert(info.name).second) << info.name;
    EXPECT_TRUE(texts.insert(info.text).second) << info.text;
    EXPECT_EQ(info.name.find(' '), std::string_view::npos) << info.name;
    EXPECT_FALSE(info.text.ends_with('.')) << info.text;
  }
  EXPECT_EQ(name_of(StopReason::kNone), "none");
  EXPECT_EQ(name_of(StopReason::kMapStale), "map_stale");  // one in the middle, and the last one: nothing is shifted
  EXPECT_EQ(text_of(StopReason::kObstacle), "something stood where its feet would have gone next");
  EXPECT_EQ(name_of(StopReason::kCommandsRefused), "commands_refused");
  EXPECT_EQ(name_of(StopReason::kDriveHot), "drive_hot");
  EXPECT_EQ(name_of(StopReason::kGroundEnds), "ground_ends");
  EXPECT_EQ(text_of(static_cast<StopReason>(99)), "it gave no known reason");
}

}  // namespace
}  // namespace polygmap
