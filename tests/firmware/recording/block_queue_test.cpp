// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/block_queue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <random>
#include <thread>
#include <vector>

namespace polygmap::recording {
namespace {

TEST(BlockQueue, BlocksAroundTheEnd_ComeOutAsTheyWentIn) {
  alignas(8) std::array<std::byte, 256> memory;
  BlockQueue queue(memory);
  EXPECT_TRUE(queue.front().empty());
  std::mt19937 random(5);
  std::deque<std::vector<std::byte>> inside;
  int refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    const std::size_t most = 1 + random() % 60, count = 1 + random() % most;
    const std::span<std::byte> room = queue.reserve(most);
    refused += room.empty() ? 1 : 0;
    if (!room.empty()) {
      ASSERT_EQ(room.size(), most);
      ASSERT_TRUE(room.data() >= memory.data() && room.data() + most <= memory.data() + memory.size());
      for (std::byte& byte : room) byte = static_cast<std::byte>(random());
      if (random() % 4 != 0) {  // else nothing comes of it
        inside.emplace_back(room.begin(), room.begin() + static_cast<std::ptrdiff_t>(count));
        queue.commit(count);
      }
    }
    if (random() % 2 == 0) continue;
    const std::span<std::byte> oldest = queue.front();
    ASSERT_EQ(oldest.empty(), inside.empty());
    if (inside.empty()) continue;
    ASSERT_TRUE(std::ranges::equal(oldest, inside.front()));
    queue.pop();
    inside.pop_front();
  }
  EXPECT_GT(refused, 100);
}

TEST(BlockQueue, NobodyReads_IsFullAndTakesAgainAfterwards) {
  alignas(8) std::array<std::byte, 128> memory;
  BlockQueue queue(memory);
  int blocks = 0;
  while (!queue.reserve(24).empty()) {
    queue.commit(24);
    ++blocks;
  }
  EXPECT_EQ(blocks, 4);
  for (int i = 0; i < blocks; ++i) {
    ASSERT_EQ(queue.front().size(), 24U);
    queue.pop();
  }
  EXPECT_TRUE(queue.front().empty());
  EXPECT_FALSE(queue.reserve(24).empty());
}

TEST(BlockQueue, TwoThreads_EveryBlockOnceAndInOrder) {
  constexpr std::uint32_t kBlocks = 100'000;
  alignas(8) std::array<std::byte, 1024> memory;
  BlockQueue queue(memory);
  std::thread writer([&queue] {
    for (std::uint32_t i = 0; i < kBlocks;) {
      const std::span<std::byte> room = queue.reserve(4 + i % 50);
      if (room.empty()) {
        std::this_thread::yield();
        continue;
      }
      std::memcpy(room.data(), &i, sizeof i);
      queue.commit(room.size());
      ++i;
    }
  });
  std::uint32_t wrong = 0;
  for (std::uint32_t i = 0; i < kBlocks;) {
    const std::span<std::byte> block = queue.front();
    if (block.empty()) {
      std::this_thread::yield();
      continue;
    }
    std::uint32_t number = 0;
    std::memcpy(&number, block.data(), sizeof number);
    wrong += number != i || block.size() != 4 + i % 50 ? 1 : 0;
    queue.pop();
    ++i;
  }
  writer.join();
  EXPECT_EQ(wrong, 0U);
}

}  // namespace
}  // namespace polygmap::recording
