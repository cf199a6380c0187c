// SPDX-License-Identifier: Apache-2.0
// The figures of one climb: what summary.json says. A figure that could not be measured is NaN here and null there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "sim_stub/host/climb/climb_options.hpp"
#include "sim_stub/host/climb/route_report.hpp"

namespace polygmap::sim {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

struct Spread {
  double median = kNotMeasured;
  double max = kNotMeasured;
};
// Median (mean of the middle two of an even count) and greatest value; not measured when there are none.
[[nodiscard]] Spread spread_of(std::vector<double> values);

// One swing as the module latched it and as it truly ended. Poses in the true world unless named otherwise.
struct Footstep {
  std::uint32_t sequence = 0;  // the module's count, from 1
  Foot foot = Foot::kLeft;
  bool onto_tread = false;
  bool landed = false;                      // touch-down reported, and the sole truly stands
  int step_index = -1;                      // true step under the landed sole, 0-based; -1: floor
  Transform true_T_planned;                 // latched target, by where the base was then
  Transform true_T_landed;                  // true sole at touch-down
  double execution_error_m = kNotMeasured;  // 3D, odometry frame: latched target to estimated sole at touch-down
  // Signed, latched minus true: the sole's distance behind the nosing and its lateral place seen from the stance sole.
  double along_error_m = kNotMeasured;
  double across_error_m = kNotMeasured;
  double sole_margin_m = kNotMeasured;      // least while it stood there
  double swing_clearance_m = kNotMeasured;  // least of the foot to the stairs on its way
  double map_age_at_latch_ms = kNotMeasured;
  double target_last_seen_ms = kNotMeasured;
};

struct ScheduleRow {
  std::string task;
  std::string lane;
  double budget_us = 0.0;
  std::uint64_t runs = 0;
  std::uint64_t overruns = 0;
  double wall_mean_us = 0.0;  // the last two by the wall clock
  double wall_max_us = 0.0;
};

struct StageBytes {
  std::string stage;
  std::size_t bytes = 0;
};

// What this seed's camera is like, and what the module found out about its mount.
struct CameraFigures {
  double scan_ms = 0.0;                 // as simulated
  double scale_error = 0.0;             // true depth is read as 1 + this
  Vec3 mount_error_deg = Vec3::Zero();  // roll, pitch, yaw in the base, against the data sheet
  Vec3 mount_error_m = Vec3::Zero();    // base frame
  Vec2 mount_found_deg = Vec2::Zero();  // roll, pitch, by the module, at the end
  double mount_found_height_m = 0.0;    // absorbs scale and leg lengths
  double mount_found_ahead_m = 0.0;     // the same, and encoders
};

struct StateChange {
  double at_s = 0.0;  // simulation's clock
  ModuleState state{};
};

// Of a climb through CAN buses.
struct BusFigures {
  std::vector<std::pair<std::string, double>> loads;  // by bus: share of its time that a cycle's frames may take
  std::string module_state;                           // at the end
  std::vector<std::string> silent_joints;             // whose drive was silent for longer than is bridged, at any time
  std::vector<std::string> error_joints;              // whose drive tells of an error at the end
  std::vector<std::string> hot_joints;                // whose drive was too hot, at any time
  std::uint64_t sent = 0, received = 0;               // frames
};

// Errors of the base's position in the true world, each world laid on it once, at the start.
struct OdometryFigures {
  double rmse_base_m = kNotMeasured, rmse_lio_m = kNotMeasured, rmse_fused_m = kNotMeasured;
  // From the first lift-off on: in the mean of the last second; and between 1 and 5 Hz, LIO as held between arrivals.
  double drift_base_m = kNotMeasured, drift_fused_m = kNotMeasured;
  double jitter_lio_m = kNotMeasured, jitter_fused_m = kNotMeasured;
  // Squared error of the fused position over its variance: 3 is honest; share of ticks within the 95 % bounds.
  double nees_mean = kNotMeasured, nees_in_bounds = kNotMeasured;
};

struct ClimbSummary {
  bool pass = false;
  std::string reason;  // one sentence
  bool fell = false;
  std::string ended_by;              // "module": by itself; "fall"; "time limit"; "interrupted"; "operator"
  int interrupted_by = 0;            // the signal; 0: none
  double ended_at_s = kNotMeasured;  // simulation's clock
  ClimbOptions options;
  std::string params_hash;          // of what the module was given
  std::vector<StateChange> states;  // the module's, the first one included
  CameraFigures camera;
  std::optional<BusFigures> bus;
  RouteFigures route;
  std::string stop_sentence;  // of the module, where it stopped
  int steps_total = 0;
  int steps_climbed = 0;  // both true soles rested on it or above, inside their treads' edges
  double climb_time_s = kNotMeasured;
  double seconds_per_step = kNotMeasured;
  double plane_rate_hz = 0.0;
  std::uint64_t frames = 0;              // behind plane_rate_hz: frames finished, ...
  std::uint64_t frames_matching = 0;     // ... frames in which every surface is a true one and none in view is missing,
  std::uint64_t surfaces = 0;            // surfaces in all frames, ...
  std::uint64_t surfaces_unmatched = 0;  // ... those that are no true surface (a leg, a ghost);
  std::uint64_t surfaces_in_view = 0;    // true surfaces that were well in view in all frames, ...
  std::uint64_t surfaces_missed = 0;     // ... those that were not reported
  Spread execution_error_m;
  Spread foothold_error_m;  // of each footstep the larger of the next two
  Spread foothold_error_along_m;
  Spread foothold_error_across_m;
  double sole_margin_min_m = kNotMeasured;
  double swing_clearance_min_m = kNotMeasured;
  // From the foremost collision toe to the first step's nosing, both feet on the floor: at the last such tick before a
  // foot left for the stairs, or of the run.
  double stand_off_m = kNotMeasured;
  Spread closure_error_m;  // by which the two standing legs disagree about the base
  double tracking_error_x_max_m = kNotMeasured;
  double tracking_error_z_max_m = kNotMeasured;
  // Planned against true centre of mass, horizontal, relative to a standing sole; centre of pressure to the edge of a
  // sole that stands alone.
  double com_tracking_max_m = kNotMeasured;
  double zmp_margin_min_m = kNotMeasured;
  // Greatest of both legs, over the drives' limits.
  std::array<double, kJointsPerLeg> torque_peak_ratio{}, joint_speed_peak_ratio{};
  double torque_limited_ms = 0.0;  // for so long a drive gave all it has at its speed
  OdometryFigures odometry;
  Spread exposure_to_map_ms;
  std::uint64_t occupied_cells_most = 0;  // of the map at any time
  Spread map_age_at_latch_ms;
  Spread target_last_seen_ms;
  std::uint64_t heap_calls = 0;
  std::vector<std::pair<std::string, std::uint32_t>> faults;  // raised faults and limits by name
  std::vector<StageBytes> static_memory;
  std::vector<ScheduleRow> schedule;
  std::vector<Footstep> footsteps;  // all of them, walking up included
  double wall_seconds = 0.0;
};

// Keys in a fixed order, lengths rounded to 0.01 mm and times to 0.1 ms: one run, one text. Whatever the wall clock
// measured stands under "wall" alone.
[[nodiscard]] nlohmann::ordered_json to_json(const ClimbSummary& summary);

// The same as summary.json holds it.
[[nodiscard]] std::string summary_text(const ClimbSummary& summary);

// "PASS: ..." or "FAIL: ...", one line without a line break.
[[nodiscard]] std::string verdict_line(const ClimbSummary& summary);

}  // namespace polygmap::sim
