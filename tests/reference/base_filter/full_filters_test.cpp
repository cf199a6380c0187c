// SPDX-License-Identifier: Apache-2.0
// The module's three axis filters against the paper's filter as printed, and that one against its sequential form.
#include "tests/reference/base_filter/full_filters.hpp"

#include <gtest/gtest.h>

#include "tests/support/slow_machine.hpp"
#include "tests/support/walk_rows.hpp"

namespace polygmap::reference {
namespace {

using test::WalkRows;
using test::WalkSpec;

constexpr double kTick_s = WalkRows::kTick_s;

WalkRows climb(std::uint32_t seed) {
  WalkSpec spec;
  spec.seed = seed;
  spec.steps = 15;
  spec.stand_s = 0.5;
  spec.yaw_per_step_rad = 0.05;
  return WalkRows(spec);
}

FullState state_of(const BaseFilter& axes) {
  FullState x;
  x << axes.odom_p_base_m(), axes.odom_v_base_mps(), FullState::Zero().tail<24>();
  for (std::size_t c = 0; c < kContactCount; ++c) x.segment<3>(contact_state(c)) = axes.odom_p_contact_m(c);
  return x;
}

FullCovariance covariance_of(const BaseFilter& axes) {
  FullCovariance P = FullCovariance::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < AxisFilter::kStates; ++i) {
      for (int j = 0; j < AxisFilter::kStates; ++j) {
        P(3 * i + axis, 3 * j + axis) = axes.axis(static_cast<std::size_t>(axis)).covariance()(i, j);
      }
    }
  }
  return P;
}

TEST(FullFilters, AxisFiltersAgainstDenseForm_OverAClimbOf20000Ticks_AreTheSameFilter) {
  WalkRows walk = climb(1);
  DenseFilter dense;
  double worst_m = 0.0, worst_P = 0.0, cross_P = 0.0;
  for (int i = 0; i < (test::kSlowMachine ? 1500 : 20000); ++i) {
    walk.next();
    if (i == 0) dense.initialise(walk.axes);
    const FullStep step = full_step(walk.axes.base_process(kTick_s), walk.rows);
    walk.axes.predict(walk.accel_mps2, kTick_s, walk.rows);
    walk.axes.correct(walk.rows);
    dense.predict(walk.accel_mps2, kTick_s, step);
    dense.correct(step);
    worst_m = std::max(worst_m, (state_of(walk.axes) - dense.state()).cwiseAbs().maxCoeff());
    const FullCovariance ours = covariance_of(walk.axes);
    worst_P = std::max(worst_P, (ours - dense.covariance()).cwiseAbs().maxCoeff());
    cross_P = std::max(cross_P, (ours.array() == 0.0).select(dense.covariance(), 0.0).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(worst_m, 1e-9);  // m and m/s; 2e-12
  EXPECT_LT(worst_P, 1e-9);
  EXPECT_LT(cross_P, 1e-15);  // why three filters of ten states are the same filter
}

// Errors as legs have them: what one leg's kinematics gets wrong is common to its four contacts and leans with the
// base, the accelerometer's error is that of its own axes, positions and velocities err together.
void couple(FullStep& step) {
  const Mat3 base = rotation_z(0.6) * rotation_y(0.2);
  const Mat3 accel = base * Vec3(1.0, 0.3, 2.0).asDiagonal() * base.transpose();
  Eigen::Matrix<double, 6, 6> base_q;
  base_q << 2.0 * step.Q(0, 0) * accel, std::sqrt(step.Q(0, 0) * step.Q(3, 3)) * accel,
      std::sqrt(step.Q(0, 0) * step.Q(3, 3)) * accel, step.Q(3, 3) * accel;
  step.Q.topLeftCorner<6, 6>() = base_q;
  for (int a = 0; a < kFullRows; ++a) {
    for (int b = 0; b < a; ++b) {
      const bool heights = a >= 48 || b >= 48;
      const int contact_a = a % 24 / 3, contact_b = b % 24 / 3;
      const bool same_foot = contact_a / 4 == contact_b / 4;
      const double correlation = heights || !same_foot ? (a >= 48 && b >= 48 ? 0.2 : 0.0) : a % 3 == b % 3 ? 0.4 : 0.1;
      step.R(a, b) = step.R(b, a) = correlation * std::sqrt(std::abs(step.R(a, a) * step.R(b, b)));
    }
  }
}

TEST(FullFilters, SequentialAgainstDenseForm_CoupledNoise_AreTheSameFilterAndNotTheAxisFilters) {
  WalkRows walk = climb(2);
  DenseFilter dense;
  SequentialFilter sequential;
  double worst_m = 0.0, worst_P = 0.0, cross_P = 0.0, from_axes_m = 0.0;
  for (int i = 0; i < (test::kSlowMachine ? 1000 : 4000); ++i) {
    walk.next();
    if (i == 0) {
      dense.initialise(walk.axes);
      sequential.initialise(walk.axes);
    }
    FullStep step = full_step(walk.axes.base_process(kTick_s), walk.rows);
    couple(step);
    ASSERT_FALSE(step.R.isDiagonal(0.0));
    walk.axes.predict(walk.accel_mps2, kTick_s, walk.rows);
    walk.axes.correct(walk.rows);
    dense.predict(walk.accel_mps2, kTick_s, step);
    dense.correct(step);
    sequential.predict(walk.accel_mps2, kTick_s, step);
    sequential.correct(step);
    worst_m = std::max(worst_m, (sequential.state() - dense.state()).cwiseAbs().maxCoeff());
    worst_P = std::max(worst_P, (sequential.covariance() - dense.covariance()).cwiseAbs().maxCoeff());
    cross_P = std::max(cross_P, std::abs(dense.covariance()(0, 1)));
    from_axes_m = std::max(from_axes_m, (state_of(walk.axes) - dense.state()).head<3>().norm());
  }
  EXPECT_LT(worst_m, 1e-9);  // 2e-12
  EXPECT_LT(worst_P, 1e-9);
  EXPECT_GT(cross_P, 1e-10);     // the axes are coupled
  EXPECT_GT(from_axes_m, 1e-5);  // and axis filters are another filter there: 0.5 mm off
}

TEST(FullFilters, EveryForm_DiagonalNoise_SameState) {
  WalkRows walk = climb(3);
  DenseFilter dense;
  SequentialFilter sequential;
  DynamicFilter dynamic;
  double sequential_m = 0.0, dynamic_m = 0.0;
  for (int i = 0; i < (test::kSlowMachine ? 300 : 2000); ++i) {
    walk.next();
    for (ContactRow& row : walk.rows) row.height_m2 = 1e-4;  // the dynamic form wants every row
    if (i == 0) {
      dense.initialise(walk.axes);
      sequential.initialise(walk.axes);
      dynamic.initialise(walk.axes);
    }
    const FullStep step = full_step(walk.axes.base_process(kTick_s), walk.rows);
    const auto run = [&](auto& filter) {
      filter.predict(walk.accel_mps2, kTick_s, step);
      filter.correct(step);
    };
    run(dense);
    run(sequential);
    run(dynamic);
    sequential_m = std::max(sequential_m, (sequential.state() - dense.state()).cwiseAbs().maxCoeff());
    dynamic_m = std::max(dynamic_m, (FullState(dynamic.state()) - dense.state()).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(sequential_m, 1e-9);
  EXPECT_LT(dynamic_m, 1e-7);  // 2e-9: without Joseph's form digits are lost
}

}  // namespace
}  // namespace polygmap::reference
