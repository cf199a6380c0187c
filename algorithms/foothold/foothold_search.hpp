// SPDX-License-Identifier: Apache-2.0
// Footholds from the polygon map, eqs (14)-(28).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/foothold/foothold_raster.hpp"
#include "algorithms/foothold/level_surface.hpp"
#include "algorithms/foothold/reach.hpp"
#include "algorithms/foothold/things_on_tread.hpp"
#include "algorithms/foothold/upright.hpp"
#include "algorithms/geometry/plan_frame.hpp"

namespace polygmap {

class FootholdSearch {
 public:
  // The raster of eqs 17-24.
  struct RasterParams {
    double g_res_m = 0.01;
    double g_range_m = 1.2;
    double centre_ahead_m = 0.4;

    static void visit(auto& p, auto& field) {
      field("g_res_m", p.g_res_m, 0.005, 0.1, "Side of a raster cell.");
      field("g_range_m", p.g_range_m, 0.1, 5.0, "Eq. 20: the search goes as far.");
      field("centre_ahead_m", p.centre_ahead_m, -0.8, 0.8,
            "The raster's centre lies this far ahead of the base, so that the raster reaches g_range_m ahead.");
    }
  };
  // Where the feet go on a tread.
  struct FeetParams {
    double side_margin_m = 0.020;
    double lone_width_m = 0.55;
    double veer_max_m = 0.02;
    double half_spacing_m = 0.100;
    double half_spacing_min_m = 0.085;
    double heel_inset_m = 0.014;
    double heel_inset_max_m = 0.030;
    double high_rise_m = 0.1775;
    double high_heel_share = 0.25;
    double shin_rise_m = 0.205;
    double nosing_round_m = 0.0015;
    double evade_max_m = 0.06;
    double seen_behind_m = 0.2;
    std::int32_t spacings = 7;

    static void visit(auto& p, auto& field) {
      field("side_margin_m", p.side_margin_m, 0.0, 0.5, "Contact rectangle to the tread's sides.");
      field("lone_width_m", p.lone_width_m, 0.0, 5.0,
            "What is narrower between the sides that were seen, with nothing rising behind it, is a stool or a box: "
            "stairs "
            "are 0.6 m wide.");
      field("veer_max_m", p.veer_max_m, 0.0, 0.2,
            "Feet go no farther sideways per tread, towards the middle of the staircase.");
      field("half_spacing_m", p.half_spacing_m, 0.05, 0.3, "Soles from their common middle.");
      field("half_spacing_min_m", p.half_spacing_min_m, 0.05, 0.3,
            "Soles from their common middle where the tread has no room.");
      field.ordered("half_spacing_min_m", "half_spacing_m");
      field("heel_inset_m", p.heel_inset_m, 0.0, 0.2, "Heel edge behind the nosing where the back edge is not mapped.");
      field("heel_inset_max_m", p.heel_inset_max_m, 0.0, 0.5, "Heel edge behind the nosing at most, on deep treads.");
      field.ordered("heel_inset_m", "heel_inset_max_m");
      field("high_rise_m", p.high_rise_m, 0.0, 0.5,
            "Before a higher rise the feet stand back, heel_inset_m behind the nosing at most: the shin needs room.");
      field("high_heel_share", p.high_heel_share, 0.0, 0.5, "Then the heel keeps this share of what is to spare.");
      field("shin_rise_m", p.shin_rise_m, 0.0, 1.0,
            "Behind a tread of 0.28 m it rises no higher, or the shin touches the edge above; behind a deeper one by "
            "half "
            "of what it is deeper more.");
      field("nosing_round_m", p.nosing_round_m, 0.0, 0.05,
            "A nosing is rounded, by wear or as it was built: the tread carries a heel from so far behind it on.");
      field("evade_max_m", p.evade_max_m, 0.0, 0.3, "Feet go no farther sideways to stand beside an obstacle.");
      field("seen_behind_m", p.seen_behind_m, 0.0, 2.0,
            "A tread is where it was seen from this much farther behind, on the mean of the map's sightings.");
      field("spacings", p.spacings, 2, 14,
            "As many distances between the feet are tried, from half_spacing_m to half_spacing_min_m.");
    }
  };
  // The floor ahead which says that the stairs end here.
  struct TopParams {
    double from_m = 0.20, to_m = 0.45;
    double half_width_m = 0.15;
    double fraction = 0.5;

    static void visit(auto& p, auto& field) {
      field("from_m", p.from_m, 0.0, 2.0, "Floor seen from this far ahead of the sole says that nothing rises there.");
      field("to_m", p.to_m, 0.0, 2.0, "Floor seen up to this far ahead of the sole says that nothing rises there.");
      field.ordered("from_m", "to_m");
      field("half_width_m", p.half_width_m, 0.01, 2.0, "Floor is looked for this far to either side of the sole.");
      field("fraction", p.fraction, 0.0, 1.0, "At least this share of that floor has been seen.");
    }
  };
  // Down over the lip of the surface that it stands on.
  struct DownParams {
    double drop_max_m = 0.21;
    double beyond_m = 0.16;
    double level_gap_m = 0.35;
    double facing_cos = 0.64;
    double heel_share = 0.78;
    double tread_heel_inset_max_m = 0.030;
    double floor_heel_inset_max_m = 0.032;
    double hidden_m = 0.010;
    double seen_inset_m = 0.006;

    static void visit(auto& p, auto& field) {
      field("drop_max_m", p.drop_max_m, 0.02, 0.5, "A step goes no farther down; below that the legs say.");
      field("beyond_m", p.beyond_m, 0.0, 0.5,
            "The next surface down lies this far beyond the lip: a tread that was not seen is not stepped over.");
      field("level_gap_m", p.level_gap_m, 0.0, 1.0,
            "Where something higher begins as near beyond the lip, the way goes up: a tread of open stairs has a lip.");
      field("facing_cos", p.facing_cos, 0.0, 1.0,
            "A lip whose turn against the base's heading has a smaller cosine is not ahead.");
      field("heel_share", p.heel_share, 0.0, 1.0,
            "Of what a tread has to spare as much is at the heel, which a riser is behind, and the rest at the toe. "
            "Chosen "
            "on a few flights of the simulation (2026-11-30), and tried on nothing else.");
      field("tread_heel_inset_max_m", p.tread_heel_inset_max_m, 0.0, 0.5,
            "Heel edge beyond the lip at most, on a tread: the legs reach no farther down.");
      field("floor_heel_inset_max_m", p.floor_heel_inset_max_m, 0.0, 0.5,
            "Heel edge beyond the lip at most where no other lip follows: a foot that walks on goes back a little "
            "first.");
      field("hidden_m", p.hidden_m, 0.0, 0.05,
            "A surface was seen from this much nearer to the lip than the map tells: an unknown end keeps "
            "`map.sides.unknown_margin_m`.");
      field("seen_inset_m", p.seen_inset_m, 0.0, 0.1,
            "The heel goes by up to as much farther beyond the lip where the lip hid what is nearer. Chosen in the "
            "simulation.");
    }
  };
  // What may be two steps.
  struct HighRiseParams {
    double from_m = 0.19;
    double riser_least_m = 0.15;

    static void visit(auto& p, auto& field) {
      field("from_m", p.from_m, 0.02, 0.5,
            "What rises higher may be two of the least rises, 0.1 m, and the tread between was not seen.");
      field(
          "riser_least_m", p.riser_least_m, 0.0, 0.5,
          "Such a rise is one where its riser was seen to reach as far down below the tread: farther than one of two.");
    }
  };
  struct Params {
    double g_z_m = 0.49;
    double delta_foot_m = 0.025;
    double rise_max_m = 0.23;
    HighRiseParams high_rise;
    // Contact rectangle to the tread's front and back edge, collision toe to the riser: the least, and two sigmas of
    // where edge and foot are. An edge errs by as much as its own sigma says, 2.3 mm rms in 620 steps on treads of
    // 270 mm; beside that a foot lands 2.2 mm off, by its legs' errors and the camera's yaw. Two sigmas of both, 6.4
    // mm of the 9 there are, keep a normal error on the tread in 97.7 % of the steps.
    EdgeMargin margin{0.003, 2.0, 0.0022};
    double tread_min_m = 0.260;
    double corridor_half_width_m = 0.25;
    double step_max_m = 0.45;
    double area_min_m2 = 0.01;
    std::uint32_t confirmed_sightings = 5;
    double back_min_m = 0.05, back_max_m = 0.8;
    double upright_beyond_m = 0.1;
    LevelSurfaceParams levels;
    UprightParams uprights;
    ThingParams things;
    RasterParams raster;
    FeetParams feet;
    TopParams top;
    DownParams down;

    static void visit(auto& p, auto& field) {
      field("g_z_m", p.g_z_m, 0.01, 2.0, "Eq. 23: a foothold is no higher, two rises and margin.");
      field("delta_foot_m", p.delta_foot_m, 0.0, 0.039,
            "Eqs 26, 28: heights as close are one level; the published 0.04 steps over a 40 mm step.");
      field("rise_max_m", p.rise_max_m, 0.02, 0.5, "A step rises no higher: above the highest rise we climb, 0.22 m.");
      field("high_rise", p.high_rise);
      field("margin", p.margin);
      field("tread_min_m", p.tread_min_m, 0.1, 1.0,
            "A tread is as deep: collision toe and contact heel, 252 mm, and 4 mm at either end.");
      field("corridor_half_width_m", p.corridor_half_width_m, 0.05, 5.0,
            "What lies farther to the side is not the next tread: both feet, 0.15 m, and as much as a body sways; 0.4 "
            "m took "
            "a box beside the way for it (2026-11).");
      field("step_max_m", p.step_max_m, 0.05, 2.0,
            "The next tread begins no farther along the stairs from the standing sole, when climbing.");
      field("area_min_m2", p.area_min_m2, 0.0, 1.0, "A smaller surface is no tread.");
      field("confirmed_sightings", p.confirmed_sightings, 0, 1000,
            "A foot goes on a surface that has been seen as often.");
      field("back_min_m", p.back_min_m, 0.0, 0.5,
            "A riser or nosing that bounds a tread lies farther behind its nosing: what is nearer is the tread's own.");
      field("back_max_m", p.back_max_m, 0.1, 3.0,
            "A riser or nosing that bounds a tread lies nearer behind its nosing: what is farther, an obstacle too, is "
            "another one's.");
      field.ordered("back_min_m", "back_max_m");
      field("upright_beyond_m", p.upright_beyond_m, 0.0, 0.5,
            "An upright surface this much farther away than the next tread's nearest point is not looked at.");
      field("levels", p.levels);
      field("uprights", p.uprights);
      field("things", p.things);
      field("raster", p.raster);
      field("feet", p.feet);
      field("top", p.top);
      field("down", p.down);
    }
  };
  struct Query {
    Transform odom_T_base;
    std::array<Transform, kFootCount> odom_T_sole;
    Foot stance = Foot::kLeft;  // the foot that stays
    bool climbing = false;      // a tread has been climbed already
    bool descends = false;      // down is a way, too
    // By how much each foot stands ahead of where it is told to: its footholds are told as much farther back.
    std::array<double, kFootCount> feet_ahead_m{};
    double way_excess = 0.0;  // 0.01: base and feet go 1 % farther than told, so footholds are told nearer
  };
  struct Counters {
    std::uint32_t searches = 0;
    std::uint32_t rejected_queries = 0;
    std::uint32_t abandoned = 0;  // begin() before the last search was done
  };

  // foot: outlives the search.
  FootholdSearch(const Params& params, const SoleModel& foot) noexcept : params_(params), foot_(foot) {}

  // Copies what it needs. Query and result are in odometry; the search itself is in the map's frame, which
  // knows how far the two have drifted apart. An invalid query is counted and leaves nothing to do.
  void begin(const MapSnapshot& map, const Query& query) noexcept;
  Progress step(WorkBudget& budget) noexcept;
  // What the next step begins with; a benchmark charges instructions to it.
  enum class Stage : std::uint8_t { kIdle, kPrepare, kLink, kRaster, kErode, kChoose, kLookAhead, kFinish };
  [[nodiscard]] Stage stage() const noexcept { return stage_; }
  // Changes only in the step that returns kDone.
  [[nodiscard]] const FootholdSet& result() const noexcept { return result_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  static constexpr std::size_t kNone = kMaxMapPolygons;
  static constexpr double kFarAway_m2 = std::numeric_limits<double>::infinity();
  // What the rows of one search have told so far.
  struct Found {
    bool unconfirmed_ahead = false;
    std::size_t next = kNone;  // the tread that comes next: owner of the nearest higher cell
    double next_distance2_m2 = kFarAway_m2;
    double p_star_distance2_m2 = kFarAway_m2;
    Vec2 p_star_cell_m = Vec2::Zero();
    std::size_t next_next = kNone;
    double p_star_star_distance2_m2 = kFarAway_m2;
    std::size_t underfoot = kNone;  // the tread under the standing foot, when its far end was seen
    std::uint32_t top_cells = 0;
    std::uint32_t top_cells_seen = 0;
  };

  void prepare_one(const MapPolygon& polygon) noexcept;
  void link(std::size_t i) noexcept;
  // What the feet meet of the segment from a to b, plan view: across both of them it ends the tread.
  enum class Extent : std::uint8_t { kAside, kPartial, kAcross };
  [[nodiscard]] Extent extent_on(const LevelSurface& tread, const Vec2& a_m, const Vec2& b_m) const noexcept;
  void link_upright(LevelSurface& tread, const Upright& upright) const noexcept;
  void raster_row(std::int32_t row) noexcept;
  // At least as much from a point to every cell of a row: one that is no nearer than what was found is not looked at.
  [[nodiscard]] double distance2_to_row_m2(const Vec2& from_m, std::int32_t row) const noexcept;
  void look_at_top(std::int32_t row) noexcept;
  void find_next(std::int32_t row) noexcept;
  template <typename Visit>
  void for_each_nearer(std::int32_t row, const Vec2& from_m, double distance2_m2, const Visit& visit) noexcept;
  [[nodiscard]] double nearest_fit(std::int32_t row, const FootholdRaster::Stretch& stretch, const Vec2& from_m,
                                   double least_z_m, double distance2_m2, Vec2& cell_m) noexcept;
  void erode_row(std::int32_t row) noexcept;
  void choose() noexcept;
  void look_ahead_row(std::int32_t row) noexcept;
  void finish() noexcept;

  [[nodiscard]] bool fits(const Vec2& p_m, const LevelSurface& surface) noexcept;
  [[nodiscard]] double aim_along_m(const LevelSurface& tread, double left_m, double right_m) const noexcept;
  [[nodiscard]] Foothold foothold_at(const LevelSurface& tread, double along_m, double lateral_m) const noexcept;
  [[nodiscard]] double middle_m(const LevelSurface& tread) const noexcept;
  using Feet = std::array<Foothold, kFootCount>;
  [[nodiscard]] Interval between_sides(const LevelSurface& tread, double along_m, double half_m) const noexcept;
  [[nodiscard]] bool blocked(const LevelSurface& tread, double middle_m, double half_m) const noexcept;
  [[nodiscard]] std::optional<double> beside_obstacles(const LevelSurface& tread, const Interval& sides,
                                                       double middle_m, double half_m) const noexcept;
  [[nodiscard]] std::int32_t place_feet_instructions(const LevelSurface& tread) const noexcept;
  [[nodiscard]] StopReason place_feet(const LevelSurface& tread, Feet& feet) const noexcept;
  [[nodiscard]] StopReason judge_feet(const LevelSurface& tread, const Feet& feet) const noexcept;
  // Of a step onto the tread from soles at a point before it; places the feet. kNoStaircase: it is too far for a step.
  [[nodiscard]] StopReason judge_tread(const LevelSurface& tread, double from_height_m, const Vec2& from_p_m,
                                       double step_max_m, Feet& feet) const noexcept;
  // Not two steps of which the tread between was missed.
  [[nodiscard]] bool is_one_rise(const LevelSurface& tread) const noexcept;
  // A shin meets the edge that rises behind it.
  [[nodiscard]] bool too_steep(const LevelSurface& tread) const noexcept;
  // Something narrow to step on that is no stairs.
  [[nodiscard]] bool is_stool(const LevelSurface& tread) const noexcept;
  [[nodiscard]] bool carries(const Upright& riser, const LevelSurface& tread) const noexcept;
  [[nodiscard]] bool blocked_by_upright(double next_distance_m, double& top_m) const noexcept;
  [[nodiscard]] StopReason without_next() const noexcept;
  [[nodiscard]] StopReason judge_next() noexcept;
  // The nearest lip ahead of the surface that it stands on, where that is what comes next.
  [[nodiscard]] const Lip* lip_ahead() const noexcept;
  // What lies below it; kNone: nothing that was seen.
  [[nodiscard]] std::size_t level_below(const Lip& lip) const noexcept;
  // Where the heels of soles that come down over the lip keep their margin from it, from so far along on.
  [[nodiscard]] double off_lip_m(const LevelSurface& tread, double along_m, double left_m,
                                 double right_m) const noexcept;
  [[nodiscard]] StopReason judge_below(const Lip& lip, std::size_t level) noexcept;
  void choose_up() noexcept;

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
  Found found_;
  WorkCount work_;
};

}  // namespace polygmap
