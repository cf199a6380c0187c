// SPDX-License-Identifier: Apache-2.0
// Eqs (1)-(4).
#include "tests/reference/base_filter/base_filter.hpp"

#include <gtest/gtest.h>

#include "algorithms/estimation/contact/leg_measurement.hpp"
#include "algorithms/geometry/so3.hpp"
#include "tests/support/measured_legs.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/synthetic_walk.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_s;
using test::SyntheticWalk;
using test::WalkSpec;
using test::WalkTruth;

ContactRows rows_of(const BaseFilter& filter, const WalkTruth& truth, const JointFeedback& joints,
                    const std::array<FootContact, kFootCount>& contacts,
                    const std::array<KnownHeight, kFootCount>& heights) {
  const LegGeometry geometry;
  return filter.make_rows(truth.true_T_base.R, Vec3::Zero(),
                          test::measured_legs(geometry, joints.q_rad, joints.dq_radps), contacts, {}, heights, kTick_s);
}

TEST(BaseFilter, Eq2Prediction_ConstantAcceleration_IsTheParabola) {
  AxisFilter axis;
  axis.initialise(AxisFilter::State::Zero(), AxisFilter::State::Constant(1e-6));
  for (int i = 0; i < 500; ++i) axis.predict(0.4, kTick_s, AxisFilter::State::Zero());
  EXPECT_NEAR(axis.velocity_mps(), 0.4, 1e-12);
  EXPECT_NEAR(axis.position_m(), 0.2, 1e-12);
  EXPECT_DOUBLE_EQ(axis.contact_m(3), 0.0);
  EXPECT_NEAR(axis.covariance()(0, 0), 2e-6, 1e-15);  // 1e-6 + (1 s)^2 1e-6
}

TEST(BaseFilter, Eq3Rows_PoseAndRates_AreContactsMinusBaseInOdomAxes) {
  BaseFilter filter;
  filter.reset({}, kSole);
  const Mat3 R = rotation_z(0.4) * rotation_y(0.1);
  LegMeasurement leg;
  leg.base_T_sole = {rotation_y(0.2), Vec3{0.1, 0.1, -0.7}};
  leg.base_v_sole_mps = {0.3, 0, 0.1};
  leg.base_w_sole_radps = {0, 0.5, 0};
  const Vec3 w{0.1, -0.2, 0.3};
  const ContactRows rows =
      filter.make_rows(R, w, {leg, leg}, {FootContact{1.0, 0.5}, FootContact{1.0, 0.5}}, {}, {}, kTick_s);
  for (std::size_t i = 0; i < kContactsPerFoot; ++i) {
    const Vec3 sole_p = sole_contacts_m()[i];
    EXPECT_LT((rows[i].odom_r_contact_m - R * (leg.base_T_sole * sole_p)).norm(), 1e-15);
    // The rate by differences: base turns with w, sole with its own rates.
    const double h = 1e-6;
    const auto at = [&](double t) -> Vec3 {
      const Transform sole{so3_exp(leg.base_w_sole_radps * t) * leg.base_T_sole.R,
                           leg.base_T_sole.p_m + leg.base_v_sole_mps * t};
      return R * so3_exp(w * t) * (sole * sole_p);
    };
    EXPECT_LT((rows[i].odom_dr_contact_mps - (at(h) - at(-h)) / (2 * h)).norm(), 1e-8);
    EXPECT_LT(rows[i].height_m2, 0.0);
  }
}

TEST(BaseFilter, Closure_LegsDisagreeAndTheWeightGoesOver_PoseGoesFromOneToTheOther) {
  WalkSpec spec;
  spec.noise_scale = 0.0;
  SyntheticWalk walk(spec);
  BaseFilter filter;
  filter.reset({}, kSole);
  const WalkTruth truth = walk.truth(0);
  const JointFeedback joints = walk.joints(0);
  filter.initialise(truth.true_T_base.p_m, Vec3::Zero(), rows_of(filter, truth, joints, {}, {}));
  const LegGeometry geometry;
  auto legs = test::measured_legs(geometry, joints.q_rad, joints.dq_radps);
  const auto run = [&](double left_share, int ticks) {
    double largest = 0.0;
    for (int i = 0; i < ticks; ++i) {
      const double before = filter.odom_p_base_m().x();
      const ContactRows rows =
          filter.make_rows(truth.true_T_base.R, Vec3::Zero(), legs,
                           {FootContact{1.0, left_share, true}, {1.0, 1.0 - left_share, true}}, {}, {}, kTick_s);
      filter.predict(Vec3::Zero(), kTick_s, rows);
      filter.correct(rows);
      largest = std::max(largest, std::abs(filter.odom_p_base_m().x() - before));
    }
    return largest;
  };
  run(1.0, 500);
  const double start_x = filter.odom_p_base_m().x();
  legs[1].base_T_sole.p_m.x() -= 0.006;  // the right leg now says the base stands 6 mm further ahead
  EXPECT_LT(run(1.0, 100), 1e-4);
  EXPECT_NEAR(filter.odom_p_base_m().x(), start_x, 5e-4);
  double largest = 0.0;
  for (int i = 0; i <= 200; ++i) largest = std::max(largest, run(1.0 - i / 200.0, 1));
  largest = std::max(largest, run(0.0, 50));
  EXPECT_NEAR(filter.odom_p_base_m().x() - start_x, 0.006, 1.5e-3);
  EXPECT_LT(largest, 2e-4);
}

TEST(BaseFilter, Eq4Heights_FloorTenMillimetresOff_PullsSlowlyAndNeverJumps) {
  BaseFilter filter;
  WalkSpec spec;
  spec.noise_scale = 0.0;
  SyntheticWalk walk(spec);
  filter.reset({}, kSole);
  const std::array<FootContact, kFootCount> standing{FootContact{1.0, 0.5, true}, FootContact{1.0, 0.5, true}};
  const std::array<KnownHeight, kFootCount> raised{KnownHeight{0.01, 0.003}, KnownHeight{0.01, 0.003}};
  const WalkTruth truth = walk.truth(0);
  const JointFeedback joints = walk.joints(0);
  filter.initialise(truth.true_T_base.p_m, Vec3::Zero(), rows_of(filter, truth, joints, {}, {}));
  const double start_z = filter.odom_p_base_m().z();
  double before = start_z;
  for (int i = 0; i < 5000; ++i) {
    const ContactRows rows = rows_of(filter, truth, joints, standing, raised);
    filter.predict(Vec3::Zero(), kTick_s, rows);
    filter.correct(rows);
    const double z = filter.odom_p_base_m().z();
    EXPECT_LT(std::abs(z - before), 5e-5);
    before = z;
  }
  EXPECT_GT(before - start_z, 0.002);
  EXPECT_LT(before - start_z, 0.0101);
  EXPECT_NEAR(filter.odom_p_base_m().x(), truth.true_T_base.p_m.x(), 1e-9);
}

}  // namespace
}  // namespace polygmap
