// SPDX-License-Identifier: Apache-2.0
#include "algorithms/core/containers/exchange.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <random>
#include <thread>

#include "tests/support/slow_machine.hpp"

namespace polygmap {
namespace {

using FourSlots = Exchange<std::int64_t, 4>;
static_assert(!std::is_copy_constructible_v<FourSlots> && !std::is_copy_assignable_v<FourSlots>,
              "two threads hold references into it: it stays where it is");

TEST(Exchange, TryTake_NothingPublished_IsFalse) {
  FourSlots exchange;
  EXPECT_FALSE(exchange.try_take(1000));
  EXPECT_EQ(exchange.front(), 0);
  EXPECT_EQ(exchange.front_frame_ns(), kNoFrame_ns);
  EXPECT_EQ(exchange.lost(), 0U);
}

TEST(Exchange, TryTake_OnePublished_GivesItOnceAndKeepsItInFront) {
  FourSlots exchange;
  exchange.back() = 5;
  EXPECT_FALSE(exchange.try_take(10)) << "filled is not published";
  exchange.publish(10);
  EXPECT_TRUE(exchange.try_take(10));
  EXPECT_EQ(exchange.front(), 5);
  EXPECT_EQ(exchange.front_frame_ns(), 10);
  EXPECT_FALSE(exchange.try_take(10));
  exchange.back() = 6;
  EXPECT_EQ(exchange.front(), 5) << "the writer never writes what the reader reads";
}

TEST(Exchange, TryTake_PublishedInTheReadersOwnFrame_IsSeenInTheNextOne) {
  FourSlots exchange;
  exchange.publish(10, 1);
  exchange.publish(11, 2);
  EXPECT_TRUE(exchange.try_take(10));  // a reader in frame 11
  EXPECT_EQ(exchange.front(), 1);
  EXPECT_FALSE(exchange.try_take(10));
  EXPECT_TRUE(exchange.try_take(11));  // and in frame 12
  EXPECT_EQ(exchange.front(), 2);
}

TEST(Exchange, TryTake_WriterIsAheadByAllItsSlotsAllow_StillGivesTheNewestOfTheFrame) {
  FourSlots exchange;
  exchange.publish(1, 1);
  ASSERT_TRUE(exchange.try_take(1));
  exchange.publish(2, 2);
  exchange.publish(3, 3);  // Slots - 3 after the one that the reader of frame 3 is to see,
  exchange.back() = 4;     // and one is being filled
  EXPECT_TRUE(exchange.try_take(2));
  EXPECT_EQ(exchange.front(), 2);
  exchange.publish(4);
  EXPECT_TRUE(exchange.try_take(3));
  EXPECT_TRUE(exchange.try_take(4));
  EXPECT_EQ(exchange.front(), 4);
  EXPECT_EQ(exchange.lost(), 0U);
}

TEST(Exchange, TryTake_WriterIsFurtherAhead_KeepsWhatItHoldsAndCountsEachTake) {
  FourSlots exchange;
  exchange.publish(1, 1);
  ASSERT_TRUE(exchange.try_take(1));
  for (std::int64_t frame = 2; frame <= 5; ++frame) exchange.publish(frame, frame);
  EXPECT_FALSE(exchange.try_take(2));
  EXPECT_FALSE(exchange.try_take(2));
  EXPECT_EQ(exchange.front(), 1);
  EXPECT_EQ(exchange.lost(), 2U);
  EXPECT_TRUE(exchange.try_take(5)) << "it goes on";
  EXPECT_EQ(exchange.front(), 5);
  exchange.publish(6, 6);
  exchange.publish(7, 7);
  exchange.publish(8, 8);
  exchange.back() = 9;
  EXPECT_FALSE(exchange.try_take(6)) << "overwritten right now";
  EXPECT_EQ(exchange.lost(), 3U);
}

// Only newer ones than it may look at were overwritten: there may have been one for it.
TEST(Exchange, TryTake_WriterIsFarAhead_IsMissedThoughTheReaderSeesNoTrace) {
  FourSlots exchange;
  exchange.publish(1, 1);
  ASSERT_TRUE(exchange.try_take(1));
  for (std::int64_t frame = 2; frame <= 9; ++frame) exchange.publish(frame, frame);
  EXPECT_FALSE(exchange.try_take(2));
  EXPECT_TRUE(exchange.missed());
  EXPECT_EQ(exchange.lost(), 1U);
  EXPECT_TRUE(exchange.try_take(9));
  EXPECT_FALSE(exchange.missed());
}

// One thread, any interleaving of take, begin to fill and publish, against a model that remembers everything.
template <std::size_t Slots>
void compare_with_a_model(unsigned seed, int most_ahead, int least_gap) {
  std::mt19937 random(seed);
  Exchange<std::int64_t, Slots> exchange;
  std::deque<std::int64_t> published;  // frames; the value is the frame
  std::int64_t writer = 1, reader = 1, front = kNoFrame_ns, published_last = -1000;
  bool filling = false;
  for (int i = 0; i < (test::kSlowMachine ? 50'000 : 300'000); ++i) {
    const unsigned what = random() % 4;
    if (what == 0 && writer - reader < most_ahead) {  // the writer's frame ends
      if (filling) {
        exchange.publish(writer);
        published.push_back(writer);
        published_last = writer;
      }
      filling = false;
      ++writer;
    } else if (what == 1 && writer - published_last >= least_gap) {
      exchange.back() = writer;
      filling = true;
    } else if (what == 2 && reader < writer) {
      ++reader;
    } else if (what == 3) {
      std::int64_t newest = front;
      for (const std::int64_t frame : published) newest = frame < reader ? std::max(frame, newest) : newest;
      ASSERT_EQ(exchange.try_take(reader - 1), newest != front);
      front = newest;
      while (!published.empty() && published.front() < front) published.pop_front();
    }
    ASSERT_EQ(exchange.front_frame_ns(), front);
    if (front != kNoFrame_ns) {
      ASSERT_EQ(exchange.front(), front);
    }
  }
  EXPECT_EQ(exchange.lost(), 0U);
  EXPECT_GT(front, 1000);
}

TEST(Exchange, RandomInterleaving_WriterAsFarAheadAsItsSlotsAllow_AlwaysGivesTheNewestOfTheFramesBefore) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    compare_with_a_model<4>(seed, 1, 1);
    compare_with_a_model<5>(seed, 2, 1);
    compare_with_a_model<8>(seed, 5, 1);
    compare_with_a_model<4>(seed, 2, 2);  // published in every second frame
    compare_with_a_model<3>(seed, 2, 3);  // or more seldom
  }
}

struct Wide {
  std::array<std::int64_t, 32> words{};  // 4 cache lines: a torn value would show
};

struct Outcome {
  std::uint64_t taken = 0;
  std::uint64_t torn = 0;
  std::uint64_t backwards = 0;
  std::uint64_t of_the_future = 0;
  std::int64_t last = 0;
};

// Publishes 1, 2, ... count from one thread; takes in another, which looks some frames behind, until the last arrived.
Outcome race(std::int64_t count, bool hesitant_writer, bool hesitant_reader) {
  Exchange<Wide, 4> exchange;
  std::atomic<int> ready{0};
  std::atomic<std::int64_t> written{0};
  Outcome outcome;
  const auto wait_for_both = [&ready] {
    ready.fetch_add(1);
    while (ready.load() < 2) std::this_thread::yield();
  };
  std::thread writer([&] {
    wait_for_both();
    for (std::int64_t i = 1; i <= count; ++i) {
      exchange.back().words.fill(i);
      exchange.publish(i);
      written.store(i, std::memory_order_relaxed);
      if (hesitant_writer && i % 8 == 0) std::this_thread::yield();
    }
  });
  std::thread reader([&] {
    wait_for_both();
    while (outcome.last < count) {
      const std::int64_t newest = written.load(std::memory_order_relaxed);
      const std::int64_t frame = newest == count ? count : newest - static_cast<std::int64_t>(outcome.taken % 3);
      if (!exchange.try_take(frame)) {
        if (hesitant_reader) std::this_thread::yield();
        continue;
      }
      ++outcome.taken;
      const Wide& value = exchange.front();
      if (value.words[0] <= outcome.last) ++outcome.backwards;
      if (value.words[0] > frame) ++outcome.of_the_future;
      outcome.last = value.words[0];
      for (const std::int64_t word : value.words) outcome.torn += word != outcome.last ? 1U : 0U;
    }
  });
  writer.join();
  reader.join();
  return outcome;
}

TEST(Exchange, TwoThreads_ValuesAreNeverTornAndNeverGoBackNorAreOfALaterFrame) {
  constexpr std::int64_t kCount = test::kSlowMachine ? 20'000 : 100'000;
  constexpr std::uint64_t kMeetings = 100;  // on a machine with other work to do, one round may have one
  constexpr int kMostRounds = 500;
  std::uint64_t taken_early = 0;
  for (int round = 0; round < kMostRounds && taken_early <= kMeetings; ++round) {
    for (const bool hesitant_writer : {false, true}) {
      for (const bool hesitant_reader : {false, true}) {
        const Outcome outcome = race(kCount, hesitant_writer, hesitant_reader);
        ASSERT_EQ(outcome.torn, 0U);
        ASSERT_EQ(outcome.backwards, 0U);
        ASSERT_EQ(outcome.of_the_future, 0U);
        ASSERT_EQ(outcome.last, kCount) << "the last published value always arrives";
        taken_early += outcome.taken - 1;  // the last value is taken whether the threads met or not
      }
    }
  }
  EXPECT_GT(taken_early, kMeetings) << "the threads hardly met: the test showed nothing";
}

}  // namespace
}  // namespace polygmap
