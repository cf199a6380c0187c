// SPDX-License-Identifier: Apache-2.0
// Vertical foot forces from joint torques. Each joint's friction and armature are learnt while its leg hangs.
//
// A momentum observer of each leg, hung on a base whose motion the IMU feels: what the drives give, less what it takes
// to carry and accelerate the links and the rotors and to overcome friction, is what the ground gives. Torques and
// momenta pass the same low-pass, so that nothing is differentiated. Source: De Luca and Mattone, "Sensorless robot
// collision detection and hybrid force/motion control", ICRA 2005; links as points, lever arms as they are now.
#pragma once

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/robot/leg_dynamics.hpp"

namespace polygmap {

class GroundForceObserver {
 public:
  struct Params {
    double smoothing_s = 0.008;
    double friction_nm = 1.0;
    double most_friction_nm = 5.0;
    double friction_s = 0.5;
    double creep_radps = 0.05;
    double armature_s = 0.3;  // this and what follows for armatures: chosen by hand, tried in the simulation alone
    double brisk_radps2 = 10.0;
    double more_armature_kgm2 = 0.25;
    double damping_m = 0.02;

    static void visit(auto& p, auto& field) {
      field("smoothing_s", p.smoothing_s, 0.0005, 0.1, "Time constant of the observed forces.");
      field("friction_nm", p.friction_nm, 0.0, 50.0,
            "Coulomb friction of a joint, which a drive's torque holds, until it is learnt.");
      field("most_friction_nm", p.most_friction_nm, 0.0, 50.0, "A joint's friction is learnt up to this.");
      field.ordered("friction_nm", "most_friction_nm");
      field("friction_s", p.friction_s, 0.01, 60.0,
            "Time of a leg's motion in the air that its friction is learnt in.");
      field("creep_radps", p.creep_radps, 0.001, 1.0, "The friction of a joint that turns more slowly is less.");
      field("armature_s", p.armature_s, 0.01, 60.0,
            "Time of brisk motion in the air that the armature of a drive is learnt in.");
      field("brisk_radps2", p.brisk_radps2, 0.1, 1000.0,
            "Accelerations well above this tell of the armature, those below hardly.");
      field("more_armature_kgm2", p.more_armature_kgm2, 0.0, 5.0,
            "An armature is learnt up to so much more than what the robot's file says.");
      field("damping_m", p.damping_m, 0.001, 0.2,
            "Damping of the inverse against a stretched knee: 0.02 takes 1 to 4 % of the force.");
    }
  };
  void reset(const Params& params) noexcept;
  // frames: of the joints. hangs: a leg does for certain, and its friction is learnt. base: what the IMU feels, base
  // axes; base_up: the vertical there. Forces in N, upwards on the foot; what friction and masses leave over has either
  // sign.
  [[nodiscard]] std::array<double, kFootCount> update(const RobotModel& robot, const BodyFrames& frames,
                                                      const JointFeedback& joints, const ImuSample& base,
                                                      const Vec3& base_up,
                                                      const std::array<bool, kFootCount>& hangs) noexcept;
  [[nodiscard]] const LegVector& friction_nm(Foot leg) const noexcept { return legs_[index_of(leg)].friction_nm; }
  [[nodiscard]] const LegVector& armature_kgm2(Foot leg) const noexcept { return legs_[index_of(leg)].armature_kgm2; }

 private:
  // Low-passed, of one leg.
  struct Leg {
    LegVector drive_nm = LegVector::Zero();
    LegVector dq_radps = LegVector::Zero();
    LegVector way = LegVector::Zero();          // in which a joint turns, -1 to 1
    LegVector friction_nm = LegVector::Zero();  // Coulomb's, not low-passed
    LegVector armature_kgm2 = LegVector::Zero();
    std::array<Vec3, kJointsPerLeg> link_mps{};  // relative to the base's origin, base axes
  };

  Params params_;
  std::array<Leg, kFootCount> legs_;
  Vec3 felt_mps2_ = Vec3::Zero();
  std::int64_t stamp_ns_ = -1;
};

}  // namespace polygmap
