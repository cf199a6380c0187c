// SPDX-License-Identifier: Apache-2.0
// When an IMU that is slower than the cycle is said to be missing, sample by sample.
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/standing_module.hpp"

namespace polygmap {
namespace {

constexpr std::int64_t kInterval_ns = 5 * kNsPerMs;

Params of_200_hz() {
  Params params;
  params.imu_interval_ns = kInterval_ns;
  return params;
}

class ImuOf200Hz : public test::StandingModule {
 protected:
  ImuOf200Hz() : StandingModule(of_200_hz()) {}

  // Samples of every 5 ms, read by the first cycle that begins once they have arrived.
  void stand_late(std::int64_t late_ns, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      clock_.advance_ns(kCycle_ns);
      feed_until(clock_.now_ns() - late_ns);
      const JointFeedback joints = joints_at(clock_.now_ns());
      tick_with(nullptr, &joints);
    }
  }
  void feed_until(std::int64_t until_ns) {
    for (; due_ns_ <= until_ns; due_ns_ += kInterval_ns) {
      ImuSample sample = imu_at(due_ns_);
      if (spoilt_ > 0) {
        --spoilt_;
        sample.gyro_radps.x() = std::numeric_limits<double>::quiet_NaN();
      }
      imu_.feed(sample);
    }
  }

  int spoilt_ = 0;  // of the next samples
  std::int64_t due_ns_ = clock_.now_ns() + kInterval_ns;
};

TEST_F(ImuOf200Hz, SamplesUpToACycleLate_NoneIsMissing) {
  for (const std::int64_t late_ns : {std::int64_t{0}, kNsPerMs, kCycle_ns - 1}) {
    stand_late(late_ns, 200);
    EXPECT_EQ(count(Fault::kImuMissing), 0U) << late_ns;
  }
}

TEST_F(ImuOf200Hz, RejectedSamples_AreNotMissingToo) {
  stand_late(0, 100);
  spoilt_ = 1;
  stand_late(0, 100);
  EXPECT_EQ(count(Fault::kImuRejected), 1U);
  spoilt_ = 20;
  stand_late(0, 100);
  EXPECT_EQ(count(Fault::kImuRejected), 21U);
  EXPECT_EQ(count(Fault::kImuMissing), 0U);
}

TEST_F(ImuOf200Hz, OneSampleLost_IsMissingOnce) {
  stand_late(0, 100);
  due_ns_ += kInterval_ns;
  stand_late(0, 100);
  EXPECT_EQ(count(Fault::kImuMissing), 1U);  // 8 ms after the last one; at 10 ms there is one again
}

// The first of the cycles that are caught up reads what all of them have.
TEST_F(ImuOf200Hz, CyclesCaughtUp_NoneIsMissing) {
  stand_late(0, 100);
  for (int i = 0; i < 20; ++i) {
    clock_.advance_ns(2 * kCycle_ns);
    stand_late(0, 1);
  }
  EXPECT_GT(count(Limit::kCycleCaughtUp), 0U);
  EXPECT_EQ(count(Fault::kImuMissing), 0U);
}

}  // namespace
}  // namespace polygmap
