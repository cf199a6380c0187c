// SPDX-License-Identifier: Apache-2.0
// Which frames of the other lane a lane sees.
#include "firmware/lane_link.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

constexpr std::int64_t frame_ns(std::int64_t n) { return 1'000'000'000 + n * kCycle_ns; }

TEST(LaneView, Begin_FirstFrame_SeesNothingAndNobodyIsBehind) {
  LaneView view;
  EXPECT_TRUE(view.begin(frame_ns(0), kNoFrame_ns));
  EXPECT_EQ(view.last_ns(), kNoFrame_ns);
}

TEST(LaneView, Begin_OtherLaneIsInTimeOrAhead_SeesTheFramesBeforeItsOwn) {
  LaneView view;
  (void)view.begin(frame_ns(0), kNoFrame_ns);
  EXPECT_TRUE(view.begin(frame_ns(1), frame_ns(0)));
  EXPECT_EQ(view.last_ns(), frame_ns(0));
  EXPECT_TRUE(view.begin(frame_ns(2), frame_ns(2))) << "it was quicker";
  EXPECT_EQ(view.last_ns(), frame_ns(1)) << "and nothing of this frame is seen";
}

TEST(LaneView, Begin_OtherLaneHasNotFinishedTheFrameBefore_IsBehindAndSeenAFrameLater) {
  LaneView view;
  (void)view.begin(frame_ns(0), kNoFrame_ns);
  EXPECT_FALSE(view.begin(frame_ns(1), kNoFrame_ns));
  EXPECT_EQ(view.last_ns(), kNoFrame_ns);
  EXPECT_FALSE(view.begin(frame_ns(2), frame_ns(0)));
  EXPECT_EQ(view.last_ns(), frame_ns(0));
  EXPECT_EQ(view.other_finished_ns(), frame_ns(0));
  EXPECT_TRUE(view.begin(frame_ns(3), frame_ns(2)));
  EXPECT_EQ(view.last_ns(), frame_ns(2));
}

TEST(LaneView, Begin_BothLanesSkippedFrames_NobodyIsBehind) {
  LaneView view;
  (void)view.begin(frame_ns(0), kNoFrame_ns);
  EXPECT_TRUE(view.begin(frame_ns(9), frame_ns(0)));
  EXPECT_EQ(view.last_ns(), frame_ns(0));
  EXPECT_FALSE(view.begin(frame_ns(10), frame_ns(0)));
}

TEST(LaneView, ValueOfAFrame_ReaderInTheSameFrame_IsSeenInTheNext) {
  LaneView view;
  Exchange<int, kSeldomSlots> exchange;
  (void)view.begin(frame_ns(0), kNoFrame_ns);
  exchange.publish(frame_ns(1), 7);
  (void)view.begin(frame_ns(1), frame_ns(1));  // the writer has even finished
  EXPECT_FALSE(exchange.try_take(view.last_ns()));
  (void)view.begin(frame_ns(2), frame_ns(1));
  EXPECT_TRUE(exchange.try_take(view.last_ns()));
  EXPECT_EQ(exchange.front(), 7);
}

// A lane that catches up runs the frame of kMaxFramesApart ago while the other one is in the newest.
TEST(LaneView, ReaderCatchesUp_ValueInEveryFrame_NoneIsLost) {
  Exchange<std::int64_t, kEveryFrameSlots> exchange;
  LaneView view;
  std::int64_t reader = 0;
  for (std::int64_t writer = 0; writer < 1000; ++writer) {
    (void)exchange.back();                                        // being filled
    if (writer % 7 == 0 || writer - reader == kMaxFramesApart) {  // from then on the reader is in time again
      for (; reader <= writer; ++reader) {
        (void)view.begin(frame_ns(reader), frame_ns(writer - 1));
        (void)exchange.try_take(view.last_ns());
        if (reader > 0) {
          ASSERT_EQ(exchange.front_frame_ns(), frame_ns(reader - 1));
        }
      }
    }
    exchange.publish(frame_ns(writer));
  }
  EXPECT_EQ(exchange.lost(), 0U);
}

}  // namespace
}  // namespace polygmap
