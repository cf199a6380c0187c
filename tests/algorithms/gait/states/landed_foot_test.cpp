// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/landed_foot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace polygmap {
namespace {

constexpr LandedFootParams kLanded;
constexpr double kEarly_m = 0.012;

struct Ticks {
  LandedFoot foot;
  std::int64_t now_ns = 0, sample_ns = 0;
  double before_mps = 0.0, most_mps2 = 0.0, most_mps = 0.0;

  explicit Ticks(double early_m) { foot.land(Foot::kLeft, true, early_m, now_ns, {}, {}); }
  void run(int ticks, double force_n, bool silent = false) {
    for (int i = 0; i < ticks; ++i) {
      now_ns += 2 * kNsPerMs;
      JointFeedback feedback;
      if (!silent) sample_ns = now_ns;
      feedback.stamp_ns = sample_ns;
      feedback.foot_force_n = {force_n, 500.0};
      const double before_m = foot.odom_T_sole().p_m.z();
      foot.update(kLanded, feedback, now_ns);
      const double mps = (before_m - foot.odom_T_sole().p_m.z()) / kTick_s;
      most_mps2 = std::max(most_mps2, std::abs(mps - before_mps) / kTick_s);
      most_mps = std::max(most_mps, mps);
      before_mps = mps;
    }
  }
  [[nodiscard]] double lowered_m() const { return -foot.odom_T_sole().p_m.z(); }
};

// A jump of its speed was 50 m/s^2, for which the other ankle gave all of its torque.
TEST(LandedFoot, HangsAboveItsTarget_IsLoweredThere_Gently) {
  Ticks ticks(kEarly_m);
  ticks.run(kLanded.unloaded_samples, 0.0);
  EXPECT_EQ(ticks.lowered_m(), 0.0);
  ticks.run(200, 0.0);
  EXPECT_NEAR(ticks.lowered_m(), kEarly_m, 1e-9);
  EXPECT_GT(ticks.most_mps, 0.9 * kLanded.lower_mps);
  EXPECT_LE(ticks.most_mps, kLanded.lower_mps + 1e-9);
  EXPECT_LE(ticks.most_mps2, 1.5 * kLanded.lower_mps2);
}

TEST(LandedFoot, FeelsTheGroundOnItsWay_StopsGently) {
  Ticks ticks(0.1);
  ticks.run(60, 0.0);
  const double felt_m = ticks.lowered_m();
  ticks.run(50, kLanded.unloaded_n + 1.0);
  EXPECT_GT(felt_m, 0.005);
  EXPECT_NEAR(ticks.lowered_m() - felt_m, 0.5 * math::square(kLanded.lower_mps) / kLanded.lower_mps2, 0.0005);
  EXPECT_LE(ticks.most_mps2, 1.01 * kLanded.lower_mps2);
}

TEST(LandedFoot, BusSilentOnItsWay_StopsGently) {
  Ticks ticks(0.1);
  ticks.run(60, 0.0);
  ticks.run(50, 0.0, true);
  EXPECT_EQ(ticks.before_mps, 0.0);
  ticks.run(50, 0.0);
  EXPECT_LE(ticks.most_mps2, 1.01 * kLanded.lower_mps2);
}

// Against a riser, say: it hangs in the air afterwards.
TEST(LandedFoot, KnockedHardAboveItsTarget_IsLoweredAllTheSame) {
  Ticks ticks(kEarly_m);
  ticks.run(kLanded.unloaded_samples, kLanded.pressed_n + 30.0);
  EXPECT_TRUE(ticks.foot.held());
  ticks.run(200, 0.0);
  EXPECT_NEAR(ticks.lowered_m(), kEarly_m, 1e-9);
}

TEST(LandedFoot, Pressed_IsHeldNoMore) {
  for (const double early_m : {0.0, kEarly_m}) {
    Ticks ticks(early_m);
    ticks.run(early_m > 0.0 ? kLanded.unloaded_samples + 1 : 1, kLanded.pressed_n);
    EXPECT_FALSE(ticks.foot.held());
  }
}

TEST(LandedFoot, EverySecondSampleMissing_IsLoweredAllTheSame) {
  Ticks ticks(kEarly_m);
  for (int i = 0; i < 150; ++i) {
    ticks.run(1, 0.0);
    ticks.run(1, 0.0, true);
  }
  EXPECT_NEAR(ticks.lowered_m(), kEarly_m, 1e-9);
}

TEST(LandedFoot, CameInTime_IsNotLowered) {
  Ticks ticks(0.0);
  ticks.run(100, 0.0);
  EXPECT_EQ(ticks.lowered_m(), 0.0);
}

}  // namespace
}  // namespace polygmap
