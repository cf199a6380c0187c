// SPDX-License-Identifier: Apache-2.0
// The polygon map: what perception saw in single frames, fused in odometry and remembered: what moves
// the world against it, LIO, moves no foothold.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/map/ground_map.hpp"
#include "algorithms/perception/map/map_drift.hpp"
#include "algorithms/perception/map/map_track.hpp"
#include "algorithms/perception/map/thing_map.hpp"
#include "algorithms/robot/body_shapes.hpp"

namespace polygmap {

// Each remembered surface is a plane with eight ends in directions 45 degrees apart, and for level surfaces the nosing
// and the back edge as lines. Planes, lines and observed ends are means weighted by information that fades with
// window_s. Only an observed end can pull an end inwards; where the picture ends, the surface is taken to reach at
// least about as far as it was seen. An offset that a frame's confirmed treads and risers share is taken for an error
// of its pose (MapDrift), as far as that pose's covariance allows, and moves nothing: surfaces out of view stay in
// place against those in view. The map's frame is that of the odometry at the start.
class PolygonMap {
 public:
  // What a surface of a kind cannot be: its normal in the map says so.
  struct KindParams {
    double tread_up_min = 0.8;
    double riser_up_max = 0.5;

    static void visit(auto& p, auto& field) {
      field("tread_up_min", p.tread_up_min, 0.0, 1.0,
            "A tread whose normal has a smaller upward part in the map is rejected.");
      field("riser_up_max", p.riser_up_max, 0.0, 1.0,
            "A riser whose normal has a larger upward or downward part in the map is rejected.");
    }
  };
  // Edges that are remembered as lines.
  struct LineParams {
    double gate_min_m = 0.012;
    double gate_max_m = 0.025;
    double turn_gate = 0.15;
    double sigmas = 4.0;
    double min_length_m = 0.05;
    std::uint32_t min_sightings = 3;
    double across_min = 0.5;

    static void visit(auto& p, auto& field) {
      field("gate_min_m", p.gate_min_m, 0.0, 0.1,
            "An edge as near to the remembered one is no outlier, whatever its sigmas.");
      field("gate_max_m", p.gate_max_m, 0.0, 0.2,
            "A plane or an edge farther from the remembered one is an outlier, whatever its sigmas.");
      field.ordered("gate_min_m", "gate_max_m");
      field(
          "turn_gate", p.turn_gate, 0.001, 10.0,
          "An edge whose slope against the remembered line is no more is no outlier by its turn; a short or noisy one "
          "may turn by `sigmas` of its own.");
      field("sigmas", p.sigmas, 1.0, 20.0,
            "An edge as many sigmas from the remembered one is an outlier, between the two gates.");
      field("min_length_m", p.min_length_m, 0.0, 1.0, "A shorter edge says nothing.");
      field("min_sightings", p.min_sightings, 1, 1000, "A line is told once it has been seen as often.");
      field("across_min", p.across_min, 0.1, 1.0,
            "A line of which a smaller share lies across the stairs, when the surface's axes turn, is forgotten.");
    }
  };
  // Which remembered surface a seen one is.
  struct MatchParams {
    double height_gate_min_m = 0.008;
    double height_gate_max_m = 0.018;
    double upright_gate_m = 0.06;
    double tilt_gate_rad = 0.17;
    double upright_turn_gate_rad = 0.35;
    double overlap_fraction = 0.3;
    double lateral_gap_m = 0.5;
    double other_gap_m = 0.1;
    double height_sigmas = 3.0;

    static void visit(auto& p, auto& field) {
      field("height_gate_min_m", p.height_gate_min_m, 0.0, 0.02,
            "Surfaces other than risers that are as near along their normal may be one, whatever their sigmas.");
      field("height_gate_max_m", p.height_gate_max_m, 0.0, 0.02,
            "Surfaces other than risers that are farther apart along their normal are two, whatever their sigmas; half "
            "of the "
            "least step is 20 mm.");
      field.ordered("height_gate_min_m", "height_gate_max_m");
      field("upright_gate_m", p.upright_gate_m, 0.001, 0.12,
            "Risers nearer to each other may be one, since they stand a tread apart.");
      field("tilt_gate_rad", p.tilt_gate_rad, 0.001, 1.5,
            "Surfaces other than risers that are turned no farther against each other may be one.");
      field("upright_turn_gate_rad", p.upright_turn_gate_rad, 0.001, 1.5,
            "Risers turned no farther against each other may be one.");
      field("overlap_fraction", p.overlap_fraction, 0.0, 1.0,
            "One surface overlaps by this share of the shorter one, along the stairs or up the riser.");
      field("lateral_gap_m", p.lateral_gap_m, 0.0, 5.0,
            "Parts of one tread or riser lie this far apart at most: the robot's own leg may split it in two.");
      field("other_gap_m", p.other_gap_m, 0.0, 5.0, "Parts of any other surface lie this far apart at most.");
      field("height_sigmas", p.height_sigmas, 0.5, 20.0,
            "Surfaces other than risers that are as many sigmas apart along their normal are two, between the two "
            "gates.");
    }
  };
  // When a surface is sure, when it goes, and what is worth a place.
  struct MemoryParams {
    std::uint32_t confirmed_sightings = 5;
    std::uint32_t misses_unconfirmed = 4;
    std::uint32_t misses_confirmed = 90;
    double unconfirmed_age_s = 2.0;
    double reach_m = 1.5;
    double other_area_min_m2 = 0.02;

    static void visit(auto& p, auto& field) {
      field("confirmed_sightings", p.confirmed_sightings, 1, 1000,
            "A surface is confirmed once it has been seen as often.");
      field("misses_unconfirmed", p.misses_unconfirmed, 1, 1000,
            "An unconfirmed surface goes after as many frames in plain view without a sighting.");
      field("misses_confirmed", p.misses_confirmed, 1, 100000,
            "A confirmed surface goes after as many frames in plain view without a sighting.");
      field("unconfirmed_age_s", p.unconfirmed_age_s, 0.01, 1000.0,
            "An unconfirmed surface goes when it was not seen for so long, in view or not.");
      field("reach_m", p.reach_m, 0.1, 20.0, "A polygon farther off makes room first when the map is full.");
      field("other_area_min_m2", p.other_area_min_m2, 0.0, 10.0,
            "A smaller other surface, or one out of reach, is not worth a place: nothing reads it.");
    }
  };
  // Where a surface that is there would be seen.
  struct PlainViewParams {
    double margin_px = 30.0;
    double range_m = 2.5;
    double min_incidence = 0.25;

    static void visit(auto& p, auto& field) {
      field("margin_px", p.margin_px, 0.0, 200.0, "What is as near to the picture's rim is not in plain view.");
      field("range_m", p.range_m, 0.1, 20.0, "What is farther is not in plain view.");
      field("min_incidence", p.min_incidence, 0.01, 1.0,
            "What is seen at a smaller sine of the angle between ray and surface is not in plain view.");
    }
  };
  // Ends that are no remembered lines.
  struct SideParams {
    double sigma_m = 0.005;
    double gate_m = 0.025;
    double unknown_margin_m = 0.010;

    static void visit(auto& p, auto& field) {
      field("sigma_m", p.sigma_m, 1e-4, 0.1, "Place of an observed end.");
      field("gate_m", p.gate_m, 0.001, 0.5, "An observed end farther off is an outlier.");
      field("unknown_margin_m", p.unknown_margin_m, 0.0, 0.1,
            "Two sigmas of a vertex, so that noise does not make unknown ends grow.");
    }
  };
  struct Params {
    double window_s = 1.5;
    std::uint32_t outliers_to_reset = 8;
    double systematic_sigma_m = 0.0015;
    double least_sigma_m = 0.0005;
    double least_tilt_sigma_rad = 0.0005;
    double max_range_m = 10.0;
    double turn_slope = 0.05;
    double level_rad = 0.039;
    double rmse_gain = 0.1;
    KindParams kinds;
    LineParams lines;
    SeenEndParams ends;
    MapDrift::Params drift;
    MatchParams match;
    MemoryParams memory;
    PlainViewParams plain_view;
    SideParams sides;
    ThingMap::Params things;
    GroundMap::Params ground;

    static void visit(auto& p, auto& field) {
      field("window_s", p.window_s, 0.05, 1000.0, "Information fades to 1/e in this time.");
      field("outliers_to_reset", p.outliers_to_reset, 1, 1000,
            "After as many outliers in a row the new evidence wins.");
      field("systematic_sigma_m", p.systematic_sigma_m, 0.0, 0.1,
            "Depth errors that repeat from frame to frame do not average out.");
      field("least_sigma_m", p.least_sigma_m, 1e-6, 0.1,
            "A frame that knows the place of a surface or an edge better by its own account is believed only so far.");
      field("least_tilt_sigma_rad", p.least_tilt_sigma_rad, 1e-6, 0.1,
            "A frame that knows the tilt of a surface better by its own account is believed only so far.");
      field("max_range_m", p.max_range_m, 0.5, 100.0, "A surface that reaches farther from the camera is rejected.");
      field("turn_slope", p.turn_slope, 0.0, 1.0,
            "A tread's axes turn to its nosing, or its back line, where that has a larger slope in them.");
      field(
          "level_rad", p.level_rad, 0.0, 0.5,
          "A surface that slopes by more is no ground to walk on: feet are put down level. Above what a mount that is "
          "not yet known makes of a floor, by the camera's data sheet; tried on ramps of the simulation alone.");
      field("rmse_gain", p.rmse_gain, 0.0, 1.0,
            "Share of the newest sighting in what is remembered of the fit's residual.");
      field("kinds", p.kinds);
      field("lines", p.lines);
      field("ends", p.ends);
      field("drift", p.drift);
      field("match", p.match);
      field("memory", p.memory);
      field("plain_view", p.plain_view);
      field("sides", p.sides);
      field("things", p.things);
      field("ground", p.ground);
    }
  };
  struct View {
    Transform odom_T_camera;        // at the exposure
    double position_sigma_m = 0.0;  // of that pose
    double tilt_sigma_rad = 0.0;    // of the base
    CameraIntrinsics intrinsics;
    std::array<LegShapes, kFootCount> body{};  // camera frame; what it hides is not seen to be empty
    BodyMargin body_margin{0.02, 0.0};
    double mount_sigma_rad = 0.0;  // of the camera's roll and pitch on the base: between what is seen and the feet
    const ColumnImage* columns = nullptr;  // the picture, until the frame is done; none: no thing is seen to be gone
    std::array<Transform, kFootCount> odom_T_sole{};
    std::array<bool, kFootCount> stands{};
    SoleRectangle sole{};
    bool tell_ground = false;  // somebody walks on it
  };
  struct Counters {
    std::uint32_t frames = 0;
    std::uint32_t rejected_frames = 0;   // not finite, or no camera model
    std::uint32_t stale_frames = 0;      // not newer than the newest
    std::uint32_t abandoned_frames = 0;  // begin() before the last one was done
    std::uint32_t rejected_surfaces = 0;
    std::uint32_t created = 0;
    std::uint32_t fused = 0;
    std::uint32_t merged = 0;  // two remembered surfaces turned out to be one
    std::uint32_t plane_outliers = 0;
    std::uint32_t line_outliers = 0;
    std::uint32_t side_outliers = 0;
    std::uint32_t resets = 0;      // outliers that persisted
    std::uint32_t degenerate = 0;  // lines that left no polygon; the ends were used
    std::uint32_t dropped_unconfirmed = 0;
    std::uint32_t dropped_vanished = 0;  // confirmed, in view, not there any more
    std::uint32_t passed_over = 0;       // not worth a place: other_area_min_m2
    std::uint32_t forgotten = 0;         // out of reach: made room
    std::uint32_t evicted = 0;           // within reach: made room
    std::uint32_t refused = 0;           // found no room
  };

  PolygonMap() noexcept : PolygonMap(Params{}) {}
  explicit PolygonMap(const Params& params) noexcept
      : params_(params), drift_(params.drift), things_(params.things), ground_(params.ground) {}

  // Copies the frame. A frame that is invalid or not newer is counted and leaves nothing to do.
  void begin(const SurfaceFrame& frame, const View& view) noexcept;
  // The largest piece publishes all that a frame changed, of a full map.
  static constexpr std::int32_t kMaxPieceUnits = 120'000 / kInstructionsPerUnit;
  Progress step(WorkBudget& budget) noexcept;
  // What the next step begins with; a benchmark charges instructions to it.
  enum class Stage : std::uint8_t {
    kIdle,
    kLoad,
    kCompare,
    kFuse,
    kAge,
    kThings,
    kThingsAgain,
    kGround,
    kTellGround,
    kSlopes,
    kPublish
  };
  [[nodiscard]] Stage stage() const noexcept { return stage_; }
  // Changes only in the step that returns kDone. The stamp moves on only with a frame in which something was seen.
  [[nodiscard]] const MapSnapshot& snapshot() const noexcept { return snapshot_; }
  void clear() noexcept;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  // Of the seen surface to a remembered one that may be the same.
  struct Nearness {
    double across_m = 0.0;  // along the remembered normal, at the seen middle
    double gate_m = 0.0;
    double variance_m2 = 0.0;  // of across, but for the pose's
  };

  // Where a pass over the frame's surfaces or things stands, and what of the map the present one may be.
  struct Pass {
    bool measuring = false;  // the first pass, in which nothing changes yet
    std::size_t patch = 0;   // in order_
    std::size_t track = 0;
    std::size_t best = kMaxMapPolygons;
    std::size_t second = kMaxMapPolygons;
    double best_cost = 0.0;
    double second_cost = 0.0;
    std::size_t thing = 0;    // the frame's sighting, or the map's cell
    std::uint32_t fused = 0;  // surfaces, of this frame
  };

  void do_piece() noexcept;
  void begin_things() noexcept;
  void begin_ground() noexcept;
  [[gnu::cold, gnu::noinline]] void leave_out_slope() noexcept;
  void order_surfaces() noexcept;
  void begin_fusing() noexcept;
  void next_surface() noexcept;
  [[nodiscard]] bool load(const SurfacePatch& patch) noexcept;
  [[nodiscard]] bool is_near(const MapTrack& track, Nearness& out) const noexcept;
  // The robot's leg leaves unknown ends. Where both were seen to end towards each other, they are two posts.
  [[nodiscard]] bool two_posts(const MapTrack& track, const ConvexPolygon& seen_polygon, bool behind) const noexcept;
  [[nodiscard]] bool matches(const MapTrack& track, const Nearness& near, double& cost) noexcept;
  void compare_some() noexcept;
  void measure_offset() noexcept;
  void fuse_best() noexcept;
  void create() noexcept;
  void admit(const MapTrack& track) noexcept;
  [[nodiscard]] int priority(const MapTrack& track) const noexcept;
  // offset_m: of the seen plane along the remembered normal, at the track's origin; fade: of what was known.
  void fuse(MapTrack& track, double offset_m, double fade) noexcept;
  void merge(MapTrack& into, MapTrack& from) noexcept;
  void age(MapTrack& track) noexcept;
  void publish() noexcept;

  [[nodiscard]] ConvexPolygon local_polygon(const MapTrack& track) const noexcept;
  [[nodiscard]] std::optional<SeenLine> local_line(const MapTrack& track, const EdgeLine& line) const noexcept;
  [[nodiscard]] std::optional<Vec3> heading_from_lines() const noexcept;
  [[nodiscard]] bool agrees(const TrackedLine& line, const SeenLine& seen) const noexcept;
  void turn_to(MapTrack& track, const Vec3& map_x) noexcept;
  void update_line(TrackedLine& line, const SeenLine& seen) noexcept;
  void update_back(MapTrack& track) noexcept;
  [[nodiscard]] bool faces_as(MapTrack& track) noexcept;
  void update_sides(MapTrack& track, bool first) noexcept;
  void update_side(TrackedSide& side, double seen_m, bool observed) noexcept;
  void rebuild(MapTrack& track) noexcept;
  [[nodiscard]] bool in_view(const MapTrack& track, const Transform& camera_T_local) const noexcept;
  [[nodiscard]] bool hidden(const MapTrack& track, const Transform& camera_T_local) noexcept;
  [[nodiscard]] double faded(std::int64_t since_ns) const noexcept;
  void write(const MapTrack& track, MapPolygon& out) const noexcept;
  [[nodiscard]] Viewpoint viewpoint() const noexcept { return {map_T_camera_.p_m, view_.mount_sigma_rad}; }
  void write_sigmas(const MapTrack& track, SurfacePatch& out) const noexcept;

  Params params_;
  Counters counters_;
  MapSnapshot snapshot_;
  StaticVector<MapTrack, kMaxMapPolygons> tracks_;  // index i is snapshot polygon i once published
  MapDrift drift_;
  ThingMap things_;
  GroundMap ground_;
  SurfaceFrame frame_;
  StaticVector<std::uint8_t, kMaxPlanesPerFrame> order_;  // of the frame's surfaces: treads and risers first
  std::size_t alignment_count_ = 0;                       // how many of these say where the frame lies
  View view_;
  Transform map_T_camera_;  // at first by the last drift, then by the frame's own offset
  SeenSurface seen_;
  ConvexPolygon seen_local_;  // in the frame of the track being updated
  std::int64_t newest_ns_ = 0;
  std::uint32_t next_id_ = 1;
  bool any_frame_ = false;
  Stage stage_ = Stage::kIdle;
  Pass pass_;
  WorkCount work_;
};

}  // namespace polygmap
