// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/buffer_book.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace polygmap::hal {
namespace {

using Holder = BufferBook::Holder;
using Index = BufferBook::Index;

[[nodiscard]] DepthFrameView view_of(std::uint32_t sequence) {
  return {.stamp_ns = 10 * sequence, .sequence = sequence};
}

TEST(BufferBook, Arrived_MoreThanMayWait_PushesTheOldestOut) {
  BufferBook book;
  book.reset(2);
  EXPECT_FALSE(book.arrived(0, view_of(1)));
  EXPECT_FALSE(book.arrived(1, view_of(2)));
  EXPECT_EQ(book.arrived(2, view_of(3)), Index{0});
  DepthFrameView view;
  ASSERT_TRUE(book.take(view));
  EXPECT_EQ(view.sequence, 2U);
}

TEST(BufferBook, GiveBack_SharedWithTheSecond_OnlyTheLastHandsBack) {
  BufferBook book;
  book.reset(1);
  DepthFrameView view;
  EXPECT_FALSE(book.share(view)) << "the module holds none";
  ASSERT_FALSE(book.arrived(3, view_of(1)));
  ASSERT_TRUE(book.take(view));
  ASSERT_TRUE(book.share(view));
  EXPECT_FALSE(book.share(view)) << "the second holds one already";
  EXPECT_FALSE(book.give_back(Holder::kModule));
  EXPECT_TRUE(book.any_held());
  EXPECT_EQ(book.give_back(Holder::kSecond), Index{3});
  EXPECT_FALSE(book.any_held());
  EXPECT_FALSE(book.give_back(Holder::kSecond)) << "nothing is handed back twice";
}

TEST(BufferBook, AnySequenceOfCalls_EveryBufferIsInOnePlace) {
  std::mt19937 random(5);
  for (int run = 0; run < 200; ++run) {
    const std::size_t buffers = 4 + random() % 5;
    BufferBook book;
    book.reset(buffers - 3);
    std::set<Index> kernel;
    for (Index i = 0; i < buffers; ++i) kernel.insert(i);
    std::uint32_t sequence = 0, last_taken = 0;
    std::optional<Index> back;
    DepthFrameView view;
    for (int step = 0; step < 500; ++step) {
      back.reset();
      switch (random() % 5) {
        case 0:
          ASSERT_FALSE(kernel.empty()) << "the camera always has a buffer to fill";
          back = book.arrived(*kernel.begin(), view_of(++sequence));
          kernel.erase(kernel.begin());
          break;
        case 1:
          if (book.take(view)) {
            ASSERT_GT(view.sequence, last_taken);
            last_taken = view.sequence;
          }
          break;
        case 2:
          if (book.share(view)) {
            ASSERT_EQ(view.sequence, last_taken);
          }
          break;
        case 3:
          back = book.give_back(Holder::kModule);
          break;
        default:
          back = book.give_back(Holder::kSecond);
          break;
      }
      if (back) {
        ASSERT_TRUE(kernel.insert(*back).second) << "handed back twice";
      }
    }
    if ((back = book.give_back(Holder::kModule))) kernel.insert(*back);
    if ((back = book.give_back(Holder::kSecond))) kernel.insert(*back);
    EXPECT_EQ(kernel.size() + book.waiting(), buffers) << "a buffer is lost";
  }
}

}  // namespace
}  // namespace polygmap::hal
