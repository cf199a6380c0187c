// SPDX-License-Identifier: Apache-2.0
// Where to walk next on the way to a place: round what stands there, and before stairs that were seen from aside to
// where the search sees them whole.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/gait/footsteps/footstep_plan.hpp"
#include "algorithms/gait/footsteps/ground_route.hpp"
#include "algorithms/gait/footsteps/level_walk.hpp"

namespace polygmap {

struct GoalWayParams {
  double look_from_m = 0.45;
  double aside_m = 0.25;
  double aside_rad = 0.40;
  double looked_m = 0.08;
  double looked_rad = 0.15;
  double moved_m = 0.12;
  std::int32_t most_looks = 12;
  std::int32_t most_turns = 3;
  std::int32_t most_steps = 40;  // this and most_refusals: chosen by hand, tried on a few worlds of the simulation
  std::int32_t most_refusals = 6;
  double faces_rad = 0.5;
  double tried_m = 0.35;
  double face_again_m = 0.8;
  std::int32_t sure_ticks = 200;
  std::int32_t again_ticks = 100;
  GroundRouteParams route;

  static void visit(auto& p, auto& field) {
    field("look_from_m", p.look_from_m, 0.2, 2.0,
          "Stairs seen from aside are looked at with the feet's middle so far before the middle of their nosing.");
    field("aside_m", p.aside_m, 0.05, 2.0, "They are seen from aside when that middle is as far to the left or right.");
    field("aside_rad", p.aside_rad, 0.05, 1.5, "They are, too, when the robot is turned as far from their heading.");
    field("looked_m", p.looked_m, 0.02, 0.5, "It looks from there when it stands as near to it.");
    field("looked_rad", p.looked_rad, 0.02, 0.5, "It looks from there when it is turned as nearly.");
    field("moved_m", p.moved_m, 0.01, 1.0,
          "The place to look from is another one when the nosing is as far from before.");
    field("most_looks", p.most_looks, 1, 1000, "Between two treads no more places to look from are gone to.");
    field("most_turns", p.most_turns, 0, 100,
          "Below or above the goal it turns by 90 degrees so often to look for stairs, before it gives up.");
    field("most_steps", p.most_steps, 0, 10000,
          "It looks for no other way after as many steps without coming nearer to the goal.");
    field("most_refusals", p.most_refusals, 1, 1000,
          "It looks for no other way after it came no further in so many places without coming nearer to the goal.");
    field("faces_rad", p.faces_rad, 0.05, 3.2, "It turns to what is in the way, within this, before it goes round.");
    field("tried_m", p.tried_m, 0.1, 1.0,
          "Where it stood before a thing and came no further, no way leads through so much about its place.");
    field("face_again_m", p.face_again_m, 0.1, 10.0,
          "Going round below or above the goal it turns to what is in the way again after as far: stairs may begin "
          "there. Chosen by hand for landings.");
    field(
        "sure_ticks", p.sure_ticks, 0, 10000,
        "It looks so long at what is in the way before it goes round, and at ground before it believes there is none.");
    field("again_ticks", p.again_ticks, 1, 10000, "While it stands it looks for a way again after as long.");
    field("route", p.route);
  }
};

class GoalWay {
 public:
  struct Input {
    const SolePair& soles;
    const FootholdSet& footholds;
    const WalkGoal& goal;
    bool climbs = false;    // stairs that it sees lead to the goal
    bool lines_up = false;  // with them: it has stood before them
    bool on_tread = false;
    bool is_over_ramp = false;  // these stairs are behind or of one that is too steep to walk on
  };

  // Why it came no further, and the rise, drop or tread behind it.
  struct Refusal {
    StopReason reason = StopReason::kNone;
    double measured_m = 0.0;
  };

  // Each tick that it stands and may step, before next() is asked.
  void watch(const GoalWayParams& params, const Input& in) noexcept;
  // A step was taken: what is in the way is looked for anew.
  void stepped() noexcept;
  void forget() noexcept { std::construct_at(this); }  // in place: another one would take kilobytes of stack
  // The step to the next place came out so, this tick.
  void walked(const GoalWayParams& params, const Input& in, LevelStep::Outcome outcome,
              const Refusal& refusal) noexcept;

  [[nodiscard]] bool looks_first() const noexcept { return look_.from && !look_.done; }
  // No other way is left than up stairs that it saw, though they do not seem to lead to the goal: as where they turn
  // back on a landing.
  [[nodiscard]] bool takes_any_stairs() const noexcept { return takes_any_; }
  // The next place is not the goal.
  [[nodiscard]] bool is_on_its_way() const noexcept { return looks_first() || goes_round_; }
  // What was in the way where it first came no further since it was nearest to the goal, once it looks for no other
  // way.
  [[nodiscard]] const std::optional<Refusal>& gave_up_for() const noexcept { return gave_up_for_; }
  // Where to walk next; none: that is not known yet.
  [[nodiscard]] std::optional<WalkGoal> next(const WalkGoal& goal) const noexcept;

 private:
  void seek_vantage(const GoalWayParams& params, const Input& in) noexcept;
  void look_round(const GoalWayParams& params, const Input& in) noexcept;
  void bar_unseen(const Input& in) noexcept;
  static void mark_place(const Input& in, double within_m, GroundView::Rows& rows) noexcept;

  struct {
    std::optional<WalkGoal> from;
    bool done = false;
    std::int32_t count = 0;
    std::int32_t turns = 0;  // to look for stairs, below or above the goal
  } look_;
  std::optional<WalkGoal> other_stairs_;  // from where stairs were to be looked at that do not seem to lead to the goal
  bool takes_any_ = false;
  GroundRoute route_;
  GroundRoute::Barred barred_;
  Vec2 barred_corner_m_ = Vec2::Zero();
  bool is_known_ = false;  // the way, since the last step
  bool goes_round_ = false;
  bool faces_ = false;                // the place that it would go to straight on
  Vec2 faced_from_m_ = Vec2::Zero();  // where it began to go round
  std::int32_t round_ticks_ = 0, refused_ticks_ = 0, ticks_ = 0, steps_ = 0;
  double nearest_m_ = std::numeric_limits<double>::infinity();  // to the goal, since the last tread
  std::int32_t refusals_ = 0;                                   // since the last step
  std::int32_t shut_places_ = 0;                        // where it came no further, since it was nearest to the goal
  std::optional<Refusal> first_refusal_, gave_up_for_;  // since then
};

}  // namespace polygmap
