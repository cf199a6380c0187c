// SPDX-License-Identifier: Apache-2.0
// What the lanes say of themselves to the daemon's own thread, which tells the service manager. Nobody waits.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "firmware/control_lane.hpp"
#include "firmware/daemon/service/status_text.hpp"
#include "firmware/mailbox/mailbox_layout.hpp"
#include "firmware/schedule.hpp"

namespace polygmap::daemon {

// Of one moment.
struct ModuleView {
  ModuleState state = ModuleState::kArming;
  GaitPhase phase = GaitPhase::kStandstill;
  StopReason reason = StopReason::kNone;
  ArmingWait waits_for{ArmingWait::For::kAnswers, JointSet::all()};
  JointSet silent;          // drives that are silent now
  JointSet hot;             // and those that are too hot
  std::uint8_t treads = 0;  // climbed; saturates

  [[nodiscard]] bool stands() const noexcept {
    return state != ModuleState::kHandingOver && (state == ModuleState::kSafeStop || phase == GaitPhase::kFinished);
  }
  [[nodiscard]] bool operator==(const ModuleView& other) const noexcept { return packed() == other.packed(); }

  [[nodiscard]] std::uint64_t packed() const noexcept {
    return std::uint64_t{static_cast<std::uint8_t>(state)} |
           std::uint64_t{static_cast<std::uint8_t>(waits_for.what)} << 4U |
           std::uint64_t{static_cast<std::uint8_t>(phase)} << 8U |
           std::uint64_t{static_cast<std::uint8_t>(reason)} << 12U | std::uint64_t{wait_detail()} << 20U |
           std::uint64_t{silent.bits()} << 32U | std::uint64_t{hot.bits()} << 44U | std::uint64_t{treads} << 56U;
  }
  [[nodiscard]] static ModuleView unpacked(std::uint64_t bits) noexcept {
    constexpr std::uint64_t kJoints = (1U << kJointCount) - 1U;
    ModuleView view;
    view.state = static_cast<ModuleState>(bits & 0xFU);
    view.waits_for.what = static_cast<ArmingWait::For>(bits >> 4U & 0xFU);
    view.phase = static_cast<GaitPhase>(bits >> 8U & 0xFU);
    view.reason = static_cast<StopReason>(bits >> 12U & 0xFFU);
    const auto detail = static_cast<std::uint16_t>(bits >> 20U & kJoints);
    const bool leans = view.waits_for.leans();
    view.waits_for.joints = leans ? JointSet{} : JointSet::of_bits(detail);
    view.waits_for.lean_deg = leans ? detail : std::uint16_t{0};
    view.silent = JointSet::of_bits(static_cast<std::uint16_t>(bits >> 32U & kJoints));
    view.hot = JointSet::of_bits(static_cast<std::uint16_t>(bits >> 44U & kJoints));
    view.treads = static_cast<std::uint8_t>(bits >> 56U);
    return view;
  }

 private:
  [[nodiscard]] std::uint16_t wait_detail() const noexcept {
    return waits_for.leans() ? waits_for.lean_deg : waits_for.joints.bits();
  }
};
static_assert(kJointCount == 12);

// Each number by itself; written by its lane only.
struct alignas(64) LaneCounts {
  std::atomic<std::uint64_t> cycles{0};
  std::atomic<std::uint64_t> overruns{0};   // cycles longer than 2 ms
  std::atomic<std::uint64_t> skipped{0};    // cycles that slipped
  std::atomic<std::uint64_t> caught_up{0};  // cycles run late
  std::atomic<std::uint64_t> wake_max_ns{0};

  void load(polygmap_mailbox_lane& lane) const noexcept {
    lane = {cycles.load(std::memory_order_relaxed), overruns.load(std::memory_order_relaxed),
            skipped.load(std::memory_order_relaxed), caught_up.load(std::memory_order_relaxed),
            wake_max_ns.load(std::memory_order_relaxed)};
  }
};

// Of a row of kSchedule; written by the row's lane only.
struct RowCounts {
  std::atomic<std::uint64_t> overruns{0};    // calls longer than the row's budget
  std::atomic<std::uint64_t> longest_ns{0};  // of those calls
  // Of runs that had work.
  std::atomic<std::uint64_t> runs{0}, shed{0}, total_ns{0}, most_ns{0};
  std::atomic<std::int64_t> total_slack_ns{0}, least_slack_ns{0};

  void store(const RowStatistics& statistics) noexcept {
    constexpr auto kRelaxed = std::memory_order_relaxed;
    longest_ns.store(statistics.overrun_max_ns, kRelaxed);
    overruns.store(statistics.overruns, kRelaxed);
    runs.store(statistics.runs, kRelaxed);
    shed.store(statistics.shed, kRelaxed);
    total_ns.store(statistics.time.sum_ns(), kRelaxed);
    most_ns.store(statistics.time.max_ns(), kRelaxed);
    total_slack_ns.store(statistics.slack_sum_ns, kRelaxed);
    least_slack_ns.store(statistics.slack_min_ns, kRelaxed);
  }
  // Each number as of then or of a run later.
  void load(polygmap_mailbox_row& row) const noexcept {
    constexpr auto kRelaxed = std::memory_order_relaxed;
    row.runs = runs.load(kRelaxed);
    row.overruns = overruns.load(kRelaxed);
    row.shed = shed.load(kRelaxed);
    row.robot = {total_ns.load(kRelaxed), most_ns.load(kRelaxed), total_slack_ns.load(kRelaxed),
                 least_slack_ns.load(kRelaxed)};
  }
};

class StatusBoard {
 public:
  // On control's thread, after a cycle.
  void publish(const ControlLane& control) noexcept {
    const GaitStatus& gait = control.gait_status();
    ModuleView view;
    view.state = control.module_state();
    view.phase = gait.phase;
    view.reason = gait.stop_reason;
    view.waits_for = control.arming_waits_for();
    view.silent = control.drives().silent;
    view.hot = control.drives().hot;
    view.treads = static_cast<std::uint8_t>(gait.treads_climbed < 0xFFU ? gait.treads_climbed : 0xFFU);
    module_.store(view.packed(), std::memory_order_release);
    if (++published_ % kCyclesPerFaults != 0) return;
    for (std::size_t i = 0; i < kFaultTable.size(); ++i) {
      faults_[i].store(control.all_faults().count(kFaultTable[i].code).count, std::memory_order_relaxed);
    }
  }
  // From any thread.
  [[nodiscard]] ModuleView module() const noexcept {
    return ModuleView::unpacked(module_.load(std::memory_order_acquire));
  }
  // Of kFaultTable's entry; a tenth of a second old at most.
  [[nodiscard]] std::uint32_t fault(std::size_t i) const noexcept { return faults_[i].load(std::memory_order_relaxed); }
  std::array<LaneCounts, kLaneCount> lanes;
  std::array<RowCounts, kSchedule.size()> rows;

 private:
  static constexpr std::uint32_t kCyclesPerFaults = 50;
  std::atomic<std::uint64_t> module_{ModuleView{}.packed()};
  std::array<std::atomic<std::uint32_t>, kFaultTable.size()> faults_{};
  std::uint32_t published_ = 0;  // control's
};

// The state in words, as systemctl shows it.
void write_status(StatusText& out, const StatusBoard& board, std::size_t lanes, std::uint64_t heap_calls) noexcept;
// Its part about the module.
void write_module(StatusText& out, const ModuleView& view) noexcept;
// "; rows over their budget: surfaces 3 (up to 1203 us)"; nothing when there are none.
void write_late_rows(StatusText& out, const StatusBoard& board) noexcept;
// "rows over their budget: surfaces 3 (+1, up to 1203 us of 840)": those that overran since it was told last.
using RowOverruns = std::array<std::uint64_t, kSchedule.size()>;
void write_more_late_rows(StatusText& out, const StatusBoard& board, RowOverruns& told) noexcept;

}  // namespace polygmap::daemon
