// SPDX-License-Identifier: Apache-2.0
// The robot without dynamics: 12 joints that follow their commands, and a base that stands on the feet that touch. The
// ankles of these give way to what stands flat: where two legs disagree about the base's attitude, the encoders say so.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "algorithms/robot/leg_dynamics.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "sim_stub/plant/plant.hpp"
#include "sim_stub/sensors/robot_errors.hpp"
#include "sim_stub/world/clearance.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

inline constexpr double kRobotWeight_n = 540.0;

class KinematicPlant final : public Plant {
 public:
  struct Params {
    double drive_lag_s = 0.010;
    // Of the critically damped load transfer: 0.1 s to move nine tenths. Twice as slow, half of the weight was still on
    // a foot that lifts when the zero-moment point has been over the other one for 30 ms.
    double share_bandwidth_radps = 40.0;
    double lift_height_m = 0.002;         // a sole this far above its anchor has left it
    double lift_share = 0.1;              // unless it carries more than this
    double loaded_lift_height_m = 0.010;  // raised this far it is off in any case,
    double loaded_lift_share = 0.3;       // and a fall when it carried more than this
    double touch_depth_m = 0.002;         // a corner deeper than this (or two ticks of travel) came from the side
    double collision_depth_m = 0.005;
    double limit_tolerance_rad = 1e-3;
    double max_closure_m = 0.06;  // both legs loaded and this far apart: a foot slips
    double min_base_height_m = 0.3;
  };

  // Stands with the middle of the soles below true_T_start (x, y and yaw are used) and the drives at q_rad.
  KinematicPlant(const Params& params, const StairWorld& world, const RobotErrors& errors,
                 const Transform& true_T_start, const JointVector& q_rad);

  // One tick towards the angles of the command, its rates known ahead: no lag on a ramp. Nothing else of it counts;
  // nothing moves any more after a fall.
  void step(const JointCommand& command) override;

  [[nodiscard]] const Transform& true_T_base() const noexcept override { return true_T_base_; }
  [[nodiscard]] const Transform& true_T_sole(std::size_t f) const noexcept override { return feet_[f].true_T_sole; }
  [[nodiscard]] bool in_contact(std::size_t foot) const noexcept override { return feet_[foot].anchored; }
  [[nodiscard]] int step_index(std::size_t foot) const noexcept override { return feet_[foot].step; }
  [[nodiscard]] double foot_force_n(std::size_t foot) const noexcept override;
  [[nodiscard]] double load_share(std::size_t f) const noexcept override { return f == 0 ? share_ : 1.0 - share_; }
  [[nodiscard]] double closure_error_m() const noexcept override { return closure_m_; }
  [[nodiscard]] const JointVector& drive_q_rad() const noexcept override { return q_; }
  [[nodiscard]] const JointVector& drive_dq_radps() const noexcept override { return dq_; }
  [[nodiscard]] const JointVector& drive_tau_nm() const noexcept override { return tau_; }
  [[nodiscard]] JointVector true_q_rad() const noexcept override { return q_ - errors_.encoder_offset_rad; }
  [[nodiscard]] const std::string& fall_reason() const noexcept override { return fall_reason_; }

 private:
  // A difference of poses that dies out smoothly: keeps the base's position and velocity continuous at lift-off.
  struct Slack {
    Vec3 p_m = Vec3::Zero(), p_rate = Vec3::Zero();
    Vec3 turn_rad = Vec3::Zero(), turn_rate = Vec3::Zero();
  };
  struct LinkState {  // of a link's centre, in the last tick
    Vec3 p_m = Vec3::Zero(), v_mps = Vec3::Zero();
    bool seen = false;
  };
  struct FootState {
    Transform base_T_sole;
    Transform true_T_sole;                                   // the anchor while anchored
    Transform true_T_base;                                   // implied by the anchor; valid while anchored
    Slack base_offset;                                       // from there to the base, last tick
    std::array<double, kContactsPerFoot> corner_height_m{};  // above what was below it, last tick
    bool anchored = true;
    int step = kFloorStep;
    double gap_m = 0.0;    // KinematicPlant::gap_m() as usual while standing
    double raise_m = 0.0;  // above that
    std::array<LinkState, kJointsPerLeg> links;
  };
  [[nodiscard]] bool accept_command(const JointVector& command_rad, const JointVector& rate_radps);
  void move_joints(const JointVector& command_rad, const JointVector& rate_radps);
  void update_leg_kinematics();
  void transfer_load();
  void lift_feet();
  void move_base();
  void give_way(double share);
  void move_swing_feet();
  void load_drives();
  [[nodiscard]] BodyFrames true_frames() const;  // of the legs as they are long
  [[nodiscard]] Vec3 true_p_mass_m() const;
  [[nodiscard]] Vec3 pressed_m() const;
  void check_falls();
  [[nodiscard]] Transform blend() const;
  [[nodiscard]] double gap_m(std::size_t foot) const;  // of its sole above its anchor, on the other leg's base
  void fall(const char* format, ...) __attribute__((format(printf, 2, 3)));

  Params params_;
  const StairWorld& world_;
  const RobotErrors& errors_;
  std::vector<SolidBox> solids_;
  std::array<FootState, kFootCount> feet_;
  JointVector q_, dq_ = JointVector::Zero();
  JointVector led_q_;                        // as the commands have led the joints:
  JointVector given_ = JointVector::Zero();  // and this further, by which the ankles have given way
  JointVector tau_ = JointVector::Zero();    // as the motion asks for
  JointVector dq_before_radps_ = JointVector::Zero();
  Transform true_T_base_;
  Slack slack_;
  double share_ = 0.5, share_rate_ = 0.0;  // of the left foot
  Vec3 base_before_m_ = Vec3::Zero(), base_v_mps_ = Vec3::Zero(), base_a_mps2_ = Vec3::Zero();
  bool both_anchored_ = false;
  double closure_m_ = 0.0;
  std::string fall_reason_;
};

}  // namespace polygmap::sim
