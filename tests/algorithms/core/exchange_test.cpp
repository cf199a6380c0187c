// SPDX-License-Identifier: Apache-2.0
#include "algorithms/core/containers/exchange.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <random>
#include <thread>

#include "tests/support/slow_machine.hpp"

namespace polygmap {
namespace {

static_assert(!std::is_copy_constructible_v<Exchange<int>> && !std::is_copy_assignable_v<Exchange<int>>,
              "two threads hold references into it: it stays where it is");

TEST(Exchange, TryTake_NothingPublished_IsFalse) {
  Exchange<int> exchange;
  EXPECT_FALSE(exchange.try_take());
  EXPECT_EQ(exchange.front(), 0);
}

TEST(Exchange, TryTake_OnePublished_GivesItOnceAndKeepsItInFront) {
  Exchange<int> exchange;
  exchange.back() = 5;
  EXPECT_FALSE(exchange.try_take()) << "filled is not published";
  exchange.publish();
  EXPECT_TRUE(exchange.try_take());
  EXPECT_EQ(exchange.front(), 5);
  EXPECT_FALSE(exchange.try_take());
  exchange.back() = 6;
  EXPECT_EQ(exchange.front(), 5) << "the producer never writes what the consumer reads";
}

// One thread, any interleaving: against a model that is one optional value.
TEST(Exchange, RandomInterleaving_AgainstAModel_GivesTheNewestValueOnce) {
  std::mt19937 random(1);
  Exchange<std::uint64_t> exchange;
  std::uint64_t published = 0, front = 0;
  bool fresh = false;
  for (std::uint64_t i = 1; i <= 1'000'000; ++i) {
    if (random() % 2 == 0) {
      exchange.back() = i;
      exchange.publish();
      published = i;
      fresh = true;
    } else {
      ASSERT_EQ(exchange.try_take(), fresh);
      if (fresh) front = published;
      fresh = false;
    }
    ASSERT_EQ(exchange.front(), front);
  }
}

struct Wide {
  std::array<std::uint64_t, 32> words{};  // 4 cache lines: a torn value would show
};

struct Outcome {
  std::uint64_t taken = 0;
  std::uint64_t torn = 0;
  std::uint64_t backwards = 0;
  std::uint64_t last = 0;
};

// Publishes 1, 2, ... count from one thread; takes in another until the last value arrived.
Outcome race(std::uint64_t count, bool hesitant_producer, bool hesitant_consumer) {
  Exchange<Wide> exchange;
  std::atomic<int> ready{0};
  Outcome outcome;
  const auto wait_for_both = [&ready] {
    ready.fetch_add(1);
    while (ready.load() < 2) std::this_thread::yield();
  };
  std::thread producer([&] {
    wait_for_both();
    for (std::uint64_t i = 1; i <= count; ++i) {
      exchange.back().words.fill(i);
      exchange.publish();
      if (hesitant_producer && i % 8 == 0) std::this_thread::yield();
    }
  });
  std::thread consumer([&] {
    wait_for_both();
    while (outcome.last < count) {
      if (!exchange.try_take()) {
        if (hesitant_consumer) std::this_thread::yield();
        continue;
      }
      ++outcome.taken;
      const Wide& value = exchange.front();
      if (value.words[0] <= outcome.last) ++outcome.backwards;
      outcome.last = value.words[0];
      for (const std::uint64_t word : value.words) outcome.torn += word != outcome.last ? 1U : 0U;
    }
  });
  producer.join();
  consumer.join();
  return outcome;
}

TEST(Exchange, TwoThreads_ValuesAreNeverTornAndNeverGoBack) {
  constexpr std::uint64_t kCount = test::kSlowMachine ? 20'000 : 100'000;
  constexpr std::uint64_t kMeetings = 100;  // on a machine with other work to do, one round may have one
  constexpr int kMostRounds = 500;
  std::uint64_t taken_early = 0;
  for (int round = 0; round < kMostRounds && taken_early <= kMeetings; ++round) {
    for (const bool hesitant_producer : {false, true}) {
      for (const bool hesitant_consumer : {false, true}) {
        const Outcome outcome = race(kCount, hesitant_producer, hesitant_consumer);
        ASSERT_EQ(outcome.torn, 0U);
        ASSERT_EQ(outcome.backwards, 0U);
        ASSERT_EQ(outcome.last, kCount) << "the last published value always arrives";
        taken_early += outcome.taken - 1;  // the last value is taken whether the threads met or not
      }
    }
  }
  EXPECT_GT(taken_early, kMeetings) << "the threads hardly met: the test showed nothing";
}

}  // namespace
}  // namespace polygmap
