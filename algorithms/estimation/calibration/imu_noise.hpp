// SPDX-License-Identifier: Apache-2.0
// How noisy an IMU is, from its samples: the second difference of evenly spaced ones holds little of a robot's motion
// and six times the variance of their noise.
#pragma once

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/estimation/calibration/noise_level.hpp"

namespace polygmap {

// White, as densities: rad/sqrt(s) and m/s/sqrt(s).
struct ImuNoiseDensity {
  double gyro_radprs = 0.0;
  double accel_mpsrs = 0.0;
};

class ImuNoise {
 public:
  void reset() noexcept {
    *this = ImuNoise{};
    gyro_radps_.level.reset({1e-3, 0.0, kMemory_s, 1e-6, 1.0});
    accel_mps2_.level.reset({0.02, 0.0, kMemory_s, 1e-6, 10.0});
  }
  void update(std::int64_t stamp_ns, const Vec3& gyro_radps, const Vec3& accel_mps2) noexcept {
    const double dt_s = seconds(stamp_ns - stamp_ns_);
    const bool even = stamp_ns_ >= 0 && std::abs(dt_s - dt_s_) < kUneven * dt_s;
    gyro_radps_.take(gyro_radps, even, dt_s);
    accel_mps2_.take(accel_mps2, even, dt_s);
    dt_s_ = dt_s;
    stamp_ns_ = stamp_ns;
  }
  [[nodiscard]] ImuNoiseDensity density() const noexcept {
    const double root_s = math::sqrt(std::max(dt_s_, 0.0));
    return {gyro_radps_.level.sigma() * root_s, accel_mps2_.level.sigma() * root_s};
  }

 private:
  static constexpr double kMemory_s = 1.0;
  static constexpr double kUneven = 0.3;
  struct Signal {
    Vec3 last = Vec3::Zero(), step = Vec3::Zero();
    NoiseLevel level;
    void take(const Vec3& value, bool even, double dt_s) noexcept {
      const Vec3 new_step = value - last;
      constexpr double kRows = 6.0 * 3.0;
      if (even) level.take((new_step - step).squaredNorm() / kRows, dt_s);
      step = new_step;
      last = value;
    }
  };
  Signal gyro_radps_, accel_mps2_;
  double dt_s_ = 0.0;
  std::int64_t stamp_ns_ = -1;
};

}  // namespace polygmap
