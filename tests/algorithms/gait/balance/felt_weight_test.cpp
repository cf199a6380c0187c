// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/felt_weight.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "algorithms/core/time.hpp"

namespace polygmap {
namespace {

constexpr FeltWeight::Params kParams;

TEST(FeltWeight, DrivesOfAFifthLessTorque_IsFoundWithinASecondAndStays) {
  FeltWeight weight;
  for (int tick = 0; tick < 50; ++tick) weight.update(kParams, 675.0, 540.0, kTick_s);
  EXPECT_GT(weight.share(), 1.1) << "after a tenth of a second";
  for (int tick = 0; tick < 450; ++tick) weight.update(kParams, 675.0, 540.0, kTick_s);
  EXPECT_NEAR(weight.share(), 1.25, 0.03);
  weight.update(kParams, 540.0, 540.0, kTick_s);
  EXPECT_NEAR(weight.share(), 1.25, 0.03) << "one tick tells little by then";
}

TEST(FeltWeight, HeavierThanIsBelieved_StopsAtTheBound) {
  FeltWeight weight;
  for (int tick = 0; tick < 5000; ++tick) weight.update(kParams, 1.9 * 540.0, 540.0, kTick_s);
  EXPECT_DOUBLE_EQ(weight.share(), 1.0 + kParams.most);
}

TEST(FeltWeight, ForcesThatAreNoWeight_ChangeNothing) {
  FeltWeight weight;
  for (const double felt_n : {0.0, 100.0, 5000.0, -540.0, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()}) {
    weight.update(kParams, felt_n, 540.0, kTick_s);
    EXPECT_DOUBLE_EQ(weight.share(), 1.0) << felt_n;
  }
}

}  // namespace
}  // namespace polygmap
