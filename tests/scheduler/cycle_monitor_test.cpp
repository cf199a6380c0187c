// SPDX-License-Identifier: Apache-2.0
#include "scheduler/cycle_monitor.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

TEST(DurationStatistics, BucketOf_PowersOfTwo_StartsANewBucketAtEach) {
  EXPECT_EQ(DurationStatistics::bucket_of(0), 0U);
  for (std::size_t b = 1; b < DurationStatistics::kBuckets; ++b) {
    const std::uint64_t low = DurationStatistics::bucket_low_ns(b);
    EXPECT_EQ(DurationStatistics::bucket_of(low), b);
    EXPECT_EQ(DurationStatistics::bucket_of(low - 1), b - 1);
  }
  EXPECT_EQ(DurationStatistics::bucket_of(UINT64_MAX), DurationStatistics::kBuckets - 1);
}

TEST(DurationStatistics, Add_Nothing_IsAllZero) {
  const DurationStatistics statistics;
  EXPECT_EQ(statistics.min_ns(), 0U);
  EXPECT_EQ(statistics.mean_ns(), 0U);
  EXPECT_EQ(statistics.max_ns(), 0U);
}

TEST(DurationStatistics, Add_ManyValues_HistogramHoldsThemAll) {
  DurationStatistics statistics;
  for (std::uint64_t ns = 0; ns < 10'000; ++ns) statistics.add(ns);
  std::uint64_t total = 0;
  for (const std::uint32_t n : statistics.histogram()) total += n;
  EXPECT_EQ(total, 10'000U);
  EXPECT_EQ(statistics.count(), 10'000U);
  EXPECT_EQ(statistics.mean_ns(), 4999U);
  EXPECT_EQ(statistics.histogram()[4], 8U);  // 8 to 15 ns
}

TEST(CountUp, AtTheTop_Stays) {
  std::uint8_t n = 254;
  count_up(n);
  count_up(n);
  EXPECT_EQ(n, 255);
}

TEST(CounterScale, ToNs_RatesOfRealCounters_IsExactToAPartInAMillion) {
  for (const double rate : {1.0, 19.2, 31.25, 1000.0, 2496.0, 10'000.0}) {
    const CounterScale scale(rate);
    for (const std::uint64_t us : {1U, 100U, 2000U, 1'000'000U}) {
      const auto counts = static_cast<std::uint64_t>(static_cast<double>(us) * rate);
      const double expected_ns = static_cast<double>(counts) * 1000.0 / rate;
      EXPECT_NEAR(static_cast<double>(scale.to_ns(counts)), expected_ns, 0.51 + 1e-6 * expected_ns) << rate;
    }
  }
}

TEST(CounterScale, ToNs_Anything_SaturatesInsteadOfWrapping) {
  for (const double rate : {1.0, 2496.0, 10'000.0}) {
    const CounterScale scale(rate);
    EXPECT_GT(scale.to_ns(UINT64_MAX), std::uint64_t{200'000'000'000});
    EXPECT_EQ(scale.to_ns(UINT64_MAX), scale.to_ns(UINT64_MAX / 2));
  }
}

}  // namespace
}  // namespace polygmap
