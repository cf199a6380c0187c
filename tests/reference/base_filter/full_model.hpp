// SPDX-License-Identifier: Apache-2.0
// Eqs (1)-(4) as printed, 30 states and 56 rows at once: what every full form of the filter starts from.
#pragma once

#include <Eigen/Core>
#include <bitset>

#include "tests/reference/base_filter/base_filter.hpp"

namespace polygmap::reference {

// States, eq. (1): base position, base velocity, eight contacts, three each. Rows, eq. (3): eight positions and eight
// velocities relative to the base, three each, eight heights.
inline constexpr int kFullStates = 30, kFullRows = 56;
using FullState = Eigen::Matrix<double, kFullStates, 1>;
using FullCovariance = Eigen::Matrix<double, kFullStates, kFullStates>;
using FullRow = Eigen::Matrix<double, 1, kFullStates>;
using FullObservation = Eigen::Matrix<double, kFullRows, kFullStates>;
using FullMeasurements = Eigen::Matrix<double, kFullRows, 1>;
using FullNoise = Eigen::Matrix<double, kFullRows, kFullRows>;

struct FullStep {
  FullCovariance Q;  // of eq. (2), this step
  FullMeasurements y;
  FullNoise R;
  std::bitset<kFullRows> known;  // a row that is not says nothing: its y and R do not count
};

[[nodiscard]] int contact_state(std::size_t contact) noexcept;
[[nodiscard]] FullCovariance transition(double dt_s) noexcept;                        // A of eq. (2)
[[nodiscard]] Eigen::Matrix<double, kFullStates, 3> input(double dt_s) noexcept;      // B of eq. (2)
[[nodiscard]] FullObservation observation() noexcept;                                 // of eq. (3)
[[nodiscard]] FullStep full_step(const Vec2& base_process, const ContactRows& rows);  // Q and R diagonal
// State and variances of the three axis filters, which have not run yet.
void take_over(const BaseFilter& axes, FullState& x, FullCovariance& P);

}  // namespace polygmap::reference
