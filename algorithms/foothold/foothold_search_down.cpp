// SPDX-License-Identifier: Apache-2.0
// The foothold search over a lip: what comes next lies below.
#include <algorithm>

#include "algorithms/foothold/foothold_search.hpp"

namespace polygmap {

const Lip* FootholdSearch::lip_ahead() const noexcept {
  const Lip* nearest = nullptr;
  double nearest_m = params_.raster.g_range_m;
  const Vec2& sole_p_m = sole_.origin_m();
  const double feet_m = params_.feet.half_spacing_m + foot_.collision.half_width_m;
  for (const LevelSurface& level : levels_) {
    if (!level.ends.lip || !in_sole_layer(level.plane.height_m(sole_p_m), z_foot_, params_.delta_foot_m)) continue;
    const Lip& lip = *level.ends.lip;
    const double ahead_m = lip.heading.dot(lip.middle_m() - sole_p_m);
    // A foot whose toe is over it stands on it all the same.
    if (!(ahead_m > 0.0) || !(ahead_m < nearest_m)) continue;
    if (lip.heading.dot(base_.heading()) < params_.down.facing_cos) continue;
    const Vec2 left = left_of(lip.heading);
    const double middle_m = left.dot(0.5 * (query_.odom_T_sole[0].p_m + query_.odom_T_sole[1].p_m).head<2>());
    if (left.dot(lip.left_m.head<2>()) < middle_m + feet_m || left.dot(lip.right_m.head<2>()) > middle_m - feet_m)
      continue;
    nearest = &lip;
    nearest_m = ahead_m;
  }
  if (nearest == nullptr || found_.next == kNone) return nearest;
  // Up comes first where both are ahead. A tread that it came down from is behind it, even where its map reaches ahead.
  const bool is_ahead = nearest->heading.dot(centroid_m(levels_[found_.next].hull) - sole_p_m) > 0.0;
  const bool rises = is_ahead && math::sqrt(found_.next_distance2_m2) < nearest_m + params_.down.level_gap_m;
  return rises ? nullptr : nearest;
}

std::size_t FootholdSearch::level_below(const Lip& lip) const noexcept {
  const Vec2 left = left_of(lip.heading);
  const double aside_m =
      left.dot(0.5 * (query_.odom_T_sole[0].p_m + query_.odom_T_sole[1].p_m).head<2>() - lip.middle_m());
  const Vec2 beyond_m = lip.middle_m() + aside_m * left + params_.down.beyond_m * lip.heading;
  std::size_t highest = kNone;
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    const LevelSurface& level = levels_[i];
    const double height_m = level.plane.height_m(beyond_m);
    if (height_m > z_foot_ - params_.delta_foot_m || !contains(level.hull, beyond_m)) continue;
    if (highest == kNone || height_m > levels_[highest].plane.height_m(beyond_m)) highest = i;
  }
  return highest;
}

double FootholdSearch::off_lip_m(const LevelSurface& tread, double along_m, double left_m,
                                 double right_m) const noexcept {
  // How far along a sole keeps so much from a limit behind it.
  const auto from_m = [&](const FootLimit& limit, double kept_m) {
    const double clearance_m =
        std::min(limit.clearance_m(tread.at(along_m, left_m)), limit.clearance_m(tread.at(along_m, right_m)));
    return along_m + (kept_m - clearance_m) / limit.inside.inward.dot(tread.heading);
  };
  // On a wedge the lip is nearer to one of the feet, and to one corner of its heel. The reserve keeps the next search,
  // whose lip lies a little elsewhere, from refusing the foothold; it was chosen in the simulation (2026-11-30).
  constexpr double kBeyondMargin_m = 0.003;
  double off_m = along_m;
  for (const FootLimit& edge : tread.edges) {
    const bool is_front = edge.inside.inward.dot(tread.heading) > params_.levels.square_cos;
    if (is_front && !edge.side) off_m = std::max(off_m, from_m(edge, edge.margin_m + kBeyondMargin_m));
  }
  // A little farther off the heel may stand on what was seen.
  double seen_m = off_m;
  for (const FootLimit& near : tread.ends.below->hidden)
    seen_m = std::max(seen_m, from_m(near, kBeyondMargin_m - params_.down.hidden_m));
  return std::min(seen_m, off_m + params_.down.seen_inset_m);
}

StopReason FootholdSearch::judge_below(const Lip& lip, std::size_t level) noexcept {
  const Lip over = lip;  // of a level that may be the one that is prepared anew
  LevelSurface& tread = levels_[level];
  const auto* polygon =
      std::find_if(map_.polygons.begin(), map_.polygons.end(), [&](const MapPolygon& p) { return p.id == tread.id; });
  if (polygon == map_.polygons.end() || !prepare_below(*polygon, over, params_.levels, params_.margin, foot_, tread)) {
    return StopReason::kNothingSeen;
  }
  work_.add(2500);
  work_.add(tread.hull.size(), 260);
  link(level);
  work_.add(place_feet_instructions(tread));
  pending_.measured_rise_m = tread.height_m - z_foot_;
  pending_.measured_tread_m = tread.depth_m;
  pending_.tread = {over.left_m, over.right_m};
  // A lip with a larger margin is not told: the gait sets a toe 20 mm before it. Both were chosen in the simulation
  // alone.
  constexpr double kVague_m = 0.016;
  pending_.has_lip_beyond = tread.ends.lip && tread.back_margin_m <= kVague_m;
  if (tread.ends.lip) pending_.lip_beyond = {tread.ends.lip->left_m, tread.ends.lip->right_m};
  if (-pending_.measured_rise_m > params_.down.drop_max_m) return StopReason::kDropTooDeep;
  const double step_max_m = query_.climbing ? params_.step_max_m : std::numeric_limits<double>::infinity();
  const StopReason judged = judge_tread(tread, z_foot_, sole_.origin_m(), step_max_m, pending_.p_star_feet);
  if (judged == StopReason::kNoStaircase) return without_next();
  if (judged != StopReason::kNone) return judged;
  // What the lip hid of it is seen from nearer by.
  for (const Foothold& foot : pending_.p_star_feet) {
    for (const FootLimit& near : tread.ends.below->hidden) {
      if (near.clearance_m(foot.position_m.head<2>()) < -params_.down.hidden_m) return StopReason::kEdgeUncertain;
    }
  }
  pending_.p_star = pending_.p_star_feet[index_of(query_.stance)];
  pending_.has_p_star = true;
  return StopReason::kNone;
}

}  // namespace polygmap
