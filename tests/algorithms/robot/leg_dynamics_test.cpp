// SPDX-License-Identifier: Apache-2.0
#include "algorithms/robot/leg_dynamics.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/bent_legs.hpp"

namespace polygmap {
namespace {

using test::bent_q_rad;
using test::links_m;

TEST(LegDynamics, CentreOfMassSpeed_IsItsDifference) {
  const JointVector q = bent_q_rad();
  for (int j = 0; j < 12; ++j) {
    const JointVector dq = 1e-6 * JointVector::Unit(j);
    const Vec3 difference = centre_of_mass_m({}, links_m(q + dq)) - centre_of_mass_m({}, links_m(q));
    EXPECT_LT((base_v_com_mps({}, body_frames({}, q), links_m(q), dq) - difference).norm(), 1e-11) << j;
  }
}

// Virtual work: torques hold the links' weights and the sole's wrench against any small motion of the joints.
TEST(LegDynamics, Torques_DoTheWorkOfWeightsAndGround) {
  const JointVector q = bent_q_rad();
  const MassModel masses;
  const Vec3 gravity{0.3, -0.2, -9.8};
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const SoleWrench ground{{20, -30, 250}, {5, -12, 3}};
    std::array<Vec3, kJointsPerLeg> specific;
    specific.fill(gravity);
    const LegVector torque = leg_torques_nm(masses, leg, body_frames({}, q)[index_of(leg)], specific, ground);
    const LegJacobian jacobian = leg_jacobian(body_frames({}, q)[index_of(leg)]);
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      const double step = 1e-6;
      JointVector moved = q;
      moved[static_cast<Eigen::Index>(joint_index(leg, j))] += step;
      const PerLink before = links_m(q), after = links_m(moved);
      double work = 0.0;
      for (std::size_t l = 0; l < kJointsPerLeg; ++l) {
        work += masses.leg[l].mass_kg * gravity.dot(after.leg[index_of(leg)][l] - before.leg[index_of(leg)][l]) / step;
      }
      const auto c = static_cast<Eigen::Index>(j);
      work += ground.force_n.dot(jacobian.col(c).head<3>()) + ground.moment_nm.dot(jacobian.col(c).tail<3>());
      EXPECT_NEAR(torque[c], -work, 1e-3) << j;
    }
  }
}

}  // namespace
}  // namespace polygmap
