// SPDX-License-Identifier: Apache-2.0
// What is measured of one foot relative to the base. Joint kinematics is one way to make it; a log's foot positions are
// another.
#pragma once

#include <optional>

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

// In base axes. Joint kinematics knows all of it; a point foot, or a log of positions, knows the position alone.
struct LegMeasurement {
  Transform base_T_sole;
  Vec3 base_v_sole_mps = Vec3::Zero();
  Vec3 base_w_sole_radps = Vec3::Zero();
  bool sole_known = true;  // its rotation and motion; without them the foot is one point
};

// Both legs at one moment.
struct LegSample {
  std::int64_t stamp_ns = 0;
  std::array<bool, kFootCount> measured{true, true};  // false: a drive of that leg has been silent for too long,
  std::int64_t silent_ns = 0;                         // the longest of them for this
  std::array<LegMeasurement, kFootCount> legs;
  std::array<double, kFootCount> foot_force_n{};        // 0 in the air, not a number where none is told
  std::array<double, kFootCount> foot_force_sigma_n{};  // 0 or no number: not known
  // Probability of contact, where somebody else has judged it: then forces do not count.
  std::optional<std::array<double, kFootCount>> stated_contact;
};

[[nodiscard]] LegMeasurement measure_leg(const LegFrames& frames, const LegVector& dq_radps) noexcept;

// Of the base, its own axes, as each leg has it whose sole rests; both legs' mean.
[[nodiscard]] Vec3 base_v_base_mps(const std::array<LegMeasurement, kFootCount>& legs) noexcept;

}  // namespace polygmap
