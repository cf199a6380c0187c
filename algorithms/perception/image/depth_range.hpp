// SPDX-License-Identifier: Apache-2.0
// Which raw depths count as measured.
#pragma once

#include <cstdint>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

// Nearer or farther is taken as not measured.
struct DepthLimits {
  double min_depth_m = 0.2;
  double max_depth_m = 4.0;

  static void visit(auto& p, auto& field) {
    field("min_depth_m", p.min_depth_m, 0.001, 5.0, "A nearer depth is no measurement.");
    field("max_depth_m", p.max_depth_m, 0.3, 20.0, "A farther depth is no measurement.");
    field.ordered("min_depth_m", "max_depth_m");
  }
};

// The same in raw units; pixels outside [min, max] count as not measured.
struct RawRange {
  std::uint16_t min = 1;
  std::uint16_t max = 65534;
  float per_metre = 1000.0F;  // raw units in a metre

  void set(const DepthLimits& limits, double depth_unit_m) noexcept {
    min = static_cast<std::uint16_t>(math::clamp(std::ceil(limits.min_depth_m / depth_unit_m), 1.0, 65534.0));
    max = static_cast<std::uint16_t>(math::clamp(std::floor(limits.max_depth_m / depth_unit_m), 1.0, 65534.0));
    per_metre = static_cast<float>(1.0 / depth_unit_m);
  }
  [[nodiscard]] bool valid(std::uint16_t raw) const noexcept { return raw >= min && raw <= max; }
};

}  // namespace polygmap
