// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>

#include "sim_stub/host/report/report_blocks.hpp"

namespace polygmap::sim {
namespace {

ReportTable table_of(int rows) {
  ReportTable table({1.0});
  for (int i = 0; i < rows; ++i) table.add(std::array{static_cast<double>(i % 7)});
  return table;
}

TEST(ReportTable, EveryThirdRow_HasTheFirstAndAsManyAsItSays) {
  EXPECT_EQ(table_of(9).json(3)["count"], 3);
  EXPECT_EQ(table_of(10).json(3)["count"], 4);
  ReportTable thin({1.0});
  for (const double value : {0.0, 3.0, 6.0, 2.0}) thin.add(std::array{value});
  EXPECT_EQ(table_of(10).json(3)["data"], thin.json()["data"]);
}

TEST(ReportTable, NothingLeftOut_IsTheTable) {
  EXPECT_EQ(table_of(10).json(1)["count"], 10);
  EXPECT_NE(table_of(10).json(1)["data"], table_of(10).json(2)["data"]);
}

}  // namespace
}  // namespace polygmap::sim
