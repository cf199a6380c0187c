// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/service.hpp"

#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <new>
#include <utility>

#include "firmware/daemon/system/error_text.hpp"
#include "firmware/daemon/system/monotonic_clock.hpp"
#include "firmware/schedule.hpp"

namespace polygmap::daemon {
namespace {

constexpr std::int64_t kLook_ns = 10 * kNsPerMs;         // of the daemon's own thread
constexpr std::int64_t kMaintain_ns = 100 * kNsPerMs;    // lost devices are opened anew
constexpr std::int64_t kThreadsEnd_ns = 300 * kNsPerMs;  // a cycle, or a look at the devices
constexpr std::int64_t kWrite_ns = 5 * kNsPerMs;         // what the lanes recorded is written
constexpr std::int64_t kWriterEnds_ns = 2 * kNsPerS;     // with what a slow disk has before it
constexpr std::int64_t kStatus_ns = kNsPerS;
constexpr std::int64_t kComplain_ns = kNsPerS;
constexpr std::uint64_t kTicksPerCount = 50;          // of a lane: then it publishes what its drivers counted
constexpr std::int64_t kLaneHangs_ns = kNsPerS;       // without a cycle
constexpr std::int64_t kFirstDue_ns = 20 * kNsPerMs;  // from the lanes' waiting to their first cycle
// The longest swing takes 1.06 s, and a foot that finds no ground goes back: later than that something is wrong.
constexpr std::int64_t kStopLimit_ns = 3 * kNsPerS;
constexpr std::size_t kOwnStack_bytes = 64U * 1024U;
constexpr std::string_view kTooLittleMemory =
    "there is too little memory: it takes a limit of locked memory (ulimit -l, LimitMEMLOCK=) that holds all of it.";

std::uint64_t thread_page_faults() noexcept {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return static_cast<std::uint64_t>(usage.ru_minflt + usage.ru_majflt);
}
// Touches the pages that the thread's stack will need.
[[gnu::noinline]] void fault_in_stack() noexcept {
  std::array<unsigned char, kOwnStack_bytes> pages;
  std::memset(pages.data(), 0, pages.size());
  asm volatile("" : : "r"(pages.data()) : "memory");  // or the compiler leaves it all out
}

}  // namespace

struct Service::LaneRun {
  explicit LaneRun(Service& whose) noexcept : service(whose) {}
  Service& service;
  LaneThread thread;
  std::atomic<bool> waits{false};      // for the first cycle's time
  std::atomic<bool> has_ended{false};  // join() does not wait
  std::uint64_t page_faults = 0;       // read after join()
};

// The module's rows, the operator's request to stop before them, and what they say of themselves after.
class Service::Tasks {
 public:
  Tasks(Pipeline& pipeline, StatusBoard& board, ServiceMailbox* mailbox, const ServiceParts& parts) noexcept
      : pipeline_(pipeline),
        board_(board),
        mailbox_(mailbox),
        recorder_(parts.recorder),
        hook_(parts.hook),
        rows_(pipeline, parts.recorder) {}
  void ask_to_stop() noexcept { stop_asked_.store(true, std::memory_order_release); }

  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    if (row == kFirstRow && stop_asked_.load(std::memory_order_acquire)) request_stop();
    if (hook_ != nullptr) hook_->before_row(row, cycle_ns);
    return rows_.run_row(row, cycle_ns, budget);
  }
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept {
    rows_.cycle_done(lane, report);
    if (lane != kControlLane) return;
    board_.publish(pipeline_.control());
    if (mailbox_ != nullptr) mailbox_->after_cycle(pipeline_, report.due_ns);
  }

 private:
  static constexpr std::size_t kFirstRow = 0;  // of control's
  static_assert(kSchedule[kFirstRow].lane == kControlLane);
  void request_stop() noexcept {
    if (recorder_ == nullptr) return pipeline_.control().request_stop();
    if (!stop_recorded_) recorder_->request_stop();
    stop_recorded_ = true;
  }
  Pipeline& pipeline_;
  StatusBoard& board_;
  ServiceMailbox* mailbox_;
  recording::Recorder* recorder_;
  RowHook* hook_;
  recording::RecordedTasks<Pipeline> rows_;
  bool stop_recorded_ = false;
  std::atomic<bool> stop_asked_{false};
};

std::string text_of(const Outcome& o) {
  std::array<char, 384> text{};
  std::string all;
  for (std::size_t row = 0; row < kSchedule.size(); ++row) {
    const Outcome::LateRow& late = o.rows[row];
    if (late.overruns == 0) continue;
    std::snprintf(text.data(), text.size(), " budget_us=%d overruns=%" PRIu64 " longest_us=%" PRIu64 "\n",
                  kSchedule[row].budget_us, late.overruns, late.longest_ns / 1000);
    all.append("row ").append(kSchedule[row].task).append(text.data());
  }
  std::snprintf(text.data(), text.size(),
                "stopped state=%s phase=%s reason=%s cycles=%" PRIu64 " overruns=%" PRIu64 " skipped=%" PRIu64
                " caught_up=%" PRIu64 " heap_calls=%" PRIu64 " page_faults=%" PRIu64 " wake_max_us=%" PRIu64
                " stack_bytes=%zu exit=%d\n",
                std::string(name_of(o.module.state)).c_str(), std::string(name_of(o.module.phase)).c_str(),
                std::string(name_of(o.module.reason)).c_str(), o.cycles, o.overruns, o.skipped, o.caught_up,
                o.heap_calls, o.page_faults, o.wake_max_ns / 1000, o.stack_bytes, number_of(o.code));
  return all + text.data();
}

Service::Service(const DaemonConfig& config, ServiceParts parts, const StopSignals& signals, Notifier& notifier)
    : config_(config), parts_(std::move(parts)), signals_(signals), notifier_(notifier) {}
Service::~Service() {
  ends_.store(true, std::memory_order_release);
  for (auto& lane : lanes_) {
    if (lane) lane->thread.join();
  }
  for (Helper* helper : {&maintainer_, &writer_}) {
    if (helper->runs.load()) helper->thread.join();
  }
}
bool Service::Helper::ends_before(std::int64_t until_ns) const noexcept {
  while (runs.load() && !has_ended.load(std::memory_order_acquire) && monotonic_ns() < until_ns) {
    sleep_until(monotonic_ns() + kNsPerMs);
  }
  return !runs.load() || has_ended.load(std::memory_order_acquire);
}

Outcome Service::run() {
  Outcome outcome;
  if (const hal::DeviceError error = clock_.open(); error.failed()) {
    outcome.code = ExitCode::kDevice;
    outcome.why = error.sentence();
    return outcome;
  }
  outcome.code = ExitCode::kNoRealTime;
  try {
    outcome.why = start();
  } catch (const std::bad_alloc&) {
    outcome.why = std::string(kTooLittleMemory);
  }
  if (!outcome.why.empty()) return outcome;
  const Decision decision = watch();
  parts_.heap.stop();
  outcome.code = decision.code;
  outcome.why = decision.why;
  finish(outcome);
  return outcome;
}

std::string Service::start() {
  if (const std::string wrong = lock_memory(); !wrong.empty()) {
    if (config_.needs_real_time) return wrong;
    std::fprintf(stderr, "polygmapd: %s\n", wrong.c_str());
  }
  fault_in_stack();
  pipeline_ = std::make_unique<Pipeline>(parts_.ports, config_.params);
  if (parts_.recorder != nullptr) parts_.recorder->watch(*pipeline_);
  if (parts_.mailbox != nullptr) {
    mailbox_ = std::make_unique<ServiceMailbox>(*parts_.mailbox, board_, config_.lanes);
    mailbox_->watch(*pipeline_);
  }
  tasks_ = std::make_unique<Tasks>(*pipeline_, board_, mailbox_.get(), parts_);
  return start_lanes();
}

std::string Service::lock_memory() const {
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return std::string("the memory cannot be locked (") + error_text(errno) +
         "): it takes CAP_IPC_LOCK, or a limit of locked memory (ulimit -l, LimitMEMLOCK=) that holds all of it.";
}

std::string Service::start_lanes() {
  using Entry = void* (*)(void*);
  constexpr Entry kControl = [](void* run) -> void* {
    auto& lane = *static_cast<LaneRun*>(run);
    lane.service.run_lane<kSchedule, kControlLane>(lane);
    return nullptr;
  };
  constexpr Entry kPerception = [](void* run) -> void* {
    auto& lane = *static_cast<LaneRun*>(run);
    lane.service.run_lane<kSchedule, kPerceptionLane>(lane);
    return nullptr;
  };
  constexpr Entry kAll = [](void* run) -> void* {
    auto& lane = *static_cast<LaneRun*>(run);
    lane.service.run_lane<kOneLaneSchedule, 0>(lane);
    return nullptr;
  };
  constexpr std::array kNames{"control", "perception"};
  std::string wrong;
  for (std::size_t n = 0; n < config_.lanes && wrong.empty(); ++n) {
    lanes_[n] = std::make_unique<LaneRun>(*this);
    LaneThread::Placement placement = config_.placement[n];
    const Entry entry = config_.lanes == 1 ? kAll : (n == kControlLane ? kControl : kPerception);
    int error = lanes_[n]->thread.start(placement, entry, lanes_[n].get());
    if (error == EPERM && !config_.needs_real_time) {
      placement.priority = 0;
      std::fprintf(stderr, "polygmapd: the lane %s has no real-time priority.\n", kNames[n]);
      error = lanes_[n]->thread.start(placement, entry, lanes_[n].get());
    }
    if (error == 0) continue;
    wrong = std::string("the lane ") + kNames[n] + " cannot have priority " + std::to_string(placement.priority) +
            " of SCHED_FIFO on processor " + std::to_string(placement.processor) + " (" + error_text(error) +
            "): it takes CAP_SYS_NICE, or a limit of real-time priority (ulimit -r, LimitRTPRIO=), and a processor "
            "that the machine has.";
  }
  for (std::size_t n = 0; n < config_.lanes && wrong.empty(); ++n) {
    while (!lanes_[n]->waits.load(std::memory_order_acquire)) sleep_until(monotonic_ns() + kNsPerMs);
  }
  if (wrong.empty()) wrong = start_helpers();
  if (wrong.empty()) {
    parts_.heap.start();
  } else {
    ends_.store(true, std::memory_order_release);
  }
  first_due_ns_.store(monotonic_ns() + kFirstDue_ns, std::memory_order_release);
  for (auto& lane : lanes_) {
    if (!wrong.empty() && lane) lane->thread.join();
  }
  return wrong;
}

std::string Service::start_helpers() {
  constexpr auto kMaintain = [](void* service) -> void* {
    static_cast<Service*>(service)->maintain();
    return nullptr;
  };
  constexpr auto kWrite = [](void* service) -> void* {
    static_cast<Service*>(service)->write_recording();
    return nullptr;
  };
  std::string wrong = start_helper(maintainer_, kMaintain, "the devices that are lost");
  if (wrong.empty() && parts_.recorder != nullptr) wrong = start_helper(writer_, kWrite, "the recording");
  return wrong;
}

// As small a stack as a lane's: one of the process' default size, 8 MB, counts whole where memory is locked.
std::string Service::start_helper(Helper& helper, void* (*function)(void*), const char* purpose) {
  const int error = helper.thread.start({}, function, this);
  helper.runs.store(error == 0);
  if (error == 0) return {};
  return std::string("there is no thread for ") + purpose + " (" + error_text(error) +
         "): it takes a limit of locked memory (ulimit -l, LimitMEMLOCK=) and one of tasks (ulimit -u, TasksMax=) that "
         "hold it.";
}

template <const auto& Table, std::size_t Lane>
void Service::run_lane(LaneRun& lane) noexcept {
  CyclicExecutive<Tasks, Table, Lane, Health> executive(*tasks_, clock_, pipeline_->lane_health(Lane));
  LaneCounts& counts = board_.lanes[Lane];
  lane.waits.store(true, std::memory_order_release);
  while (first_due_ns_.load(std::memory_order_acquire) == 0 && !ends_.load(std::memory_order_acquire)) {
    sleep_until(monotonic_ns() + kNsPerMs);
  }
  executive.start(first_due_ns_.load(std::memory_order_acquire));
  const auto publish_devices = [this]() noexcept {
    for (std::size_t n = 0; parts_.devices != nullptr && n < kLaneCount; ++n) {
      if (n == Lane || lane_count(Table) == 1) parts_.devices->publish(n);
    }
  };
  const std::uint64_t faults = thread_page_faults();
  for (std::uint64_t ticks = 1; !ends_.load(std::memory_order_acquire); ++ticks) {
    sleep_until(executive.next_due_ns());
    executive.tick(clock_.now_ns());
    const LaneStatistics& statistics = executive.lane_statistics();
    counts.cycles.store(statistics.cycles, std::memory_order_relaxed);
    counts.overruns.store(statistics.overruns, std::memory_order_relaxed);
    counts.skipped.store(statistics.slips, std::memory_order_relaxed);
    counts.caught_up.store(statistics.caught_up, std::memory_order_relaxed);
    counts.wake_max_ns.store(statistics.lateness.max_ns(), std::memory_order_relaxed);
    for (std::size_t row = 0; row < Table.size(); ++row) {
      if (Table[row].lane == Lane) board_.rows[row].store(executive.row_statistics(row));
    }
    if (ticks % kTicksPerCount == 0) publish_devices();
  }
  publish_devices();
  lane.page_faults = thread_page_faults() - faults;
  lane.has_ended.store(true, std::memory_order_release);
}

Service::Decision Service::watch() {
  seen_.moved_ns = monotonic_ns();
  if (parts_.operator_socket != nullptr) parts_.operator_socket->drop_waiting();
  for (;;) {
    const int signal = signals_.wait(kLook_ns);
    const std::int64_t now_ns = monotonic_ns();
    if (signal != 0 && seen_.asked_ns < 0) {
      seen_.asked_ns = now_ns;
      tasks_->ask_to_stop();
      notifier_.tell("STOPPING=1");
      std::fprintf(stderr, "polygmapd: asked to stop by signal %d.\n", signal);
    }
    const bool listens = parts_.operator_socket != nullptr && seen_.asked_ns < 0;
    if (listens) parts_.operator_socket->serve(board_.module().state, now_ns);
    log_changes();
    log_trouble(now_ns);
    if (const std::optional<Decision> decision = decide(now_ns)) return *decision;
    tell(now_ns);
  }
}

// A device that is opened anew may hold its caller up for seconds.
void Service::maintain() noexcept {
  while (!ends_.load(std::memory_order_acquire)) {
    sleep_until(monotonic_ns() + kMaintain_ns);
    parts_.maintain();
  }
  maintainer_.has_ended.store(true, std::memory_order_release);
}

// A disk may hold its writer up for longer than the queues last: the recorder says so then.
void Service::write_recording() noexcept {
  while (!ends_.load(std::memory_order_acquire)) {
    sleep_until(monotonic_ns() + kWrite_ns);
    parts_.recorder->write_out();
  }
  writer_.has_ended.store(true, std::memory_order_release);
}

std::optional<Service::Decision> Service::decide(std::int64_t now_ns) {
  const ModuleView view = board_.module();
  if (!lanes_move(now_ns)) return Decision{ExitCode::kStoppedItself, "a lane has not finished a cycle for a second."};
  if (view.state == ModuleState::kReleased) return Decision{ExitCode::kAsked, "another controller has the robot."};
  const bool asked = seen_.asked_ns >= 0;
  const bool fallen = view.state == ModuleState::kFallen;
  const bool may_reset = parts_.operator_socket != nullptr && !fallen;
  const bool over = !may_reset && (fallen || view.state == ModuleState::kSafeStop);
  if (!asked && over && seen_.stopped_ns < 0) seen_.stopped_ns = now_ns;
  if (seen_.stopped_ns >= 0 && (asked || now_ns - seen_.stopped_ns >= config_.hold_ns)) {
    return Decision{ExitCode::kStoppedItself, fallen ? "the robot has fallen." : "the gait had stopped by itself."};
  }
  if (!asked) return std::nullopt;
  if (const std::optional<Decision> decision = decision_when_asked(view)) return decision;
  if (now_ns - seen_.asked_ns < kStopLimit_ns) return std::nullopt;
  return Decision{ExitCode::kStoppedItself, "asked to stop, and after three seconds it still does not stand."};
}

std::optional<Service::Decision> Service::decision_when_asked(const ModuleView& view) noexcept {
  if (view.state == ModuleState::kFallen) return Decision{ExitCode::kStoppedItself, "the robot has fallen."};
  if (view.state == ModuleState::kOff) return Decision{ExitCode::kAsked, "asked to stop before it armed."};
  if (view.state == ModuleState::kArming) return Decision{ExitCode::kAsked, "asked to stop while it armed."};
  const bool by_itself = view.state == ModuleState::kSafeStop && view.reason != StopReason::kOperator;
  if (by_itself) return Decision{ExitCode::kStoppedItself, "the gait had stopped by itself."};
  if (view.stands()) return Decision{ExitCode::kAsked, "asked to stop, and stands."};
  return std::nullopt;
}

bool Service::lanes_move(std::int64_t now_ns) noexcept {
  bool all = true;
  for (std::size_t n = 0; n < config_.lanes; ++n) {
    all = all && board_.lanes[n].cycles.load(std::memory_order_relaxed) != seen_.cycles[n];
  }
  if (all) {
    seen_.moved_ns = now_ns;
    for (std::size_t n = 0; n < config_.lanes; ++n) seen_.cycles[n] = board_.lanes[n].cycles.load();
  }
  return now_ns - seen_.moved_ns < kLaneHangs_ns;
}

// The watchdog is fed for cycles that were done since it was fed last, not for being alive.
void Service::tell(std::int64_t now_ns) noexcept {
  const auto cycles = [this](std::size_t n) { return board_.lanes[n].cycles.load(std::memory_order_relaxed); };
  bool moved = true;
  for (std::size_t n = 0; n < config_.lanes; ++n) moved = moved && cycles(n) != seen_.fed_cycles[n];
  if (!seen_.is_ready && moved) {
    seen_.is_ready = notifier_.tell("READY=1") || !notifier_.is_open();  // not taken: once more
  }
  if (notifier_.watchdog_ns() > 0 && moved && now_ns - seen_.fed_ns >= notifier_.watchdog_ns() / 4) {
    seen_.fed_ns = now_ns;
    for (std::size_t n = 0; n < config_.lanes; ++n) seen_.fed_cycles[n] = cycles(n);
    notifier_.tell("WATCHDOG=1");
  }
  if (!notifier_.is_open() || now_ns - seen_.told_ns < kStatus_ns) return;
  seen_.told_ns = now_ns;
  StatusText status;
  status.add("STATUS=");
  write_status(status, board_, config_.lanes, parts_.heap.calls());
  notifier_.tell({status.text.data(), status.length});
}

void Service::log_changes() noexcept {
  const ModuleView view = board_.module();
  if (view == logged_) return;
  seen_.told_ns = 0;  // the service manager hears of it at once
  const bool disagrees = view.waits_for.leans() && view.waits_for.what != logged_.waits_for.what;
  const bool is_news =
      view.state != logged_.state || !(view.silent == logged_.silent) || !(view.hot == logged_.hot) || disagrees;
  logged_ = view;
  if (!is_news) return;
  StatusText status;
  write_status(status, board_, config_.lanes, parts_.heap.calls());
  std::fprintf(stderr, "polygmapd: %s\n", status.text.data());
}

void Service::log_trouble(std::int64_t now_ns) noexcept {
  if (parts_.recorder != nullptr && !seen_.recording_failed && parts_.recorder->failed()) {
    seen_.recording_failed = true;
    std::fprintf(stderr, "polygmapd: the recording has ended; the module goes on without it.\n");
  }
  if (now_ns - seen_.complained_ns < kComplain_ns) return;
  StatusText rows, devices;
  write_more_late_rows(rows, board_, logged_overruns_);
  if (parts_.devices != nullptr) parts_.devices->write_trouble(devices);
  for (const StatusText* trouble : {&rows, &devices}) {
    if (trouble->length == 0) continue;
    seen_.complained_ns = now_ns;
    std::fprintf(stderr, "polygmapd: %s\n", trouble->text.data());
  }
}

bool Service::all_end_within(std::int64_t most_ns) const noexcept {
  const std::int64_t until_ns = monotonic_ns() + most_ns;
  for (std::size_t n = 0; n < config_.lanes; ++n) {
    while (!lanes_[n]->has_ended.load(std::memory_order_acquire)) {
      if (monotonic_ns() >= until_ns) return false;
      sleep_until(monotonic_ns() + kNsPerMs);
    }
  }
  return true;
}

void Service::finish(Outcome& outcome) {
  ends_.store(true, std::memory_order_release);
  const std::int64_t until_ns = monotonic_ns() + kThreadsEnd_ns;
  const bool lanes_hang = !all_end_within(kThreadsEnd_ns);
  if (lanes_hang && outcome.code == ExitCode::kAsked) {
    outcome.code = ExitCode::kStoppedItself;
    outcome.why = "asked to stop, and a lane did not end.";
  }
  outcome.heap_calls = parts_.heap.calls();
  for (std::size_t n = 0; n < config_.lanes; ++n) {
    const LaneCounts& counts = board_.lanes[n];
    if (!lanes_hang) {
      lanes_[n]->thread.join();
      outcome.page_faults += lanes_[n]->page_faults;
      outcome.stack_bytes = std::max(outcome.stack_bytes, lanes_[n]->thread.used_stack_bytes());
    }
    outcome.overruns += counts.overruns.load();
    outcome.skipped += counts.skipped.load();
    outcome.caught_up += counts.caught_up.load();
    outcome.wake_max_ns = std::max(outcome.wake_max_ns, counts.wake_max_ns.load());
  }
  for (std::size_t row = 0; row < kSchedule.size(); ++row) {
    outcome.rows[row] = {board_.rows[row].overruns.load(), board_.rows[row].longest_ns.load()};
  }
  outcome.cycles = board_.lanes[kControlLane].cycles.load();
  outcome.module = board_.module();
  const bool maintainer_ends = maintainer_.ends_before(until_ns);
  outcome.threads_hang = lanes_hang || !maintainer_ends;
  if (!lanes_hang && outcome.module.state <= ModuleState::kArming) parts_.let_go();
  if (parts_.recorder != nullptr) finish_recording(outcome, lanes_hang);
}

void Service::finish_recording(Outcome& outcome, bool lanes_hang) {
  const bool writer_ends = writer_.ends_before(monotonic_ns() + kWriterEnds_ns);
  outcome.threads_hang = outcome.threads_hang || !writer_ends;
  outcome.recording_failure = writer_ends && !lanes_hang ? parts_.recorder->finish()
                                                         : "The recording ends early: a thread that it needs hangs.";
  if (!outcome.recording_failure.empty() && outcome.code == ExitCode::kAsked) outcome.code = ExitCode::kRecording;
}

}  // namespace polygmap::daemon
