// SPDX-License-Identifier: Apache-2.0
// Joint speeds as drives tell them: smooth ones pass, those of coarse encoders are averaged.
#include "algorithms/estimation/joint_speeds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "algorithms/core/time.hpp"

namespace polygmap {
namespace {

constexpr double kStep_rad = 0.00175;  // 0.1 degrees

JointVector all(double dq_radps) { return JointVector::Constant(dq_radps); }

// What a drive says that differences an encoder of that step, of a joint that turns as q_rad says.
template <typename Angle>
double differenced(const Angle& q_rad, int tick, double step_rad) {
  const auto read_rad = [&](int t) { return step_rad * std::round(q_rad(t * kTick_s) / step_rad); };
  return (read_rad(tick) - read_rad(tick - 1)) / kTick_s;
}

TEST(JointSpeeds, SmoothSpeeds_PassToTheBit) {
  JointSpeeds speeds;
  speeds.reset({});
  std::mt19937 random(3);
  std::normal_distribution<double> noise_radps(0.0, 0.01);
  for (int tick = 0; tick < 5000; ++tick) {
    double dq_radps = 6.0 * std::sin(12.0 * tick * kTick_s) + noise_radps(random);
    if (tick % 500 == 250) dq_radps += 1.0;  // a foot lands
    EXPECT_EQ(speeds.smoothed(all(dq_radps), tick == 0 ? 0.0 : kTick_s)[0], dq_radps) << tick;
  }
}

TEST(JointSpeeds, CoarseEncoderDifferenced_FollowsTheJointWithLessThanHalfTheNoise) {
  constexpr double kRate_radps = 3.0, kSwing_rad = 0.3;
  const auto q_rad = [](double t_s) { return kSwing_rad * std::sin(kRate_radps * t_s); };
  JointSpeeds speeds;
  speeds.reset({});
  double told_radps2 = 0.0, off_radps2 = 0.0;
  int count = 0;
  for (int tick = 1; tick < 5000; ++tick) {
    const double told_radps = differenced(q_rad, tick, kStep_rad);
    const double smoothed_radps = speeds.smoothed(all(told_radps), kTick_s)[5];
    if (tick < 500) continue;
    const double true_radps = kSwing_rad * kRate_radps * std::cos(kRate_radps * tick * kTick_s);
    told_radps2 += math::square(told_radps - true_radps);
    off_radps2 += math::square(smoothed_radps - true_radps);
    ++count;
  }
  EXPECT_GT(std::sqrt(told_radps2 / count), 0.25);
  EXPECT_LT(std::sqrt(off_radps2 / count), 0.12);
}

TEST(JointSpeeds, OneNoisyJoint_TheOthersPass) {
  JointSpeeds speeds;
  speeds.reset({});
  for (int tick = 0; tick < 1000; ++tick) {
    JointVector dq_radps = all(0.5);
    dq_radps[3] = tick % 2 == 0 ? 0.9 : -0.9;
    const JointVector& smoothed_radps = speeds.smoothed(dq_radps, kTick_s);
    EXPECT_EQ(smoothed_radps[2], 0.5);
    if (tick > 500) {
      EXPECT_LT(std::abs(smoothed_radps[3]), 0.1);
    }
  }
}

TEST(JointSpeeds, NoiseIsOver_SpeedsPassAgain) {
  JointSpeeds speeds;
  speeds.reset({});
  for (int tick = 0; tick < 1000; ++tick) (void)speeds.smoothed(all(tick % 2 == 0 ? 0.9 : -0.9), kTick_s);
  for (int tick = 0; tick < 2000; ++tick) (void)speeds.smoothed(all(0.2), kTick_s);
  EXPECT_EQ(speeds.smoothed(all(0.3), kTick_s)[0], 0.3);
}

}  // namespace
}  // namespace polygmap
