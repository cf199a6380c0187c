// SPDX-License-Identifier: Apache-2.0
// What a world's seed draws, one after the other.
#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

#include "sim_stub/camera/counter_noise.hpp"

namespace polygmap::sim {

class Draw {
 public:
  // Another kind draws otherwise from the same seed.
  constexpr Draw(std::uint64_t seed, std::string_view kind) noexcept : noise_(seed, Stream::kWorld) {
    for (const char c : kind) next_ = mix64(next_ ^ static_cast<unsigned char>(c));
  }

  double from(double low, double high) noexcept { return noise_.uniform(next_++, low, high); }
  // To the millimetre or the degree, as people build.
  double length_m(double low_m, double high_m) noexcept { return 1e-3 * std::round(1e3 * from(low_m, high_m)); }
  double angle_deg(double low_deg, double high_deg) noexcept { return std::round(from(low_deg, high_deg)); }
  int whole(int low, int high) noexcept {
    return low + static_cast<int>(std::floor(from(0.0, static_cast<double>(high - low + 1))));
  }
  bool chance(double share) noexcept { return from(0.0, 1.0) < share; }
  double side() noexcept { return chance(0.5) ? 1.0 : -1.0; }

 private:
  CounterNoise noise_;
  std::uint64_t next_ = 0;
};

}  // namespace polygmap::sim
