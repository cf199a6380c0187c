// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/quality/covariance_scale.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_s;
using Covariance = CovarianceScale::Covariance;
constexpr double kUsual = 0.2;

// Numbers of the tests' own; position and velocity without what is added to them.
CovarianceScale::Params round_numbers() {
  CovarianceScale::Params params;
  params.usual_ratio = kUsual;
  params.fall_s = 0.06;
  params.least = 0.3;
  params.position_share = 0.4;
  params.coupling_s = 0.0;
  params.jerk_times = 2.0;
  params.jerk_floor_mpsrs = 0.01;
  params.least_position_m = 0.0;
  params.least_velocity_mps = 0.0;
  return params;
}

// Sigmas of 10 mm, 20 mm/s and 3 mrad.
Covariance filters(double position_m2 = 1e-4) {
  Covariance P = Covariance::Zero();
  P.diagonal().head<3>().setConstant(position_m2);
  P.diagonal().segment<3>(3).setConstant(4e-4);
  P.diagonal().tail<3>().setConstant(9e-6);
  return P;
}

class CovarianceScaleTest : public testing::Test {
 protected:
  CovarianceScaleTest() { scale_.reset(params_); }
  void feed(double innovation_ratio, double for_s, const Vec3& accel_step_mps2 = Vec3::Zero()) {
    const int ticks = static_cast<int>(for_s / kTick_s + 0.5);
    for (int i = 0; i < ticks; ++i) scale_.update(innovation_ratio, accel_step_mps2, kTick_s);
  }
  // Of its variance, as a multiple of the filter's.
  double velocity_times() { return scale_.published(filters())(4, 4) / 4e-4; }
  double position_m2(double filters_m2) { return scale_.published(filters(filters_m2))(1, 1); }
  CovarianceScale::Params params_ = round_numbers();
  CovarianceScale scale_;
};

TEST_F(CovarianceScaleTest, LargerInnovations_PublishedVelocityIsLargerAndAttitudeTheFilters) {
  feed(kUsual, 20.0);
  EXPECT_NEAR(velocity_times(), 1.0, 1e-6);
  feed(4.0 * kUsual, 20.0);
  EXPECT_NEAR(velocity_times(), 4.0, 1e-6);
  EXPECT_EQ(scale_.published(filters())(7, 7), 9e-6);
}

TEST_F(CovarianceScaleTest, Innovations_CountAtOnceAndFadeAway) {
  feed(kUsual, 20.0);
  scale_.update(3.0 * kUsual, Vec3::Zero(), kTick_s);
  EXPECT_NEAR(velocity_times(), 3.0, 1e-6);
  scale_.update(kUsual, Vec3::Zero(), 0.06);
  EXPECT_NEAR(velocity_times(), 2.0, 1e-6);  // half of the way
}

TEST_F(CovarianceScaleTest, FeetThatAgreeTooWell_ScaleIsNoLessThanTheLeast) {
  feed(0.0, 20.0);
  EXPECT_NEAR(velocity_times(), 0.3, 1e-12);
  EXPECT_NEAR(scale_.growth_share(), 0.4 * 0.3, 1e-12);
}

TEST_F(CovarianceScaleTest, NoFootStands_ScaleStays) {
  feed(4.0 * kUsual, 0.2);
  const double times = velocity_times();
  EXPECT_GT(times, 3.5);
  feed(-1.0, 5.0);
  EXPECT_EQ(velocity_times(), times);
}

TEST_F(CovarianceScaleTest, FiltersPositionGrows_ThePublishedOneGrowsByItsShare) {
  feed(kUsual, 20.0);
  EXPECT_NEAR(scale_.growth_share(), 0.4, 1e-6);
  EXPECT_NEAR(position_m2(1e-4), 1e-4, 1e-12);
  EXPECT_NEAR(position_m2(2e-4), 1.4e-4, 1e-10);
  EXPECT_NEAR(position_m2(6e-4), 3e-4, 1e-10);
  feed(4.0 * kUsual, 20.0);  // what has grown stays as it is, what grows from now on counts four times as much
  EXPECT_NEAR(position_m2(6e-4), 3e-4, 1e-10);
  EXPECT_NEAR(position_m2(7e-4), 4.6e-4, 1e-10);
}

TEST_F(CovarianceScaleTest, FiltersPositionShrinks_ThePublishedOneShrinksInProportion) {
  feed(kUsual, 20.0);
  position_m2(2e-4);
  EXPECT_NEAR(position_m2(6e-4), 3.6e-4, 1e-10);
  EXPECT_NEAR(position_m2(3e-4), 1.8e-4, 1e-10);
  EXPECT_NEAR(position_m2(4e-4), 2.2e-4, 1e-10);
}

TEST_F(CovarianceScaleTest, AxesOfThePosition_KeepTheirProportionsAndCorrelations) {
  feed(kUsual, 20.0);
  Covariance filter = filters();
  ASSERT_EQ(scale_.published(filter)(0, 0), 1e-4);
  filter.diagonal().head<3>() += Vec3(3e-4, 0.0, 3e-4);
  filter(0, 4) = filter(4, 0) = 1e-4;
  const Covariance P = scale_.published(filter);
  EXPECT_NEAR(P(0, 0), 4e-4 * 5.4 / 9.0, 1e-10);  // of 3e-4 m^2 in all, to 5.4e-4 where the filter's are 9e-4
  EXPECT_NEAR(P(1, 1), 1e-4 * 5.4 / 9.0, 1e-10);
  EXPECT_NEAR(P(0, 4), 1e-4 * std::sqrt(5.4 / 9.0), 1e-10);
}

TEST_F(CovarianceScaleTest, VelocitysErrors_MoveThePosition) {
  params_.coupling_s = 0.05;
  scale_.reset(params_);
  feed(4.0 * kUsual, 20.0);
  EXPECT_NEAR(position_m2(1e-4), 1e-4 + 0.0025 * 4.0 * 4e-4, 1e-10);
}

TEST_F(CovarianceScaleTest, LeastSigmas_AreLeftWhereTheFilterKnowsAll) {
  params_.least_position_m = 1e-3;
  params_.least_velocity_mps = 2e-3;
  scale_.reset(params_);
  feed(kUsual, 1.0);
  const Covariance P = scale_.published(Covariance::Zero());
  EXPECT_NEAR(P(2, 2), 1e-6, 1e-12);
  EXPECT_NEAR(P(5, 5), 4e-6, 1e-12);
  EXPECT_EQ(P(8, 8), 0.0);
}

TEST_F(CovarianceScaleTest, VibratingAccelerometer_AddsToTheVelocityBeyondItsNoise) {
  feed(kUsual, 20.0, {0.2, 0.0, 0.0});  // 0.4 mm/s a tick: 5e-8 m^2/s^2 an axis, of a floor of 4e-7
  EXPECT_NEAR(velocity_times(), 1.0, 1e-6);
  feed(kUsual, 2.0, {0.0, 3.0, 0.0});  // 6 mm/s a tick: 1.2e-5 m^2/s^2 an axis
  EXPECT_NEAR(scale_.published(filters())(3, 3), 4e-4 + 4.0 * (1.2e-5 - 4e-7), 1e-9);
  EXPECT_NEAR(position_m2(1e-4), 1e-4, 1e-12);
  feed(kUsual, 2.0);
  EXPECT_NEAR(velocity_times(), 1.0, 1e-6);  // it ceases
}

TEST_F(CovarianceScaleTest, AnyCovarianceOfAFilter_StaysSymmetricAndPositive) {
  scale_.reset({});  // what the module has, all that is added included
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 500; ++i) {
    Eigen::Matrix<double, 9, 6> A;  // of less than full rank: nothing is to spare
    const double size = 0.1 * std::exp(normal(random));
    for (int j = 0; j < 6; ++j) {
      for (int k = 0; k < 9; ++k) A(k, j) = size * normal(random);
    }
    Covariance filter = A.lazyProduct(A.transpose());
    filter = (0.5 * (filter + filter.transpose())).eval();
    const double innovation_ratio = i % 7 == 0 ? -1.0 : kUsual * std::exp(2.0 * normal(random));
    scale_.update(innovation_ratio, {normal(random), normal(random), normal(random)}, kTick_s);
    const Covariance P = scale_.published(filter);
    ASSERT_EQ(P, P.transpose()) << i;
    const Eigen::SelfAdjointEigenSolver<Covariance> solver(P, Eigen::EigenvaluesOnly);
    ASSERT_GT(solver.eigenvalues().minCoeff(), -1e-14 * P.trace()) << i;
    ASSERT_GT(P.diagonal().minCoeff(), 0.0) << i;
  }
}

}  // namespace
}  // namespace polygmap
