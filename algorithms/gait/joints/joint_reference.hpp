// SPDX-License-Identifier: Apache-2.0
// From poses of base and soles to what the drives are told: leg kinematics, the drives' limits, their lag.
#pragma once

#include <array>

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

class JointReference {
 public:
  struct Params {
    double swing_gain = 2.0;
    double encoder_offset_rad = 0.02;
    double blind_ramp_s = 0.1;
    std::int64_t damping_age_ns = 6 * kNsPerMs;

    static void visit(auto& p, auto& field) {
      field("swing_gain", p.swing_gain, 0.1, 10.0,
            "The drives' gains are this many times as large in the leg that swings.");
      field("encoder_offset_rad", p.encoder_offset_rad, 0.0, 0.2,
            "A joint measured farther outside its range at the start is refused: an encoder is off by less.");
      field("blind_ramp_s", p.blind_ramp_s, 0.002, 2.0,
            "In this time a standing leg becomes as stiff as it is while nobody balances, and back.");
      field("damping_age_ns", p.damping_age_ns, 0, 100'000'000,
            "Older speeds damp no joint: held for longer than some cycles they push where nothing moves any more.");
    }
  };

  // Joints whose angle is not finite or farther outside its range than an encoder may be off.
  [[nodiscard]] static JointSet out_of_range(const RobotModel& robot, const Params& params,
                                             const JointVector& q_rad) noexcept;
  // Starts from measured angles, moved into the joints' ranges. False, and nothing changes, when one is out of range.
  // robot: outlives this.
  [[nodiscard]] bool try_arm(const RobotModel& robot, const Params& params, const JointVector& q_rad) noexcept;
  // True when a leg could not do what was asked: out of reach, range or speed, or not a number, upon which the leg
  // stays. The command never leaves the limits.
  bool follow(const std::array<Transform, kFootCount>& base_T_sole, const std::array<bool, kFootCount>& stands,
              JointCommand& command) noexcept;
  // Of a leg in the air whose knee is mute, or (leg_impaired) was: the sole on its line from the hip, as far away as
  // the knee keeps it.
  void fit_mute_knees(const JointFeedback& feedback, const std::array<bool, kFootCount>& stands, bool leg_impaired,
                      std::array<Transform, kFootCount>& base_T_sole) noexcept;
  // The damping that the drives' commands have no room for, as torques: without it a swinging leg's joints are some
  // milliradians beside their path when the foot lands. stands: as follow() was given it. Speeds older than
  // `damping_age_ns`, or of a drive that missed a cycle, damp nothing, and a drive with room for all of its damping
  // gets no such torque.
  void add_damping(const std::array<bool, kFootCount>& stands, const JointFeedback& feedback,
                   const JointCommand& command, JointVector& torque_nm) const noexcept;
  // Stiffens the standing legs of commands that nobody balances, as far as their drives allow, and lets go of it
  // afterwards: over `blind_ramp_s`, since joints are not where they are commanded. Once in a tick. stands: as follow()
  // was given it.
  void stiffen_blind(bool blind, const std::array<bool, kFootCount>& stands, JointCommand& command) noexcept;
  // Repeats the last joint angles, at rest.
  void hold(JointCommand& command) const noexcept;
  [[nodiscard]] const JointVector& reference_rad() const noexcept { return reference_rad_; }
  // Where the reference puts the soles.
  [[nodiscard]] Transform base_T_sole_reference(Foot leg) const noexcept;

 private:
  // Times as stiff and damped as standing.
  [[nodiscard]] double gain_of(Foot leg, const std::array<bool, kFootCount>& stands) const noexcept {
    return stands[index_of(leg)] ? 1.0 : params_.swing_gain;
  }

  const RobotModel* robot_ = nullptr;
  Params params_;
  JointVector reference_rad_ = JointVector::Zero();
  JointVector commanded_rad_ = JointVector::Zero();  // with the lead for the drives' delay
  std::array<bool, kFootCount> knee_was_mute_{};
  double blind_share_ = 0.0;  // of the way to kp_blind_nmprad
};

}  // namespace polygmap
