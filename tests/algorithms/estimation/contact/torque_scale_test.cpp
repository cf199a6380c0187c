// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/torque_scale.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "algorithms/core/time.hpp"

namespace polygmap {
namespace {

constexpr TorqueScale::Params kParams;
constexpr double kWeight_n = 540.0;

// Drives that tell `times` as much as the legs need.
void feel(TorqueScale& torques, double times, int ticks) {
  for (int tick = 0; tick < ticks; ++tick) {
    torques.update(kParams, times * kWeight_n / torques.scale(), kWeight_n, kTick_s);
  }
}

TEST(TorqueScale, DrivesOfAFifthLessTorque_IsFoundWithinASecondAndStays) {
  TorqueScale torques;
  feel(torques, 1.25, 50);
  EXPECT_GT(torques.scale(), 1.1) << "after a tenth of a second";
  feel(torques, 1.25, 450);
  EXPECT_NEAR(torques.scale(), 1.25, 0.03);
  feel(torques, 1.0, 1);
  EXPECT_NEAR(torques.scale(), 1.25, 0.03) << "one tick tells little by then";
}

TEST(TorqueScale, HeavierThanIsBelieved_StopsAtTheBound) {
  TorqueScale torques;
  feel(torques, 1.9, 5000);
  EXPECT_DOUBLE_EQ(torques.scale(), 1.0 + kParams.most);
}

TEST(TorqueScale, WeightWithinItsOwnError_ChangesNothing) {
  TorqueScale torques;
  for (const double times : {1.0 - 0.9 * kParams.unsure, 1.0 + 0.9 * kParams.unsure}) {
    feel(torques, times, 2000);
    EXPECT_DOUBLE_EQ(torques.scale(), 1.0) << times;
  }
}

TEST(TorqueScale, ForcesThatAreNoWeight_ChangeNothing) {
  TorqueScale torques;
  for (const double felt_n : {0.0, 100.0, 5000.0, -540.0, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()}) {
    torques.update(kParams, felt_n, kWeight_n, kTick_s);
    EXPECT_DOUBLE_EQ(torques.scale(), 1.0) << felt_n;
  }
  for (const double weight_n : {0.0, -540.0, std::numeric_limits<double>::quiet_NaN()}) {
    torques.update(kParams, 540.0, weight_n, kTick_s);
    EXPECT_DOUBLE_EQ(torques.scale(), 1.0) << weight_n;
  }
}

}  // namespace
}  // namespace polygmap
