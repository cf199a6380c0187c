// SPDX-License-Identifier: Apache-2.0
// Which foot goes where next: the walk up to the stand-off before the stairs, then both feet on every tread (DS) or one
// (SS); where it was told to go somewhere, the walk there on level ground, before stairs and behind them.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/operator_command.hpp"
#include "algorithms/gait/footsteps/goal_way.hpp"
#include "algorithms/gait/footsteps/level_walk.hpp"
#include "algorithms/gait/footsteps/step_goal.hpp"

namespace polygmap {

// The paper's two gaits. A single step passes the standing foot and lands one tread beyond it.
enum class GaitPattern : std::uint8_t { kDoubleStep, kSingleStep };
inline constexpr std::array<std::string_view, 2> kGaitPatternNames{"ds", "ss"};

class ClimbPlanner {
 public:
  // Floor steps that the legs cannot do.
  struct ShorterParams {
    double share = 0.6;
    double least_share = 0.2;

    static void visit(auto& p, auto& field) {
      field("share", p.share, 0.1, 0.95, "Floor steps become this times as long when the legs cannot do one.");
      field("least_share", p.least_share, 0.01, 1.0,
            "Floor steps that would be no longer than this share are given up.");
    }
  };
  // Of the soles from their middle, in floor steps.
  struct WidthParams {
    double least_half_m = 0.08;
    double wider_m = 0.03;

    static void visit(auto& p, auto& field) {
      field("least_half_m", p.least_half_m, 0.03, 0.08,
            "Floor steps keep the soles at least this far from their middle.");
      field("wider_m", p.wider_m, 0.0, 0.2,
            "Floor steps keep the soles no farther from their middle than the stance's half width and this.");
    }
  };
  // Feet that slid on their tread.
  struct SlidParams {
    double off_m = 0.012;
    std::uint32_t max_set_back = 2;

    static void visit(auto& p, auto& field) {
      field(
          "off_m", p.off_m, 0.002, 0.2,
          "A foot that is farther from where it landed, seen from the other one on its tread, is set back beside it.");
      field("max_set_back", p.max_set_back, 0, 100, "Feet that slid are set back so often on a tread.");
    }
  };
  // Before an edge that drops away.
  struct LipParams {
    double stand_off_m = 0.014;
    double min_stand_off_m = 0.006;
    double clearance_m = 0.006;
    double far_m = 0.08;
    double near_m = 0.035;
    // Both were chosen on seeds 1 to 9 of the simulation's flights down (2026-12-01).
    double trailing_stand_off_m = 0.02;
    double trailing_ahead_m = 0.13;

    static void visit(auto& p, auto& field) {
      field("stand_off_m", p.stand_off_m, 0.0, 0.3, "Collision toe to the lip.");
      field("min_stand_off_m", p.min_stand_off_m, 0.0, 0.3, "Nearer is not lined up, whatever the tolerance.");
      field.ordered("min_stand_off_m", "stand_off_m");
      field("clearance_m", p.clearance_m, 0.0, 0.5, "Clearance of a toe from the lip on the way.");
      field("far_m", p.far_m, 0.0, 0.5, "From farther off it comes nearer first, on a deep tread, too.");
      field(
          "near_m", p.near_m, 0.0, 0.5,
          "Where the legs refuse a step from farther off, it comes nearer first, and on the treads that follow, too.");
      field.ordered("near_m", "far_m");
      field("trailing_stand_off_m", p.trailing_stand_off_m, 0.0, 0.3,
            "Collision toe to the next lip of a foot that trails there: that lip was seen from a tread higher.");
      field.ordered("trailing_stand_off_m", "near_m");
      field("trailing_ahead_m", p.trailing_ahead_m, 0.0, 0.3,
            "It goes no farther ahead of where it would stand beside the other one.");
    }
  };
  // When the feet are lined up before the stairs.
  struct LineUpParams {
    double along_m = 0.004;
    double lateral_m = 0.012;
    double yaw_rad = 0.009;
    std::uint32_t strict_corrections = 2;
    double max_relaxation = 2.5;
    std::uint32_t max_corrections = 12;
    double under_way = 0.5;

    static void visit(auto& p, auto& field) {
      field("along_m", p.along_m, 0.001, 0.1, "Either foot is lined up within this along the heading.");
      field("lateral_m", p.lateral_m, 0.001, 0.2, "Either foot is lined up within this to the side.");
      field("yaw_rad", p.yaw_rad, 0.001, 0.3, "Either foot is lined up within this turn.");
      field("strict_corrections", p.strict_corrections, 0, 1000,
            "The tolerance relaxes by half of itself per step in place after as many.");
      field("max_relaxation", p.max_relaxation, 1.0, 10.0, "The tolerance relaxes up to this many times.");
      field("max_corrections", p.max_corrections, 0, 1000,
            "The feet will not be lined up when they are not after as many: 200 climbs took up to 7.");
      field("under_way", p.under_way, 0.0, 10.0,
            "The tolerance relaxes by this times itself while the weight is on its way for the first leading step.");
    }
  };
  struct Params {
    GaitPattern pattern = GaitPattern::kDoubleStep;
    double stand_off_m = 0.032;
    double min_stand_off_m = 0.022;
    std::uint32_t max_floor_steps = 60;
    FloorStepLimits floor;
    double floor_clearance_m = 0.02;
    SwingRule rule;
    double min_rise_m = 0.02;
    double max_passing_rise_m = 0.185;
    std::int64_t max_map_age_ns = 500 * kNsPerMs;
    std::int64_t remembered_ns = 5 * kNsPerS;
    double correction_m = 0.05;
    double turn_round = 2.5;
    ShorterParams shorter;
    WidthParams width;
    SlidParams slid;
    LipParams lip;
    LineUpParams line_up;
    LevelWalkParams walk;
    GoalWayParams way;

    static void visit(auto& p, auto& field) {
      field("pattern", p.pattern, kGaitPatternNames,
            "Both feet on every tread (ds), or one foot on every tread and both on the last (ss).");
      field("stand_off_m", p.stand_off_m, 0.0, 0.3, "Collision toe to the first nosing or riser.");
      field("min_stand_off_m", p.min_stand_off_m, 0.0, 0.3, "Nearer is not lined up, whatever the tolerance.");
      field.ordered("min_stand_off_m", "stand_off_m");
      field("max_floor_steps", p.max_floor_steps, 0, 10000,
            "The feet will not be lined up when they are not after as many floor steps of any length.");
      field("floor", p.floor);
      field("floor_clearance_m", p.floor_clearance_m, 0.0, 0.5,
            "Clearance of a toe from the line of the first nosing on the way.");
      field("rule", p.rule);
      field("min_rise_m", p.min_rise_m, 0.001, 0.039, "Delta_foot: a tread that is not higher is already underfoot.");
      field("max_passing_rise_m", p.max_passing_rise_m, 0.0, 0.5,
            "No foot passes the other one up a higher rise, it stops beside it: past 0.19 m the shin touched the edge "
            "above.");
      field("max_map_age_ns", p.max_map_age_ns, 1000000, 10000000000, "An older map is no reason to step.");
      field("remembered_ns", p.remembered_ns, 1000000, 100000000000,
            "After a longer pause between two treads the rear foot goes as far beside the other one as its foothold "
            "was beside that one's, wherever odometry has both.");
      field("correction_m", p.correction_m, 0.0, 0.5, "A shorter step on the floor only corrects.");
      field("turn_round", p.turn_round, 1.0, 100.0,
            "The other foot leads than the one that was to only for a displacement beyond this times the dead bands.");
      field("shorter", p.shorter);
      field("width", p.width);
      field("slid", p.slid);
      field("lip", p.lip);
      field("line_up", p.line_up);
      field("walk", p.walk);
      field("way", p.way);
    }
  };

  // What the planner looks at; poses in odom.
  struct Situation {
    std::int64_t stamp_ns = 0;
    SolePair soles;
    // The weight is on its way over the other foot for a leading step of this one, or it looks at its toes for it: no
    // reason to turn round but a large one.
    bool leads = false;
    Foot leading = Foot::kLeft;
  };
  struct Decision {
    bool has_step = false;
    bool walks = false;                                     // to a place, on level ground
    std::optional<LevelStep::Outcome> walk = std::nullopt;  // how the step there came out; none: it looks for its way
    StepGoal goal;
    StepGoal trailing;                           // the step that may come after a leading or passing one
    Foothold beside;                             // of a leading step: where the trailing one would end beside it
    StopReason obstruction = StopReason::kNone;  // without a step: why
    double measured_m = 0.0;
    double rise_m = 0.0;         // of a leading step, negative down
    bool trails_to_lip = false;  // the trailing step, this one or the one that may come, goes on to the next lip
    double to_lip_m = 0.0;       // from the foot that carries to the lip that it leads over; 0 where it leads over none
  };

  // robot: outlives the planner.
  void reset(const Params& params, const RobotModel& robot) noexcept;
  [[nodiscard]] Decision decide(const Situation& situation, const FootholdSet& footholds) const noexcept;
  // The same of who stands and waits for a step: with every tick that it does it looks on for the way to its goal.
  [[nodiscard]] Decision look_and_decide(const Situation& situation, const FootholdSet& footholds) noexcept;
  // After an end: what it has tried to line up with the stairs, and what it has given up, is forgotten; where it stands
  // is not.
  void restart() noexcept;
  // From now on: to there, from where the soles are when it is laid out.
  void go_to(const Destination& destination) noexcept { goal_.asked = destination; }
  // In odometry, where one was asked for that is not yet laid out.
  void lay_out_destination(const SolePair& soles) noexcept;
  // Up the stairs that it sees, until they end.
  void climb() noexcept { goal_ = {}; }
  [[nodiscard]] bool goes_to() const noexcept { return goal_.asked || goal_.laid_out; }
  // A swing was latched: its goal is what the next decisions build on.
  void latched(const Situation& situation, const Decision& decision) noexcept;
  // The legs cannot do the step: the next ones on the floor are shorter. False when they are short already.
  bool shorten_floor_steps() noexcept;
  // The legs cannot pass the standing foot: the next step ends beside it.
  void refuse_passing() noexcept { passing_refused_ = true; }
  // The legs cannot do that leading step: from now on it begins nearer to the lip, and at last with both feet lined up
  // there. False when it does already.
  [[nodiscard]] bool come_nearer(const Decision& leading) noexcept;
  // They cannot trail so far ahead, to the next lip: no step does any more. False when none did.
  [[nodiscard]] bool trail_beside() noexcept;
  // The legs cannot lead on. A foot that landed farther out, in a stance too wide for the ankle rolls of both legs,
  // comes back beside the other one first. False when the feet are close enough already.
  [[nodiscard]] bool close_up(const Situation& situation) noexcept;
  // Where the passing foot that is in the air would land beside the standing one, odom.
  [[nodiscard]] SolePose beside_passed(const SolePose& stance, Foot foot) const noexcept;
  // The passing foot that is in the air lands beside the standing one instead.
  void passing_ends_beside(const StepGoal& goal) noexcept;
  // Both feet stand: on a tread, has one slid since they landed? Their places to each other tell, by the encoders,
  // wherever odometry has both; which of them moved, odometry tells. It is to be set back.
  void watch_feet(const SolePair& soles) noexcept;
  // The legs cannot set the foot back that slid: on without. False when none is to be.
  [[nodiscard]] bool leave_slid_foot() noexcept;
  // Its foot stands on its goal, or where it stood before: with which foot to lead as before the latch. soles: as
  // estimated, none while the estimate tells nothing.
  void landed(const std::optional<SolePair>& soles) noexcept;
  void swing_aborted() noexcept;
  // The last one that was latched.
  [[nodiscard]] const Decision& latched_decision() const noexcept { return latched_; }
  [[nodiscard]] std::uint32_t tread_id() const noexcept { return tread_id_; }  // under the foot that landed last
  [[nodiscard]] std::uint32_t treads_climbed() const noexcept { return treads_climbed_; }

 private:
  [[nodiscard]] bool leads_to_goal(const Situation& situation, const FootholdSet& footholds) const noexcept;
  [[nodiscard]] bool is_over_ramp(const Situation& situation, const FootholdSet& footholds) const noexcept;
  void look_for_ramps(const Situation& situation, const FootholdSet& footholds) noexcept;
  [[nodiscard]] bool saw_lately(const std::optional<std::int64_t>& stamp_ns, const Situation& situation) const noexcept;
  [[nodiscard]] Decision walk(const Situation& situation, const FootholdSet& footholds) const noexcept;
  [[nodiscard]] Decision trailing_step(const Situation& situation, const FootholdSet& footholds) const noexcept;
  // Down: the foot that trails goes on ahead of the other one on its tread, to the lip where that ends. There it
  // carries while the other one leads over, and nobody walks on the tread.
  bool trail_to_lip(const FootholdSet& footholds, const SolePose& leading, StepGoal& trailing) const noexcept;
  // Past the standing foot onto the tread beyond it; false when there is none to be sure of.
  [[nodiscard]] bool passing_step(const Situation& situation, const FootholdSet& footholds,
                                  Decision& decision) const noexcept;
  // The foot beside the other one on the same tread.
  [[nodiscard]] StepGoal closing_goal(const Situation& situation, const FootholdSet& footholds,
                                      Foot foot) const noexcept;
  [[nodiscard]] bool floor_goal(const Situation& situation, const FootholdSet& footholds,
                                StepGoal& goal) const noexcept;
  [[nodiscard]] StopReason reason_against(const Situation& situation, const FootholdSet& footholds) const noexcept;
  // Soles straight back from the footholds, so far that the toes are a stand-off from the nosing or the lip.
  struct StandOff;
  [[nodiscard]] StandOff stand_off(const Situation& situation, const FootholdSet& footholds) const noexcept;
  [[nodiscard]] bool lined_up(const Situation& situation, const StandOff& to, std::size_t foot) const noexcept;
  // From each collision toe; 0 where it leads over none.
  [[nodiscard]] std::array<double, kFootCount> to_lip_m(const Situation& situation,
                                                        const FootholdSet& footholds) const noexcept;
  [[nodiscard]] Foot leading_foot(const Situation& situation, const SolePair& targets) const noexcept;

  Params params_;
  const RobotModel* robot_ = nullptr;
  Decision latched_;
  // What a latch changes, and what it was before.
  struct Memory {
    Foothold trailing_foothold;           // from the leading latch
    Vec3 odom_trailing_m = Vec3::Zero();  // from the leading foot's target to it
    Foothold beside_foothold;             // the same beside it, where that goes on to a lip
    Vec3 odom_beside_m = Vec3::Zero();
    Foot last_swing = Foot::kRight;
    std::int32_t swings_in_a_row = 1;  // of that foot
    Foot leading = Foot::kLeft;
    bool has_leading = false;
    bool led_down = false;                                     // the step that led last
    bool trails_to_lip = false;                                // so does its trailing foothold
    double ramp = 0.0;                                         // that was on its way: by what it rises over a metre
    std::optional<std::int64_t> ramp_ns, stairs_over_ramp_ns;  // when it saw it, and stairs of or behind one
  } memory_, before_latch_;
  struct {
    double reach_m = 0.0;        // from so far off the legs have not refused to lead down yet
    bool trails_beside = false;  // they refused to trail to the next lip
  } over_lip_;
  struct {
    std::optional<Destination> asked;
    std::optional<WalkGoal> laid_out;
  } goal_;
  GoalWay way_;                // to where it is told to go
  bool walking_ = false;       // the last step was one to a place
  bool on_treads_ = false;     // false: on level ground, before stairs or behind them
  bool split_stance_ = false;  // the leading foot stands on a tread, the other one below: the trailing step ends this
  bool passing_refused_ = false;
  bool closes_up_ = false;
  SolePose landed_;                     // where the foot that landed last was to
  std::optional<SolePair> odom_stood_;  // both soles when it landed
  std::optional<Foot> slid_;            // since then, and is to be set back
  std::uint32_t set_back_ = 0;          // feet that slid, on this tread
  std::uint32_t tread_id_ = 0;          // under the foot that landed last
  std::uint32_t treads_climbed_ = 0;
  struct {
    double stride_share = 1.0;  // of a step's limits
    std::uint32_t steps = 0;
    std::uint32_t corrections = 0;  // the short ones of them
  } floor_;
};

}  // namespace polygmap
