// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/climb.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "firmware/config/param_table.hpp"
#include "firmware/recording/recorder.hpp"
#include "firmware/schedule.hpp"
#include "sim_stub/bus/bus_robot.hpp"
#include "sim_stub/heap_trap.hpp"
#include "sim_stub/host/climb/climb_report.hpp"
#include "sim_stub/host/live/climb_live.hpp"
#include "sim_stub/host/live/pacer.hpp"
#include "sim_stub/host/record/climb_recorder.hpp"
#include "sim_stub/host/record/preview_camera.hpp"
#include "sim_stub/host/record/truth_topics.hpp"
#include "sim_stub/host/report/report_page.hpp"
#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/sim_robot.hpp"
#include "sim_stub/world/clearance.hpp"

namespace polygmap::sim {
namespace {

using WallClock = std::chrono::steady_clock;

// The module's rows, timed by the wall clock on the way: virtual time has no cost.
class TimedPipeline {
 public:
  explicit TimedPipeline(Pipeline& pipeline) noexcept : pipeline_(pipeline) {}

  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    const auto begin = WallClock::now();
    const std::int32_t units = budget.left();
    const Progress progress = pipeline_.run_row(row, cycle_ns, budget);
    if (progress != Progress::kIdle) {
      wall_[row].add(static_cast<std::uint64_t>(std::chrono::nanoseconds(WallClock::now() - begin).count()));
      charge(row, units - budget.left(), budget.left());
    }
    return progress;
  }
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept { pipeline_.cycle_done(lane, report); }
  [[nodiscard]] const DurationStatistics& wall(std::size_t row) const noexcept { return wall_[row]; }
  // By the work that was done, at the robot's prices; 0 of rows whose work is not counted.
  [[nodiscard]] const polygmap_mailbox_cost& charged(std::size_t row) const noexcept { return charged_[row]; }

 private:
  void charge(std::size_t row, std::int64_t spent_units, std::int64_t left_units) noexcept {
    if (!kSchedule[row].resumable()) return;
    polygmap_mailbox_cost& cost = charged_[row];
    const bool is_first = cost.most_ns == 0;
    const std::int64_t unit_ns = kSchedule[row].unit_cost_ns;
    const auto spent_ns = static_cast<std::uint64_t>(spent_units * unit_ns);
    cost.total_ns += spent_ns;
    cost.most_ns = std::max(cost.most_ns, spent_ns);
    cost.total_slack_ns += left_units * unit_ns;
    cost.least_slack_ns = is_first ? left_units * unit_ns : std::min(cost.least_slack_ns, left_units * unit_ns);
  }
  Pipeline& pipeline_;
  std::array<DurationStatistics, kTasks.size()> wall_;
  std::array<polygmap_mailbox_cost, kTasks.size()> charged_{};
};

// The lidar's port on the way to the module: the report wants to see what the module accepts.
class WatchedLidar final : public hal::LidarOdometry {
 public:
  explicit WatchedLidar(hal::LidarOdometry& lidar) noexcept : lidar_(lidar) {}
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    if (!lidar_.try_read(sample)) return false;
    last_ = sample;
    return true;
  }
  // Once per sample: it is the one that the newest estimate is as old as.
  [[nodiscard]] bool accepted(const StateEstimate& state) noexcept {
    const bool fresh =
        last_.stamp_ns > told_ns_ && state.lio_age_ns >= 0 && state.stamp_ns - state.lio_age_ns == last_.stamp_ns;
    if (fresh) told_ns_ = last_.stamp_ns;
    return fresh;
  }
  [[nodiscard]] const LioSample& last() const noexcept { return last_; }

 private:
  hal::LidarOdometry& lidar_;
  LioSample last_;
  std::int64_t told_ns_ = 0;
};

using Tasks = recording::RecordedTasks<TimedPipeline>;
using Executive = OneLaneExecutive<Tasks>;

// Memory that is there before the module is: the heap is watched from its first instruction on.
struct Module {
  std::optional<Pipeline> pipeline;
  std::optional<TimedPipeline> timed;
  std::optional<Tasks> tasks;
  std::optional<Executive> executive;
  PerceptionTelemetry watched;
};

static_assert(VirtualClock::kTick_ns == kCycle_ns);

SimOptions sim_options(const ClimbOptions& options) {
  SimOptions sim;
  sim.seed = options.seed;
  sim.stairs = options.stairs;
  if (options.world) {
    const WorldPlace& start = options.world->start;
    sim.world = options.world->world;
    sim.start = {-start.x_m, start.y_m, start.yaw_rad.value_or(0.0), options.world->start_height_m};
  }
  sim.noise = options.noise;
  sim.plant_kind = options.plant;
  sim.pushes = options.pushes;
  sim.errors = options.reality.sensors;
  sim.mujoco = options.reality.plant;
  sim.stair_errors = options.reality.stairs;
  sim.camera.errors = options.reality.camera;
  sim.camera.stairs_shift_m = {options.render_dx_m, options.render_dy_m, options.render_dz_m};
  sim.camera.missing_step = options.render_missing_step;
  sim.camera.threaded = options.threaded_render;
  sim.camera.scan_s = 1e-3 * options.scan_ms;
  if (options.camera) {
    sim.intrinsics = options.camera->intrinsics;
    sim.depth_sigma = options.camera->noise;
  }
  sim.imu_interval_ns = std::max(options.params.imu_interval_ns, VirtualClock::kTick_ns);
  sim.force_sensors = options.foot_sensors;
  if (options.blank_depth) sim.camera.blank = {{0, INT64_MAX}};
  return sim;
}

ClimbProgress progress_of(std::int64_t now_ns, const GaitStatus& gait, const TimedPipeline& tasks) {
  ClimbProgress progress{seconds(now_ns), static_cast<int>(gait.treads_climbed), name_of(gait.phase), "", 0.0};
  double worst_share = -1.0;
  for (std::size_t row = 0; row < kTasks.size(); ++row) {
    const double max_us = 1e-3 * static_cast<double>(tasks.wall(row).max_ns());
    if (max_us / kOneLaneSchedule[row].budget_us <= worst_share) continue;
    worst_share = max_us / kOneLaneSchedule[row].budget_us;
    progress.worst_row = kOneLaneSchedule[row].task.data();
    progress.worst_row_us = max_us;
  }
  return progress;
}

std::vector<ScheduleRow> schedule_of(const Executive& executive, const TimedPipeline& tasks) {
  std::vector<ScheduleRow> rows;
  for (std::size_t row = 0; row < kTasks.size(); ++row) {
    const RowStatistics& statistics = executive.row_statistics(row);
    rows.push_back({std::string(kSchedule[row].task), kSchedule[row].lane == kControlLane ? "control" : "perception",
                    static_cast<double>(kSchedule[row].budget_us), statistics.runs, statistics.overruns,
                    1e-3 * static_cast<double>(tasks.wall(row).mean_ns()),
                    1e-3 * static_cast<double>(tasks.wall(row).max_ns())});
  }
  return rows;
}

polygmap_mailbox_timing timing_of(const Executive& executive, const TimedPipeline& tasks, std::int64_t now_ns) {
  polygmap_mailbox_timing timing{};
  timing.stamp_ns = now_ns;
  timing.row_count = static_cast<std::uint32_t>(kTasks.size());
  timing.lane_count = 1;
  for (std::size_t row = 0; row < kTasks.size(); ++row) {
    const RowStatistics& statistics = executive.row_statistics(row);
    polygmap_mailbox_row& to = timing.rows[row];
    to.runs = statistics.runs;
    to.overruns = statistics.overruns;
    to.shed = statistics.shed;
    to.robot = tasks.charged(row);
    to.host.total_ns = tasks.wall(row).sum_ns();
    to.host.most_ns = tasks.wall(row).max_ns();
  }
  const LaneStatistics& lane = executive.lane_statistics();
  timing.lanes[0] = {lane.cycles, lane.overruns, lane.slips, lane.caught_up, lane.lateness.max_ns()};
  return timing;
}

CameraFigures camera_figures(const SimRobot& robot, const CameraExtrinsicsEstimator& mount) {
  constexpr double kDegrees = 180.0 / kPi;
  const RobotErrors& errors = robot.errors();
  const Mat3 turn = errors.base_T_camera.R * nominal_robot().mounts.base_T_camera.R.transpose();
  CameraFigures f;
  f.scan_ms = 1e3 * robot.depth_camera().scan_s();
  f.scale_error = errors.depth_scale - 1.0;
  f.mount_error_deg = kDegrees * Vec3{std::atan2(turn(2, 1), turn(2, 2)), -std::asin(turn(2, 0)), yaw_of(turn)};
  f.mount_error_m = errors.base_T_camera.p_m - nominal_robot().mounts.base_T_camera.p_m;
  f.mount_found_deg = kDegrees * Vec2{mount.roll_rad(), mount.pitch_rad()};
  f.mount_found_height_m = mount.height_m();
  f.mount_found_ahead_m = mount.x_m();
  return f;
}

// Nothing but a command leads on.
bool waits_for_operator(ModuleState state) {
  return state == ModuleState::kOff || state == ModuleState::kStanding || state == ModuleState::kHolding;
}

std::vector<std::string> names_of(JointSet joints) {
  std::vector<std::string> names;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (joints.contains(n)) names.emplace_back(kJointNames[n]);
  }
  return names;
}

BusFigures bus_figures(const config::BusFile& file, BusRobot& robot, const Telemetry& telemetry) {
  BusFigures f;
  f.module_state = name_of(telemetry.module_state);
  f.silent_joints = names_of(telemetry.drives.ever_silent);
  f.error_joints = names_of(telemetry.drives.bus.drive_errors);
  f.hot_joints = names_of(telemetry.drives.ever_hot);
  for (std::size_t i = 0; i < file.buses.size(); ++i) {
    f.loads.emplace_back(file.buses[i], hal::bus_load(file.table, i));
    f.sent += robot.bus(i).status().sent;
    f.received += robot.bus(i).status().received;
  }
  return f;
}

// Of all lanes, by name; only what was raised.
std::vector<std::pair<std::string, std::uint32_t>> raised(const Health& health) {
  std::vector<std::pair<std::string, std::uint32_t>> out;
  const auto add = [&](const auto& table) {
    for (const auto& line : table) {
      if (const std::uint32_t count = health.count(line.code).count; count > 0) out.emplace_back(line.name, count);
    }
  };
  add(kFaultTable);
  add(kLimitTable);
  return out;
}

// As go_to has it: from the middle between the feet.
Destination destination_from(const Truth& truth, const Vec3& to_m) {
  const Transform &left = truth.true_T_sole[0], &right = truth.true_T_sole[1];
  const double yaw_rad = yaw_of(left.R) + 0.5 * math::wrap_angle(yaw_of(right.R) - yaw_of(left.R));
  const Vec3 middle_m = 0.5 * (left.p_m + right.p_m);
  const Vec3 way_m = rotation_z(yaw_rad).transpose() * (to_m - middle_m);
  return {.ahead_m = way_m.x(), .left_m = way_m.y(), .up_m = way_m.z(), .has_height = true};
}

}  // namespace

ClimbSummary run_climb(const ClimbOptions& options, const ClimbProgressFunction& progress) {
  constexpr std::int64_t kRestAfterEnd_ns = 2 * kNsPerS;      // a robot that topples takes its time
  constexpr std::int64_t kRestAfterRelease_ns = 5 * kNsPerS;  // on the other controller
  constexpr std::int64_t kUnheard_ns = 10 * kNsPerMs;         // who hears no command for so long takes the robot over
  const auto wall_begin = WallClock::now();
  heap::set_on_call(heap::OnCall::kCount);
  heap::reset();

  SimRobot robot(sim_options(options));
  // Who says nothing else wants the robot to go to the world's goal.
  std::ostream nobody(nullptr);
  const std::optional<Destination> goal = options.world ? destination_in(*options.world) : std::nullopt;
  std::optional<Dispatcher> dispatcher;
  Dispatcher::WayBack way_back;
  std::optional<WorldPlace> sent_to;  // once it is
  if (options.comes_back) {
    way_back = [&] {
      sent_to = WorldPlace{options.world->start.x_m, options.world->start.y_m, std::nullopt, options.world->start.step};
      return destination_from(robot.truth(), options.world->world.point_m(*sent_to));
    };
  }
  ClimbOperator* const climb_operator = options.climb_operator != nullptr || !goal
                                            ? options.climb_operator
                                            : &dispatcher.emplace(*goal, nobody, way_back);
  Params params = options.params;
  params.gait.planner.pattern = options.gait;
  params.supervisor.autostart = params.supervisor.autostart && climb_operator == nullptr;
  params.self_filter = options.self_filter;
  params.estimate_mount = options.estimate_mount;
  if (options.camera) {
    params.surfaces.noise = options.camera->noise;
    params.surfaces.limits.min_depth_m = options.camera->min_depth_m;
    params.surfaces.limits.max_depth_m = options.camera->max_depth_m;
  }
  std::optional<CandumpLog> can_log;
  std::unique_ptr<BusRobot> bus;
  if (options.bus) {
    config::limit_by_drives(*options.bus, params.robot);
    config::BusFile file = *options.bus;
    if (!options.foot_sensors) file.table.feet = {};
    if (!options.can_log.empty()) can_log.emplace(options.can_log);
    bus = std::make_unique<BusRobot>(robot, file, can_log ? &*can_log : nullptr);
  }
  hal::JointBus& joints = bus ? static_cast<hal::JointBus&>(bus->joints()) : robot;
  WatchedLidar lidar(robot);
  PreviewCamera camera(robot);
  std::optional<ClimbRecorder> recorder;
  if (options.save_inputs) recorder.emplace(camera, robot, joints, lidar);
  Ports watched_ports =
      recorder ? Ports{*recorder, *recorder, *recorder, *recorder} : Ports{camera, robot, joints, lidar};
  watched_ports.operator_input = climb_operator;
  std::unique_ptr<recording::Recorder> recording;
  std::optional<TruthTopics> truth_topics;
  if (!options.recording.empty()) {
    recording = std::make_unique<recording::Recorder>(watched_ports, options.record_pictures ? &robot : nullptr);
    recording->begin(options.recording, params,
                     static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()));
    truth_topics.emplace(*recording, robot.stairs());
  }
  const auto module = std::make_unique<Module>();
  {
    const heap::ModuleCall call("Pipeline::Pipeline");
    module->pipeline.emplace(recording ? recording->ports() : watched_ports, params);
    module->pipeline->watch(module->watched);
    if (recording) recording->watch(*module->pipeline);
    module->timed.emplace(*module->pipeline);
    module->tasks.emplace(*module->timed, recording.get());
    module->executive.emplace(*module->tasks, robot, module->pipeline->lane_health(0));
    module->executive->start(robot.now_ns() + kCycle_ns);
  }
  Pipeline& pipeline = *module->pipeline;
  TimedPipeline& tasks = *module->timed;
  Executive& executive = *module->executive;
  ClimbReport report(robot.stairs(), robot.errors().base_T_camera, robot.depth_camera().intrinsics(),
                     robot.errors().sole);

  ClimbLive live(options.display, options.mailbox, options.pace);
  const auto timing = [&] { return timing_of(executive, tasks, robot.now_ns()); };
  Pacer pacer(options.pace, options.interrupt);
  std::vector<StateChange> states;
  std::int64_t end_ns = -1, released_ns = -1;
  bool held_again = false;
  OperatorEnd operator_end = OperatorEnd::kNone;
  std::int64_t next_progress_ns = 0;
  while (seconds(robot.now_ns()) < options.time_limit_s) {
    if (bus) {
      bus->advance();
    } else {
      robot.advance();
    }
    pacer.wait_for(robot.now_ns());
    if (climb_operator != nullptr) {
      climb_operator->look(robot.now_ns(), pipeline.control().module_state());
    }
    {
      const heap::ModuleCall call("CyclicExecutive::tick");
      executive.tick(robot.now_ns());
    }
    if (recording) {
      recording->flush();
      truth_topics->write(robot.truth());
      if (const Preview* preview = camera.take()) truth_topics->write(*preview);
    }
    const Telemetry telemetry = pipeline.telemetry(robot.now_ns(), module->watched);
    live.after_cycle(pipeline.control(), telemetry, timing);
    report.observe(robot.truth(), telemetry);
    if (sent_to) {
      report.send_on(*sent_to);
      sent_to.reset();
    }
    if (recorder) recorder->observe(robot.truth(), telemetry.state);
    if (lidar.accepted(telemetry.state)) report.observe_lio(lidar.last());
    if (progress && robot.now_ns() >= next_progress_ns) {
      progress(progress_of(robot.now_ns(), telemetry.gait, tasks));
      next_progress_ns += kNsPerS;
    }
    const ModuleState state = telemetry.module_state;
    if (states.empty() || states.back().state != state) states.push_back({seconds(robot.now_ns()), state});
    const bool goes_on = climb_operator != nullptr && climb_operator->has_more();
    const bool ended = state == ModuleState::kOnTop || state == ModuleState::kSafeStop;
    const bool waits = waits_for_operator(state);
    const bool released = state == ModuleState::kReleased;
    if (released && released_ns < 0) released_ns = robot.now_ns();
    if (released && !held_again && robot.now_ns() - released_ns >= kUnheard_ns) {
      held_again = true;
      if (bus) {
        bus->hold_again();
      } else {
        robot.hold_again();
      }
    }
    // Out of a fall no command leads.
    const bool over = state == ModuleState::kFallen || released ||
                      ((ended || waits || telemetry.arming_waits_for.leans()) && !goes_on);
    if (!over) end_ns = -1;
    if (over && end_ns < 0) end_ns = robot.now_ns() + (released ? kRestAfterRelease_ns : kRestAfterEnd_ns);
    if (robot.truth().fell) break;
    if (climb_operator != nullptr && climb_operator->has_left()) {
      operator_end = OperatorEnd::kLeft;
      break;
    }
    if (over && robot.now_ns() >= end_ns) {
      if (waits) operator_end = OperatorEnd::kAsksNoMore;
      break;
    }
    if (options.interrupt != nullptr && *options.interrupt != 0) break;
  }

  live.end(pipeline.control(), pipeline.telemetry(robot.now_ns(), module->watched), timing);

  RunFigures figures;
  figures.options = options;
  figures.operator_end = operator_end;
  figures.interrupted_by = options.interrupt != nullptr ? options.interrupt->load() : 0;
  figures.params_hash = config::hash_of(params);
  figures.states = std::move(states);
  if (bus) figures.bus = bus_figures(*options.bus, *bus, pipeline.telemetry(robot.now_ns(), module->watched));
  figures.camera = camera_figures(robot, pipeline.perception().mount());
  figures.heap_calls = heap::report().calls;
  figures.faults = raised(module->pipeline->health());
  figures.heap_first_caller = heap::report().first_caller;
  const auto memory = static_memory();
  figures.static_memory.assign(memory.begin(), memory.end());
  if (recording) figures.static_memory.push_back({"recording", sizeof(recording::Recorder)});
  figures.schedule = schedule_of(executive, tasks);
  figures.wall_seconds = std::chrono::duration<double>(WallClock::now() - wall_begin).count();
  const ClimbSummary summary = report.finish(figures);
  std::string recording_failure;
  if (recording) {
    truth_topics->write_verdict(summary_text(summary), robot.now_ns());
    recording_failure = recording->finish();
  }
  if (!options.out_dir.empty()) {
    try {
      write_climb_files(options.out_dir, report, summary);
      if (recorder) recorder->write(options.out_dir + "/inputs");
      if (can_log) can_log->close();
      if (recording && recording_failure.empty()) {
        // One that is interrupted may have nothing to report yet.
        const std::string wrong = write_report({options.recording}, options.out_dir).unreadable;
        if (figures.interrupted_by == 0) recording_failure = wrong;
      }
    } catch (const std::runtime_error& error) {
      throw ClimbNotWritten(error.what(), summary);
    }
  }
  if (!recording_failure.empty()) throw ClimbNotWritten(recording_failure, summary);
  return summary;
}

}  // namespace polygmap::sim
