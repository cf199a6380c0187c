// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/level_walk.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "algorithms/geometry/line.hpp"

namespace polygmap {

bool LevelWalk::carries(const GroundView& ground, const OrientedRectangle& sole) noexcept {
  const Vec2 ahead = unit_at(sole.yaw_rad), left = left_of(ahead);
  const Vec2 at_m = sole.centre_m - ground.corner_m;
  const Vec2 reach_m = sole.half_length_m * ahead.cwiseAbs() + sole.half_width_m * left.cwiseAbs();
  const std::int32_t first_x = GroundView::cell_of(at_m.x() - reach_m.x()),
                     last_x = GroundView::cell_of(at_m.x() + reach_m.x());
  const std::int32_t first_y = GroundView::cell_of(at_m.y() - reach_m.y()),
                     last_y = GroundView::cell_of(at_m.y() + reach_m.y());
  if (first_x < 0 || first_y < 0 || last_x >= GroundView::kSide_cells || last_y >= GroundView::kSide_cells)
    return false;
  // Mostly there is ground all about it.
  const std::uint64_t about = GroundView::bits_of(first_x, last_x);
  bool all = true;
  for (std::int32_t y = first_y; y <= last_y; ++y)
    all = all && (~ground.level[static_cast<std::size_t>(y)] & about) == 0;
  if (all) return true;
  // Lines and points as near together as half a square miss none that the rectangle covers by more than a corner.
  constexpr double kStep_m = 0.5 * GroundView::kCell_m;
  const auto steps = [](double half_m) { return static_cast<std::int32_t>(std::ceil(2.0 * half_m / kStep_m)); };
  const std::int32_t along = steps(sole.half_length_m), across = steps(sole.half_width_m);
  for (std::int32_t i = 0; i <= along; ++i) {
    for (std::int32_t j = 0; j <= across; ++j) {
      const Vec2 p_m = at_m + (2.0 * i / along - 1.0) * sole.half_length_m * ahead +
                       (2.0 * j / across - 1.0) * sole.half_width_m * left;
      if (!GroundView::has(ground.level, GroundView::cell_of(p_m.x()), GroundView::cell_of(p_m.y()))) return false;
    }
  }
  return true;
}

double LevelWalk::ramp_on_way(const GroundView& ground, const Vec2& from_m, const Vec2& to_m) noexcept {
  constexpr double kFar_m = 0.8, kAside_m = 0.1;
  if (!(ground.steepest > 0.0)) return 0.0;
  const double way_m = (to_m - from_m).norm();
  const Vec2 ahead = way_m > 0.0 ? Vec2{(to_m - from_m) / way_m} : Vec2::Zero();
  const auto squares = static_cast<std::int32_t>(std::ceil(std::min(way_m, kFar_m) / GroundView::kCell_m));
  for (std::int32_t i = 0; i <= squares; ++i) {
    for (const double aside_m : {-kAside_m, 0.0, kAside_m}) {
      const Vec2 at_m = from_m + i * GroundView::kCell_m * ahead + aside_m * left_of(ahead) - ground.corner_m;
      if (GroundView::has(ground.ramps, GroundView::cell_of(at_m.x()), GroundView::cell_of(at_m.y())))
        return ground.steepest;
    }
  }
  return 0.0;
}

double LevelWalk::clearance_m(const GroundView& ground, const Vec2& odom_p_m, double most_m) noexcept {
  const Vec2 at_m = odom_p_m - ground.corner_m;
  double least2_m2 = math::square(most_m);
  const std::uint64_t about =
      GroundView::bits_of(GroundView::cell_of(at_m.x() - most_m), GroundView::cell_of(at_m.x() + most_m));
  const std::int32_t first_y = std::max(GroundView::cell_of(at_m.y() - most_m), 0);
  const std::int32_t last_y = std::min(GroundView::cell_of(at_m.y() + most_m), GroundView::kSide_cells - 1);
  for (std::int32_t y = first_y; y <= last_y; ++y) {
    for (std::uint64_t tall = ground.tall[static_cast<std::size_t>(y)] & about; tall != 0; tall &= tall - 1) {
      const Vec2 middle_m = Vec2{std::countr_zero(tall) + 0.5, y + 0.5} * GroundView::kCell_m;
      least2_m2 = std::min(least2_m2, (middle_m - at_m).squaredNorm());
    }
  }
  return math::sqrt(least2_m2);
}

bool LevelWalk::is_there(const SolePose& sole, Foot foot, const TorsoPose& at) const noexcept {
  const SolePose to = foot_of_torso(at, foot, half_width_m_, 0.0);
  const Vec2 off_m = (rotation_z(to.yaw_rad).transpose() * (sole.position_m - to.position_m)).head<2>();
  return off_m.cwiseAbs().maxCoeff() <= params_.within_m &&
         std::abs(math::wrap_angle(sole.yaw_rad - to.yaw_rad)) <= params_.within_rad;
}

// Where the torso is to go from there: first round towards the goal, then on to it, last round as it is to stand.
LevelWalk::Aim LevelWalk::aim(const TorsoPose& middle, const WalkGoal& goal) const noexcept {
  const Vec2 way_m = goal.odom_p_m - middle.position_m.head<2>();
  Aim aim{middle, false};
  if (way_m.norm() > params_.near_m) {
    aim.pose.yaw_rad = math::atan2(way_m.y(), way_m.x());
    aim.turns_first = std::abs(math::wrap_angle(aim.pose.yaw_rad - middle.yaw_rad)) > params_.turn_first_rad;
    if (aim.turns_first) return aim;
  } else if (goal.has_yaw) {
    aim.pose.yaw_rad = goal.yaw_rad;
  }
  aim.pose.position_m.head<2>() = goal.odom_p_m;
  return aim;
}

bool LevelWalk::has_arrived(const SolePair& soles, const WalkGoal& goal) const noexcept {
  const TorsoPose middle = middle_of(soles);
  const TorsoPose to = aim(middle, goal).pose;
  return goal.is_at_height(middle.position_m.z()) && is_there(soles[0], Foot::kLeft, to) &&
         is_there(soles[1], Foot::kRight, to);
}

LevelStep LevelWalk::next(const SolePair& soles, const LastSwing& last, const WalkGoal& goal,
                          const GroundView& ground) const noexcept {
  const TorsoPose middle = middle_of(soles);
  const Aim to = aim(middle, goal);
  const auto is_there = [&](Foot foot) { return this->is_there(soles[index_of(foot)], foot, to.pose); };
  LevelStep step;
  // Of before the last step, from another level.
  if (!(std::abs(ground.height_m - middle.position_m.z()) < params_.level_m)) return step;
  if (is_there(Foot::kLeft) && is_there(Foot::kRight)) {
    step.outcome = LevelStep::Outcome::kArrived;
    return step;
  }
  step.foot = other(last.foot);
  if (last.begins) step.foot = swing_foot(displacement(middle, to.pose), step.foot, rule_);
  if (is_there(step.foot)) step.foot = other(step.foot);
  if (try_steps(soles, to, ground, step)) return step;
  // Beside an edge the foot away from it steps farther away first, and then the other one has to follow: eight steps of
  // one foot, to and fro, ended in a fall.
  constexpr std::int32_t kMost = 3;
  if (last.in_a_row >= kMost && !last.begins) return step;
  LevelStep of_other;
  of_other.foot = other(step.foot);
  if (is_there(of_other.foot) || !try_steps(soles, to, ground, of_other)) return step;
  const SolePose& now = soles[index_of(of_other.foot)];
  const bool moves = (of_other.target.position_m - now.position_m).head<2>().norm() > params_.within_m ||
                     std::abs(math::wrap_angle(of_other.target.yaw_rad - now.yaw_rad)) > params_.within_rad;
  return moves ? of_other : step;
}

bool LevelWalk::try_steps(const SolePair& soles, const Aim& to, const GroundView& ground,
                          LevelStep& step) const noexcept {
  const TorsoPose middle = middle_of(soles);
  const double now_m = clearance_m(ground, middle.position_m.head<2>(), params_.body_m);
  // A shorter step may still be on what was seen; and from an edge or a wall it goes a step away before it turns.
  constexpr std::array kShares{1.0, 0.5, 0.25};
  struct Away {
    double ahead_m, left_m;
  };
  constexpr std::array kAway{Away{0.0, 0.0},  Away{0.1, 0.0}, Away{0.2, 0.0},
                             Away{-0.1, 0.0}, Away{0.0, 0.1}, Away{0.0, -0.1}};
  for (const double share : kShares) {
    if (try_step(soles, to.pose, shortened(limits_, share), ground, now_m, step)) return true;
  }
  const double turn_rad = math::wrap_angle(to.pose.yaw_rad - middle.yaw_rad);
  if (!to.turns_first && std::abs(turn_rad) < params_.within_rad) return false;
  const LevelStep refused = step;
  for (const double turn_share : {1.0, 0.0}) {
    if (turn_share == 0.0 && !to.turns_first) break;
    for (const Away& away : kAway) {
      TorsoPose aside = middle;
      const Vec2 heading = unit_at(middle.yaw_rad);
      aside.position_m.head<2>() += away.ahead_m * heading + away.left_m * left_of(heading);
      aside.yaw_rad += turn_share * turn_rad;
      if (try_step(soles, aside, limits_, ground, now_m, step)) return true;
    }
  }
  step = refused;
  return false;
}

bool LevelWalk::try_step(const SolePair& soles, const TorsoPose& to, const FloorStepLimits& limits,
                         const GroundView& ground, double now_m, LevelStep& step) const noexcept {
  const SolePose& stance = soles[index_of(other(step.foot))];
  FloorStepLimits of_foot = limits;
  if (side_sign(step.foot) * math::wrap_angle(to.yaw_rad - stance.yaw_rad) > 0.0) of_foot.turn_rad *= params_.turn_out;
  step.target = floor_step(sole_.collision, stance, step.foot, to, half_width_m_, of_foot);
  SolePair landed = soles;
  landed[index_of(step.foot)] = step.target;
  if (clearance_m(ground, middle_of(landed).position_m.head<2>(), params_.body_m) < now_m) {
    step.outcome = LevelStep::Outcome::kBlocked;
  } else if (!carries(ground, foot_rectangle(sole_.contact, step.target, params_.sole_margin_m))) {
    step.outcome = LevelStep::Outcome::kNoGround;
  } else {
    step.outcome = LevelStep::Outcome::kSteps;
  }
  return step.outcome == LevelStep::Outcome::kSteps;
}

}  // namespace polygmap
