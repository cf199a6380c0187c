// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/climb_planner.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "algorithms/geometry/line.hpp"
#include "algorithms/geometry/oriented_rectangle.hpp"

namespace polygmap {
namespace {

// A sole is laid on a slope of 10 degrees at most.
constexpr double kLeastUp = 0.985;

bool usable(const Foothold& f) noexcept {
  return math::all_finite(f.position_m) && std::isfinite(f.yaw_rad) && f.up.z() > kLeastUp;
}

SolePose sole_on(const Foothold& foothold) noexcept { return {foothold.position_m, foothold.yaw_rad, foothold.up}; }

Foothold foothold_at(const SolePose& target, std::int64_t last_seen_ns) noexcept {
  Foothold foothold;
  foothold.position_m = target.position_m;
  foothold.yaw_rad = target.yaw_rad;
  foothold.up = target.up;
  foothold.last_seen_ns = last_seen_ns;
  return foothold;
}

bool usable(const std::array<Foothold, kFootCount>& feet) noexcept { return usable(feet[0]) && usable(feet[1]); }

double measured(const FootholdSet& set) noexcept {
  switch (set.obstruction) {
    case StopReason::kRiseTooHigh:
      return set.measured_rise_m;
    case StopReason::kDropTooDeep:
      return -set.measured_rise_m;
    case StopReason::kTreadTooShort:
      return set.measured_tread_m;
    default:
      return 0.0;
  }
}

struct Nosing {
  Vec3 odom_p_a, odom_p_b;
};
// Distance from the foremost corner of the foot to the line through the nosing, along `yaw_rad`; positive before it.
double toe_to_line_m(const SoleRectangle& collision, const SolePose& sole, const Nosing& nosing,
                     double yaw_rad) noexcept {
  const Mat3 R = rotation_z(yaw_rad).transpose();
  const Vec3 a = R * nosing.odom_p_a, b = R * nosing.odom_p_b;
  double least_m = 1e9;
  for (const double side : {-1.0, 1.0}) {
    const Vec3 corner = sole.transform() * Vec3{collision.toe_x_m, side * collision.half_width_m, 0};
    const Vec3 p = R * corner;
    const double along = std::abs(b.y() - a.y()) > 0.05 ? (p.y() - a.y()) / (b.y() - a.y()) : 0.5;
    least_m = std::min(least_m, a.x() + along * (b.x() - a.x()) - p.x());
  }
  return least_m;
}

}  // namespace

struct ClimbPlanner::StandOff {
  Nosing nosing;
  double yaw_rad = 0.0;
  bool at_lip = false;  // it is the edge of what it stands on
  SolePair soles;
};

void ClimbPlanner::reset(const Params& params, const RobotModel& robot) noexcept {
  std::construct_at(this);  // in place: another one would take kilobytes of stack
  params_ = params;
  robot_ = &robot;
  over_lip_.reach_m = params.lip.far_m;
}

void ClimbPlanner::restart() noexcept {
  floor_.stride_share = 1.0;
  floor_.steps = floor_.corrections = 0;
  way_.forget();
  passing_refused_ = closes_up_ = over_lip_.trails_beside = false;
  over_lip_.reach_m = params_.lip.far_m;
  odom_stood_.reset();
  slid_.reset();
  set_back_ = 0;
}

ClimbPlanner::Decision ClimbPlanner::trailing_step(const Situation& situation,
                                                   const FootholdSet& footholds) const noexcept {
  Decision decision;
  decision.has_step = true;
  StepGoal& goal = decision.goal;
  goal.kind = StepKind::kTrailing;
  goal.foot = other(memory_.leading);
  if (memory_.trails_to_lip && over_lip_.trails_beside) {
    goal.foothold = memory_.beside_foothold;
    goal.foothold.position_m = situation.soles[index_of(memory_.leading)].position_m + memory_.odom_beside_m;
    goal.target = sole_on(goal.foothold);
    return decision;
  }
  // The search looks from the foot that stands and soon offers the tread above: then the memory holds.
  const Foothold& seen = footholds.p_star_feet[index_of(goal.foot)];
  const bool same_tread = footholds.has_p_star && seen.polygon_id == memory_.trailing_foothold.polygon_id &&
                          usable(seen) && (footholds.has_lip_beyond || !memory_.trails_to_lip);
  goal.foothold = same_tread ? seen : memory_.trailing_foothold;
  goal.target = sole_on(goal.foothold);
  decision.trails_to_lip = memory_.trails_to_lip;
  if (same_tread && memory_.trails_to_lip) {
    decision.trails_to_lip = trail_to_lip(footholds, situation.soles[index_of(memory_.leading)], goal);
  }
  if (situation.stamp_ns - goal.foothold.last_seen_ns <= params_.remembered_ns) return decision;
  // Odometry has wandered since, but not from the foot that stands there: as far from it as the two footholds were.
  decision.trails_to_lip = memory_.trails_to_lip;
  goal.foothold = memory_.trailing_foothold;
  goal.foothold.last_seen_ns = 0;
  goal.foothold.position_m = situation.soles[index_of(memory_.leading)].position_m + memory_.odom_trailing_m;
  goal.target = sole_on(goal.foothold);
  return decision;
}

bool ClimbPlanner::trail_to_lip(const FootholdSet& footholds, const SolePose& leading,
                                StepGoal& trailing) const noexcept {
  if (over_lip_.trails_beside || !footholds.has_lip_beyond) return false;
  const Nosing lip{footholds.lip_beyond.nosing_a_m, footholds.lip_beyond.nosing_b_m};
  const Vec2 along = (lip.odom_p_b - lip.odom_p_a).head<2>();
  if (!(along.norm() > 0.0)) return false;
  const Vec2 over = left_of(along);
  const double yaw_rad = trailing.target.yaw_rad;
  const double turn_rad = math::clamp(math::wrap_angle(math::atan2(over.y(), over.x()) - yaw_rad),
                                      -params_.floor.turn_rad, params_.floor.turn_rad);
  SolePose target = trailing.target;
  target.yaw_rad = math::wrap_angle(yaw_rad + turn_rad);
  const double to_lip_m = toe_to_line_m(robot_->sole.collision, target, lip, target.yaw_rad);
  const double ahead_m = to_lip_m - params_.lip.trailing_stand_off_m;
  if (to_lip_m < params_.lip.near_m || ahead_m > params_.lip.trailing_ahead_m) return false;
  // The search judged it where it lies beside: what rises on the tread, and where that ends to either side.
  constexpr double kLeastAside_m = 0.01;
  Foothold& foothold = trailing.foothold;
  const double aside_m = (ahead_m + robot_->sole.contact.toe_x_m) * std::abs(math::sin(turn_rad));
  const double room_m = std::min(foothold.side_room_m[0], foothold.side_room_m[1]);
  if (ahead_m > foothold.toe_clearance_m - params_.floor_clearance_m || aside_m > room_m - kLeastAside_m) return false;
  const Vec2 way_m = ahead_m * unit_at(target.yaw_rad);
  target.position_m.head<2>() += way_m;
  target.position_m.z() -= target.up.head<2>().dot(way_m) / target.up.z();
  if (overlap(foot_rectangle(robot_->sole.collision, target, params_.floor.overlap_margin_m),
              foot_rectangle(robot_->sole.collision, leading, params_.floor.overlap_margin_m)))
    return false;
  const SoleModel& sole = robot_->sole;
  const double lip_clearance_m = params_.lip.trailing_stand_off_m + sole.collision.toe_x_m - sole.contact.toe_x_m;
  foothold.clearance_m = std::min(foothold.clearance_m, lip_clearance_m);
  foothold.toe_clearance_m -= ahead_m;
  for (double& side_m : foothold.side_room_m) side_m -= aside_m;
  foothold.nosing_distance_m += unit_at(yaw_rad).dot(way_m);
  foothold.position_m = target.position_m;
  foothold.yaw_rad = target.yaw_rad;
  trailing.target = target;
  return true;
}

// The rear foot's p** is the standing foot's p*. A search from before the standing foot landed has its tread for p* and
// the one beyond for p**: the weight need not wait for the next one.
bool ClimbPlanner::passing_step(const Situation& situation, const FootholdSet& footholds,
                                Decision& decision) const noexcept {
  if (params_.pattern != GaitPattern::kSingleStep || passing_refused_) return false;
  if (footholds.map_stamp_ns <= 0 || situation.stamp_ns - footholds.map_stamp_ns > params_.max_map_age_ns) return false;
  if (footholds.obstruction != StopReason::kNone || !footholds.has_p_star || !usable(footholds.p_star_feet)) {
    return false;
  }
  const Foot foot = other(memory_.leading);
  const double standing_m = situation.soles[index_of(memory_.leading)].position_m.z();
  const auto rise_m = [&](const std::array<Foothold, kFootCount>& feet) {
    return sole_on(feet[index_of(foot)]).position_m.z() - standing_m;
  };
  const auto* feet = &footholds.p_star_feet;
  if ((*feet)[0].polygon_id == tread_id_ || rise_m(*feet) < params_.min_rise_m) {
    feet = &footholds.p_star_star_feet;
    if (!footholds.has_p_star_star || !usable(*feet) || rise_m(*feet) < params_.min_rise_m) return false;
  }
  if (rise_m(*feet) > params_.max_passing_rise_m) return false;
  decision.has_step = true;
  decision.rise_m = rise_m(*feet);
  const auto goal = [&](StepKind kind, Foot f) -> StepGoal {
    const Foothold& foothold = (*feet)[index_of(f)];
    return {kind, f, sole_on(foothold), foothold};
  };
  decision.goal = goal(StepKind::kPassing, foot);
  decision.trailing = goal(StepKind::kTrailing, memory_.leading);
  return true;
}

Foot ClimbPlanner::leading_foot(const Situation& situation, const SolePair& targets) const noexcept {
  const TorsoDisplacement step = displacement(middle_of(situation.soles), middle_of(targets));
  // With the weight on its way, and from tread to tread, the foot stays the one it was: a footstep may go that far
  // sideways with either, and the other one just landed (seed 16 of ten steps toppled by 20 mm when it had to lead at
  // once).
  if (situation.leads || on_treads_) {
    return swing_foot(
        step, situation.leads ? situation.leading : memory_.leading,
        {params_.turn_round * params_.rule.lateral_dead_band_m, params_.turn_round * params_.rule.turn_dead_band_rad});
  }
  return swing_foot(step, memory_.has_leading ? memory_.leading : other(memory_.last_swing), params_.rule);
}

ClimbPlanner::StandOff ClimbPlanner::stand_off(const Situation& situation,
                                               const FootholdSet& footholds) const noexcept {
  const TreadView& tread = footholds.tread;
  const SolePair on_tread{sole_on(footholds.p_star_feet[0]), sole_on(footholds.p_star_feet[1])};
  const double floor_m = middle_of(situation.soles).position_m.z();
  StandOff to{{tread.nosing_a_m, tread.nosing_b_m}, middle_of(on_tread).yaw_rad, false, {}};
  to.at_lip = middle_of(on_tread).position_m.z() < floor_m;
  const double stand_off_m = to.at_lip ? params_.lip.stand_off_m : params_.stand_off_m;
  for (std::size_t i = 0; i < kFootCount; ++i) {
    const double back_m = stand_off_m - toe_to_line_m(robot_->sole.collision, on_tread[i], to.nosing, to.yaw_rad);
    to.soles[i] = {on_tread[i].position_m - rotation_z(to.yaw_rad) * Vec3{back_m, 0, 0}, to.yaw_rad};
    to.soles[i].position_m.z() = floor_m;
  }
  return to;
}

bool ClimbPlanner::lined_up(const Situation& situation, const StandOff& to, std::size_t foot) const noexcept {
  const double relaxed = floor_.corrections > params_.line_up.strict_corrections
                             ? 1.0 + 0.5 * (floor_.corrections - params_.line_up.strict_corrections)
                             : 1.0;
  // With the leading step under way a little more is no reason to line up again.
  const double tolerance =
      std::min(relaxed, params_.line_up.max_relaxation) + (situation.leads ? params_.line_up.under_way : 0.0);
  const SolePose& sole = situation.soles[foot];
  const Vec3 off_m = rotation_z(to.yaw_rad).transpose() * (sole.position_m - to.soles[foot].position_m);
  return std::abs(off_m.x()) <= tolerance * params_.line_up.along_m &&
         std::abs(off_m.y()) <= tolerance * params_.line_up.lateral_m &&
         std::abs(math::wrap_angle(sole.yaw_rad - to.yaw_rad)) <= tolerance * params_.line_up.yaw_rad &&
         toe_to_line_m(robot_->sole.collision, sole, to.nosing, to.yaw_rad) >=
             (to.at_lip ? params_.lip.min_stand_off_m : params_.min_stand_off_m);
}

std::array<double, kFootCount> ClimbPlanner::to_lip_m(const Situation& situation,
                                                      const FootholdSet& footholds) const noexcept {
  const StandOff to = stand_off(situation, footholds);
  if (!to.at_lip) return {};
  const auto of = [&](Foot foot) {
    return toe_to_line_m(robot_->sole.collision, situation.soles[index_of(foot)], to.nosing, to.yaw_rad);
  };
  return {of(Foot::kLeft), of(Foot::kRight)};
}

bool ClimbPlanner::floor_goal(const Situation& situation, const FootholdSet& footholds, StepGoal& goal) const noexcept {
  const StandOff to = stand_off(situation, footholds);
  const std::array<bool, kFootCount> lined{lined_up(situation, to, 0), lined_up(situation, to, 1)};
  if (lined[0] && lined[1]) return false;

  const TorsoPose torso_goal = middle_of(to.soles);
  Foot foot = other(memory_.last_swing);
  if (lined[index_of(foot)]) {
    foot = other(foot);
  } else if (floor_.steps == 0) {
    foot = swing_foot(displacement(middle_of(situation.soles), torso_goal), foot, params_.rule);
  }
  const double half_width_m =
      math::clamp(0.5 * (to.soles[0].position_m - to.soles[1].position_m).norm(), params_.width.least_half_m,
                  robot_->stance.half_width_m + params_.width.wider_m);
  const SolePose& stance = situation.soles[index_of(other(foot))];
  goal = {};
  goal.kind = StepKind::kFloor;
  goal.foot = foot;
  // Before a slanted edge one foot stands farther back than the other.
  const TorsoPose torso_of_its_own = torso_of_foot(to.soles[index_of(foot)], foot, half_width_m, 0.0);
  goal.target = floor_step(robot_->sole.collision, stance, foot, torso_of_its_own, half_width_m,
                           shortened(params_.floor, floor_.stride_share));
  // On the way, with the heading still wrong, no toe comes near the riser.
  const double short_m = (to.at_lip ? params_.lip.clearance_m : params_.floor_clearance_m) -
                         toe_to_line_m(robot_->sole.collision, goal.target, to.nosing, to.yaw_rad);
  if (short_m > 0.0) goal.target.position_m -= rotation_z(to.yaw_rad) * Vec3{short_m, 0, 0};
  goal.foothold = foothold_at(goal.target, footholds.map_stamp_ns);
  return true;
}

void ClimbPlanner::watch_feet(const SolePair& soles) noexcept {
  if (slid_ || !on_treads_ || split_stance_ || !odom_stood_ || set_back_ >= params_.slid.max_set_back) return;
  const auto right_p_left_m = [](const SolePair& pair) -> Vec2 {
    const Vec3 apart_m = pair[0].position_m - pair[1].position_m;
    return (rotation_z(pair[1].yaw_rad).transpose() * apart_m).head<2>();
  };
  if (!((right_p_left_m(soles) - right_p_left_m(*odom_stood_)).norm() > params_.slid.off_m)) return;
  const auto moved_m = [&](std::size_t i) { return (soles[i].position_m - (*odom_stood_)[i].position_m).norm(); };
  slid_ = moved_m(0) > moved_m(1) ? Foot::kLeft : Foot::kRight;
}

bool ClimbPlanner::leave_slid_foot() noexcept {
  if (closes_up_ || !slid_) return false;
  slid_.reset();
  set_back_ = params_.slid.max_set_back;
  return true;
}

StepGoal ClimbPlanner::closing_goal(const Situation& situation, const FootholdSet& footholds,
                                    Foot foot) const noexcept {
  StepGoal goal;
  goal.kind = StepKind::kClosing;
  goal.foot = foot;
  goal.target = sole_beside_on_tread(situation.soles[index_of(other(goal.foot))], goal.foot, landed_,
                                     robot_->stance.half_width_m);
  goal.foothold = foothold_at(goal.target, footholds.map_stamp_ns);
  goal.foothold.polygon_id = tread_id_;
  return goal;
}

bool ClimbPlanner::come_nearer(const Decision& leading) noexcept {
  if (!on_treads_ || leading.to_lip_m <= 0.0 || over_lip_.reach_m == 0.0) return false;
  over_lip_.reach_m = leading.to_lip_m > params_.lip.near_m ? params_.lip.near_m : 0.0;
  return true;
}

bool ClimbPlanner::trail_beside() noexcept { return !std::exchange(over_lip_.trails_beside, true); }

bool ClimbPlanner::close_up(const Situation& situation) noexcept {
  const Vec3 way_m = situation.soles[0].position_m - situation.soles[1].position_m;
  const double apart_m = std::abs((rotation_z(situation.soles[1].yaw_rad).transpose() * way_m).y());
  closes_up_ = on_treads_ && apart_m > 2.0 * (robot_->stance.half_width_m + params_.line_up.lateral_m);
  return closes_up_;
}

// From nearer by, an edge that is known too vaguely may be known better: no reason against the walk up.
StopReason ClimbPlanner::reason_against(const Situation& situation, const FootholdSet& footholds) const noexcept {
  if (footholds.map_stamp_ns <= 0) {
    return footholds.obstruction == StopReason::kNone ? StopReason::kNothingSeen : footholds.obstruction;
  }
  if (situation.stamp_ns - footholds.map_stamp_ns > params_.max_map_age_ns) return StopReason::kMapStale;
  const bool walks_up = footholds.obstruction == StopReason::kEdgeUncertain && !on_treads_;
  if (footholds.obstruction != StopReason::kNone && !walks_up) return footholds.obstruction;
  if (!(footholds.has_p_star || walks_up) || !usable(footholds.p_star_feet) ||
      !math::all_finite(footholds.tread.nosing_a_m) || !math::all_finite(footholds.tread.nosing_b_m)) {
    return StopReason::kNoStaircase;
  }
  return StopReason::kNone;
}

void ClimbPlanner::lay_out_destination(const SolePair& soles) noexcept {
  if (!goal_.asked) return;
  const TorsoPose middle = middle_of(soles);
  const Vec3 way_m = rotation_z(middle.yaw_rad) * Vec3{goal_.asked->ahead_m, goal_.asked->left_m, goal_.asked->up_m};
  const double ground_m = std::min(soles[0].position_m.z(), soles[1].position_m.z());  // one may be in the air
  goal_.laid_out =
      WalkGoal{(middle.position_m + way_m).head<2>(), math::wrap_angle(middle.yaw_rad + goal_.asked->turn_rad),
               goal_.asked->has_turn, ground_m + way_m.z(), goal_.asked->has_height};
  goal_.asked.reset();
  walking_ = false;
  memory_.swings_in_a_row = 1;
  way_.forget();
}

// Stairs are the way where they come nearer to the goal's height, or, where that is not known or is this one, where the
// goal lies behind their edge. Until it is known whether more of them come, they still are.
bool ClimbPlanner::leads_to_goal(const Situation& situation, const FootholdSet& footholds) const noexcept {
  if (footholds.map_stamp_ns <= 0 || situation.stamp_ns - footholds.map_stamp_ns > params_.max_map_age_ns) return true;
  const bool offers = footholds.has_p_star || footholds.obstruction == StopReason::kEdgeUncertain;
  if (!offers) return on_treads_ && footholds.obstruction == StopReason::kNothingSeen;
  if (!usable(footholds.p_star_feet)) return false;
  const Vec2 heading = unit_at(footholds.p_star_feet[0].yaw_rad);
  const Vec2 nosing_m = 0.5 * (footholds.tread.nosing_a_m + footholds.tread.nosing_b_m).head<2>();
  const Vec2 way_m = goal_.laid_out->odom_p_m - middle_of(situation.soles).position_m.head<2>();
  if (saw_lately(memory_.stairs_over_ramp_ns, situation)) return false;
  // Amid a flight there is no other way than on: the landing behind it may lead back, aside, or over a rise to where it
  // came from. Not past the goal's height, and not back.
  constexpr double kOnTread_m = 0.40, kReach_m = 0.60;
  const double nosing_ahead_m = heading.dot(nosing_m - middle_of(situation.soles).position_m.head<2>());
  const double goal_ahead_m = heading.dot(way_m);
  const double z_m = middle_of(situation.soles).position_m.z();
  const WalkGoal& goal = *goal_.laid_out;
  const double to_goal_m = goal.odom_z_m - z_m, rise_m = footholds.measured_rise_m;
  const bool passes = to_goal_m * (to_goal_m - rise_m) < 0.0 && !goal.is_by_rise(z_m, rise_m).value_or(false);
  const bool goes_on = (rise_m < 0.0) == memory_.led_down && !goal.is_at_height(z_m) && !passes;
  const bool goal_is_here = goal_ahead_m < nosing_ahead_m && way_m.norm() < kReach_m;
  const bool amid_flight = on_treads_ && nosing_ahead_m < kOnTread_m && !goal_is_here && (!goal.has_height || goes_on);
  if (amid_flight || way_.takes_any_stairs()) return true;
  if (const auto by_rise = goal.is_by_rise(z_m, footholds.measured_rise_m)) return *by_rise;
  return heading.dot(goal_.laid_out->odom_p_m - nosing_m) > params_.walk.stairs_beyond_m &&
         heading.dot(way_m) > math::cos(params_.walk.stairs_aside_rad) * way_m.norm();
}

// What the search offers is a ramp, or begins behind one: no steps lead over it.
bool ClimbPlanner::is_over_ramp(const Situation& situation, const FootholdSet& footholds) const noexcept {
  const Vec2 nosing_m = 0.5 * (footholds.tread.nosing_a_m + footholds.tread.nosing_b_m).head<2>();
  const bool offers = footholds.has_p_star || footholds.obstruction == StopReason::kEdgeUncertain;
  return offers && usable(footholds.p_star_feet) && math::all_finite(footholds.tread.nosing_a_m) &&
         math::all_finite(footholds.tread.nosing_b_m) &&
         LevelWalk::ramp_on_way(footholds.ground, middle_of(situation.soles).position_m.head<2>(), nosing_m) > 0.0;
}

void ClimbPlanner::look_for_ramps(const Situation& situation, const FootholdSet& footholds) noexcept {
  const WalkGoal to = way_.next(*goal_.laid_out).value_or(*goal_.laid_out);
  const double ramp =
      LevelWalk::ramp_on_way(footholds.ground, middle_of(situation.soles).position_m.head<2>(), to.odom_p_m);
  if (ramp > 0.0) {
    memory_.ramp = ramp;
    memory_.ramp_ns = situation.stamp_ns;
  }
  if (is_over_ramp(situation, footholds)) memory_.stairs_over_ramp_ns = situation.stamp_ns;
}

// The map has it in some pictures and not in others.
bool ClimbPlanner::saw_lately(const std::optional<std::int64_t>& stamp_ns, const Situation& situation) const noexcept {
  constexpr std::int64_t kLately_ns = 1'500'000'000;  // a step on the floor takes 1.4 s, and then it looks elsewhere
  return stamp_ns && situation.stamp_ns - *stamp_ns < kLately_ns;
}

ClimbPlanner::Decision ClimbPlanner::walk(const Situation& situation, const FootholdSet& footholds) const noexcept {
  Decision decision;
  decision.walks = true;
  const LevelWalk walk(params_.walk, robot_->sole, robot_->stance.half_width_m,
                       shortened(params_.floor, floor_.stride_share), params_.rule);
  if (walk.has_arrived(situation.soles, *goal_.laid_out)) {  // whatever the way is thought to be
    decision.obstruction = StopReason::kAtGoal;
    return decision;
  }
  const std::optional<WalkGoal> to = way_.next(*goal_.laid_out);
  if (!to) return decision;
  const LevelStep step =
      walk.next(situation.soles, {memory_.last_swing, memory_.swings_in_a_row, !walking_ && floor_.steps == 0}, *to,
                footholds.ground);
  decision.walk = step.outcome;
  switch (step.outcome) {
    case LevelStep::Outcome::kArrived:
      if (!way_.is_on_its_way()) decision.obstruction = StopReason::kNoWayUpOrDown;  // has_arrived() says no
      return decision;
    case LevelStep::Outcome::kSteps:
      decision.has_step = true;
      decision.goal.kind = StepKind::kFloor;
      decision.goal.foot = step.foot;
      decision.goal.target = step.target;
      decision.goal.foothold = foothold_at(step.target, footholds.map_stamp_ns);
      return decision;
    case LevelStep::Outcome::kNoGround:
    case LevelStep::Outcome::kBlocked:
      break;
  }
  if (way_.gave_up_for()) {
    decision.obstruction = way_.gave_up_for()->reason;
    decision.measured_m = way_.gave_up_for()->measured_m;
    return decision;
  }
  if (step.outcome == LevelStep::Outcome::kNoGround && saw_lately(memory_.ramp_ns, situation)) {
    decision.obstruction = StopReason::kTooSteep;
    decision.measured_m = memory_.ramp;
    return decision;
  }
  // What the search says of what comes next is the better reason, where it says anything.
  decision.measured_m = measured(footholds);
  decision.obstruction = footholds.obstruction;
  const bool says_nothing = footholds.obstruction == StopReason::kNone || footholds.obstruction == StopReason::kTop ||
                            footholds.obstruction == StopReason::kNoStaircase;
  if (!says_nothing) return decision;
  decision.obstruction = step.outcome == LevelStep::Outcome::kBlocked ? StopReason::kObstacle : StopReason::kGroundEnds;
  return decision;
}

ClimbPlanner::Decision ClimbPlanner::look_and_decide(const Situation& situation,
                                                     const FootholdSet& footholds) noexcept {
  if (!goal_.laid_out || split_stance_) return decide(situation, footholds);
  look_for_ramps(situation, footholds);
  const bool climbs = leads_to_goal(situation, footholds), lines_up = floor_.steps > 0;
  const GoalWay::Input in{situation.soles,
                          footholds,
                          *goal_.laid_out,
                          climbs,
                          lines_up,
                          on_treads_,
                          saw_lately(memory_.stairs_over_ramp_ns, situation)};
  way_.watch(params_.way, in);
  const Decision decision = decide(situation, footholds);
  if (decision.walk) way_.walked(params_.way, in, *decision.walk, {decision.obstruction, decision.measured_m});
  return decision;
}

ClimbPlanner::Decision ClimbPlanner::decide(const Situation& situation, const FootholdSet& footholds) const noexcept {
  Decision decision;
  if (split_stance_) {
    return passing_step(situation, footholds, decision) ? decision : trailing_step(situation, footholds);
  }
  const std::optional<Foot> closing = closes_up_ ? memory_.last_swing : slid_;
  if (closing) {
    decision.has_step = true;
    decision.goal = closing_goal(situation, footholds, *closing);
    return decision;
  }
  const bool walks = goal_.laid_out && (way_.looks_first() || !leads_to_goal(situation, footholds));
  if (walks) return walk(situation, footholds);
  decision.measured_m = measured(footholds);
  decision.obstruction = reason_against(situation, footholds);
  if (decision.obstruction != StopReason::kNone) return decision;
  const bool walks_up = footholds.obstruction != StopReason::kNone;
  decision.obstruction = footholds.obstruction;
  const auto& feet = footholds.p_star_feet;
  const SolePair targets{sole_on(feet[0]), sole_on(feet[1])};
  decision.rise_m = middle_of(targets).position_m.z() - middle_of(situation.soles).position_m.z();
  const bool underfoot = treads_climbed_ > 0 && feet[0].polygon_id == tread_id_;
  if (std::abs(decision.rise_m) < params_.min_rise_m || underfoot) {  // a search from before the last step
    decision.obstruction = StopReason::kMapStale;
    return decision;
  }
  const std::array<double, kFootCount> to_lip = to_lip_m(situation, footholds);
  // The foot that trailed to the lip carries.
  constexpr double kStaggered_m = 0.03;
  Foot lead = leading_foot(situation, targets);
  if (on_treads_ && std::abs(to_lip[0] - to_lip[1]) > kStaggered_m) {
    lead = to_lip[0] > to_lip[1] ? Foot::kLeft : Foot::kRight;
  }
  const Foot trail = other(lead);
  decision.to_lip_m = to_lip[index_of(trail)];
  const bool lines_up = !on_treads_ || decision.to_lip_m > over_lip_.reach_m;
  if (lines_up && floor_goal(situation, footholds, decision.goal)) {
    decision.has_step = floor_.corrections < params_.line_up.max_corrections && floor_.steps < params_.max_floor_steps;
    if (decision.has_step) return decision;
    decision = {};
    decision.obstruction = StopReason::kNotLinedUp;
    return decision;
  }
  decision.has_step = !walks_up;
  if (walks_up) return decision;

  decision.goal = {StepKind::kLeading, lead, targets[index_of(lead)], feet[index_of(lead)]};
  decision.trailing = {StepKind::kTrailing, trail, targets[index_of(trail)], feet[index_of(trail)]};
  decision.beside = decision.trailing.foothold;
  decision.trails_to_lip = decision.rise_m < 0.0 && trail_to_lip(footholds, decision.goal.target, decision.trailing);
  return decision;
}

void ClimbPlanner::latched(const Situation& situation, const Decision& decision) noexcept {
  latched_ = decision;
  before_latch_ = memory_;
  memory_.swings_in_a_row = decision.goal.foot == memory_.last_swing ? memory_.swings_in_a_row + 1 : 1;
  memory_.last_swing = decision.goal.foot;
  const Vec3 travel_m = decision.goal.target.position_m - situation.soles[index_of(memory_.last_swing)].position_m;
  walking_ = decision.walks;
  way_.stepped();
  const bool begins_on_tread = on_treads_ && decision.goal.kind == StepKind::kFloor;
  if (walking_ || begins_on_tread) {
    floor_.steps = floor_.corrections = 0;
  } else if (decision.goal.kind == StepKind::kFloor && travel_m.norm() < params_.correction_m) {
    ++floor_.corrections;
  }
  if (leads(decision.goal.kind)) {
    memory_.leading = decision.goal.foot;
    memory_.has_leading = true;
    memory_.led_down = decision.rise_m < 0.0;
    memory_.trailing_foothold = decision.trailing.foothold;
    memory_.odom_trailing_m = decision.trailing.foothold.position_m - decision.goal.target.position_m;
    memory_.trails_to_lip = decision.trails_to_lip;
    memory_.beside_foothold = decision.beside;
    memory_.odom_beside_m = decision.beside.position_m - decision.goal.target.position_m;
  }
}

bool ClimbPlanner::shorten_floor_steps() noexcept {
  floor_.stride_share *= params_.shorter.share;
  return floor_.stride_share > params_.shorter.least_share;
}

SolePose ClimbPlanner::beside_passed(const SolePose& stance, Foot foot) const noexcept {
  const Foothold& foothold = before_latch_.trailing_foothold;  // of this foot, on the tread of the standing one
  const bool known = foothold.polygon_id == tread_id_ && usable(foothold);
  return known ? sole_beside_on_tread(stance, foot, sole_on(foothold), robot_->stance.half_width_m)
               : sole_beside(stance, foot, robot_->stance.half_width_m);
}

void ClimbPlanner::passing_ends_beside(const StepGoal& goal) noexcept {
  latched_.goal = goal;
  memory_.leading = other(goal.foot);
}

void ClimbPlanner::swing_aborted() noexcept { memory_ = before_latch_; }

void ClimbPlanner::landed(const std::optional<SolePair>& soles) noexcept {
  odom_stood_ = soles;
  slid_.reset();
  floor_.stride_share = 1.0;
  closes_up_ = false;
  landed_ = latched_.goal.target;
  switch (latched_.goal.kind) {
    case StepKind::kFloor:
      if (!walking_) ++floor_.steps;
      on_treads_ = false;
      break;
    case StepKind::kClosing:
      ++set_back_;
      break;
    case StepKind::kPassing:
      ++treads_climbed_;
      break;
    case StepKind::kLeading:
      way_.forget();
      split_stance_ = true;
      set_back_ = 0;
      break;
    case StepKind::kTrailing:
      split_stance_ = passing_refused_ = false;
      if (over_lip_.reach_m == 0.0) over_lip_.reach_m = params_.lip.near_m;
      ++treads_climbed_;
      break;
  }
  if (!onto_tread(latched_.goal.kind)) return;
  tread_id_ = latched_.goal.foothold.polygon_id;
  on_treads_ = on_treads_ || latched_.goal.kind != StepKind::kClosing;
}

}  // namespace polygmap
