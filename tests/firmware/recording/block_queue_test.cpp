// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/block_queue.hpp"

#include <gtest/gtest.h>

#include <array>
#include <deque>
#include <random>
#include <vector>

namespace polygmap::recording {
namespace {

TEST(BlockQueue, BlocksAroundTheEnd_ComeOutAsTheyWentInAndNoneTooMany) {
  std::array<std::byte, 100> inside_memory{};
  BlockQueue queue(inside_memory);
  std::array<std::byte, 64> memory{};
  EXPECT_TRUE(queue.pop(memory).empty());
  std::mt19937 random(5);
  std::deque<std::vector<std::byte>> inside;
  std::size_t used = 0;
  for (int i = 0; i < 10'000; ++i) {
    std::vector<std::byte> block(1 + random() % 40);
    for (std::byte& byte : block) byte = static_cast<std::byte>(random());
    const std::size_t head = random() % block.size();
    const std::span<const std::byte> bytes(block);
    const bool fits = used + 4 + block.size() <= 100;
    ASSERT_EQ(queue.try_push(bytes.first(head), bytes.subspan(head)), fits);
    if (fits) {
      used += 4 + block.size();
      inside.push_back(block);
    }
    if (random() % 2 == 0 || inside.empty()) continue;
    const std::span<std::byte> out = queue.pop(memory);
    ASSERT_TRUE(std::ranges::equal(out, inside.front()));
    used -= 4 + inside.front().size();
    inside.pop_front();
  }
}

}  // namespace
}  // namespace polygmap::recording
