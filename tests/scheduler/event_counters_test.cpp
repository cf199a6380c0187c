// SPDX-License-Identifier: Apache-2.0
#include "scheduler/event_counters.hpp"

#include <gtest/gtest.h>

#include "scheduler/executive_event.hpp"

namespace polygmap {

enum class Odd : std::uint8_t { kOne = 101, kThree = 103, kSeven = 107 };  // numbers with gaps
template <>
inline constexpr std::array kEventTable<Odd> = std::to_array<EventInfo<Odd>>({
    {Odd::kOne, "one", "One."},
    {Odd::kThree, "three", "Three."},
    {Odd::kSeven, "seven", "Seven."},
});
static_assert(bad_event_lines<Odd>(101, 107) == 0);
static_assert(bad_event_lines<Odd>(102, 107) == 1 && bad_event_lines<Odd>(101, 106) == 1);

enum class Wrong : std::uint8_t { kA = 1, kB = 2, kC = 3, kD = 4 };
template <>
inline constexpr std::array kEventTable<Wrong> = std::to_array<EventInfo<Wrong>>({
    {Wrong::kB, "b", "Stands right."},
    {Wrong::kA, "a", "Its number is not above the one before."},
    {Wrong::kC, "b", "Its name is taken."},
    {Wrong::kD, "d", ""},
});
static_assert(bad_event_lines<Wrong>(1, 4) == 3);

namespace {

using Counters = EventCounters<Odd, ExecutiveEvent>;

template <typename Code>
class EventCodes : public ::testing::Test {};
using CodeTypes = ::testing::Types<Odd, ExecutiveEvent>;
TYPED_TEST_SUITE(EventCodes, CodeTypes);

TYPED_TEST(EventCodes, Raise_EachCode_CountsThatOneAlone) {
  const auto& table = kEventTable<TypeParam>;
  for (const auto& line : table) {
    Counters counters;
    counters.raise(line.code, 10);
    counters.raise(line.code, 30);
    for (const auto& other : table) EXPECT_EQ(counters.count(other.code).count, &line == &other ? 2U : 0U);
    EXPECT_EQ(counters.count(line.code).first_ns, 10);
    EXPECT_EQ(counters.count(line.code).last_ns, 30);
    EXPECT_EQ(counters.any<Odd>(), (std::is_same_v<TypeParam, Odd>));
    EXPECT_EQ(counters.any<ExecutiveEvent>(), (std::is_same_v<TypeParam, ExecutiveEvent>));
    counters.clear(line.code);
    EXPECT_EQ(counters.count(line.code).count, 0U);
    EXPECT_FALSE(counters.any<TypeParam>());
  }
}

TYPED_TEST(EventCodes, Raise_NumberThatTheTableLacks_ChangesNothing) {
  Counters counters;
  for (const int number : {0, 100, 102, 255}) {
    const auto code = static_cast<TypeParam>(number);
    counters.raise(code, 1);
    counters.follow(code, 1, 5);
    EXPECT_EQ(counters.count(code).count, 0U);
    EXPECT_EQ(name_of_event(code), "unknown");
  }
  EXPECT_FALSE(counters.any<TypeParam>());
}

TYPED_TEST(EventCodes, Raise_ManyTimes_Saturates) {
  const auto& table = kEventTable<TypeParam>;
  Counters counters;
  counters.raise(table[0].code, 1, UINT32_MAX - 1);
  counters.raise(table[0].code, 2, 5);
  EXPECT_EQ(counters.count(table[0].code).count, UINT32_MAX);
  counters.raise(table[1].code, 3, 0);
  EXPECT_EQ(counters.count(table[1].code).count, 0U);
}

// A stage's counter may also wrap around.
TYPED_TEST(EventCodes, Follow_AStagesCounter_RaisesByItsGrowth) {
  const auto& table = kEventTable<TypeParam>;
  Counters counters;
  counters.follow(table[0].code, 10, 0);
  EXPECT_EQ(counters.count(table[0].code).count, 0U);
  counters.follow(table[0].code, 20, 3);
  counters.follow(table[0].code, 30, 3);
  EXPECT_EQ(counters.count(table[0].code).count, 3U);
  EXPECT_EQ(counters.count(table[0].code).last_ns, 20);
  counters.raise(table[0].code, 40);  // by hand besides
  counters.follow(table[0].code, 50, 5);
  EXPECT_EQ(counters.count(table[0].code).count, 6U);
  EXPECT_EQ(counters.count(table[1].code).count, 0U);
  counters.follow(table[1].code, 50, UINT32_MAX);
  counters.clear();
  counters.follow(table[1].code, 60, 1);
  EXPECT_EQ(counters.count(table[1].code).count, 2U);
}

TYPED_TEST(EventCodes, Merge_TwoLanes_AddsCountsAndWidensTheStamps) {
  const auto& table = kEventTable<TypeParam>;
  Counters a, b;
  a.raise(table[0].code, 10);
  b.raise(table[0].code, 5, 2);
  b.raise(table[1].code, 7);
  a.merge(b);
  EXPECT_EQ(a.count(table[0].code).count, 3U);
  EXPECT_EQ(a.count(table[0].code).first_ns, 5);
  EXPECT_EQ(a.count(table[0].code).last_ns, 10);
  EXPECT_EQ(a.count(table[1].code).first_ns, 7);
  a.clear();
  EXPECT_FALSE(a.any<TypeParam>());
}

}  // namespace
}  // namespace polygmap
