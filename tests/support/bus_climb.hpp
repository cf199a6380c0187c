// SPDX-License-Identifier: Apache-2.0
// The whole module climbs with its joints behind CAN buses, until a drive or a bus is taken away. What is mute neither
// hears nor speaks and holds its last command: angle, speed, gains and torque, as an MIT drive does until a timeout of
// its own.
#pragma once

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <new>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "firmware/pipeline.hpp"
#include "firmware/schedule.hpp"
#include "sim_stub/bus/bus_robot.hpp"
#include "sim_stub/host/operator/climb_operator.hpp"
#include "sim_stub/host/world_file.hpp"

namespace polygmap::sim {

// What falls silent: one drive, or one bus with all of its drives.
struct Mute {
  bool is_bus = false;
  std::size_t number = 0;
};

class BusClimb {
 public:
  struct Options {
    PlantKind plant = PlantKind::kMujoco;
    GaitPattern pattern = GaitPattern::kDoubleStep;
    std::string bus_file;
    std::uint64_t seed = 1;
    int steps = 2;
    std::optional<WorldFile> world = std::nullopt;  // in the staircase's stead; it is sent to its goal
  };
  explicit BusClimb(const Options& options)
      : file_(config::read_bus(options.bus_file)), robot_(sim_options(options)), bus_(robot_, file_, nullptr) {
    Params params;
    params.gait.planner.pattern = options.pattern;
    config::limit_by_drives(file_, params.robot);
    if (const auto goal = options.world ? destination_in(*options.world) : std::nullopt)
      dispatcher_.emplace(*goal, out_);
    params.supervisor.autostart = params.supervisor.autostart && !dispatcher_;
    const Ports ports{robot_, robot_, bus_.joints(), robot_, dispatcher_ ? &*dispatcher_ : nullptr};
    pipeline_ = std::make_unique<Pipeline>(ports, params);
    executive_ = std::make_unique<OneLaneExecutive<>>(*pipeline_, robot_, pipeline_->lane_health(0));
    executive_->start(robot_.now_ns() + kCycle_ns);
  }

  void tick() {
    bus_.advance();
    if (dispatcher_) dispatcher_->look(robot_.now_ns(), control().module_state());
    executive_->tick(robot_.now_ns());
  }
  void run_until(double time_s) {
    while (this->time_s() < time_s && !has_ended()) tick();
  }
  void run_on(double for_s) {
    const double end_s = time_s() + for_s;
    while (time_s() < end_s && !truth().fell) tick();
  }
  void set_mute(const Mute& mute, bool on) {
    if (mute.is_bus) {
      bus_.bus(mute.number).set_bus_off(on);
      if (mute.number == file_.table.feet.bus) bus_.set_feet_silent(on);
    } else {
      bus_.set_fault(mute.number, on ? DriveFault::kUnplugged : DriveFault::kNone);
    }
  }

  [[nodiscard]] double time_s() const { return seconds(robot_.now_ns()); }
  [[nodiscard]] const Truth& truth() const { return robot_.truth(); }
  [[nodiscard]] const ControlLane& control() const { return pipeline_->control(); }
  [[nodiscard]] const GaitStatus& status() const { return control().gait_status(); }
  [[nodiscard]] bool has_ended() const {
    return truth().fell || status().phase == GaitPhase::kFinished || status().phase == GaitPhase::kStopped;
  }
  [[nodiscard]] bool stands_on_both() const { return !truth().fell && truth().in_contact[0] && truth().in_contact[1]; }

 private:
  static SimOptions sim_options(const Options& options) {
    SimOptions sim;
    sim.seed = options.seed;
    sim.stairs.steps = options.steps;
    if (options.world) {
      const WorldPlace& start = options.world->start;
      sim.world = options.world->world;
      sim.start = {-start.x_m, start.y_m, start.yaw_rad.value_or(0.0), options.world->start_height_m};
    }
    sim.plant_kind = options.plant;
    sim.camera.threaded = false;
    return sim;
  }

  config::BusFile file_;
  SimRobot robot_;
  BusRobot bus_;
  std::ostream out_{nullptr};
  std::optional<Dispatcher> dispatcher_;
  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<OneLaneExecutive<>> executive_;
};

// A swing of a climb without faults, by the module's own clock.
struct SwingTimes {
  Foot foot = Foot::kLeft;
  bool onto_tread = false;
  double lift_off_s = 0.0;
  double touch_down_s = 0.0;
};
[[nodiscard]] inline std::vector<SwingTimes> swings_of(BusClimb& climb, double limit_s = 60.0) {
  std::vector<SwingTimes> swings;
  std::uint32_t sequence = 0;
  bool in_the_air = false;
  while (climb.time_s() < limit_s && !climb.has_ended()) {
    climb.tick();
    const LatchedStep& step = climb.status().step;
    if (step.sequence != sequence) {
      sequence = step.sequence;
      swings.push_back({step.foot, step.onto_tread, climb.time_s(), 0.0});
      in_the_air = true;
    }
    if (!in_the_air || climb.status().phase == GaitPhase::kSwing) continue;
    in_the_air = false;
    swings.back().touch_down_s = climb.time_s();
  }
  if (in_the_air) swings.pop_back();  // cut short by the limit
  return swings;
}

// A moment of a climb: of the two feet before a swing, or of the swing.
struct MuteMoment {
  double at_s = 0.0;
  std::size_t swing = 0;  // which one
  Foot foot = Foot::kLeft;
  bool in_the_air = false;
  double share = 0.0;  // of the time on both feet before it, or in the air
};
[[nodiscard]] inline std::vector<MuteMoment> moments_of(const std::vector<SwingTimes>& swings, std::size_t first,
                                                        std::size_t last) {
  constexpr double kStand_s = 1.0;  // before the first swing
  std::vector<MuteMoment> moments;
  for (std::size_t n = first; n <= last && n < swings.size(); ++n) {
    const SwingTimes& s = swings[n];
    const double both_s = s.lift_off_s - (n == 0 ? s.lift_off_s - kStand_s : swings[n - 1].touch_down_s);
    const double air_s = s.touch_down_s - s.lift_off_s;
    for (const double share : {0.1, 0.5, 0.95}) {
      moments.push_back({s.lift_off_s - (1.0 - share) * both_s, n, s.foot, false, share});
    }
    for (const double share : {0.05, 0.25, 0.5, 0.75, 0.95}) {
      moments.push_back({s.lift_off_s + share * air_s, n, s.foot, true, share});
    }
  }
  return moments;
}
// Each drive of the leg that stands, then of the one that swings; then the buses of hip and of knee and ankle of
// either, where a bus has half a leg, as in the shipped files.
inline constexpr std::size_t kMutes = kJointCount + 4;
[[nodiscard]] inline std::array<Mute, kMutes> mutes_of(Foot swing) {
  std::array<Mute, kMutes> mutes;
  std::size_t n = 0;
  for (const Foot leg : {other(swing), swing}) {
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) mutes[n++] = {false, joint_index(leg, j)};
  }
  for (const Foot leg : {other(swing), swing}) {
    for (std::size_t half = 0; half < 2; ++half) mutes[n++] = {true, 2 * index_of(leg) + half};
  }
  return mutes;
}

// What became of it.
struct MuteOutcome {
  bool stopped = false;  // the module is in safe_stop
  bool fell = false;     // the robot did
  bool both = false;     // both feet stand
  double stop_s = 0.0;   // from the fault to safe_stop
  [[nodiscard]] bool stands() const { return stopped && both && !fell; }
};
// It stays mute; a robot that is to stand does so for rest_s.
[[nodiscard]] inline MuteOutcome outcome_of(BusClimb& climb, const Mute& mute, double limit_s = 3.0,
                                            double rest_s = 2.0) {
  const double begin_s = climb.time_s();
  climb.set_mute(mute, true);
  MuteOutcome outcome;
  while (climb.time_s() < begin_s + limit_s && !climb.truth().fell && !outcome.stopped) {
    climb.tick();
    outcome.stopped = climb.control().module_state() == ModuleState::kSafeStop;
  }
  if (outcome.stopped) outcome.stop_s = climb.time_s() - begin_s;
  climb.run_on(rest_s);
  outcome.fell = climb.truth().fell;
  outcome.both = climb.stands_on_both();
  return outcome;
}
// The same in a copy of the process: the climb itself stays where it is. Empty: the copy crashed.
[[nodiscard]] inline std::optional<MuteOutcome> outcome_in_a_copy(BusClimb& climb, const Mute& mute) {
  void* memory = mmap(nullptr, sizeof(MuteOutcome), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return std::nullopt;
  auto* shared = new (memory) MuteOutcome;
  const pid_t pid = fork();
  if (pid == 0) {
    *shared = outcome_of(climb, mute);
    _exit(0);
  }
  int status = 0;
  const bool good = pid > 0 && waitpid(pid, &status, 0) == pid && status == 0;
  const std::optional<MuteOutcome> outcome = good ? std::optional(*shared) : std::nullopt;
  munmap(memory, sizeof(MuteOutcome));
  return outcome;
}

}  // namespace polygmap::sim
