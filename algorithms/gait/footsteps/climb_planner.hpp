// SPDX-License-Identifier: Apache-2.0
// Which foot goes where next: the walk up to the stand-off before the stairs, then both feet on every tread (DS) or one
// (SS).
#pragma once

#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/gait/footsteps/step_goal.hpp"

namespace polygmap {

// The paper's two gaits. A single step passes the standing foot and lands one tread beyond it.
enum class GaitPattern : std::uint8_t { kDoubleStep, kSingleStep };

class ClimbPlanner {
 public:
  struct Params {
    GaitPattern pattern = GaitPattern::kDoubleStep;
    double stand_off_m = 0.032;      // collision toe to the first nosing or riser
    double min_stand_off_m = 0.022;  // nearer than this is not lined up, whatever the tolerance
    double line_up_m = 0.004;        // along the heading, of either foot
    double line_up_lateral_m = 0.012;
    double line_up_yaw_rad = 0.009;        // 0.5 degrees
    std::uint32_t strict_corrections = 2;  // steps in place before the tolerance relaxes, by half of itself per step
    double max_relaxation = 2.5;
    std::uint32_t max_corrections = 12;  // not lined up after so many: it will not be. 200 climbs took up to 7
    std::uint32_t max_floor_steps = 60;  // nor after so many of any length
    FloorStepLimits floor;
    double floor_clearance_m = 0.02;  // of a toe on the way to the line of the first nosing
    SwingRule rule;
    double min_rise_m = 0.02;  // Delta_foot: below it is the tread already underfoot
    std::int64_t max_map_age_ns = 500 * kNsPerMs;
  };

  // What the planner looks at; poses in odom.
  struct Situation {
    std::int64_t stamp_ns = 0;
    Transform world_T_odom;
    SolePair soles;
    // The weight is on its way over the other foot for a leading step of this one, or it looks at its toes for it: no
    // reason to turn round but a large one.
    bool leads = false;
    Foot leading = Foot::kLeft;
  };
  struct Decision {
    bool has_step = false;
    StepGoal goal;
    StepGoal trailing;                           // the step that may come after a leading or passing one
    StopReason obstruction = StopReason::kNone;  // without a step: why
    double measured_m = 0.0;
    double rise_m = 0.0;  // of a leading step
  };

  // robot: outlives the planner.
  void reset(const Params& params, const RobotModel& robot) noexcept;
  [[nodiscard]] Decision decide(const Situation& situation, const FootholdSet& footholds) const noexcept;
  // A swing was latched: its goal is what the next decisions build on.
  void latched(const Situation& situation, const Decision& decision) noexcept;
  // The legs cannot do the step: the next ones on the floor are shorter. False when they are short already.
  bool shorten_floor_steps() noexcept;
  // The legs cannot pass the standing foot: the next step ends beside it.
  void refuse_passing() noexcept { passing_refused_ = true; }
  // The passing foot that is in the air lands beside the standing one instead.
  void passing_ends_beside(const StepGoal& goal) noexcept;
  // Its foot stands on its goal, or where it stood before: with which foot to lead as before the latch.
  void landed() noexcept;
  void swing_aborted() noexcept;
  [[nodiscard]] std::uint32_t tread_id() const noexcept { return tread_id_; }  // under the foot that landed last
  [[nodiscard]] std::uint32_t treads_climbed() const noexcept { return treads_climbed_; }

 private:
  [[nodiscard]] Decision trailing_step(const Situation& situation, const FootholdSet& footholds) const noexcept;
  // Past the standing foot onto the tread beyond it; false when there is none to be sure of.
  [[nodiscard]] bool passing_step(const Situation& situation, const FootholdSet& footholds,
                                  Decision& decision) const noexcept;
  [[nodiscard]] bool floor_goal(const Situation& situation, const FootholdSet& footholds,
                                StepGoal& goal) const noexcept;
  [[nodiscard]] StopReason reason_against(const Situation& situation, const FootholdSet& footholds) const noexcept;
  // Soles straight back from the footholds, so far that the toes are stand_off_m from the nosing.
  struct StandOff;
  [[nodiscard]] StandOff stand_off(const Situation& situation, const FootholdSet& footholds) const noexcept;
  [[nodiscard]] bool lined_up(const Situation& situation, const StandOff& to, std::size_t foot) const noexcept;
  [[nodiscard]] Foot leading_foot(const Situation& situation, const SolePair& targets) const noexcept;

  Params params_;
  const RobotModel* robot_ = nullptr;
  Decision latched_;
  // What a latch changes, and what it was before.
  struct Memory {
    Foothold trailing_foothold;  // from the leading latch, world
    Foot last_swing = Foot::kRight;
    Foot leading = Foot::kLeft;
    bool has_leading = false;
  } memory_, before_latch_;
  bool split_stance_ = false;  // the leading foot stands on a tread, the other one below: the trailing step ends this
  bool passing_refused_ = false;
  std::uint32_t tread_id_ = 0;  // under the foot that landed last
  std::uint32_t treads_climbed_ = 0;
  double stride_share_ = 1.0;  // of the floor step's limits
  std::uint32_t floor_steps_ = 0;
  std::uint32_t corrections_ = 0;  // the short ones of them
};

}  // namespace polygmap
