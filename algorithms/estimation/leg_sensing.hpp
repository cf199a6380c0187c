// SPDX-License-Identifier: Apache-2.0
// From joint feedback to legs in the base frame: what is no joint's angle is left out, encoder offsets are taken off,
// and what presses on the feet is told from torques and force sensors.
#pragma once

#include "algorithms/estimation/calibration/encoder_offsets.hpp"
#include "algorithms/estimation/contact/foot_forces.hpp"
#include "algorithms/estimation/contact/leg_measurement.hpp"
#include "algorithms/estimation/joint_speeds.hpp"

namespace polygmap {

class LegSensing {
 public:
  struct Params {
    EncoderOffsets::Params encoders;
    FootForces::Params forces;
    JointSpeeds::Params speeds;
    double max_torque_nm = 1000.0;
    double max_joint_rad = 4.0;
    double max_joint_speed_radps = 15.0;
    double joint_slack_rad = 0.01;
    double max_force_n = 5000.0;
    double level_n = 60.0;

    static void visit(auto& p, auto& field) {
      field("encoders", p.encoders);
      field("forces", p.forces);
      field("speeds", p.speeds);
      field("max_torque_nm", p.max_torque_nm, 1.0, 100000.0, "A joint sample of a higher torque is invalid.");
      field("max_joint_rad", p.max_joint_rad, 1.0, 100.0, "A joint sample of a larger angle is invalid.");
      field("max_joint_speed_radps", p.max_joint_speed_radps, 0.1, 1000.0,
            "A faster joint sample is invalid, also against the last one: a single wrong angle is not a motion.");
      field("joint_slack_rad", p.joint_slack_rad, 0.0, 1.0,
            "An encoder may jump by this besides what the joint's speed allows.");
      field("max_force_n", p.max_force_n, 100.0, 1e6, "A foot that presses harder makes the sample invalid.");
      field("level_n", p.level_n, 1.0, 5000.0,
            "The sole of a foot that presses harder is level: that tells the angle of a silent drive of its leg.");
    }
  };
  struct Counters {
    std::uint32_t invalid = 0;  // not finite or out of range
    std::uint32_t stale = 0;    // no newer stamp than the last
    std::uint32_t future = 0;   // stamped later than may be
    std::uint32_t jump = 0;     // moved faster than a joint can
  };

  // robot: outlives this object.
  void reset(const Params& params, const RobotModel& robot) noexcept;
  // False, and the sample counted, when it is bad, stale or stamped after latest_ns. base: what the IMU feels, base
  // axes, and base_up there, as well as they are known. stands: which feet do as far as is known, for those whose force
  // is not told.
  [[nodiscard]] bool try_take(const JointFeedback& joints, std::int64_t latest_ns, const ImuSample& base,
                              const Vec3& base_up, const std::array<bool, kFootCount>& stands) noexcept;
  // Of the last accepted feedback.
  [[nodiscard]] LegSample legs() const noexcept;
  // The encoders' offsets learn from the last accepted feedback. longest_s: it stands for no more time than this.
  void learn_offsets(const std::array<LegMeasurement, kFootCount>& legs,
                     const std::array<FootContact, kFootCount>& contacts, double longest_s) noexcept;
  void forget_offsets() noexcept { encoders_.learn_anew(); }

  // The last accepted feedback, its angles without offset_rad(), its speeds smooth, its torques as the legs need them
  // (over torque_scale()), its forces those of FootForces; any() is false before the first.
  [[nodiscard]] const JointFeedback& joints() const noexcept { return joints_; }
  [[nodiscard]] bool any() const noexcept { return any_; }
  [[nodiscard]] const JointVector& offset_rad() const noexcept { return encoders_.offset_rad(); }
  [[nodiscard]] double torque_scale() const noexcept { return forces_.torque_scale(); }
  // A command in angles and torques of joints(), to what the drives' encoders will read and their motors take. No drive
  // beyond its corner is asked for more torque, stiffness and damping included, than it has at its joint's speed: as
  // told by joints(), carried on to when the command is taken.
  void to_drives(JointCommand& command) const noexcept;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] bool is_valid(const JointFeedback& joints) const noexcept;
  [[nodiscard]] bool is_mute(std::size_t joint) const noexcept { return joints_.is_mute(joint); }
  void level_soles(const Vec3& base_up, const std::array<bool, kFootCount>& stands,
                   JointFeedback& joints) const noexcept;
  [[nodiscard]] bool jumps(const JointFeedback& carried) const noexcept;

  Params params_;
  const RobotModel* robot_ = nullptr;
  Counters counters_;
  EncoderOffsets encoders_;
  FootForces forces_;
  JointSpeeds speeds_;
  JointFeedback joints_;                                // last accepted
  BodyFrames frames_;                                   // of it
  std::int64_t felt_ns_ = 0;                            // when both feet's forces were told last
  double dt_s_ = 0.0;                                   // between it and the one before
  std::array<std::int64_t, kJointCount> replied_ns_{};  // last reply of each joint that was accepted
  bool any_ = false;
};

}  // namespace polygmap
