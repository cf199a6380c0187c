// SPDX-License-Identifier: Apache-2.0
// Whether the IMU is mounted as its data sheet says. Of a robot that stands still three things tell where up is: the
// gravity that the IMU feels, the soles, and where the ground presses under the centre of mass. Where two agree and the
// third does not, the third is off: the IMU's mount, the floor, which slopes, or the masses, with a load nobody told
// of. Each is mostly about right and sometimes not at all, so each has two Gaussians; the turn of the IMU is its mean
// over what these make of the three together. An IMU that is within its data sheet is left alone.
#pragma once

#include "algorithms/estimation/calibration/standing_vertical.hpp"

namespace polygmap {

class ImuMount {
 public:
  // Of an error that is mostly one of usual_rad, and with that chance one of off_rad. One sigma about each axis.
  struct Prior {
    double usual_rad = 0.0;
    double off_rad = 0.0;
    double off_chance = 0.0;

    static void visit(auto& p, auto& field) {
      field("usual_rad", p.usual_rad, 1e-4, 0.2, "Its error mostly, about each axis.");
      field("off_rad", p.off_rad, 1e-4, 0.5, "Its error where something is off.");
      field("off_chance", p.off_chance, 0.0, 0.9, "How often something is.");
      field.ordered("usual_rad", "off_rad");
    }
  };
  struct Params {
    // The mount's 3.5 mrad and the accelerometer's bias, 5.1 mrad; a bracket that is bent or was set by eye.
    Prior imu{0.0062, 0.025, 0.2};
    // Encoders, 2.5 mrad, on a floor that is level to 3 mrad; a floor that slopes by a degree.
    Prior soles{0.004, 0.02, 0.2};
    // 10 mm of the centre of mass over 0.85 m; a load of some kilograms that is held ahead or aside.
    Prior statics{0.012, 0.03, 0.1};
    double most_rad = 0.08;
    double told_rad = 0.01;
    StandingVerticalParams standing;

    static void visit(auto& p, auto& field) {
      field("imu", p.imu);
      field("soles", p.soles);
      field("statics", p.statics);
      field("most_rad", p.most_rad, 0.0, 0.5, "The IMU is turned by no more; 0: never.");
      field("told_rad", p.told_rad, 0.0, 0.5, "`imu_turned` is raised where it is turned by more.");
      field("standing", p.standing);
    }
  };
  // Turns that bring gravity as it is felt onto another vertical, about the base's x and y.
  struct Turns {
    Vec2 soles_rad = Vec2::Zero();
    Vec2 statics_rad = Vec2::Zero();
  };

  void reset(const Params& params) noexcept;
  // What was averaged was another place.
  void forget() noexcept;
  // A tick at rest. base_accel_mps2: felt, as the mount is configured. joints: LegSensing's.
  void add(const Vec3& base_accel_mps2, const JointFeedback& joints) noexcept;
  // By which the IMU's samples are to be turned, base axes: the mean of what is likely, about 0 for an IMU as in its
  // data sheet. Error: half of the turn where floor and masses are off alike.
  [[nodiscard]] static Vec2 turn_rad(const Params& params, const Turns& turns) noexcept;
  // The same by the means of what was added, no more than most_rad; identity where statics are not told.
  [[nodiscard]] Mat3 base_R_felt(const RobotModel& robot) const noexcept;

 private:
  // By the means of what was added. False, and nothing changes, where statics are not told.
  [[nodiscard]] bool try_turns(const RobotModel& robot, Turns& turns) const noexcept;

  Params params_;
  double samples_ = 0.0;
  Vec3 accel_mps2_ = Vec3::Zero();  // sums
  JointVector q_rad_ = JointVector::Zero(), tau_nm_ = JointVector::Zero();
  std::array<double, kFootCount> foot_force_n_{};
};

}  // namespace polygmap
