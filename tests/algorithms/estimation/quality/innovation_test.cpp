// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/quality/innovation.hpp"

#include <gtest/gtest.h>

#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_ns;

TEST(InnovationStatistics, NoisierMeasurements_ShowInTheLastSecondAtOnceAndInTheMeanLater) {
  InnovationStatistics statistics;
  statistics.take({}, 1);  // no rows: no update
  EXPECT_EQ(statistics.stamp_ns, -1);
  for (int i = 0; i < 5000; ++i) statistics.take({3.0, 3}, i * kTick_ns);
  for (int i = 5000; i < 6000; ++i) statistics.take({27.0, 3}, i * kTick_ns);
  EXPECT_EQ(statistics.count, 6000U);
  EXPECT_EQ(statistics.last, 9.0);
  EXPECT_NEAR(statistics.recent, 9.0 - 8.0 * std::exp(-2.0), 0.01);
  EXPECT_NEAR(statistics.mean, (5000.0 + 9.0 * 1000.0) / 6000.0, 1e-9);
}

}  // namespace
}  // namespace polygmap
