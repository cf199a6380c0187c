// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/sensors/imu_interval.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace polygmap::sim {
namespace {

constexpr std::int64_t kTick_ns = 2 * kNsPerMs;

// What the ticks have, in rates that tell one from the other.
ImuSample tick_at(std::int64_t stamp_ns) {
  const double n = static_cast<double>(stamp_ns / kTick_ns);
  return {stamp_ns, Vec3{n, 0, -n * n}, Vec3{0, 3 * n, 1}};
}
std::vector<ImuSample> samples_of(std::int64_t interval_ns, int ticks) {
  ImuInterval imu(interval_ns, kTick_ns);
  std::vector<ImuSample> samples;
  ImuSample sample;
  for (int i = 1; i <= ticks; ++i) {
    if (imu.push(tick_at(i * kTick_ns), sample)) samples.push_back(sample);
  }
  return samples;
}

TEST(ImuInterval, AsLongAsATick_IsWhatTheTicksHave) {
  const std::vector<ImuSample> samples = samples_of(kTick_ns, 4);
  ASSERT_EQ(samples.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    const ImuSample tick = tick_at((i + 1) * kTick_ns);
    EXPECT_EQ(samples[static_cast<std::size_t>(i)].stamp_ns, tick.stamp_ns);
    EXPECT_EQ(samples[static_cast<std::size_t>(i)].gyro_radps, tick.gyro_radps);
    EXPECT_EQ(samples[static_cast<std::size_t>(i)].accel_mps2, tick.accel_mps2);
  }
}

TEST(ImuInterval, TwoTicksAndAHalf_TheTickBetweenCountsByHalfForEither) {
  const std::vector<ImuSample> samples = samples_of(5 * kNsPerMs, 5);
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].stamp_ns, 5 * kNsPerMs);
  EXPECT_EQ(samples[1].stamp_ns, 10 * kNsPerMs);
  EXPECT_NEAR(samples[0].gyro_radps.x(), (2 * 1 + 2 * 2 + 1 * 3) / 5.0, 1e-12);
  EXPECT_NEAR(samples[1].gyro_radps.x(), (1 * 3 + 2 * 4 + 2 * 5) / 5.0, 1e-12);
  EXPECT_NEAR(samples[1].accel_mps2.y(), 3 * (1 * 3 + 2 * 4 + 2 * 5) / 5.0, 1e-12);
}

// Nothing of a turn is lost or felt twice.
TEST(ImuInterval, AnyInterval_SamplesAddUpToTheTicks) {
  constexpr int kTicks = 2 * 3 * 5 * 7 * 10;
  for (const std::int64_t interval_ns : {2'500'000, 3'000'000, 4'000'000, 7'000'000, 20'000'000}) {
    const std::vector<ImuSample> samples = samples_of(interval_ns, kTicks);
    ASSERT_EQ(samples.size(), static_cast<std::size_t>(kTicks * kTick_ns / interval_ns));
    Vec3 felt = Vec3::Zero(), had = Vec3::Zero();
    for (const ImuSample& sample : samples) felt += seconds(interval_ns) * sample.gyro_radps;
    for (int i = 1; i <= kTicks; ++i) had += seconds(kTick_ns) * tick_at(i * kTick_ns).gyro_radps;
    EXPECT_LT((felt - had).norm(), 1e-9 * had.norm()) << interval_ns;
  }
}

}  // namespace
}  // namespace polygmap::sim
