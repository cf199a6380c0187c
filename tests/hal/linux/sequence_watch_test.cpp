// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/sequence_watch.hpp"

#include <gtest/gtest.h>

namespace polygmap::hal {
namespace {

using Verdict = SequenceVerdict;

TEST(SequenceWatch, Judge_EachKind_NamedAndLastKept) {
  SequenceWatch watch({.farthest = 10, .confirm = 3});
  EXPECT_EQ(watch.judge(100), Verdict::kNext);
  EXPECT_EQ(watch.judge(101), Verdict::kNext);
  EXPECT_EQ(watch.judge(101), Verdict::kRepeated);
  EXPECT_EQ(watch.judge(104), Verdict::kGap);
  EXPECT_EQ(watch.judge(102), Verdict::kOutOfOrder);
  EXPECT_EQ(watch.judge(115), Verdict::kJumped);
  EXPECT_EQ(watch.judge(93), Verdict::kJumped);
  EXPECT_EQ(watch.judge(114), Verdict::kGap);
}

TEST(SequenceWatch, Judge_WrapsAround_IsNext) {
  SequenceWatch watch;
  EXPECT_EQ(watch.judge(0xFFFFFFFF), Verdict::kNext);
  EXPECT_EQ(watch.judge(0), Verdict::kNext);
  EXPECT_EQ(watch.judge(0xFFFFFFFE), Verdict::kOutOfOrder);
}

TEST(SequenceWatch, Judge_OneForgedAmongGood_NeverRestarts) {
  SequenceWatch watch({.farthest = 10, .confirm = 3});
  ASSERT_EQ(watch.judge(0), Verdict::kNext);
  for (std::uint32_t i = 1; i < 50; ++i) {
    ASSERT_EQ(watch.judge(1'000'000 + i), Verdict::kJumped);  // they continue each other, but not in a row
    ASSERT_EQ(watch.judge(i), Verdict::kNext);
  }
}

TEST(SequenceWatch, Judge_SenderStartsFromZero_TakenOnceConfirmed) {
  SequenceWatch watch({.farthest = 10, .confirm = 3});
  ASSERT_EQ(watch.judge(5), Verdict::kNext);  // started anew after five packets: behind, within the window
  EXPECT_EQ(watch.judge(0), Verdict::kOutOfOrder);
  EXPECT_EQ(watch.judge(1), Verdict::kOutOfOrder);
  EXPECT_EQ(watch.judge(2), Verdict::kRestarted);
  EXPECT_EQ(watch.judge(3), Verdict::kNext);
}

TEST(SequenceWatch, Takes_GapOfThree_CountsThreeMissing) {
  SequenceWatch watch;
  SequenceCounters counters;
  EXPECT_TRUE(watch.takes(1, counters));
  EXPECT_TRUE(watch.takes(5, counters));
  EXPECT_FALSE(watch.takes(5, counters));
  EXPECT_EQ(counters.missing, 3U);
  EXPECT_EQ(counters.repeated, 1U);
}

}  // namespace
}  // namespace polygmap::hal
