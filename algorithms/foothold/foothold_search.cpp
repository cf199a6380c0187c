// SPDX-License-Identifier: Apache-2.0
#include "algorithms/foothold/foothold_search.hpp"

#include <algorithm>

namespace polygmap {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool valid(const FootholdSearch::Query& q) noexcept {
  const auto finite = [](const Transform& t) { return math::all_finite(t.R) && math::all_finite(t.p_m); };
  return finite(q.odom_T_base) && finite(q.odom_T_sole[0]) && finite(q.odom_T_sole[1]) &&
         q.odom_T_base.p_m.cwiseAbs().maxCoeff() < 1e6 && std::isfinite(q.feet_ahead_m[0]) &&
         std::isfinite(q.feet_ahead_m[1]) && std::isfinite(q.way_excess);
}

// From the map's frame, in which the base is given, to odometry, where a foot is told to go.
FootholdSet moved(FootholdSet set, const Vec3& by_m, const FootholdSearch::Query& query, const PlanFrame& base,
                  double seen_behind_m) noexcept {
  for (Vec3* p : {&set.p_star.position_m, &set.tread.nosing_a_m, &set.tread.nosing_b_m, &set.lip_beyond.nosing_a_m,
                  &set.lip_beyond.nosing_b_m}) {
    *p += by_m;
  }
  set.ground.corner_m += by_m.head<2>();
  set.ground.height_m += by_m.z();
  // The lip as the feet, which are told to go there.
  const Vec2 heading = unit_at(set.p_star_feet[0].yaw_rad);
  for (Vec3* end : {&set.lip_beyond.nosing_a_m, &set.lip_beyond.nosing_b_m}) {
    const double way_m = base((*end - by_m).head<2>()).x() + seen_behind_m;
    const double ahead_m = 0.5 * (query.feet_ahead_m[0] + query.feet_ahead_m[1]) + query.way_excess * way_m;
    end->head<2>() -= ahead_m * heading;
  }
  for (std::size_t f = 0; f < kFootCount; ++f) {
    for (Foothold* foot : {&set.p_star_feet[f], &set.p_star_star_feet[f]}) {
      const double way_m = base(foot->position_m.head<2>()).x() + seen_behind_m;
      foot->position_m += by_m - (query.feet_ahead_m[f] + query.way_excess * way_m) * rotation_z(foot->yaw_rad).col(0);
    }
  }
  return set;
}

}  // namespace

void FootholdSearch::begin(const MapSnapshot& map, const Query& query) noexcept {
  if (stage_ != Stage::kIdle) ++counters_.abandoned;
  stage_ = Stage::kIdle;
  if (!valid(query)) {
    ++counters_.rejected_queries;
    return;
  }
  map_ = map;
  query_ = query;
  query_.odom_T_base.p_m -= map.drift_m;
  for (Transform& sole : query_.odom_T_sole) sole.p_m -= map.drift_m;
  base_ = PlanFrame(query_.odom_T_base);
  sole_ = PlanFrame(query_.odom_T_sole[index_of(query.stance)]);
  z_foot_ = z_foot_m(foot_, query_.odom_T_sole[index_of(query.stance)]);
  pending_ = {};
  pending_.map_stamp_ns = map.stamp_ns;
  pending_.ground = map.ground;
  levels_.clear();
  uprights_.clear();
  found_ = {};
  raster_.centre_on(base_.origin_m() + params_.raster.centre_ahead_m * base_.heading(), params_.raster.g_res_m);
  index_ = 0;
  row_ = 0;
  stage_ = Stage::kPrepare;
}

Progress FootholdSearch::step(WorkBudget& budget) noexcept {
  if (stage_ == Stage::kIdle) return Progress::kIdle;
  // Runs piece(row) for the next row and moves on after the last.
  const auto rows = [this](auto&& piece, Stage next) {
    piece(row_);
    if (++row_ < FootholdRaster::kSide) return;
    row_ = 0;
    stage_ = next;
  };
  while (!budget.exhausted()) {
    work_.add(110);
    switch (stage_) {
      case Stage::kPrepare:
        if (index_ < map_.polygons.size()) {
          prepare_one(map_.polygons[index_++]);
        } else {
          index_ = 0;
          stage_ = Stage::kLink;
        }
        break;
      case Stage::kLink:
        if (index_ < levels_.size()) {
          link(index_++);
        } else {
          stage_ = Stage::kRaster;
        }
        break;
      case Stage::kRaster:
        rows([this](std::int32_t row) { raster_row(row); }, Stage::kErode);
        break;
      case Stage::kErode:
        rows([this](std::int32_t row) { erode_row(row); }, Stage::kChoose);
        break;
      case Stage::kChoose:
        choose();
        stage_ = pending_.has_p_star && pending_.measured_rise_m > 0.0 ? Stage::kLookAhead : Stage::kFinish;
        break;
      case Stage::kLookAhead:
        rows([this](std::int32_t row) { look_ahead_row(row); }, Stage::kFinish);
        break;
      case Stage::kFinish:
        finish();
        stage_ = Stage::kIdle;
        budget.spend(work_.take_units());
        return Progress::kDone;
      case Stage::kIdle:
        return Progress::kIdle;
    }
    work_.add(raster_.work());
    budget.spend(work_.take_units());
  }
  return Progress::kBusy;
}

void FootholdSearch::prepare_one(const MapPolygon& polygon) noexcept {
  const SurfacePatch& surface = polygon.surface;
  const bool confirmed = polygon.sightings >= params_.confirmed_sightings;
  if (surface.kind == SurfaceKind::kTread && surface.area_m2 >= params_.area_min_m2) {
    work_.add(2500);
    work_.add(surface.polygon.size(), 260);
    LevelSurface level;
    if (!prepare(polygon, yaw_of(query_.odom_T_base.R), params_.levels, params_.margin, foot_, level)) return;
    if (is_top_of_thing(map_.occupied, params_.things, level, work_)) return;
    if (confirmed) {
      (void)levels_.try_push_back(level);  // as many as the map holds
    } else if (level.height_m > z_foot_ + params_.delta_foot_m &&
               in_range(base_(centroid_m(level.hull)), params_.raster.g_range_m)) {
      found_.unconfirmed_ahead = true;
    }
  }
  if (surface.kind == SurfaceKind::kRiser && confirmed) {
    work_.add(120);
    work_.add(surface.polygon.size(), 18);
    (void)uprights_.try_push_back(upright_of(surface));
  }
}

FootholdSearch::Extent FootholdSearch::extent_on(const LevelSurface& tread, const Vec2& a_m,
                                                 const Vec2& b_m) const noexcept {
  const double a = tread.lateral_m(a_m), b = tread.lateral_m(b_m), middle_m = this->middle_m(tread);
  const double feet_m = params_.feet.half_spacing_m + foot_.collision.half_width_m + params_.feet.side_margin_m;
  if (std::min(a, b) < middle_m - feet_m && std::max(a, b) > middle_m + feet_m) return Extent::kAcross;
  const bool near = std::max(a, b) > middle_m - feet_m - params_.feet.evade_max_m &&
                    std::min(a, b) < middle_m + feet_m + params_.feet.evade_max_m;
  return near ? Extent::kPartial : Extent::kAside;
}

// A riser ends the tread. A post on it or before it, a box, the end of a wall is in the way only where a foot, or the
// leg above it, would meet it: as an endless line, balusters ended a tread of 0.28 m after 0.121 m (2026-11).
void FootholdSearch::link_upright(LevelSurface& tread, const Upright& u) const noexcept {
  const UprightParams& p = params_.uprights;
  if (u.top_m < tread.height_m + params_.delta_foot_m || u.bottom_m > tread.height_m + p.leg_m) return;
  const double facing = u.outward.dot(tread.heading);
  const Extent extent = extent_on(tread, u.left_m(), u.right_m());
  const double margin_m = params_.margin.of(u.sigma_m);
  // A wall that crosses both feet at a slant ends the tread at no one place: it is in the way.
  if (extent == Extent::kAcross && facing <= -params_.levels.square_cos) {
    add_toe_limit(tread, params_.levels, foot_, {u.point_m, u.direction}, margin_m,
                  {params_.back_min_m, params_.back_max_m});
    return;
  }
  if (extent == Extent::kAside || facing > p.aside_cos) return;
  const double a = tread.along_m(u.left_m()), b = tread.along_m(u.right_m());
  const double passed_m = tread.along_m(sole_.origin_m()) + foot_.collision.toe_x_m;
  if (std::max(a, b) < passed_m || std::min(a, b) > params_.back_max_m) return;
  const bool own_riser = std::max(a, b) < params_.back_min_m && u.bottom_m < tread.height_m - p.below_m &&
                         u.top_m < tread.height_m + p.taller_m;
  if (own_riser) return;
  const double left = tread.lateral_m(u.left_m()), right = tread.lateral_m(u.right_m());
  const double aside_m = foot_.collision.half_width_m + params_.feet.side_margin_m;
  const Interval met{std::min(left, right) - aside_m, std::max(left, right) + aside_m};
  add_obstacle(tread, {std::min(a, b) - foot_.collision.toe_x_m, margin_m, met}, middle_m(tread));
}

// What the toe must not reach: the next tread's nosing and the next riser, beside the tread's own back edge.
void FootholdSearch::link(std::size_t i) noexcept {
  LevelSurface& tread = levels_[i];
  work_.add(60);
  if (!tread.has_nosing) return;
  work_.add(levels_.size(), 95);
  work_.add(uprights_.size(), 130);
  for (std::size_t j = 0; j < levels_.size(); ++j) {
    const LevelSurface& other = levels_[j];
    const double rise_m = other.height_m - tread.height_m;
    if (j == i || !other.has_nosing || rise_m < params_.delta_foot_m) continue;
    const Vec2 a_m = other.nosing_a_m.head<2>(), b_m = other.nosing_b_m.head<2>();
    // A tread seen in part goes on; the top of a box beside the way does not.
    if (extent_on(tread, a_m, b_m) == Extent::kAside) continue;
    const double behind_m = tread.along_m(0.5 * (a_m + b_m));  // down stairs the higher ones lie before it
    const bool is_next = behind_m > 0.0 && behind_m < params_.step_max_m;
    if (is_next && (tread.rise_behind_m == 0.0 || rise_m < tread.rise_behind_m)) tread.rise_behind_m = rise_m;
    add_toe_limit(tread, params_.levels, foot_, {other.nosing_middle_m(), other.left}, other.nosing_margin_m,
                  {params_.back_min_m, params_.back_max_m});
  }
  for (const Upright& upright : uprights_) link_upright(tread, upright);
  if (!map_.occupied.empty()) {
    const double feet_m = params_.feet.half_spacing_m + params_.feet.evade_max_m;
    add_things(map_.occupied, params_.things, foot_, middle_m(tread), feet_m, tread, work_);
  }
  const Vec2& sole_p_m = sole_.origin_m();
  const double along_m = tread.along_m(sole_p_m);
  if (tread.ends.far_m && along_m > 0.0 && along_m < *tread.ends.far_m &&
      in_sole_layer(tread.plane.height_m(sole_p_m), z_foot_, params_.delta_foot_m)) {
    found_.underfoot = i;
  }
}

void FootholdSearch::raster_row(std::int32_t row) noexcept {
  work_.add(140);
  raster_.clear_row(row);
  const std::span<const LevelSurface> levels(levels_.begin(), levels_.size());
  for (std::size_t i = 0; i < levels_.size(); ++i) raster_.add_row(row, levels, static_cast<std::uint8_t>(i));
  look_at_top(row);
  find_next(row);
}

double FootholdSearch::distance2_to_row_m2(const Vec2& from_m, std::int32_t row) const noexcept {
  return math::square(raster_.at(0, row).y() - from_m.y());
}

// How much of the floor before the standing foot was seen, eq. (28): where nothing rises, that says so.
void FootholdSearch::look_at_top(std::int32_t row) noexcept {
  if (std::abs(raster_.at(0, row).y() - sole_.origin_m().y()) > params_.top.to_m + params_.top.half_width_m) return;
  const Vec2 first = sole_(raster_.at(0, row)), step = sole_(raster_.at(1, row)) - first;
  const double half_width_m = params_.top.half_width_m;
  const FootholdRaster::Columns ahead =
      FootholdRaster::columns_within(first.x(), step.x(), {params_.top.from_m, params_.top.to_m}) &
      FootholdRaster::columns_within(first.y(), step.y(), {-half_width_m, half_width_m});
  work_.add(120);
  work_.add(std::max(ahead.end - ahead.begin, 0), 46);
  for (std::int32_t column = ahead.begin; column < ahead.end; ++column) {
    const Vec2 sole_p = first + static_cast<double>(column) * step;
    if (sole_p.x() < params_.top.from_m || sole_p.x() > params_.top.to_m ||
        std::abs(sole_p.y()) > params_.top.half_width_m) {
      continue;
    }
    const Vec2 p = raster_.at(column, row);
    // Where the tread underfoot was seen to end there is nothing to look at behind.
    if (found_.underfoot != kNone) {
      const LevelSurface& underfoot = levels_[found_.underfoot];
      if (underfoot.along_m(p) > *underfoot.ends.far_m) continue;
    }
    ++found_.top_cells;
    const std::uint8_t layer = raster_.layer(column, row);
    const bool seen = layer != FootholdRaster::kNoLayer &&
                      in_sole_layer(levels_[layer].plane.height_m(p), z_foot_, params_.delta_foot_m);
    if (seen) ++found_.top_cells_seen;
  }
}

// The nearest higher cell in the corridor, before the height limit and the erosion: an obstacle is not skipped over.
// The ground that the robot stands on is not what comes next, however it slopes: a landing of 3 degrees rises by 45 mm.
void FootholdSearch::find_next(std::int32_t row) noexcept {
  if (distance2_to_row_m2(base_.origin_m(), row) >= found_.next_distance2_m2) return;
  const Vec2 first = base_(raster_.at(0, row)), step = base_(raster_.at(1, row)) - first;
  const double range_m = params_.raster.g_range_m, half_width_m = params_.corridor_half_width_m;
  const double nearest_m = query_.descends ? 0.0 : -range_m;  // down stairs the higher ones lie behind
  const FootholdRaster::Columns corridor =
      FootholdRaster::columns_within(first.x(), step.x(), {nearest_m, range_m}) &
      FootholdRaster::columns_within(first.y(), step.y(), {-half_width_m, half_width_m});
  work_.add(200);
  // Distances grow to both sides of the nearest column: of what the corridor has of a surface that is high enough all
  // along, no cell but one of the nearest ones counts. columns_within() has three too many at either end.
  constexpr std::int32_t kNearest = 4;
  const auto nearest =
      static_cast<std::int32_t>(math::clamp(-first.dot(step) / step.squaredNorm(), 0.0, FootholdRaster::kSide - 1.0));
  const double least_z_m = z_foot_ + params_.delta_foot_m;
  for (std::int32_t begin = corridor.begin; begin < corridor.end;) {
    const FootholdRaster::Stretch stretch = raster_.stretch(row, begin, corridor.end);
    work_.add(50 + (stretch.end - begin) / 2);
    begin = stretch.end;
    if (stretch.layer == FootholdRaster::kNoLayer) continue;
    const Plane& plane = levels_[stretch.layer].plane;
    if (plane.height_m(sole_.origin_m()) <= least_z_m) continue;
    const FootholdRaster::Rises rises = raster_.rises(row, stretch, plane, least_z_m);
    if (rises == FootholdRaster::Rises::kNowhere) continue;
    std::int32_t from = stretch.begin, until = stretch.end;
    if (rises == FootholdRaster::Rises::kEverywhere) {
      const std::int32_t middle = std::clamp(nearest, from, until - 1);
      from = std::max(from, middle - kNearest);
      until = std::min(until, middle + kNearest + 1);
    }
    work_.add(50 + 22 * (until - from));
    for (std::int32_t column = from; column < until; ++column) {
      const Vec2 base_p = first + static_cast<double>(column) * step;
      const double distance2 = base_p.squaredNorm();
      if (distance2 >= found_.next_distance2_m2 || std::abs(base_p.y()) > half_width_m || base_p.x() < nearest_m) {
        continue;
      }
      if (plane.height_m(raster_.at(column, row)) <= least_z_m || !in_range(base_p, range_m)) continue;  // eq. (20)
      found_.next_distance2_m2 = distance2;
      found_.next = stretch.layer;
    }
  }
}

// May a foot be put at a cell, eqs (20), (23), (25)? It survives when a foot may fit somewhere in it: half its diagonal
// is forgiven here and not in the refinement.
bool FootholdSearch::fits(const Vec2& p_m, const LevelSurface& surface) noexcept {
  work_.add(85);
  work_.add(surface.edges.size() + surface.toe.size() + surface.obstacles.size(), 12);
  return in_range(base_(p_m), params_.raster.g_range_m) &&
         below_limit(surface.plane.height_m(p_m), z_foot_, params_.g_z_m) &&
         surface.spare_m(p_m) >= -params_.raster.g_res_m * std::numbers::sqrt2 / 2.0;
}

// The stretches of a row's cells that may be nearer to a point than that; the caller still asks every cell.
template <typename Visit>
void FootholdSearch::for_each_nearer(std::int32_t row, const Vec2& from_m, double distance2_m2,
                                     const Visit& visit) noexcept {
  work_.add(110);
  FootholdRaster::Columns near;
  if (distance2_m2 < kFarAway_m2) {
    const double reach_m = math::sqrt(std::max(distance2_m2 - distance2_to_row_m2(from_m, row), 0.0));
    near.begin = std::max(raster_.column_of(from_m.x() - reach_m) - 1, 0);
    near.end = std::min(raster_.column_of(from_m.x() + reach_m) + 3, FootholdRaster::kSide);
  }
  while (near.begin < near.end) {
    const FootholdRaster::Stretch stretch = raster_.stretch(row, near.begin, near.end);
    work_.add(40 + (stretch.end - near.begin) / 2);
    near.begin = stretch.end;
    visit(stretch);
  }
}

// The squared distance to the nearest cell of a stretch that is high enough and where a foot fits, the first of those,
// if it is less than that. From the nearest cell outwards: the first one that a foot fits in is it.
double FootholdSearch::nearest_fit(std::int32_t row, const FootholdRaster::Stretch& stretch, const Vec2& from_m,
                                   double least_z_m, double distance2_m2, Vec2& cell_m) noexcept {
  const LevelSurface& surface = levels_[stretch.layer];
  work_.add(120);
  if (raster_.rises(row, stretch, surface.plane, least_z_m) == FootholdRaster::Rises::kNowhere) return kFarAway_m2;
  const auto distance2_to = [&](std::int32_t column) {
    return column < stretch.begin || column >= stretch.end ? kFarAway_m2
                                                           : (raster_.at(column, row) - from_m).squaredNorm();
  };
  std::int32_t right = std::clamp(raster_.column_of(from_m.x()), stretch.begin, stretch.end - 1);
  if (distance2_to(right + 1) < distance2_to(right)) ++right;
  std::int32_t left = right - 1;
  double to_left = distance2_to(left), to_right = distance2_to(right);
  for (;;) {
    const bool at_left = to_left <= to_right;
    const double distance2 = at_left ? to_left : to_right;
    if (distance2 >= distance2_m2) return kFarAway_m2;
    work_.add(60);
    const Vec2 p = raster_.at(at_left ? left : right, row);
    if (surface.plane.height_m(p) > least_z_m && fits(p, surface)) {
      cell_m = p;
      return distance2;
    }
    (at_left ? to_left : to_right) = distance2_to(at_left ? --left : ++right);
  }
}

// Erosion of each layer, eqs (24)-(25). A layer is a mapped surface, since the map has already put together what lies
// within its height gate; floor(z / 1 mm) would split a noisy or tilted tread. The structuring element is the contact
// rectangle at the tread's yaw, exact, instead of N pixels in all directions (13 of them leave nothing of a 0.28 m
// tread).
// A cell is asked only where its answer decides, so no eroded layer is kept.
void FootholdSearch::erode_row(std::int32_t row) noexcept {
  if (found_.next == kNone) return;
  if (distance2_to_row_m2(base_.origin_m(), row) >= found_.p_star_distance2_m2) return;
  const double least_z_m = z_foot_ + params_.delta_foot_m;
  for_each_nearer(row, base_.origin_m(), found_.p_star_distance2_m2, [&](const FootholdRaster::Stretch& stretch) {
    if (stretch.layer != found_.next) return;
    // Eq. (26), on the tread that comes next.
    const double distance2 =
        nearest_fit(row, stretch, base_.origin_m(), least_z_m, found_.p_star_distance2_m2, found_.p_star_cell_m);
    found_.p_star_distance2_m2 = std::min(found_.p_star_distance2_m2, distance2);
  });
}

// Sole origin behind the nosing for a foot between two lateral positions: as much to spare at the heel, behind the
// nosing's round, as at the toe, but not deep into a long tread or a landing. Before a high rise more at the toe: the
// shin leans over it while the knee bends deep, and touched the next nosing from 0.20 m on (2026-11).
double FootholdSearch::aim_along_m(const LevelSurface& tread, double left_m, double right_m) const noexcept {
  const double heel_m = -foot_.contact.heel_x_m;
  const double margin_m = tread.nosing_margin_m;
  double spare_m = kInfinity;
  const auto bound_by = [&](const FootLimit& limit, double kept_m) {
    const double clearance_m =
        std::min(limit.clearance_m(tread.at(heel_m, left_m)), limit.clearance_m(tread.at(heel_m, right_m)));
    const double closing = -limit.inside.inward.dot(tread.heading);
    spare_m = std::min(spare_m, (clearance_m - kept_m) / closing - margin_m);
  };
  for (const FootLimit& limit : tread.toe) bound_by(limit, limit.margin_m);
  if (tread.toe.empty()) {  // nothing is mapped behind: it is as deep as it was seen to be, at least
    // Over a lip nothing is in the toe's way.
    const double toe_ahead_m = tread.ends.lip ? 0.0 : foot_.collision.toe_x_m - foot_.contact.toe_x_m;
    for (const FootLimit& edge : tread.edges) {
      const bool is_back = edge.inside.inward.dot(tread.heading) < -params_.levels.square_cos;
      if (is_back) bound_by(edge, tread.back_margin_m + toe_ahead_m);
    }
    spare_m = std::max(spare_m < kInfinity ? spare_m : 0.0, 2.0 * (params_.feet.heel_inset_m - margin_m));
  }
  for (const TreadObstacle& o : tread.obstacles) {
    if (o.meets_feet(right_m, left_m)) spare_m = std::min(spare_m, o.sole_end_m - o.margin_m - heel_m - margin_m);
  }
  // A tread that ends in nothing ends all the same: the next riser may be there and not be seen.
  if (tread.ends.far_m) {
    const double room_m = *tread.ends.far_m - heel_m - (tread.ends.lip ? foot_.contact : foot_.collision).toe_x_m;
    spare_m = std::min(spare_m, room_m - margin_m - tread.back_margin_m);
  }
  const double round_m = std::min(params_.feet.nosing_round_m, std::max(0.5 * spare_m, 0.0));
  if (tread.rise_behind_m > params_.feet.high_rise_m) {
    const double inset_m = margin_m + 0.5 * round_m + params_.feet.high_heel_share * spare_m;
    return heel_m + math::clamp(inset_m, 0.0, params_.feet.heel_inset_m);
  }
  const FeetParams& feet = params_.feet;
  const DownParams& down = params_.down;
  const double inset_max_m = !tread.ends.below ? feet.heel_inset_max_m
                             : tread.ends.lip  ? down.tread_heel_inset_max_m
                                               : down.floor_heel_inset_max_m;
  const double heel_share = tread.ends.below ? down.heel_share : 0.5;
  const double along_m = heel_m + math::clamp(margin_m + heel_share * (spare_m + round_m), 0.0, inset_max_m);
  if (!tread.ends.below) return along_m;
  const double farthest_m = along_m + std::max(margin_m + spare_m + heel_m - along_m, 0.0);
  return std::min(off_lip_m(tread, along_m, left_m, right_m), farthest_m);
}

Foothold FootholdSearch::foothold_at(const LevelSurface& tread, double along_m, double lateral_m) const noexcept {
  const Vec2 p = tread.at(along_m, lateral_m);
  Foothold out;
  out.position_m = {p.x(), p.y(), tread.plane.height_m(p)};
  out.yaw_rad = tread.yaw_rad;
  out.up = tread.plane.normal;
  out.clearance_m = tread.contact_clearance_m(p);
  out.toe_clearance_m = tread.toe_clearance_m(p);
  out.polygon_id = tread.id;
  out.last_seen_ns = tread.last_seen_ns;
  const Vec2 out_of_nosing = left_of((tread.nosing_b_m - tread.nosing_a_m).head<2>());
  const double facing = out_of_nosing.dot(tread.heading);  // of a wedge's two feet one is nearer to it
  const double slanted_m = out_of_nosing.dot(p - tread.nosing_a_m.head<2>());
  out.nosing_distance_m = tread.has_nosing && facing > 0.0 ? slanted_m / facing : along_m;
  for (const FootLimit& edge : tread.edges) {
    if (!edge.side) continue;
    const double across = edge.inside.inward.dot(tread.left);
    double& room_m = out.side_room_m[index_of(across < 0.0 ? Foot::kLeft : Foot::kRight)];
    room_m = std::min(room_m, edge.clearance_m(p) / std::abs(across));
  }
  return out;
}

// Where the middle between the feet should be: in the middle of the tread when both its sides are known, without
// veering on the way up; otherwise where the robot is.
double FootholdSearch::middle_m(const LevelSurface& tread) const noexcept {
  const double own_m = 0.5 * (tread.lateral_m(query_.odom_T_sole[0].p_m.head<2>()) +
                              tread.lateral_m(query_.odom_T_sole[1].p_m.head<2>()));
  if (!tread.ends.left_m || !tread.ends.right_m) return own_m;
  const double centre_m = 0.5 * (*tread.ends.left_m + *tread.ends.right_m);
  if (!query_.climbing) return centre_m;
  return math::clamp(centre_m, own_m - params_.feet.veer_max_m, own_m + params_.feet.veer_max_m);
}

// For the middle of the feet; the one nearer to a side keeps the margin.
Interval FootholdSearch::between_sides(const LevelSurface& tread, double along_m, double half_m) const noexcept {
  Interval out{-kInfinity, kInfinity};
  for (const FootLimit& edge : tread.edges) {
    if (!edge.side) continue;
    // Clearance of the foot nearer to the edge is base + inward . left * middle.
    const double across = edge.inside.inward.dot(tread.left);
    const double base_m = edge.clearance_m(tread.at(along_m, 0.0)) - half_m * std::abs(across);
    const double bound_m = (params_.feet.side_margin_m - base_m) / across;
    if (across > 0.0) {
      out.min_m = std::max(out.min_m, bound_m);
    } else {
      out.max_m = std::min(out.max_m, bound_m);
    }
  }
  return out;
}

// Do feet about that middle meet something that leaves them too little of the tread?
bool FootholdSearch::blocked(const LevelSurface& tread, double middle_m, double half_m) const noexcept {
  const double least_m = params_.tread_min_m - foot_.collision.toe_x_m;
  return std::any_of(tread.obstacles.begin(), tread.obstacles.end(), [&](const TreadObstacle& o) {
    return o.sole_end_m < least_m && o.meets_feet(middle_m - half_m, middle_m + half_m);
  });
}

// The nearest middle between the sides at which the feet stand beside all that blocks them.
std::optional<double> FootholdSearch::beside_obstacles(const LevelSurface& tread, const Interval& sides,
                                                       double middle_m, double half_m) const noexcept {
  std::optional<double> best;
  for (const TreadObstacle& o : tread.obstacles) {
    const auto [right_m, left_m] = o.sole_lateral_m;
    // To the left and to the right of it, or over it.
    for (const double beside_m : {left_m + half_m, right_m - half_m, left_m - half_m, right_m + half_m}) {
      const double moved_m = std::abs(beside_m - middle_m);
      if (moved_m > params_.feet.evade_max_m || beside_m < sides.min_m || beside_m > sides.max_m) continue;
      if (best && moved_m >= std::abs(*best - middle_m)) continue;
      if (!blocked(tread, beside_m, half_m)) best = beside_m;
    }
  }
  return best;
}

// Both soles side by side on the tread, as near to that middle as sides and obstacles allow, closer together when they
// must. Eq. (26) picks the tread and says that a foot fits there; its nearest cell is no aim, being the one with the
// least room at the heel: least sole margins of 7.2 and 5.5 mm in two climbs of ten steps, against 11.7 and 9.7 mm
// centred (seeds 1 and 4, both noises).
StopReason FootholdSearch::place_feet(const LevelSurface& tread, Feet& feet) const noexcept {
  const double middle_m = this->middle_m(tread);
  // A side that was not seen, as under a patch of sunlight, says nothing of how wide the tread is.
  const bool sides_seen = tread.ends.left_m && tread.ends.right_m;
  StopReason reason = sides_seen ? StopReason::kTooNarrow : StopReason::kNothingSeen;
  for (std::int32_t i = 0; i < params_.feet.spacings; ++i) {
    const double half_m =
        params_.feet.half_spacing_m - (params_.feet.half_spacing_m - params_.feet.half_spacing_min_m) *
                                          static_cast<double>(i) / (params_.feet.spacings - 1);
    double along_m = aim_along_m(tread, middle_m + half_m, middle_m - half_m);
    const Interval sides = between_sides(tread, along_m, half_m);
    if (sides.min_m > sides.max_m) continue;
    double placed_m = std::min(std::max(middle_m, sides.min_m), sides.max_m);
    if (blocked(tread, placed_m, half_m)) {
      reason = StopReason::kObstacle;
      const std::optional<double> beside_m = beside_obstacles(tread, sides, placed_m, half_m);
      if (!beside_m) continue;
      placed_m = *beside_m;
      along_m = aim_along_m(tread, placed_m + half_m, placed_m - half_m);
    }
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      feet[index_of(foot)] = foothold_at(tread, along_m, placed_m + side_sign(foot) * half_m);
    }
    return StopReason::kNone;
  }
  return reason;
}

// The riser beneath a mapped tread: the tread says how high it is. Seen from close above, a riser's own ends are the
// worst known part of the map: 0.12 m of riser measured 0.21 m, and 0.13 m 0.195 m below a strip without depth.
bool FootholdSearch::carries(const Upright& riser, const LevelSurface& tread) const noexcept {
  const UprightParams& p = params_.uprights;
  if (tread.has_nosing) {
    const double behind_m = tread.along_m(riser.point_m);
    return behind_m >= -p.overhang_tolerance_m && behind_m <= p.overhang_max_m + p.overhang_tolerance_m;
  }
  double behind_m = kInfinity;
  for (const Vec2& corner : tread.hull) behind_m = std::min(behind_m, riser.outward.dot(riser.point_m - corner));
  return behind_m >= -p.overhang_tolerance_m && behind_m <= p.hidden_max_m;
}

bool FootholdSearch::is_one_rise(const LevelSurface& tread) const noexcept {
  return std::any_of(uprights_.begin(), uprights_.end(), [&](const Upright& u) {
    return u.width_m() > 2.0 * params_.top.half_width_m && carries(u, tread) &&
           tread.height_m - u.bottom_m > params_.high_rise.riser_least_m;
  });
}

bool FootholdSearch::too_steep(const LevelSurface& tread) const noexcept {
  constexpr double kTread_m = 0.28, kSteepness = 0.5;
  return tread.rise_behind_m > params_.high_rise.from_m && tread.depth_m > 0.0 &&
         tread.rise_behind_m > params_.feet.shin_rise_m + kSteepness * (tread.depth_m - kTread_m);
}

bool FootholdSearch::is_stool(const LevelSurface& tread) const noexcept {
  return tread.depth_m == 0.0 && tread.ends.left_m && tread.ends.right_m &&
         *tread.ends.left_m - *tread.ends.right_m < params_.feet.lone_width_m;
}

// A face that rises from the level the robot stands on higher than it may climb, before the next tread.
bool FootholdSearch::blocked_by_upright(double next_distance_m, double& top_m) const noexcept {
  const Vec2 sole_p_m = base_(sole_.origin_m());
  const double farthest_m = std::min(query_.climbing ? sole_p_m.x() + params_.step_max_m : params_.raster.g_range_m,
                                     next_distance_m + params_.upright_beyond_m);
  const double highest_m = found_.next == kNone ? params_.rise_max_m : params_.high_rise.from_m;
  for (const Upright& u : uprights_) {
    if (u.top_m - z_foot_ <= highest_m || u.bottom_m > z_foot_ + 2.0 * params_.delta_foot_m) continue;
    // A post is no rise: the feet may go beside it, see link_upright().
    if (u.outward.dot(base_.heading()) > -params_.uprights.facing_cos || u.width_m() < 2.0 * params_.top.half_width_m)
      continue;
    if (found_.next != kNone && carries(u, levels_[found_.next])) continue;
    const Vec2 a = base_(u.point_m + u.reach_left_m * u.direction);
    const Vec2 b = base_(u.point_m + u.reach_right_m * u.direction);
    const double gap_m = std::max(std::min(a.y(), b.y()), -std::max(a.y(), b.y()));
    const double x_m = 0.5 * (a.x() + b.x());
    if (gap_m > params_.top.half_width_m || x_m < 0.0 || x_m > farthest_m) continue;
    top_m = u.top_m;
    return true;
  }
  return false;
}

// Of as many spacings as may be tried, edges, toe limits and obstacles are gone through.
std::int32_t FootholdSearch::place_feet_instructions(const LevelSurface& tread) const noexcept {
  const auto edges = static_cast<std::int32_t>(tread.edges.size()), toe = static_cast<std::int32_t>(tread.toe.size());
  const auto obstacles = static_cast<std::int32_t>(tread.obstacles.size());
  const std::int32_t once = 1500 + 50 * edges + 40 * toe + 30 * obstacles;
  return once + params_.feet.spacings * (120 + 14 * edges + 40 * toe + 60 * obstacles * (1 + obstacles));
}

StopReason FootholdSearch::without_next() const noexcept {
  if (found_.unconfirmed_ahead) return StopReason::kNothingSeen;
  if (!query_.climbing) return StopReason::kNoStaircase;
  // Nothing higher is known: is that because nothing rises there, or because nobody looked?
  const bool looked = found_.top_cells > 0 && static_cast<double>(found_.top_cells_seen) >=
                                                  params_.top.fraction * static_cast<double>(found_.top_cells);
  return looked ? StopReason::kTop : StopReason::kNothingSeen;
}

StopReason FootholdSearch::judge_feet(const LevelSurface& tread, const Feet& feet) const noexcept {
  for (const Foothold& f : feet) {
    // Reaching over the end of what has been seen of it.
    if (std::min(f.clearance_m, f.toe_clearance_m) < params_.margin.least_m) return StopReason::kNothingSeen;
    if (tread.spare_m(f.position_m.head<2>()) < 0.0) return StopReason::kEdgeUncertain;
  }
  return StopReason::kNone;
}

StopReason FootholdSearch::judge_tread(const LevelSurface& tread, double from_height_m, const Vec2& from_p_m,
                                       double step_max_m, Feet& feet) const noexcept {
  const double rise_m = tread.height_m - from_height_m;
  const bool sure = rise_m <= params_.high_rise.from_m || (is_one_rise(tread) && !too_steep(tread));
  if (rise_m > params_.rise_max_m || !sure) return StopReason::kRiseTooHigh;
  if (!tread.has_nosing) return StopReason::kNothingSeen;
  if (tread.depth_m > 0.0 && tread.depth_m < params_.tread_min_m) return StopReason::kTreadTooShort;
  if (is_stool(tread)) return StopReason::kTooNarrow;
  const StopReason placed = place_feet(tread, feet);
  if (placed != StopReason::kNone) return placed;
  const Foothold& foot = feet[index_of(query_.stance)];
  if (tread.along_m(foot.position_m.head<2>()) - tread.along_m(from_p_m) > step_max_m) return StopReason::kNoStaircase;
  return judge_feet(tread, feet);
}

StopReason FootholdSearch::judge_next() noexcept {
  const LevelSurface& tread = levels_[found_.next];
  pending_.measured_rise_m = tread.height_m - z_foot_;
  pending_.measured_tread_m = tread.depth_m;
  pending_.tread = {tread.nosing_a_m, tread.nosing_b_m};
  double step_max_m = kInfinity;
  if (query_.climbing) step_max_m = params_.step_max_m;
  const StopReason found = judge_tread(tread, z_foot_, sole_.origin_m(), step_max_m, pending_.p_star_feet);
  if (found == StopReason::kNoStaircase) return without_next();  // another flight
  if (found != StopReason::kNone) return found;
  return found_.p_star_distance2_m2 < kFarAway_m2 ? StopReason::kNone : StopReason::kNothingSeen;
}

void FootholdSearch::choose() noexcept {
  if (query_.descends) {
    work_.add(200);
    work_.add(levels_.size(), 120);
    const Lip* lip = lip_ahead();
    const std::size_t below = lip != nullptr ? level_below(*lip) : kNone;
    if (below != kNone) {
      pending_.obstruction = judge_below(*lip, below);
      return;
    }
  }
  choose_up();
}

void FootholdSearch::choose_up() noexcept {
  work_.add(400);
  work_.add(uprights_.size(), 150);
  if (found_.next != kNone) work_.add(place_feet_instructions(levels_[found_.next]));
  double top_m = 0.0;
  if (map_.stamp_ns == 0 || (levels_.empty() && uprights_.empty())) {
    pending_.obstruction = StopReason::kNothingSeen;
  } else if (blocked_by_upright(math::sqrt(found_.next_distance2_m2), top_m)) {
    pending_.obstruction = StopReason::kRiseTooHigh;
    pending_.measured_rise_m = top_m - z_foot_;
  } else {
    pending_.obstruction = found_.next == kNone ? without_next() : judge_next();
  }
  if (pending_.obstruction != StopReason::kNone) return;

  const LevelSurface& tread = levels_[found_.next];
  const double lateral_m = tread.lateral_m(found_.p_star_cell_m);
  pending_.p_star = foothold_at(tread, aim_along_m(tread, lateral_m, lateral_m), lateral_m);
  pending_.has_p_star = true;
}

// p**: the candidate nearest to p* that is higher by more than delta_foot.
void FootholdSearch::look_ahead_row(std::int32_t row) noexcept {
  const Vec2 p_star_m = pending_.p_star.position_m.head<2>();
  if (distance2_to_row_m2(p_star_m, row) >= found_.p_star_star_distance2_m2) return;
  const double least_z_m = pending_.p_star.position_m.z() + params_.delta_foot_m;
  for_each_nearer(row, p_star_m, found_.p_star_star_distance2_m2, [&](const FootholdRaster::Stretch& stretch) {
    if (stretch.layer == FootholdRaster::kNoLayer) return;
    Vec2 cell_m;
    const double distance2 = nearest_fit(row, stretch, p_star_m, least_z_m, found_.p_star_star_distance2_m2, cell_m);
    if (distance2 >= found_.p_star_star_distance2_m2) return;
    found_.p_star_star_distance2_m2 = distance2;
    found_.next_next = stretch.layer;
  });
}

void FootholdSearch::finish() noexcept {
  work_.add(1200);
  work_.add(uprights_.size(), 60);
  if (found_.next_next != kNone) work_.add(place_feet_instructions(levels_[found_.next_next]));
  if (found_.next_next != kNone) {
    pending_.has_p_star_star =
        judge_tread(levels_[found_.next_next], levels_[found_.next].height_m, pending_.p_star.position_m.head<2>(),
                    params_.step_max_m, pending_.p_star_star_feet) == StopReason::kNone;
  }
  result_ = moved(pending_, map_.drift_m, query_, base_, params_.feet.seen_behind_m);
  ++counters_.searches;
}

}  // namespace polygmap
