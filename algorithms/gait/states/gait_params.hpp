// SPDX-License-Identifier: Apache-2.0
// What of the gait can be tuned.
#pragma once

#include "algorithms/gait/balance/balance.hpp"
#include "algorithms/gait/footsteps/climb_planner.hpp"
#include "algorithms/gait/joints/joint_reference.hpp"
#include "algorithms/gait/states/early_touch.hpp"
#include "algorithms/gait/states/touch_evidence.hpp"
#include "algorithms/gait/trajectories/step_plan.hpp"
#include "algorithms/gait/trajectories/swing_timing.hpp"

namespace polygmap {

// On two feet, a body off its plan stands lower.
struct CrouchParams {
  double gain = 1.0;
  double max_m = 0.04;
  double step_m = 0.005;
  std::int32_t off_ticks = 5;
  std::int32_t plan_ticks = 100;

  static void visit(auto& p, auto& field) {
    field("gain", p.gain, 0.0, 10.0, "The torso goes lower by this for each metre of the divergent component's error.");
    field("max_m", p.max_m, 0.0, 0.2, "The torso goes no lower.");
    field("step_m", p.step_m, 0.001, 0.1, "A smaller change of height is not worth a new plan of the torso.");
    field("off_ticks", p.off_ticks, 1, 100, "More crouch is wanted for as long: an estimate that jumps is no fall.");
    field("plan_ticks", p.plan_ticks, 2, 2000, "The torso takes so long.");
  }
};

// Before the first step onto the stairs both legs stretch: past straight knees the camera sees the toes, which tell
// where it sits (toe_detector.hpp).
struct ToeCalibrationParams {
  double height_m = 0.86;
  std::int32_t ticks = 550;

  static void visit(auto& p, auto& field) {
    field("height_m", p.height_m, 0.7, 0.95, "Base above the soles: past straight knees the camera sees the toes.");
    field("ticks", p.ticks, 0, 5000,
          "The robot stands tall for so long: up in settle_ticks, then half a second, 15 pictures; 0: never.");
  }
};

struct StandingParams {
  std::int32_t settle_ticks = 300;
  std::int32_t start_patience_ticks = 1500;
  std::int32_t patience_ticks = 500;
  std::int32_t obstacle_patience_ticks = 5000;
  std::int32_t unsteady_patience = 3;
  ToeCalibrationParams toe_calibration;

  static void visit(auto& p, auto& field) {
    field("settle_ticks", p.settle_ticks, 2, 5000, "The body goes to the middle between the feet in this time.");
    field("start_patience_ticks", p.start_patience_ticks, 0, 100000,
          "Before the first step the gait stops when one obstruction lasts so long without a break.");
    field("patience_ticks", p.patience_ticks, 0, 100000,
          "After the first step, or at the top, the gait stops when one obstruction lasts so long: 1 s.");
    field("obstacle_patience_ticks", p.obstacle_patience_ticks, 0, 100000,
          "The gait waits so long for what stands in its way to go, 10 s.");
    field("unsteady_patience", p.unsteady_patience, 1, 100,
          "Obstructions that change are waited for this many times as long.");
    field("toe_calibration", p.toe_calibration);
  }
};

struct WeightShiftParams {
  double absorb_m = 0.015;
  double absorb_rad = 0.035;
  std::int32_t reshift_ticks = 125;
  std::int32_t max_shifts = 9;
  std::int32_t max_refusals = 3;
  std::int64_t max_gap_ns = 20 * kNsPerMs;

  static void visit(auto& p, auto& field) {
    field("absorb_m", p.absorb_m, 0.0, 0.1, "A target that moves no farther up to lift-off needs no new shift.");
    field("absorb_rad", p.absorb_rad, 0.0, 0.5, "A target that turns no farther up to lift-off needs no new shift.");
    field("reshift_ticks", p.reshift_ticks, 2, 2000, "Another shift over the same foot takes so long.");
    field("max_shifts", p.max_shifts, 1, 1000, "There are no more shifts for one swing.");
    field("max_refusals", p.max_refusals, 1, 100,
          "A step that the legs cannot do is given up after so many tries, all but the first from rest.");
    field("max_gap_ns", p.max_gap_ns, 0, 1'000'000'000,
          "A shift in which no tick came for longer is given up: the body went on without it.");
  }
};

struct SwingParams {
  SwingTiming::Params timing;
  TouchEvidence::Params touch;
  EarlyTouch::Params early;
  double late_m = 0.005;
  double blocked_m = 0.008;
  double max_lowering_m = 0.055;
  double abort_share = 0.38;
  double abort_passing_ticks = 45.0;
  double stop_ticks = 490.0;
  double abort_mute_share = 0.25;
  std::int32_t unjudged_ticks = 50;
  double abort_landing_m = 0.01;
  std::uint32_t max_aborted = 4;
  double soon_ticks = 100.0;
  double soon_ticks_per_m = 450.0;
  double soon_below_m = 0.03;
  double beside_from_m = 0.1;
  double side_margin_m = 0.01;
  double lowering_spare_m = 0.02;
  double wait_inward_m = 0.01;

  static void visit(auto& p, auto& field) {
    field("timing", p.timing);
    field("touch", p.touch);
    field("early", p.early);
    field("late_m", p.late_m, 0.0, 0.1, "Contact this far below the target counts as late.");
    field("blocked_m", p.blocked_m, 0.001, 0.1, "A foot this far above where it is asked to be does not go down.");
    field("max_lowering_m", p.max_lowering_m, 0.0, 0.15,
          "A foot that finds no ground so far below its target goes back.");
    field("abort_share", p.abort_share, 0.0, 1.0,
          "In this share of a swing a foot that falls outward goes back to where it stood.");
    field("abort_passing_ticks", p.abort_passing_ticks, 0.0, 2000.0,
          "That of a passing swing, in ticks, and of a floor's or a leading one when the operator asks to stop.");
    field("stop_ticks", p.stop_ticks, 0.0, 5000.0,
          "When he asks in another swing, the foot goes back if on to its target it would take longer.");
    field("abort_mute_share", p.abort_mute_share, 0.0, 1.0,
          "In this share of a swing a foot goes back to where it stood when a drive is silent for good.");
    field(
        "unjudged_ticks", p.unjudged_ticks, 0, 500,
        "After a drive was silent for a moment no error tells for so long of a fall: the plan stood still meanwhile.");
    field("abort_landing_m", p.abort_landing_m, 0.0, 0.1,
          "A foot that goes back feels the ground within this of where it stood.");
    field("max_aborted", p.max_aborted, 0, 1000, "As many swings in a row are aborted, then the gait stops.");
    field("soon_ticks", p.soon_ticks, 1.0, 2000.0,
          "The foot of a body that falls outward is to go straight to its target in this time; it hurries while it "
          "falls.");
    field("soon_ticks_per_m", p.soon_ticks_per_m, 0.0, 10000.0,
          "It takes so much longer for each metre of that way, for the drives.");
    field("soon_below_m", p.soon_below_m, 0.0, 0.5,
          "A passing foot farther below its target does not go straight to it.");
    field("beside_from_m", p.beside_from_m, 0.0, 1.0,
          "A passing foot that far behind the standing one lands beside it.");
    field("side_margin_m", p.side_margin_m, 0.0, 0.2,
          "A sole that lands farther out keeps this from the end of its tread.");
    field("lowering_spare_m", p.lowering_spare_m, 0.0, 0.1,
          "The torso goes lower by this than a lowered foot asks for: the base is not right over the centre of mass.");
    field("wait_inward_m", p.wait_inward_m, -0.04, 0.04,
          "The weight waits this far from the standing sole's middle line, towards the foot that found no ground.");
  }
};

// Until a foot that landed is pressed, it would go along with what the base is off its plan.
struct LandedFootParams {
  double pressed_n = 100.0;
  double lifted_n = 40.0;
  // Chosen on 16 pushed climbs of the simulation (2026-11-28), and tried on nothing else.
  double thrown_m = 0.03;
  double caught_m = 0.01;
  std::int64_t hold_ns = 200 * kNsPerMs;
  std::int64_t felt_hold_ns = 600 * kNsPerMs;
  double unloaded_n = 5.0;
  std::int32_t unloaded_samples = 10;
  double lower_mps = 0.1;
  double lower_mps2 = 2.0;

  static void visit(auto& p, auto& field) {
    field("pressed_n", p.pressed_n, 0.0, 500.0, "A foot that is pressed less is held where it landed.");
    field("lifted_n", p.lifted_n, 0.0, 500.0,
          "After a foot went back, and while the body is thrown, one of the two that is pressed less is held: the body "
          "lifted it.");
    field("thrown_m", p.thrown_m, 0.001, 0.5, "The divergent component's error is larger once the body is thrown.");
    field("caught_m", p.caught_m, 0.001, 0.5, "It is smaller once the body is thrown no more.");
    field.ordered("caught_m", "thrown_m");
    field("hold_ns", p.hold_ns, 0, 5000000000,
          "A landed foot is held no longer where its force told nothing of the ground: it may be the sensor.");
    field("felt_hold_ns", p.felt_hold_ns, 0, 5000000000,
          "A landed foot is held no longer where its force told of the ground.");
    field("unloaded_n", p.unloaded_n, 0.0, 200.0,
          "A foot that landed early and feels less than this hangs in the air.");
    field("unloaded_samples", p.unloaded_samples, 0, 500,
          "After more samples of that in a row it is lowered to its target. A foot that landed early is held until it "
          "was pressed in more.");
    field("lower_mps", p.lower_mps, 0.0, 1.0, "The speed of that lowering.");
    field("lower_mps2", p.lower_mps2, 0.1, 100.0,
          "It begins and ends so gently, since the torques feed the leg's acceleration forward: from `lower_mps` it "
          "goes on for 2.5 mm.");
  }
};

// Two feet that carry do not move against each other. Where legs give way, after a push by centimetres, the feet stand
// otherwise than planned: stiff drives press them against each other, and the next step is planned from where no foot
// stands.
struct FeetApartParams {
  // Chosen on 15 pushed climbs of the simulation (2026-11-28), and tried on no robot.
  double pressed_n = 60.0;
  double least_m = 0.004;
  double time_s = 0.2;
  double most_mps = 0.1;

  static void visit(auto& p, auto& field) {
    field("pressed_n", p.pressed_n, 0.0, 500.0, "Both feet are pressed more: neither moves.");
    field("least_m", p.least_m, 0.0, 0.1, "Feet so near to how they are planned to each other stay planned so.");
    field("time_s", p.time_s, 0.01, 10.0, "Time constant of what is beyond that.");
    field("most_mps", p.most_mps, 0.001, 1.0, "The planned feet move against each other no faster.");
  }
};

// While a drive is mute the body stays where it was.
struct HeldBodyParams {
  double lean_m = 0.05;
  double lean_mps = 0.1;
  double lower_m = 0.2;
  double lower_mps = 0.2;

  static void visit(auto& p, auto& field) {
    field("lean_m", p.lean_m, 0.0, 0.2,
          "The body leans so far to between the feet when the one in the air has landed: both are to carry.");
    field("lean_mps", p.lean_mps, 0.001, 1.0, "The speed of that lean.");
    field("lower_m", p.lower_m, 0.0, 0.4,
          "The body comes down no farther for a foot that its mute leg keeps in the air.");
    field("lower_mps", p.lower_mps, 0.001, 1.0, "The speed of that way down.");
  }
};

struct GaitParams {
  StepParams step;
  ClimbPlanner::Params planner;
  JointReference::Params joints;
  Balance::Params balance;
  StandingParams standing;
  WeightShiftParams weight_shift;
  SwingParams swing;
  CrouchParams crouch;
  LandedFootParams landed_foot;
  FeetApartParams feet_apart;
  HeldBodyParams held_body;
  double steady_m = 0.015;
  double soft_ground_rad = 0.031;
  double correction_time_s = 0.03;
  double bias_time_s = 0.1;
  std::int64_t steer_age_ns = 20 * kNsPerMs;
  std::int64_t stop_age_ns = 100 * kNsPerMs;

  static void visit(auto& p, auto& field) {
    field("step", p.step);
    field("planner", p.planner);
    field("joints", p.joints);
    field("balance", p.balance);
    field("standing", p.standing);
    field("weight_shift", p.weight_shift);
    field("swing", p.swing);
    field("crouch", p.crouch);
    field("landed_foot", p.landed_foot);
    field("feet_apart", p.feet_apart);
    field("held_body", p.held_body);
    field("steady_m", p.steady_m, 0.001, 0.5, "No foot lifts when the divergent component's error is larger.");
    field("soft_ground_rad", p.soft_ground_rad, 0.001, 1.0,
          "No step is begun where the soles turned against each other by more since they were met.");
    field("correction_time_s", p.correction_time_s, 0.002, 2.0,
          "Time constant of the low-pass of the base's difference to the plan.");
    field("bias_time_s", p.bias_time_s, 0.002, 10.0,
          "Time constant of the low-pass of the centre of mass's bias: its steps must not accelerate the links.");
    field("steer_age_ns", p.steer_age_ns, 2000000, 1000000000,
          "Older IMU and joint samples steer nothing and start nothing.");
    field("stop_age_ns", p.stop_age_ns, 2000000, 5000000000,
          "Two feet on the ground and samples as old: the gait stops.");
  }
};

}  // namespace polygmap
