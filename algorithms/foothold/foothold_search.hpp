// SPDX-License-Identifier: Apache-2.0
// Footholds from the polygon map, eqs (14)-(28).
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/foothold/foothold_raster.hpp"
#include "algorithms/foothold/level_surface.hpp"
#include "algorithms/foothold/reach.hpp"
#include "algorithms/geometry/plan_frame.hpp"

namespace polygmap {

class FootholdSearch {
 public:
  struct Params {
    double g_res_m = 0.01;
    double g_range_m = 1.2;       // eq. 20
    double g_z_m = 0.40;          // eq. 23: two rises of 0.175 m and margin
    double delta_foot_m = 0.025;  // eqs 26, 28; the published 0.04 steps over a 40 mm step
    double rise_max_m = 0.19;     // above the highest rise we climb, 0.175 m; below two of the least, 0.2 m
    // Contact rectangle to the tread's front and back edge, collision toe to the riser: the least, and two sigmas of
    // where edge and foot are. An edge errs by as much as its own sigma says, 2.3 mm rms in 620 steps on treads of
    // 270 mm; beside that a foot lands 2.2 mm off, by its legs' errors and the camera's yaw. Two sigmas of both, 6.4
    // mm of the 9 there are, keep a normal error on the tread in 97.7 % of the steps.
    EdgeMargin margin{0.003, 2.0, 0.0022};
    double tread_min_m = 0.260;     // collision toe and contact heel, 252 mm, and 4 mm at either end
    double side_margin_m = 0.020;   // contact rectangle to the tread's sides
    double veer_max_m = 0.02;       // sideways per tread, towards the middle of the staircase
    double half_spacing_m = 0.100;  // soles from their common middle
    double half_spacing_min_m = 0.085;
    double heel_inset_m = 0.014;                // heel edge behind the nosing where the back edge is not mapped
    double heel_inset_max_m = 0.030;            // on deep treads
    double corridor_half_width_m = 0.4;         // what lies further to the side is not the next tread
    double step_max_m = 0.45;                   // along the stairs from the standing sole, when climbing
    double area_min_m2 = 0.01;                  // a smaller surface is no tread
    double top_from_m = 0.20, top_to_m = 0.45;  // floor seen this far ahead of the sole says that nothing rises there
    double top_half_width_m = 0.15;
    double top_fraction = 0.5;
    std::uint32_t confirmed_sightings = 5;
  };
  struct Query {
    Transform world_T_base;
    std::array<Transform, kFootCount> world_T_sole;
    Foot stance = Foot::kLeft;  // the foot that stays
    bool climbing = false;      // a tread has been climbed already
  };
  struct Counters {
    std::uint32_t searches = 0;
    std::uint32_t rejected_queries = 0;
    std::uint32_t abandoned = 0;  // begin() before the last search was done
  };

  // foot: outlives the search.
  FootholdSearch(const Params& params, const SoleModel& foot) noexcept : params_(params), foot_(foot) {}

  // Copies what it needs. Query and result are in the world of the pose; the search itself is in that of the map, which
  // knows how far the two have drifted apart. An invalid query is counted and leaves nothing to do.
  void begin(const MapSnapshot& map, const Query& query) noexcept;
  // A unit is one row of the raster or one polygon.
  Progress step(WorkBudget& budget) noexcept;
  // Changes only in the step that returns kDone.
  [[nodiscard]] const FootholdSet& result() const noexcept { return result_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  enum class Stage : std::uint8_t { kIdle, kPrepare, kLink, kRaster, kErode, kChoose, kLookAhead, kFinish };

  // A mapped upright surface, plan view.
  struct Upright {
    Vec2 point_m, direction, outward;
    double reach_left_m, reach_right_m;  // along direction from the point
    double bottom_m, top_m;
    double sigma_m;  // of its place along outward
  };
  static constexpr std::size_t kNone = kMaxMapPolygons;

  void prepare_one(const MapPolygon& polygon) noexcept;
  void link(std::size_t i) noexcept;
  void raster_row(std::int32_t row) noexcept;
  void erode_row(std::int32_t row) noexcept;
  void choose() noexcept;
  void look_ahead_row(std::int32_t row) noexcept;
  void finish() noexcept;

  [[nodiscard]] bool fits(const FootholdRaster::Cell& cell) const noexcept;
  [[nodiscard]] double aim_along_m(const LevelSurface& tread, double left_m, double right_m) const noexcept;
  [[nodiscard]] Foothold foothold_at(const LevelSurface& tread, double along_m, double lateral_m) const noexcept;
  [[nodiscard]] double middle_m(const LevelSurface& tread) const noexcept;
  using Feet = std::array<Foothold, kFootCount>;
  [[nodiscard]] bool place_feet(const LevelSurface& tread, Feet& feet) const noexcept;
  [[nodiscard]] StopReason judge_feet(const LevelSurface& tread, const Feet& feet) const noexcept;
  // Of a step onto the tread from soles at a point before it; places the feet. kNoStaircase: it is too far for a step.
  [[nodiscard]] StopReason judge_tread(const LevelSurface& tread, double from_height_m, const Vec2& from_p_m,
                                       double step_max_m, Feet& feet) const noexcept;
  [[nodiscard]] static bool carries(const Upright& riser, const LevelSurface& tread) noexcept;
  [[nodiscard]] bool blocked_by_upright(double next_distance_m, double& top_m) const noexcept;
  [[nodiscard]] StopReason without_next() const noexcept;
  [[nodiscard]] StopReason judge_next() noexcept;

  Params params_;
  const SoleModel& foot_;
  Counters counters_;
  FootholdSet result_;   // of the last finished search
  FootholdSet pending_;  // being filled
  MapSnapshot map_;
  Query query_;
  double z_foot_ = 0.0;
  PlanFrame base_;
  PlanFrame sole_;  // of the standing foot
  StaticVector<LevelSurface, kMaxMapPolygons> levels_;
  StaticVector<Upright, kMaxMapPolygons> uprights_;
  FootholdRaster raster_;
  Stage stage_ = Stage::kIdle;
  std::int32_t row_ = 0;
  std::size_t index_ = 0;

  // Found on the way.
  bool unconfirmed_ahead_ = false;
  std::size_t next_ = kNone;  // the tread that comes next: owner of the nearest higher cell
  double next_distance2_m2_ = 0.0;
  double p_star_distance2_m2_ = 0.0;
  Vec2 p_star_cell_m_ = Vec2::Zero();
  bool has_p_star_cell_ = false;
  std::size_t next_next_ = kNone;
  std::size_t underfoot_ = kNone;  // the tread under the standing foot, when its far end was seen
  double p_star_star_distance2_m2_ = 0.0;
  std::uint32_t top_cells_ = 0;
  std::uint32_t top_cells_seen_ = 0;
};

}  // namespace polygmap
