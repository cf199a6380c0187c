// SPDX-License-Identifier: Apache-2.0
// Judges a climb: compares what the module says and does with what is true, tick by tick.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "firmware/telemetry.hpp"
#include "sim_stub/host/climb/climb_summary.hpp"
#include "sim_stub/host/climb/climb_svg.hpp"
#include "sim_stub/host/climb/climb_verdict.hpp"
#include "sim_stub/host/climb/odometry_report.hpp"
#include "sim_stub/host/climb/route_report.hpp"
#include "sim_stub/host/climb/surface_match.hpp"
#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/robot_camera.hpp"
#include "sim_stub/world/clearance.hpp"
#include "sim_stub/world/stair_world.hpp"
#include "sim_stub/world/tops.hpp"
#include "sim_stub/world/truth.hpp"

namespace polygmap::sim {

// What the run knows beside truth and telemetry.
struct RunFigures {
  ClimbOptions options;
  int interrupted_by = 0;  // the signal; 0: none
  OperatorEnd operator_end = OperatorEnd::kNone;
  std::string params_hash;  // of what the module was given
  std::vector<StateChange> states;
  CameraFigures camera;
  std::optional<BusFigures> bus;
  std::uint64_t heap_calls = 0;
  std::vector<std::pair<std::string, std::uint32_t>> faults;  // raised faults and limits by name
  std::string heap_first_caller;                              // the function, when there was a call
  std::vector<StageMemory> static_memory;
  std::vector<ScheduleRow> schedule;
  double wall_seconds = 0.0;
};

class ClimbReport {
 public:
  explicit ClimbReport(StairWorld world, const Transform& true_base_T_camera = nominal_robot().mounts.base_T_camera,
                       const CameraIntrinsics& intrinsics = robot_camera_intrinsics(),
                       const SoleModel& true_sole = nominal_robot().sole);

  // Once per tick, after the module's tick, with the truth of the same instant.
  void observe(const Truth& truth, const Telemetry& telemetry);
  // Every LIO pose that the module accepted, at its arrival; the truth of its stamp must lie within the last 2 s.
  void observe_lio(const LioSample& sample) { odometry_.observe_lio(sample); }

  // From the world's goal, where it stands, to another one.
  void send_on(const WorldPlace& goal) { route_.send_on(goal); }
  [[nodiscard]] ClimbSummary finish(const RunFigures& run) const;
  [[nodiscard]] ClimbDrawing drawing() const;
  [[nodiscard]] const StairWorld& world() const { return world_; }

 private:
  struct PastLegs {
    std::int64_t stamp_ns;
    std::array<LegShapes, kFootCount> base_legs;
  };
  // A foot in the air: where it came from and where it has been, judged once it is known where it lands.
  struct Flight {
    int from_step = -1;
    std::int64_t lift_off_ns = 0;
    std::vector<Transform> true_T_sole;
  };

  void observe_surfaces(const SurfaceFrame& frame);
  void observe_map(const Telemetry& telemetry);
  void observe_footsteps(const Truth& truth, const Telemetry& telemetry);
  void take_target(const Telemetry& telemetry);
  void observe_landing(const Truth& truth);
  void observe_tracking(const Truth& truth, const GaitStatus& gait);
  void observe_balance(const Truth& truth, const Telemetry& telemetry);
  void observe_soles(const Truth& truth, bool onto_tread);
  void observe_stance(const Truth& truth);
  void observe_steps_climbed(const Truth& truth);
  void observe_trails(const Truth& truth);
  [[nodiscard]] std::vector<int> beneath_foot(int step) const;
  // The least of a flight that ended on to_step, and of at_most_m.
  [[nodiscard]] double flight_clearance_m(const Flight& flight, int to_step, double at_most_m) const;
  [[nodiscard]] double clearance_min_m() const;
  // The step that a foot in the air is meant for, by the module's word.
  [[nodiscard]] int meant_step(Foot foot, const Flight& flight) const;

  StairWorld world_;
  std::vector<SolidBox> solids_;
  Transform true_base_T_camera_;
  SoleModel true_sole_;
  SurfaceVisibility visibility_;
  std::deque<PastLegs> past_legs_;

  std::uint64_t ticks_ = 0;
  std::int64_t last_stamp_ns_ = 0;
  bool fell_ = false;
  ClimbEnding ending_;

  OdometryReport odometry_;
  RouteReport route_;

  std::uint32_t frame_sequence_ = 0;
  std::int64_t frame_stamp_ns_ = 0;
  std::uint64_t frames_ = 0, frames_matching_ = 0, surfaces_ = 0, surfaces_unmatched_ = 0;
  std::uint64_t in_view_ = 0, missed_ = 0;  // true surfaces
  std::int64_t map_stamp_ns_ = 0;
  std::vector<double> exposure_to_map_ms_;
  std::uint64_t occupied_cells_most_ = 0;
  struct Seen {
    SurfacePatch surface;
    bool remembered;
  };
  std::map<std::uint32_t, Seen> polygons_;  // newest form of every polygon, by id; true world

  std::vector<Footstep> footsteps_;
  Foothold target_;              // of the newest footstep
  double latched_across_m_ = 0;  // the same: target's lateral place seen from the stance sole when it was chosen
  bool target_below_ = false;    // of where its foot stood
  bool target_mapped_ = false;   // the same: on a mapped tread, not beside the standing foot
  bool landing_pending_ = false;
  double com_tracking_max_m_ = kNotMeasured, zmp_margin_min_m_ = kNotMeasured;
  std::array<double, kJointsPerLeg> torque_peak_ratio_{}, joint_speed_peak_ratio_{};
  int torque_limited_ticks_ = 0;
  double tracking_x_max_m_ = kNotMeasured, tracking_z_max_m_ = kNotMeasured;

  std::array<std::optional<Flight>, kFootCount> flights_;
  bool flight_onto_tread_ = false;
  std::array<int, kFootCount> last_step_{-1, -1};
  std::array<std::int64_t, kFootCount> landed_ns_{};
  std::array<int, kFootCount> standing_footstep_{-1, -1};  // index into footsteps_ of what each sole stands on
  bool swung_ = false;
  double sole_margin_min_m_ = kNotMeasured;
  double clearance_min_m_ = std::numeric_limits<double>::infinity();
  double stand_off_m_ = kNotMeasured;
  std::vector<double> closure_error_m_;  // every tick on both feet

  int steps_climbed_ = 0;
  std::vector<bool> climbed_;
  std::int64_t resting_since_ns_ = 0;
  int resting_step_ = -1;
  std::int64_t first_lift_off_ns_ = -1;
  std::int64_t on_top_ns_ = -1;

  std::vector<Vec3> base_trail_m_;
  std::array<std::vector<Vec3>, kFootCount> sole_trail_m_;
};

// Writes summary.json and climb.svg into an existing directory; throws std::runtime_error with one sentence if it
// cannot.
void write_climb_files(const std::string& directory, const ClimbReport& report, const ClimbSummary& summary);

}  // namespace polygmap::sim
