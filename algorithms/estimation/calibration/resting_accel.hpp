// SPDX-License-Identifier: Apache-2.0
// What the accelerometer feels of a robot that another controller still holds at rest: the mean of a tenth of a second
// has a seventh of a single sample's noise. A balance that begins with a tilt off by some hundredths pushes the robot
// aside with its first commands.
#pragma once

#include <algorithm>
#include <cstdint>

#include "algorithms/core/math/math.hpp"
#include "algorithms/core/time.hpp"

namespace polygmap {

class RestingAccel {
 public:
  // time_ns: it is the mean of about so long; 0: the last sample.
  void reset(std::int64_t time_ns) noexcept {
    *this = {};
    time_ns_ = time_ns;
  }
  // In base axes, stamps increase.
  void add(std::int64_t stamp_ns, const Vec3& base_accel_mps2) noexcept {
    const std::int64_t step_ns = stamp_ns - newest_ns_;
    if (samples_ == 0 || step_ns >= time_ns_) {  // what was felt before a silence is too old
      reset(time_ns_);
      first_ns_ = stamp_ns;
    }
    samples_ = std::min(samples_ + 1, 1'000'000);  // it may listen for weeks
    newest_ns_ = stamp_ns;
    const double evenly = 1.0 / samples_;
    const double share = samples_ == 1 ? 1.0 : static_cast<double>(step_ns) / static_cast<double>(time_ns_);
    mean_mps2_ += std::max(evenly, share) * (base_accel_mps2 - mean_mps2_);
  }
  // It has been heard for as long as it averages over.
  [[nodiscard]] bool is_settled() const noexcept { return samples_ > 0 && newest_ns_ - first_ns_ >= time_ns_; }
  [[nodiscard]] const Vec3& mean_mps2() const noexcept { return mean_mps2_; }

 private:
  std::int64_t time_ns_ = 0;
  std::int64_t first_ns_ = 0;
  std::int64_t newest_ns_ = 0;
  std::int32_t samples_ = 0;
  Vec3 mean_mps2_ = Vec3::Zero();
};

}  // namespace polygmap
