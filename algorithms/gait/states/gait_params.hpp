// SPDX-License-Identifier: Apache-2.0
// What of the gait can be tuned.
#pragma once

#include "algorithms/gait/balance/balance.hpp"
#include "algorithms/gait/footsteps/climb_planner.hpp"
#include "algorithms/gait/joints/joint_reference.hpp"
#include "algorithms/gait/trajectories/step_plan.hpp"
#include "algorithms/gait/trajectories/swing_timing.hpp"

namespace polygmap {

// On two feet, a body off its plan stands lower.
struct CrouchParams {
  double gain = 1.0;  // metres lower for each metre of the divergent component's error
  double max_m = 0.04;
};

// Before the first step onto the stairs both legs stretch: past straight knees the camera sees the toes, which tell
// where it sits (toe_detector.hpp).
struct ToeCalibrationParams {
  double height_m = 0.86;    // of the base above the soles
  std::int32_t ticks = 550;  // up in settle_ticks, then half a second: 15 pictures. 0: never
};

struct StandingParams {
  std::int32_t settle_ticks = 300;           // to the middle between the feet
  std::int32_t start_patience_ticks = 1500;  // the same obstruction without a break, before the first step
  std::int32_t patience_ticks = 500;         // and later, or the top: 1 s
  std::int32_t unsteady_patience = 3;        // as many times longer for obstructions that change
  ToeCalibrationParams toe_calibration;
};

struct WeightShiftParams {
  double absorb_m = 0.015;  // change of a target up to lift-off that needs no new shift
  double absorb_rad = 0.035;
  std::int32_t reshift_ticks = 125;  // another shift over the same foot for a target that changed more
  std::int32_t max_shifts = 9;       // for one swing
};

struct SwingParams {
  SwingTiming::Params timing;
  double touch_force_n = 15.0;        // felt by the sole: it touches something
  double early_m = 0.005;             // contact this far above the target counts as early
  std::int32_t scrape_ticks = 5;      // early contact that lasts so long is ground and not a scraping toe
  double late_m = 0.005;              // contact this far below the target counts as late
  double blocked_m = 0.008;           // a foot this far above where it is asked to be does not go down
  double max_lowering_m = 0.055;      // no ground found so far below the target: the foot goes back
  double abort_share = 0.38;          // of a swing, in which a foot that falls outward goes back to where it stood
  double abort_passing_ticks = 45.0;  // of a passing swing, likewise
  double abort_landing_m = 0.01;      // about where it stood: weight counts as the ground; below, it is there
  std::uint32_t max_aborted = 4;      // swings in a row
  double soon_ticks = 100.0;          // a passing foot that falls outward goes straight to its target: at least,
  double soon_ticks_per_m = 450.0;    // and so much longer for each metre of its way, for the drives
  double soon_below_m = 0.03;         // not from farther below
  double beside_from_m = 0.1;         // a passing foot that far behind the standing one lands beside it
  double side_margin_m = 0.01;        // of a sole that lands farther out, to the end of its tread
};

// Until a foot that landed is pressed, it would go along with what the base is off its plan.
struct LandedFootParams {
  double pressed_n = 100.0;                    // pressed less, it is held where it landed,
  std::int64_t hold_ns = 200 * kNsPerMs;       // not longer: it may be the sensor,
  std::int64_t felt_hold_ns = 600 * kNsPerMs;  // unless that told of the ground
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
  double steady_m = 0.015;                    // of the divergent component's error: beyond it no foot lifts
  double correction_time_s = 0.03;            // low-pass of the base's difference to the plan, see BaseCorrection
  std::int64_t steer_age_ns = 20 * kNsPerMs;  // of IMU and joint samples: older ones steer nothing and start nothing
  std::int64_t stop_age_ns = 100 * kNsPerMs;  // of the same on two feet: then the gait stops
};

}  // namespace polygmap
