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
  struct Params {
    NoiseLevel::Params gyro_radps{1e-3, 0.0, 1.0, 1e-6, 1.0};
    NoiseLevel::Params accel_mps2{0.02, 0.0, 1.0, 1e-6, 10.0};
    double uneven = 0.3;

    static void visit(auto& p, auto& field) {
      field("gyro_radps", p.gyro_radps);
      field("accel_mps2", p.accel_mps2);
      field("uneven", p.uneven, 0.0, 1.0,
            "Samples whose times lie apart by more than this share otherwise than the last two are not compared.");
    }
  };
  void reset(const Params& params) noexcept {
    *this = ImuNoise{};
    uneven_ = params.uneven;
    gyro_radps_.level.reset(params.gyro_radps);
    accel_mps2_.level.reset(params.accel_mps2);
  }
  void update(std::int64_t stamp_ns, const Vec3& gyro_radps, const Vec3& accel_mps2) noexcept {
    const double dt_s = seconds(stamp_ns - stamp_ns_);
    const bool even = stamp_ns_ >= 0 && std::abs(dt_s - dt_s_) < uneven_ * dt_s;
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
  struct Signal {
    Vec3 last = Vec3::Zero(), step = Vec3::Zero();
    NoiseLevel level;
    void take(const Vec3& value, bool even, double dt_s) noexcept {
      const Vec3 new_step = value - last;
      constexpr double kRows = 6.0 * 3.0;  // of a second difference, three axes: by its definition
      if (even) level.take((new_step - step).squaredNorm() / kRows, dt_s);
      step = new_step;
      last = value;
    }
  };
  Signal gyro_radps_, accel_mps2_;
  double uneven_ = 0.0;
  double dt_s_ = 0.0;
  std::int64_t stamp_ns_ = -1;
};

}  // namespace polygmap
