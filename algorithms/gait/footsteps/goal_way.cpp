// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/goal_way.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "algorithms/geometry/line.hpp"

namespace polygmap {
namespace {

struct Stairs {
  Vec2 nosing_m;  // its middle
  double yaw_rad;
};

std::optional<Stairs> stairs_in(const FootholdSet& set) noexcept {
  const Vec2 left_m = set.tread.nosing_a_m.head<2>(), right_m = set.tread.nosing_b_m.head<2>();
  const Vec2 across_m = left_m - right_m;
  constexpr double kShortest_m = 0.40;  // a tread's own side is no front
  if (!(across_m.norm() > kShortest_m) || !(across_m.norm() < 1e3)) return std::nullopt;
  return Stairs{0.5 * (left_m + right_m), math::atan2(-across_m.x(), across_m.y())};
}

bool may_be_told_better(StopReason reason) noexcept {
  switch (reason) {
    case StopReason::kNone:
    case StopReason::kNothingSeen:
    case StopReason::kTreadTooShort:
    case StopReason::kTooNarrow:
    case StopReason::kEdgeUncertain:
    case StopReason::kObstacle:
    case StopReason::kRiseTooHigh:
      return true;
    default:
      return false;
  }
}

// Bits of a view as another one has them, whose corner is elsewhere.
void move_to(const Vec2& corner_m, GroundView::Rows& rows, Vec2& rows_corner_m) noexcept {
  if (corner_m == rows_corner_m) return;
  const Vec2 by = (corner_m - rows_corner_m) / GroundView::kCell_m;
  constexpr double kSide = GroundView::kSide_cells;
  const GroundView::Rows before = rows;
  rows = {};
  rows_corner_m = corner_m;
  if (!(by.cwiseAbs().maxCoeff() < kSide - 1.0)) return;
  const auto dx = static_cast<std::int32_t>(std::lround(by.x())), dy = static_cast<std::int32_t>(std::lround(by.y()));
  for (std::int32_t y = 0; y < GroundView::kSide_cells; ++y) {
    const std::int32_t from = y + dy;
    if (from < 0 || from >= GroundView::kSide_cells) continue;
    const std::uint64_t row = before[static_cast<std::size_t>(from)];
    rows[static_cast<std::size_t>(y)] =
        dx >= 0 ? row >> static_cast<std::uint32_t>(dx) : row << static_cast<std::uint32_t>(-dx);
  }
}

}  // namespace

void GoalWay::stepped() noexcept {
  is_known_ = false;
  round_ticks_ = refused_ticks_ = ticks_ = refusals_ = 0;
  ++steps_;
}

void GoalWay::seek_vantage(const GoalWayParams& params, const Input& in) noexcept {
  const TorsoPose middle = middle_of(in.soles);
  if (look_.from) {
    const Vec2 off_m = look_.from->odom_p_m - middle.position_m.head<2>();
    look_.done = look_.done || (off_m.norm() < params.looked_m &&
                                std::abs(math::wrap_angle(look_.from->yaw_rad - middle.yaw_rad)) < params.looked_rad);
  }
  const std::optional<Stairs> stairs = stairs_in(in.footholds);
  if (!stairs || in.is_over_ramp || !may_be_told_better(in.footholds.obstruction) || look_.count >= params.most_looks)
    return;
  const Vec2 heading = unit_at(stairs->yaw_rad);
  const Vec2 way_m = stairs->nosing_m - middle.position_m.head<2>();
  const bool offers = in.footholds.has_p_star && in.footholds.obstruction == StopReason::kNone;
  const auto by_rise = in.goal.is_by_rise(middle.position_m.z(), in.footholds.measured_rise_m);
  const bool is_behind = heading.dot(in.goal.odom_p_m - stairs->nosing_m) > 0.0;
  // What rises and cannot be climbed from here is a table more often than stairs: it has to lie on the way, too.
  const bool leads = heading.dot(way_m) > 0.0 && by_rise.value_or(is_behind) && (offers || is_behind);
  // From tread to tread a seen part of the nosing says little of its middle.
  const bool aside = (!(in.climbs && in.on_tread) && std::abs(left_of(heading).dot(way_m)) > params.aside_m) ||
                     std::abs(math::wrap_angle(stairs->yaw_rad - middle.yaw_rad)) > params.aside_rad;
  // Below a tread out of reach there are others, which were not seen from there.
  constexpr double kRise_m = 0.15, kTread_m = 0.30, kMost_m = 0.60;
  const double rise_m = in.footholds.measured_rise_m;
  if (rise_m > kMost_m) return;
  const double back_m = params.look_from_m + kTread_m * std::max(std::ceil(rise_m / kRise_m - 0.1) - 1.0, 0.0);
  const WalkGoal place{.odom_p_m = stairs->nosing_m - back_m * heading, .yaw_rad = stairs->yaw_rad, .has_yaw = true};
  if (!in.climbs && offers && by_rise.value_or(true)) other_stairs_ = place;
  if (!(leads || takes_any_) || !aside) return;
  if (look_.from && (look_.from->odom_p_m - place.odom_p_m).norm() < params.moved_m) return;
  look_.from = place;
  look_.done = false;
  ++look_.count;
  route_.clear();
}

void GoalWay::watch(const GoalWayParams& params, const Input& in) noexcept {
  for (GroundView::Rows* rows : {&barred_.unseen, &barred_.walked}) {
    Vec2 corner_m = barred_corner_m_;
    move_to(in.footholds.ground.corner_m, *rows, corner_m);
  }
  move_to(in.footholds.ground.corner_m, barred_.tried, barred_corner_m_);
  if (!(in.climbs && in.lines_up)) seek_vantage(params, in);
  if (in.climbs && !looks_first()) {
    goes_round_ = false;
    route_.clear();
    return;
  }
  const TorsoPose middle = middle_of(in.soles);
  constexpr double kNearer_m = 0.05;
  const double goal_m = (in.goal.odom_p_m - middle.position_m.head<2>()).norm();
  if (goal_m < nearest_m_ - kNearer_m) {
    nearest_m_ = goal_m;
    steps_ = shut_places_ = 0;
    first_refusal_.reset();
    gave_up_for_.reset();
    barred_.walked = {};
  }
  const Vec2 to_m = looks_first() ? look_.from->odom_p_m : in.goal.odom_p_m;
  if (route_.is_busy()) {
    route_.step(params.route);
  } else if (!is_known_ || ++ticks_ >= params.again_ticks) {
    ticks_ = 0;
    if (goes_round_) mark_place(in, params.tried_m, barred_.walked);
    route_.begin(params.route, in.footholds.ground, barred_, middle.position_m.head<2>(), to_m);
  }
  if (route_.is_busy()) return;
  is_known_ = true;
  const Vec2 way_m = to_m - middle.position_m.head<2>();
  faces_ = std::abs(math::wrap_angle(math::atan2(way_m.y(), way_m.x()) - middle.yaw_rad)) < params.faces_rad;
  const bool faces_again = goes_round_ && !in.goal.is_at_height(middle.position_m.z()) &&
                           (middle.position_m.head<2>() - faced_from_m_).norm() > params.face_again_m;
  if (faces_again || route_.way() != GroundRoute::Way::kRound || steps_ >= params.most_steps || gave_up_for_) {
    goes_round_ = false;
    round_ticks_ = 0;
  } else if ((faces_ && ++round_ticks_ >= params.sure_ticks) || refusals_ > 0) {
    // Where it was refused it has looked as long, and may be unable to turn: beside an edge.
    if (!goes_round_) faced_from_m_ = middle.position_m.head<2>();
    goes_round_ = true;
  }
}

void GoalWay::walked(const GoalWayParams& params, const Input& in, LevelStep::Outcome outcome,
                     const Refusal& refusal) noexcept {
  if (outcome == LevelStep::Outcome::kSteps) {
    refused_ticks_ = 0;
    return;
  }
  if (looks_first() && outcome == LevelStep::Outcome::kArrived) look_.done = true;
  if (++refused_ticks_ < params.sure_ticks || gave_up_for_) return;
  refused_ticks_ = 0;
  const bool shut = outcome != LevelStep::Outcome::kArrived;
  const bool below_or_above = !shut && !goes_round_ && !in.goal.is_at_height(middle_of(in.soles).position_m.z());
  if (shut && !first_refusal_) first_refusal_ = refusal;
  if (shut && refusals_ == 0) ++shut_places_;  // who waits before a thing that may go is in one place
  const bool searched = shut_places_ > params.most_refusals || steps_ >= params.most_steps;
  const bool last_way_is_stairs = (++refusals_ > 1 || searched) && other_stairs_ && !takes_any_;
  if (last_way_is_stairs) {
    steps_ = shut_places_ = 0;  // the way to them may lead away from the goal
    nearest_m_ = std::numeric_limits<double>::infinity();
    takes_any_ = true;
    look_.from = other_stairs_;
    look_.done = false;
    barred_ = {};
  } else if (searched) {
    gave_up_for_ = first_refusal_;
  } else if (looks_first()) {
    look_.done = true;  // from as near as it could come
  } else if (below_or_above) {
    look_round(params, in);
  } else if (outcome == LevelStep::Outcome::kNoGround) {
    bar_unseen(in);
  } else if (outcome == LevelStep::Outcome::kBlocked) {
    mark_place(in, params.tried_m, barred_.tried);
  }
  route_.clear();
  goes_round_ = false;
  round_ticks_ = 0;
  ticks_ = params.again_ticks;
}

// It stands below or above the goal, and what it has seen leads nowhere else: stairs may begin behind it.
void GoalWay::look_round(const GoalWayParams& params, const Input& in) noexcept {
  if (look_.turns >= params.most_turns) return;
  ++look_.turns;
  const TorsoPose middle = middle_of(in.soles);
  look_.from = WalkGoal{.odom_p_m = middle.position_m.head<2>(),
                        .yaw_rad = math::wrap_angle(middle.yaw_rad + 0.5 * kPi),
                        .has_yaw = true};
  look_.done = false;
}

void GoalWay::mark_place(const Input& in, double within_m, GroundView::Rows& rows) noexcept {
  const Vec2 at_m = middle_of(in.soles).position_m.head<2>() - in.footholds.ground.corner_m;
  const std::int32_t last_y = std::min(GroundView::cell_of(at_m.y() + within_m), GroundView::kSide_cells - 1);
  for (std::int32_t y = std::max(GroundView::cell_of(at_m.y() - within_m), 0); y <= last_y; ++y) {
    const double off_m = (y + 0.5) * GroundView::kCell_m - at_m.y();
    const double half_m = math::sqrt(std::max(math::square(within_m) - math::square(off_m), 0.0));
    constexpr double kHalf_m = 0.5 * GroundView::kCell_m;  // of a square: its middle counts
    rows[static_cast<std::size_t>(y)] |= GroundView::bits_of(GroundView::cell_of(at_m.x() - half_m + kHalf_m),
                                                             GroundView::cell_of(at_m.x() + half_m - kHalf_m));
  }
}

// What the camera looks at before the feet, and is not known to be level.
void GoalWay::bar_unseen(const Input& in) noexcept {
  const TorsoPose middle = middle_of(in.soles);
  const Vec2 ahead = unit_at(middle.yaw_rad), left = left_of(ahead);
  constexpr double kFrom_m = 0.10, kTo_m = 0.75, kHalf_m = 0.20, kWider = 0.3;
  constexpr double kReach_m = kTo_m + kHalf_m;  // more than it is to the farthest corner
  const GroundView& ground = in.footholds.ground;
  const Vec2 at_m = middle.position_m.head<2>() - ground.corner_m;
  const std::uint64_t about =
      GroundView::bits_of(GroundView::cell_of(at_m.x() - kReach_m), GroundView::cell_of(at_m.x() + kReach_m));
  const std::int32_t last_y = std::min(GroundView::cell_of(at_m.y() + kReach_m), GroundView::kSide_cells - 1);
  for (std::int32_t y = std::max(GroundView::cell_of(at_m.y() - kReach_m), 0); y <= last_y; ++y) {
    const auto row = static_cast<std::size_t>(y);
    for (std::uint64_t unseen = ~(ground.level[row] | ground.tall[row]) & about; unseen != 0; unseen &= unseen - 1) {
      const int x = std::countr_zero(unseen);
      const Vec2 p_m = Vec2{x + 0.5, y + 0.5} * GroundView::kCell_m - at_m;
      const double ahead_m = ahead.dot(p_m);
      if (ahead_m < kFrom_m || ahead_m > kTo_m || std::abs(left.dot(p_m)) > kHalf_m + kWider * ahead_m) continue;
      barred_.unseen[row] |= std::uint64_t{1} << static_cast<std::uint32_t>(x);
    }
  }
}

std::optional<WalkGoal> GoalWay::next(const WalkGoal& goal) const noexcept {
  if (!is_known_) return std::nullopt;
  if (goes_round_) return WalkGoal{route_.via_m(), 0.0, false};
  // What is in the way it first turns to, and looks at for a while.
  if (faces_ && round_ticks_ > 0) return std::nullopt;
  return looks_first() ? *look_.from : goal;
}

}  // namespace polygmap
