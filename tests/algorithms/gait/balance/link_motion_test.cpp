// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/link_motion.hpp"

#include <gtest/gtest.h>

#include "algorithms/core/time.hpp"
#include "tests/support/bent_legs.hpp"

namespace polygmap {
namespace {

using test::bent_q_rad;
using test::links_m;

TEST(LinkMotion, EvenAcceleration_IsFoundAndForgottenAtARestart) {
  LinkMotion motion;
  const Vec3 a{1.0, -2.0, 0.5};
  LinkMotion::Acceleration found;
  for (int tick = 0; tick < 5; ++tick) {
    const double t = tick * kTick_s;
    found = motion.update({Mat3::Identity(), 0.5 * t * t * a}, links_m(bent_q_rad()), bent_q_rad());
    EXPECT_EQ(found.plan_mps2.torso.norm() > 0.0, tick >= 2);
  }
  EXPECT_LT((found.plan_mps2.torso - a).norm(), 1e-6);
  EXPECT_LT((found.plan_mps2.leg[1][kKnee] - a).norm(), 1e-6);
  // A body that moves as one does not turn.
  EXPECT_LT(angular_momentum_rate_nm({}, links_m(bent_q_rad()), found.plan_mps2).norm(), 1e-5);
  motion.restart();
  EXPECT_EQ(motion.update({}, links_m(bent_q_rad()), bent_q_rad()).plan_mps2.torso.norm(), 0.0);
}

TEST(LinkMotion, SwingingFoot_TurnsTheBody) {
  PerLink p = links_m(JointVector::Zero()), a;
  a.leg[0][kAnkleRoll] = {10.0, 0, 0};  // forward, far below the centre of mass
  const MassModel masses;
  const double lever_m = p.leg[0][kAnkleRoll].z() - centre_of_mass_m(masses, p).z();
  EXPECT_NEAR(angular_momentum_rate_nm(masses, p, a).y(), masses.leg[kAnkleRoll].mass_kg * 10.0 * lever_m, 1e-9);
}

}  // namespace
}  // namespace polygmap
