// SPDX-License-Identifier: Apache-2.0
// The polygon map: what perception saw in single frames, fused in the world frame and remembered.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "algorithms/core/samples.hpp"
#include "algorithms/core/surfaces.hpp"
#include "algorithms/core/transform.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/map_track.hpp"

namespace polygmap {

// Each remembered surface is a plane with eight ends in directions 45 degrees apart, and for level surfaces the nosing
// and the back edge as lines. Every quantity is a mean weighted by information that fades with window_s: noise
// averages, slow odometry drift is followed. Only an observed end can pull an end inwards; where the picture ends, the
// surface is taken to reach at least as far as it was seen.
class PolygonMap {
 public:
  struct Params {
    double window_s = 1.5;             // information fades to 1/e
    double height_gate_min_m = 0.008;  // level surfaces within 3 sigma, but between these two, are one
    double height_gate_max_m = 0.018;  // below half of the least step, 40 mm
    double upright_gate_m = 0.06;      // risers stand a tread apart
    double tilt_gate_rad = 0.17;
    double upright_turn_gate_rad = 0.35;
    double overlap_fraction = 0.3;  // of the shorter one, along the stairs or up the riser
    double lateral_gap_m = 0.5;     // the robot's own leg may split a tread in two
    double other_gap_m = 0.1;
    double line_gate_min_m = 0.012;  // an edge further off than 4 sigma, but between these two, is an outlier
    double line_gate_max_m = 0.025;
    double line_turn_gate = 0.15;  // slope against the remembered line
    double line_min_length_m = 0.05;
    double side_sigma_m = 0.005;  // of an observed end
    double side_gate_m = 0.025;
    double unknown_margin_m = 0.010;      // two sigma of a vertex: noise must not make unknown ends grow
    std::uint32_t outliers_to_reset = 8;  // consecutive, then the new evidence wins
    std::uint32_t line_min_sightings = 3;
    std::uint32_t confirmed_sightings = 5;
    std::uint32_t misses_unconfirmed = 4;  // consecutive frames in plain view without a sighting
    std::uint32_t misses_confirmed = 90;
    double unconfirmed_age_s = 2.0;      // unconfirmed and out of view
    double systematic_sigma_m = 0.0015;  // of depth errors that repeat from frame to frame and do not average out
    double drift_m_per_sqrt_s = 0.0015;  // of the world pose while a surface is out of view
    double view_margin_px = 30.0;
    double view_range_m = 2.5;
    double view_min_incidence = 0.25;  // sine of the angle between ray and surface
    double reach_m = 1.5;              // beyond it a polygon makes room first when the map is full
  };
  struct View {
    Transform world_T_camera;       // at the exposure
    double position_sigma_m = 0.0;  // of that pose
    double tilt_sigma_rad = 0.0;
    CameraIntrinsics intrinsics;
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
    std::uint32_t line_outliers = 0;
    std::uint32_t side_outliers = 0;
    std::uint32_t resets = 0;      // outliers that persisted
    std::uint32_t degenerate = 0;  // lines that left no polygon; the ends were used
    std::uint32_t dropped_unconfirmed = 0;
    std::uint32_t dropped_vanished = 0;  // confirmed, in view, not there any more
    std::uint32_t evicted = 0;           // full
  };

  PolygonMap() noexcept : PolygonMap(Params{}) {}
  explicit PolygonMap(const Params& params) noexcept : params_(params) {}

  // Copies the frame. A frame that is invalid or not newer is counted and leaves nothing to do.
  void begin(const SurfaceFrame& frame, const View& view) noexcept;
  // A unit is one comparison of a seen with a remembered surface; the largest piece is 24 units.
  Progress step(WorkBudget& budget) noexcept;
  // Changes only in the step that returns kDone. The stamp moves on only with a frame in which something was seen.
  [[nodiscard]] const MapSnapshot& snapshot() const noexcept { return snapshot_; }
  void clear() noexcept;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  enum class Stage : std::uint8_t { kIdle, kLoad, kCompare, kFuse, kAge, kPublish };

  [[nodiscard]] bool load(const SurfacePatch& patch) noexcept;
  [[nodiscard]] bool matches(const MapTrack& track, double& cost) const noexcept;
  [[nodiscard]] double overlap_area_m2(const MapTrack& track) const noexcept;
  void compare_one() noexcept;
  void fuse_best() noexcept;
  void create() noexcept;
  void fuse(MapTrack& track) noexcept;
  void merge(MapTrack& into, MapTrack& from) noexcept;
  void age(MapTrack& track) noexcept;
  void publish() noexcept;

  [[nodiscard]] ConvexPolygon local_polygon(const MapTrack& track) const noexcept;
  [[nodiscard]] std::optional<SeenLine> local_line(const MapTrack& track, const EdgeLine& line) const noexcept;
  [[nodiscard]] std::optional<Vec3> heading_from_lines() const noexcept;
  void turn_to(MapTrack& track, const Vec3& world_x) noexcept;
  void update_line(TrackedLine& line, const SeenLine& seen) noexcept;
  void update_sides(MapTrack& track, bool first) noexcept;
  void update_side(TrackedSide& side, double seen_m, bool observed) noexcept;
  void rebuild(MapTrack& track) noexcept;
  [[nodiscard]] bool should_be_seen(const MapTrack& track) const noexcept;
  [[nodiscard]] double faded(std::int64_t since_ns) const noexcept;
  void write(const MapTrack& track, MapPolygon& out) const noexcept;
  void write_sigmas(const MapTrack& track, SurfacePatch& out) const noexcept;

  Params params_;
  Counters counters_;
  MapSnapshot snapshot_;
  StaticVector<MapTrack, kMaxMapPolygons> tracks_;  // index i is snapshot polygon i once published
  SurfaceFrame frame_;
  View view_;
  SeenSurface seen_;
  ConvexPolygon seen_local_;  // in the frame of the track being updated
  std::int64_t newest_ns_ = 0;
  std::uint32_t next_id_ = 1;
  std::uint32_t fused_in_frame_ = 0;
  bool any_frame_ = false;
  Stage stage_ = Stage::kIdle;
  std::size_t patch_ = 0;
  std::size_t track_ = 0;
  std::size_t best_ = kMaxMapPolygons;
  std::size_t second_ = kMaxMapPolygons;
  double best_cost_ = 0.0;
  double second_cost_ = 0.0;
};

}  // namespace polygmap
