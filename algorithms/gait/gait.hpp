// SPDX-License-Identifier: Apache-2.0
// The gait: walks up to the stairs, climbs them in either of the paper's gaits, ends by itself.
#pragma once

#include <array>

#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/state.hpp"
#include "algorithms/gait/balance/balance.hpp"
#include "algorithms/gait/footsteps/climb_planner.hpp"
#include "algorithms/gait/joints/base_correction.hpp"
#include "algorithms/gait/joints/joint_reference.hpp"
#include "algorithms/gait/joints/planned_posture.hpp"
#include "algorithms/gait/trajectories/step_plan.hpp"
#include "algorithms/gait/trajectories/swing_timing.hpp"

namespace polygmap {

// Inside, everything moves in the plan frame: odometry as it was when the last shift or swing began, in which standing
// feet do not move and the joint commands never jump. The swing foot is steered in odometry through the base
// correction.
class Gait {
 public:
  struct Params {
    LegGeometry geometry;
    StepParams step;
    ClimbPlanner::Params planner;
    JointReference::Params joints;
    Balance::Params balance;
    double correction_time_s = 0.03;  // low-pass of the base's difference to the plan, see BaseCorrection
    double absorb_m = 0.015;          // change of a target up to lift-off that needs no new weight shift
    double absorb_rad = 0.035;
    std::int32_t reshift_ticks = 125;          // another weight shift over the same foot for a target that changed more
    std::int32_t max_shifts = 9;               // for one swing
    std::int32_t start_patience_ticks = 1500;  // the same obstruction without a break, before the first step
    std::int32_t patience_ticks = 500;         // and later, or the top: 1 s
    std::int32_t unsteady_patience = 3;        // as many times longer for obstructions that change
    std::int32_t settle_ticks = 300;           // to the middle between the feet when there is nothing to do
    // Before the first step onto the stairs both legs stretch: past straight knees the camera sees the toes, which tell
    // where it sits (toe_sight.hpp). Up in settle_ticks, then half a second: 15 pictures. 0: no look.
    double look_height_m = 0.86;
    std::int32_t look_ticks = 550;
    double touch_force_n = 15.0;
    double hold_force_n = 100.0;            // pressed less, a foot that landed is held where it landed,
    std::int64_t hold_ns = 200 * kNsPerMs;  // not longer: it may be the sensor, unless that told of the ground
    std::int64_t felt_hold_ns = 600 * kNsPerMs;
    double steady_m = 0.015;  // of the divergent component's error: beyond it no foot lifts
    SwingTiming::Params pace;
    double turn_share = 0.38;         // of a swing, in which a toppling body's foot goes back to where it stood;
    double turn_ticks = 45.0;         // of a passing one
    double soon_ticks = 100.0;        // of the rest of a swing, straight to its target, when the body topples:
    double soon_ticks_per_m = 450.0;  // ticks for each metre of its way, for the drives
    double below_m = 0.03;            // not from farther below
    double beside_from_m = 0.1;       // a passing foot that far behind the standing one lands beside it
    double crouch = 1.0;              // lower in double support, of the divergent component's error
    double crouch_max_m = 0.04;
    double side_margin_m = 0.01;                // of a sole that lands farther out, to the end of its tread
    double early_m = 0.005;                     // contact this far above the target counts as early
    std::int32_t scrape_ticks = 5;              // which is ground only when it lasts so long
    double late_m = 0.005;                      // and this far below as late
    double blocked_m = 0.008;                   // a foot this far above where it is asked to be does not go down
    double max_lowering_m = 0.055;              // no ground found: the foot goes back
    std::uint32_t max_put_back = 4;             // feet in a row that a toppling body takes back
    double put_back_m = 0.01;                   // about where it stood: weight counts as the ground; below, it is there
    std::int64_t steer_age_ns = 20 * kNsPerMs;  // of IMU and joint samples: older ones steer nothing and start nothing
    std::int64_t stop_age_ns = 100 * kNsPerMs;  // of the same on two feet: then the gait stops
  };

  void reset(const Params& params) noexcept;
  // One 500 Hz tick: state machine, trajectories, leg kinematics, joint command. footholds: the newest finished search.
  // Without fresh samples a swing is finished as it was planned; then the gait stops on two feet.
  void tick(std::int64_t now_ns, const StateEstimate& state, const FootholdSet& footholds,
            const JointFeedback& feedback, JointCommand& command) noexcept;
  [[nodiscard]] const GaitStatus& status() const noexcept { return status_; }
  [[nodiscard]] const Balance& balance() const noexcept { return balance_; }
  // Finishes the committed step, then holds in double support. From the thread of tick().
  void request_stop() noexcept { stop_requested_ = true; }

 private:
  enum class Activity : std::uint8_t {
    kHold,   // both feet stand and nothing is planned: settle between the feet, look for a step
    kShift,  // weight moves over the stance foot
    kSwing,  // on its way or on its way back
    kEnd,    // finished or stopped
  };

  void start(const StateEstimate& state) noexcept;
  void hold(const StateEstimate& state, const FootholdSet& footholds) noexcept;
  void shift(const StateEstimate& state, const FootholdSet& footholds) noexcept;
  void swing(const StateEstimate& state, const JointFeedback& feedback) noexcept;
  void put_back(const JointFeedback& feedback) noexcept;
  [[nodiscard]] Transform beside_path(const Transform& odom_T_sole) const noexcept;
  void land_soon(const StateEstimate& state) noexcept;
  void set_pace() noexcept;

  void observe_reference() noexcept;
  void hold_upright(JointCommand& command) noexcept;
  [[nodiscard]] Transform plan_T_base_over(const TorsoTrajectory::State& state) const noexcept;
  void observe_links() noexcept;
  void add_torques(const StateEstimate& state, const JointFeedback& feedback, JointCommand& command) noexcept;
  void begin_hold() noexcept;
  [[nodiscard]] bool looks_first(const ClimbPlanner::Decision& decision) const noexcept;
  void begin_shift(const ClimbPlanner::Decision& decision, bool again) noexcept;
  void lift_off(const StateEstimate& state, const FootholdSet& footholds,
                const ClimbPlanner::Decision& decision) noexcept;
  void touch_down(const StateEstimate& state) noexcept;
  void hold_landed_foot(const JointFeedback& feedback) noexcept;
  void end(GaitPhase phase, StopReason reason, double measured_m) noexcept;
  void carry_plan_to_odometry() noexcept;
  [[nodiscard]] double crouch_m() const noexcept;
  void crouch() noexcept;
  void settle_between_feet() noexcept;
  void rise_between_feet() noexcept;
  void move_torso(double height_m, double yaw_rad, std::int32_t ticks, std::int32_t height_ticks) noexcept;
  void lower_torso(const SolePose& sole) noexcept;
  void wait_over_stance(const SolePose& sole) noexcept;
  void rest_over(const Vec2& plan_p_m) noexcept;
  void look_at(const StateEstimate& state) noexcept;
  [[nodiscard]] bool lost(const StateEstimate& state) const noexcept;
  [[nodiscard]] ClimbPlanner::Situation situation(const StateEstimate& state) const noexcept;
  [[nodiscard]] bool close_to_planned(const StepGoal& goal) const noexcept;

  Params params_;
  std::int64_t now_ns_ = 0;
  ClimbPlanner planner_;
  JointReference joints_;
  Balance balance_;
  PlannedPosture posture_;
  LinkMotion::Acceleration link_acceleration_;
  Vec3 reference_p_com_m_ = Vec3::Zero();  // centre of mass of the posture last asked for, base frame,
  Vec3 base_com_bias_m_ = Vec3::Zero();    // without this, which the masses have too much
  StepSearch search_;
  BaseCorrection correction_;
  TorsoTrajectory torso_;
  TorsoTrajectory::State torso_state_{};  // x and y: of the centre of mass
  struct {
    double height_m = 0.0, yaw_rad = 0.0;
  } upright_;                   // plan frame: of the torso in this hold or shift,
  double crouched_m_ = 0.0;     // less this
  std::int32_t off_ticks_ = 0;  // for which more was wanted
  ComPlan com_;
  Vec2 dcm_error_m_ = Vec2::Zero();   // of the divergent component, as last measured, odometry
  Vec2 zmp_stance_m_ = Vec2::Zero();  // of the swing, plan frame
  Swing swing_;                       // odometry
  SwingTiming pace_;
  Transform plan_T_base_;
  std::array<Transform, kFootCount> plan_T_sole_;
  // The last swing foot as it was asked to be when it landed; in the plan frame it follows no correction.
  Transform odom_T_landed_, plan_T_landed_;
  ClimbPlanner::Decision decision_;
  GaitStatus status_;
  Activity activity_ = Activity::kHold;
  std::int32_t tick_ = 0;        // of the activity, saturates
  std::int32_t torso_tick_ = 0;  // of the torso's plan, likewise
  std::int32_t com_tick_ = 0;    // of the plan of the centre of mass, likewise
  std::int32_t shift_ticks_ = 0;
  std::int32_t shifts_ = 0;     // since the last swing
  std::uint32_t put_back_ = 0;  // feet since the last one that landed
  StopReason waiting_for_ = StopReason::kNone;
  std::int32_t wait_ticks_ = 0;     // for that reason, without a break
  std::int32_t touched_ticks_ = 0;  // for which the swing foot has been felt to touch,
  std::int64_t felt_stamp_ns_ = 0;  // as told by then
  std::int32_t idle_ticks_ = 0;     // without a step to do since the last swing
  bool usable_ = false;             // this tick's estimate: fresh, and all of it numbers
  bool armed_ = false;
  bool started_ = false;
  bool unloaded_ = false;  // the swing foot was felt to leave the ground
  bool retried_ = false;   // the legs could not do a step from the motion the plan was in: once more, from rest
  bool looks_ = false;     // stands tall, to see its toes
  bool looked_ = false;    // has, once
  bool settles_ = false;   // the last swing foot landed and carries little yet
  bool felt_ = false;      // its force told of the ground
  bool stop_requested_ = false;
};

}  // namespace polygmap
