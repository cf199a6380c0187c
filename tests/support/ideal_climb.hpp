// SPDX-License-Identifier: Apache-2.0
// A little closed loop for tests of the gait: joints with lag, a base that hangs on the supporting foot, an estimator
// that knows everything up to chosen errors, and a foothold search that reads the staircase from a list.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "algorithms/gait/gait.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::test {

struct Staircase {  // first riser at x = 0, level floor at z = 0
  int steps = 4;
  double rise_m = 0.13;
  double tread_m = 0.28;
  double landing_m = 1.0;
  double half_width_m = 0.6;
  [[nodiscard]] double riser_x_m(int step) const { return step * tread_m; }
  [[nodiscard]] double top_m(int step) const { return (step + 1) * rise_m; }
  [[nodiscard]] double height_m(double x_m) const;
};

struct ClimbSetup {
  Staircase stairs;
  double map_shift_x_m = 0.0;  // of the mapped stairs against the true ones
  double map_shift_z_m = 0.0;
  double distance_m = 0.5;  // base to the first riser
  double lateral_m = 0.0;
  double yaw_rad = 0.0;
  double odom_yaw_rad = 0.0;                             // of the robot at the start, in odometry
  double estimate_tilt_rad = 0.0;                        // constant pitch and roll error of the estimated attitude
  double estimate_noise_m = 0.0;                         // white, of the estimated base
  double world_drift_mps = 0.0;                          // the LIO offset wanders that fast
  JointVector encoder_offset_rad = JointVector::Zero();  // reading minus true angle
  double foothold_noise_m = 0.0;                         // white, of every search
  std::int64_t clock_ns = 0;                             // at the first tick
};

struct ClimbRecord {
  std::vector<LatchedStep> steps;                 // finished swings
  std::array<double, kJointCount> speed_share{};  // greatest commanded rate over the drive's limit
  double joint_margin_rad = 1e9;                  // least, of commands
  double knee_min_rad = 1e9;
  double penetration_m = -1e9;  // deepest point of a swinging foot's collision box in the stairs
  double crossing_m = 1e9;      // least height of the toe's edge over the nosing it crosses
  double toe_gap_m = 1e9;       // least, of standing toes before the first riser
  double zmp_margin_m = 1e9;    // of the true zero-moment point in the stance foot's contact rectangle, on one foot
  double execution_m = 0.0;     // latched against executed along the ground, greatest
  double execution_z_m = 0.0;
  double swing_tracking_m = 0.0;       // desired against true, relative to the stance foot
  double true_tilt_rad = 0.0;          // of the base, after the start
  double landed_tilt_rad = 0.0;        // of the true base, greatest at a touch-down
  double jump_rad = 0.0;               // greatest change of a command in a tick
  std::vector<double> sole_margin_m;   // heel to nosing and toe to riser of every foot on a tread
  std::int64_t first_lift_off_ns = 0;  // onto the stairs
  std::int64_t last_touch_down_ns = 0;
  std::int64_t end_ns = 0;
  int ticks = 0;
};

class IdealClimb {
 public:
  // robot: as the gait has it, which it must outlive; the true one is the nominal one.
  explicit IdealClimb(const ClimbSetup& setup, const Gait::Params& params = {},
                      const RobotModel& robot = nominal_robot());
  // One tick; false when the gait has ended.
  bool tick();
  // Until the gait is in that phase of its nth swing (1-based; the double support after it belongs to it); false when
  // that never came.
  bool run_until(GaitPhase phase, std::uint32_t swing, double limit_s = 60.0);
  // Until the end or so many seconds.
  void run(double seconds);
  [[nodiscard]] const GaitStatus& status() const { return gait_.status(); }
  [[nodiscard]] Gait& gait() { return gait_; }
  [[nodiscard]] const ClimbRecord& record() const { return record_; }
  [[nodiscard]] const Transform& true_T_base() const { return true_T_base_; }
  [[nodiscard]] const Transform& true_T_sole(Foot f) const { return feet_[index_of(f)].true_T_sole; }
  [[nodiscard]] const JointVector& q_rad() const { return q_; }
  [[nodiscard]] const JointCommand& command() const { return command_; }
  [[nodiscard]] bool touches(Foot f) const { return feet_[index_of(f)].anchored; }
  [[nodiscard]] int tick_count() const { return record_.ticks; }

  // May change what the gait sees, after it was made.
  std::function<void(StateEstimate&, FootholdSet&, JointFeedback&)> tamper;

 private:
  struct FootState {
    Transform true_T_sole;
    bool anchored = true;
  };
  void sense();
  void move();
  void measure(const GaitStatus& before);
  void measure_zmp();
  [[nodiscard]] FootholdSet search() const;
  double noise();

  ClimbSetup setup_;
  Gait gait_;
  ClimbRecord record_;
  std::array<FootState, kFootCount> feet_;
  std::size_t support_ = 0;
  Transform true_T_base_;
  Vec3 true_v_base_mps_ = Vec3::Zero();
  JointVector q_ = JointVector::Zero(), sent_ = JointVector::Zero(), active_ = JointVector::Zero();
  JointCommand command_;
  StateEstimate state_;
  FootholdSet footholds_;
  JointFeedback feedback_;
  std::array<std::array<double, kFootCount>, 4> force_history_{};
  Transform odom_T_true_;
  std::vector<Vec3> com_m_;  // true, of the single support so far
  std::uint64_t random_ = 88172645463325252ULL;
};

}  // namespace polygmap::test
