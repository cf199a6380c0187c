// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/buffer_book.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace polygmap::hal {
namespace {

using Index = BufferBook::Index;

// A picture whose pixels lie at a place of its own for each buffer.
constexpr std::size_t kMost = BufferBook::kMostBuffers;
constexpr std::array<std::uint16_t, kMost> kPixels{};
[[nodiscard]] DepthFrameView view_of(std::uint32_t sequence, Index buffer) {
  return {.stamp_ns = 10 * sequence, .sequence = sequence, .depth = &kPixels[buffer]};
}

TEST(BufferBook, Arrived_MoreThanMayWait_PushesTheOldestOut) {
  BufferBook book;
  book.reset(5);
  EXPECT_FALSE(book.arrived(0, view_of(1, 0)));
  EXPECT_FALSE(book.arrived(1, view_of(2, 1)));
  EXPECT_EQ(book.arrived(2, view_of(3, 2)), Index{0});
  DepthFrameView view;
  ASSERT_TRUE(book.take(view));
  EXPECT_EQ(view.sequence, 2U);
}

TEST(BufferBook, GiveBack_SharedWithTheSecond_OnlyTheLastHandsBack) {
  BufferBook book;
  book.reset(4);
  DepthFrameView view;
  EXPECT_FALSE(book.share()) << "the module holds none";
  ASSERT_FALSE(book.arrived(3, view_of(1, 3)));
  ASSERT_TRUE(book.take(view));
  ASSERT_TRUE(book.share());
  EXPECT_FALSE(book.share()) << "the second holds it already";
  EXPECT_FALSE(book.give_back());
  EXPECT_TRUE(book.any_held());
  EXPECT_FALSE(book.give_back_shared(&kPixels[2])) << "nobody holds that one";
  EXPECT_EQ(book.give_back_shared(view.depth), Index{3});
  EXPECT_FALSE(book.any_held());
  EXPECT_FALSE(book.give_back_shared(view.depth)) << "nothing is handed back twice";
}

TEST(BufferBook, Share_MoreBuffers_TheSecondHoldsAsManyAsAreSpare) {
  for (const auto& [buffers, most] : {std::pair{4, 1}, {5, 1}, {6, 2}, {7, 3}, {8, 4}}) {
    BufferBook book;
    book.reset(static_cast<std::size_t>(buffers));
    DepthFrameView view;
    for (int i = 0; i <= most; ++i) {
      const auto buffer = static_cast<Index>(i);
      ASSERT_FALSE(book.arrived(buffer, view_of(buffer + 1, buffer)));
      ASSERT_TRUE(book.take(view));
      EXPECT_EQ(book.share(), i < most) << buffers << " buffers, picture " << i;
      EXPECT_EQ(book.give_back().has_value(), i == most);
    }
    EXPECT_EQ(book.give_back_shared(&kPixels[0]), Index{0}) << "in any order";
  }
}

TEST(BufferBook, AnySequenceOfCalls_EveryBufferIsInOnePlace) {
  std::mt19937 random(5);
  for (int run = 0; run < 200; ++run) {
    const std::size_t buffers = 4 + random() % 5;
    BufferBook book;
    book.reset(buffers);
    std::set<Index> kernel;
    for (Index i = 0; i < buffers; ++i) kernel.insert(i);
    std::vector<const std::uint16_t*> shared;
    std::uint32_t sequence = 0, last_taken = 0;
    std::optional<Index> back;
    DepthFrameView view;
    for (int step = 0; step < 500; ++step) {
      back.reset();
      switch (random() % 5) {
        case 0:
          ASSERT_FALSE(kernel.empty()) << "the camera always has a buffer to fill";
          back = book.arrived(*kernel.begin(), view_of(++sequence, *kernel.begin()));
          kernel.erase(kernel.begin());
          break;
        case 1:
          if (book.take(view)) {
            ASSERT_GT(view.sequence, last_taken);
            last_taken = view.sequence;
          }
          break;
        case 2:
          if (book.share()) shared.push_back(view.depth);
          break;
        case 3:
          back = book.give_back();
          break;
        default:
          if (shared.empty()) break;
          std::swap(shared[random() % shared.size()], shared.back());
          back = book.give_back_shared(shared.back());
          shared.pop_back();
          break;
      }
      if (back) {
        ASSERT_TRUE(kernel.insert(*back).second) << "handed back twice";
      }
    }
    if ((back = book.give_back())) kernel.insert(*back);
    for (const std::uint16_t* const pixels : shared) {
      if ((back = book.give_back_shared(pixels))) kernel.insert(*back);
    }
    EXPECT_EQ(kernel.size() + book.waiting(), buffers) << "a buffer is lost";
  }
}

}  // namespace
}  // namespace polygmap::hal
