// SPDX-License-Identifier: Apache-2.0
// guest_climb FOLDER [--lanes 1|2] [--clock real|virtual] [--gait ds|ss] [--steps N] [--babble FILE] [--inject
// WHAT@S]...: runs the module in the guest on a recorded climb (record_climb), 500 times a second under SCHED_FIFO,
// counts what it takes, compares what it commands, and prints it all, the line RESULT last.
// --clock virtual: tick after tick without waiting, time stands still within one; nothing is late then and no slot is
// given up, so that every row's work is counted whatever it takes.
// --babble: the joints are behind buses of that file, in memory, that are as full as they can be (babbling_bus.hpp).
// WHAT: allocate (a heap call inside the module), overrun=ROW (that row takes 3 ms), gap=MS (IMU and joints are
// silent). A fault whose time never came fails the run.
#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/config/bus_file.hpp"
#include "firmware/schedule.hpp"
#include "hal/can/can_joint_bus.hpp"
#include "hal/linux/instruction_counter.hpp"
#include "hal/linux/row_meter.hpp"
#include "hal/linux/socket_can.hpp"
#include "sim_stub/heap_trap.hpp"
#include "tests/vm/babbling_bus.hpp"
#include "tests/vm/lane_thread.hpp"
#include "tests/vm/replayed_robot.hpp"

namespace polygmap::vm {
namespace {

struct Injection {
  std::size_t row = kTasks.size();  // allocates, or else overruns, when it runs next; none: no row does
  bool allocates = false;
  std::int64_t silent_ns = 0;
  std::int64_t at_ns = 0;  // since the first tick
};
struct Options {
  std::string folder;
  std::string bus;     // a bus file: the joints are behind the guest's CAN buses
  std::string babble;  // a bus file: they are behind full buses in memory
  std::size_t lanes = 1;
  bool real_time = true;
  GaitPattern gait = GaitPattern::kDoubleStep;
  unsigned steps = 0;  // 0: not judged
  Injection injection;
};

std::int64_t monotonic_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerS + now.tv_nsec;
}

// The recording's time: that of CLOCK_MONOTONIC less an offset, or set by hand.
class ReplayClock final : public hal::Clock {
 public:
  // From here on real time runs, and it is now_ns.
  void run_from(std::int64_t now_ns) noexcept { offset_ns_ = monotonic_ns() - now_ns; }
  void set(std::int64_t now_ns) noexcept { set_ns_ = now_ns; }

  [[nodiscard]] std::int64_t now_ns() const noexcept override {
    return offset_ns_ == 0 ? set_ns_ : monotonic_ns() - offset_ns_;
  }
  [[nodiscard]] std::uint64_t count() const noexcept override { return static_cast<std::uint64_t>(now_ns()); }
  [[nodiscard]] double counts_per_us() const noexcept override { return 1000.0; }

  // Returns how late the thread woke, ns.
  [[nodiscard]] std::int64_t wait_until(std::int64_t due_ns) const noexcept {
    if (const std::int64_t late_ns = now_ns() - due_ns; late_ns >= 0) return late_ns;
    const std::int64_t at_ns = due_ns + offset_ns_;
    const timespec at{at_ns / kNsPerS, at_ns % kNsPerS};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) != 0) {
    }
    return now_ns() - due_ns;
  }

 private:
  std::int64_t offset_ns_ = 0, set_ns_ = 0;
};

// The module's rows, on which the seeded violations sit.
class InjectedPipeline {
 public:
  InjectedPipeline(Pipeline& pipeline, const Injection& injection, std::int64_t first_ns) noexcept
      : pipeline_(pipeline), injection_(injection), at_ns_(first_ns + injection.at_ns) {}

  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    if (row == injection_.row && cycle_ns >= at_ns_ && !done_) inject();
    return pipeline_.run_row(row, cycle_ns, budget);
  }
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept { pipeline_.cycle_done(lane, report); }
  [[nodiscard]] bool done() const noexcept { return done_; }

 private:
  void inject() noexcept {
    done_ = true;
    if (injection_.allocates) {
      void* volatile block = std::malloc(1);  // volatile: or the compiler leaves both calls out
      std::free(block);
      return;
    }
    constexpr std::int64_t kTooLong_ns = 3 * kNsPerMs;
    const std::int64_t begin_ns = monotonic_ns();
    while (monotonic_ns() - begin_ns < kTooLong_ns) {
    }
  }
  Pipeline& pipeline_;
  const Injection injection_;
  const std::int64_t at_ns_;
  bool done_ = false;  // only the row's own lane looks at it while the lanes run
};

using Meter = hal::RowMeter<InjectedPipeline, kTasks.size()>;

constexpr std::uint32_t rows_of_lane(std::uint8_t lane) noexcept {
  std::uint32_t mask = 0;
  for (std::size_t row = 0; row < kTasks.size(); ++row) mask |= kSchedule[row].lane == lane ? 1U << row : 0U;
  return mask;
}
constexpr std::uint32_t resumable_rows() noexcept {
  std::uint32_t mask = 0;
  for (std::size_t row = 0; row < kTasks.size(); ++row) mask |= kSchedule[row].resumable() ? 1U << row : 0U;
  return mask;
}

// The drives' buses: can0 of the file is vcan0 here.
class Wires {
 public:
  explicit Wires(const config::BusFile& file) {
    for (std::size_t bus = 0; bus < file.buses.size(); ++bus) {
      hal::SocketCan::Config config;
      config.interface = "v" + file.buses[bus];
      const hal::DeviceError error = sockets_[bus].open(config);
      if (error.failed()) std::fprintf(stderr, "guest_climb: %s\n", error.sentence());
      channels_.push_back(&sockets_[bus]);
    }
    joints_.emplace(file.table, channels_);
  }
  [[nodiscard]] hal::CanJointBus& joints() noexcept { return *joints_; }

 private:
  std::array<hal::SocketCan, hal::kMaxBuses> sockets_;
  std::vector<hal::CanChannel*> channels_;
  std::optional<hal::CanJointBus> joints_;
};

// What one lane's thread sees.
struct LaneFigures {
  Meter meter;
  LaneThread thread;
  std::uint64_t overruns = 0, slips = 0, caught_up = 0, cycles = 0;
  std::int64_t wake_max_ns = 0;
  int error = 0;

  explicit LaneFigures(InjectedPipeline& tasks) : meter(tasks, rows_of_lane(kControlLane), resumable_rows()) {}
};

struct Climb {
  const Options& options;
  const Recording& recording;
  ReplayedSensors sensors;
  ReplayedCamera camera;
  std::array<ReplayClock, kLaneCount> clocks{};
  std::unique_ptr<Wires> wires;
  std::unique_ptr<BabblingBus> babble;
  std::unique_ptr<Pipeline> pipeline;
  std::unique_ptr<InjectedPipeline> tasks;
  std::array<std::unique_ptr<LaneFigures>, kLaneCount> lanes;

  Climb(const Options& asked, const Recording& recorded)
      : options(asked), recording(recorded), sensors(recorded), camera(recorded) {
    Params params;
    params.gait.planner.pattern = asked.gait;
    if (!asked.bus.empty()) {
      const config::BusFile file = config::read_bus(asked.bus);
      config::limit_by_drives(file, params.robot);
      wires = std::make_unique<Wires>(file);
      sensors.connect(wires->joints());
    }
    if (!asked.babble.empty()) {
      const config::BusFile file = config::read_bus(asked.babble);
      config::limit_by_drives(file, params.robot);
      babble = std::make_unique<BabblingBus>(file, sensors);
    }
    hal::JointBus& joints = babble ? static_cast<hal::JointBus&>(*babble) : sensors;
    pipeline = std::make_unique<Pipeline>(Ports{camera, sensors, joints, sensors}, params);
    tasks = std::make_unique<InjectedPipeline>(*pipeline, asked.injection, first_ns());
    for (auto& lane : lanes) lane = std::make_unique<LaneFigures>(*tasks);
  }
  [[nodiscard]] std::int64_t first_ns() const noexcept { return recording.ticks.front().now_ns; }
  [[nodiscard]] std::int64_t last_ns() const noexcept { return recording.ticks.back().now_ns; }
};

// One lane's whole run, on its thread.
template <const auto& Table, std::size_t Lane>
void run_lane(Climb& climb) {
  LaneFigures& figures = *climb.lanes[Lane];
  ReplayClock& clock = climb.clocks[Lane];
  hal::InstructionCounter counter;
  figures.error = counter.start();
  if (figures.error != 0) return;
  figures.meter.count_with(counter);
  constexpr bool kAllRows = lane_count(Table) == 1;
  const Injection& injection = climb.options.injection;
  CyclicExecutive<Meter, Table, Lane, Health> executive(figures.meter, clock, climb.pipeline->lane_health(Lane));
  executive.start(climb.first_ns());
  while (executive.next_due_ns() <= climb.last_ns()) {
    const std::int64_t due_ns = executive.next_due_ns();
    if (climb.options.real_time) {
      figures.wake_max_ns = std::max(figures.wake_max_ns, clock.wait_until(due_ns));
    } else {
      clock.set(due_ns);
    }
    const std::int64_t now_ns = clock.now_ns();
    const std::int64_t since_ns = now_ns - climb.first_ns() - injection.at_ns;
    if (kAllRows || Lane == kControlLane) {
      climb.sensors.set_silent(since_ns >= 0 && since_ns < injection.silent_ns);
      climb.sensors.advance(now_ns);
      if (climb.babble) climb.babble->advance();
    }
    if (kAllRows || Lane == kPerceptionLane) climb.camera.advance(now_ns);
    figures.meter.begin_cycle();
    const heap::ModuleCall call("CyclicExecutive::tick");
    executive.tick(now_ns);
  }
  const LaneStatistics& statistics = executive.lane_statistics();
  figures.overruns = statistics.overruns;
  figures.slips = statistics.slips;
  figures.caught_up = statistics.caught_up;
  figures.cycles = statistics.cycles;
}

long page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

// Threads of the robot's priorities; they start a hundredth of a second from now.
int run_threads(Climb& climb, long& faults) {
  const long processors = sysconf(_SC_NPROCESSORS_ONLN);
  constexpr int kControlPriority = 80, kPerceptionPriority = 75;
  for (ReplayClock& clock : climb.clocks) clock.set(climb.first_ns());
  // The kernel waits for a grace period, up to ten milliseconds, before the first counter counts: not in a lane's.
  hal::InstructionCounter first;
  if (const int error = first.start(); error != 0) return error;
  if (climb.options.real_time) {
    climb.clocks[0].run_from(climb.first_ns() - 10 * kNsPerMs);
    climb.clocks[1] = climb.clocks[0];
  }
  faults = page_faults();
  const bool two = climb.options.lanes == 2;
  int error = climb.lanes[0]->thread.start(kControlPriority, 0, [&climb, two] {
    two ? run_lane<kSchedule, kControlLane>(climb) : run_lane<kOneLaneSchedule, 0>(climb);
  });
  if (error != 0) return error;
  if (two) {
    error = climb.lanes[1]->thread.start(kPerceptionPriority, processors > 1 ? 1 : 0,
                                         [&climb] { run_lane<kSchedule, kPerceptionLane>(climb); });
    if (error == 0) climb.lanes[1]->thread.join();
  }
  climb.lanes[0]->thread.join();
  faults = page_faults() - faults;
  return error != 0 ? error : climb.lanes[0]->error != 0 ? climb.lanes[0]->error : climb.lanes[1]->error;
}

// Lines "MEASURED name value", which toolchain/checks/budgets reads.
void print_measured(const std::string& name, const hal::InstructionStatistics& figures) {
  if (figures.count == 0) return;
  std::printf("MEASURED %s count=%" PRIu64 " mean=%" PRIu64 " max=%" PRIu64 "\n", name.c_str(), figures.count,
              figures.mean(), figures.max);
}
void print_figures(const Climb& climb) {
  for (std::size_t lane = 0; lane < climb.options.lanes; ++lane) {
    const Meter& meter = climb.lanes[lane]->meter;
    for (std::size_t row = 0; row < kTasks.size(); ++row) {
      const std::string name(kSchedule[row].task);
      print_measured("row." + name, meter.row(row));
      print_measured("job." + name, meter.job(row));
      if (meter.units(row) > 0) {
        std::printf("MEASURED unit.%s count=%" PRIu64 " mean=%" PRIu64 "\n", name.c_str(), meter.units(row),
                    meter.row(row).sum / meter.units(row));
      }
    }
    const std::string suffix = climb.options.lanes == 1 ? "" : lane == 0 ? ".control" : ".perception";
    if (lane == 0) print_measured("control_rows", meter.control());
    print_measured("picture", meter.picture());
    print_measured("cycle" + suffix, meter.cycle());
    print_measured("kernel" + suffix, meter.kernel());
    std::printf("MEASURED stack.lane%zu max=%zu\n", lane, climb.lanes[lane]->thread.used_stack_bytes());
  }
  for (const StageMemory& part : static_memory()) std::printf("MEASURED memory.%s max=%zu\n", part.stage, part.bytes);
}

struct Totals {
  std::uint64_t ticks = 0, overruns = 0, user_max = 0, user_mean = 0, kernel_max = 0;
  std::int64_t wake_max_ns = 0;
};
Totals totals_of(const Climb& climb) {
  Totals t;
  t.ticks = climb.lanes[0]->cycles;
  for (std::size_t lane = 0; lane < climb.options.lanes; ++lane) {
    const LaneFigures& figures = *climb.lanes[lane];
    t.overruns += figures.overruns + figures.slips + figures.caught_up;
    t.user_max = std::max(t.user_max, figures.meter.cycle().max);
    t.user_mean += figures.meter.cycle().mean();
    t.kernel_max = std::max(t.kernel_max, figures.meter.kernel().max);
    t.wake_max_ns = std::max(t.wake_max_ns, figures.wake_max_ns);
  }
  return t;
}

// Says so where a fault was asked for and its time never came.
bool missed_fault(const Climb& climb) {
  const Injection& injection = climb.options.injection;
  const std::int64_t lasted_ns = climb.last_ns() - climb.first_ns();
  const bool missed =
      injection.silent_ns > 0 ? lasted_ns < injection.at_ns : injection.row < kTasks.size() && !climb.tasks->done();
  if (missed) {
    std::printf("the fault was never injected: the climb had ended at %.2f s\n", 1e-9 * static_cast<double>(lasted_ns));
  }
  return missed;
}

// Returns whether all that can be judged here passed.
bool print_result(const Climb& climb, long faults) {
  const Totals t = totals_of(climb);
  const GaitStatus& gait = climb.pipeline->control().gait_status();
  const heap::Report heap = heap::report();
  if (heap.calls > 0) std::printf("HEAP first call by %s\n", heap.first_caller.c_str());
  if (climb.sensors.frames_differ() > 0) {
    std::printf("DIFFER first at %.3f s, at most %.3g rad\n",
                1e-9 * static_cast<double>(climb.sensors.first_difference_ns()), climb.sensors.farthest_rad());
  }
  const bool missed = missed_fault(climb);
  const bool pass = !missed && t.overruns == 0 && faults == 0 && heap.calls == 0 && climb.sensors.frames() > 0 &&
                    climb.sensors.frames_differ() == 0 && climb.camera.lost() == 0 &&
                    (climb.options.steps == 0 ||
                     (gait.phase == GaitPhase::kFinished && gait.treads_climbed == climb.options.steps)) &&
                    t.ticks == climb.recording.ticks.size();
  std::printf(
      "RESULT %s steps=%u ticks=%" PRIu64 " overruns=%" PRIu64 " page_faults=%ld heap_calls=%" PRIu64 " frames=%" PRIu64
      " frames_differ=%" PRIu64 " user_max=%" PRIu64 " user_mean=%" PRIu64 " control_max=%" PRIu64
      " kernel_max=%" PRIu64 " wake_max_us=%.1f pictures_lost=%" PRIu64 " state=%s support=%s\n",
      pass ? "pass" : "fail", gait.treads_climbed, t.ticks, t.overruns, faults, heap.calls, climb.sensors.frames(),
      climb.sensors.frames_differ(), t.user_max, t.user_mean, climb.lanes[0]->meter.control().max, t.kernel_max,
      1e-3 * static_cast<double>(t.wake_max_ns), climb.camera.lost(), std::string(name_of(gait.phase)).c_str(),
      gait.stands[0] && gait.stands[1] ? "both"
      : gait.stands[0]                 ? "left"
      : gait.stands[1]                 ? "right"
                                       : "none");
  return pass;
}

// The whole file in memory, its pages there.
std::span<const char> map_file(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (file < 0 || fstat(file, &status) != 0 || status.st_size == 0) {
    std::fprintf(stderr, "guest_climb: %s cannot be read or is empty\n", path.c_str());
    std::exit(2);
  }
  const auto bytes = static_cast<std::size_t>(status.st_size);
  void* memory = mmap(nullptr, bytes, PROT_READ, MAP_SHARED | MAP_POPULATE, file, 0);
  close(file);
  if (memory == MAP_FAILED) {
    std::perror("guest_climb: mmap");
    std::exit(2);
  }
  return {static_cast<const char*>(memory), bytes};
}

[[noreturn]] void refuse(const std::string& why) {
  std::fprintf(stderr, "guest_climb: %s\n", why.c_str());
  std::exit(2);
}

Injection parse_injection(const std::string& text) {
  const std::size_t at = text.find('@');
  char* end = nullptr;
  const double seconds = at == std::string::npos ? -1.0 : std::strtod(text.c_str() + at + 1, &end);
  if (end == nullptr || *end != '\0' || !(seconds >= 0.0 && seconds < 1e4)) refuse("--inject is WHAT@SECONDS: " + text);
  const std::string what = text.substr(0, at);
  Injection injection;
  injection.at_ns = static_cast<std::int64_t>(seconds * 500.0 + 0.5) * kCycle_ns;
  if (what == "allocate") {
    injection.allocates = true;
    injection.row = 0;
  } else if (what.starts_with("overrun=")) {
    injection.row = row_named(kSchedule, std::string_view(what).substr(8));
    if (injection.row == kTasks.size()) refuse("no row of the schedule is called " + what.substr(8));
  } else if (what.starts_with("gap=")) {
    injection.silent_ns = std::strtol(what.c_str() + 4, &end, 10) * kNsPerMs;
    if (*end != '\0' || injection.silent_ns <= 0) refuse("gap= takes milliseconds: " + what);
  } else {
    refuse("what is to be injected is allocate, overrun=ROW or gap=MS here, not " + what);
  }
  return injection;
}

Options parse(int argc, char** argv) {
  Options options;
  if (argc < 2 || argc % 2 != 0)
    refuse(
        "usage: FOLDER [--lanes 1|2] [--clock real|virtual] [--gait ds|ss] [--steps N] [--babble FILE] [--inject "
        "WHAT@S]");
  options.folder = argv[1];
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string_view key = argv[i], value = argv[i + 1];
    if (key == "--lanes" && (value == "1" || value == "2")) {
      options.lanes = value == "2" ? 2 : 1;
    } else if (key == "--clock" && (value == "real" || value == "virtual")) {
      options.real_time = value == "real";
    } else if (key == "--bus") {
      options.bus = value;
    } else if (key == "--babble") {
      options.babble = value;
    } else if (key == "--gait" && (value == "ds" || value == "ss")) {
      options.gait = value == "ss" ? GaitPattern::kSingleStep : GaitPattern::kDoubleStep;
    } else if (key == "--steps") {
      options.steps = static_cast<unsigned>(std::strtoul(argv[i + 1], nullptr, 10));
    } else if (key == "--inject") {
      options.injection = parse_injection(argv[i + 1]);
    } else {
      refuse("unknown option or value: " + std::string(key) + " " + std::string(value));
    }
  }
  if (options.lanes == 2 && !options.real_time) refuse("two lanes need --clock real");
  return options;
}

int run(const Options& options) {
  heap::set_on_call(heap::OnCall::kCount);
  Recording recording;
  if (!recording.read(map_file(options.folder + "/inputs.bin"), map_file(options.folder + "/pictures.bin"))) {
    refuse(options.folder + "/inputs.bin is no recording of record_climb");
  }
  Climb climb(options, recording);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    std::perror("guest_climb: mlockall");
    return 2;
  }
  long faults = 0;
  if (const int error = run_threads(climb, faults); error != 0) {
    std::fprintf(stderr, "guest_climb: a lane could not run: %s\n", std::strerror(error));
    return 2;
  }
  print_figures(climb);
  return print_result(climb, faults) ? 0 : 1;
}

}  // namespace
}  // namespace polygmap::vm

int main(int argc, char** argv) { return polygmap::vm::run(polygmap::vm::parse(argc, argv)); }
