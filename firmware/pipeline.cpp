// SPDX-License-Identifier: Apache-2.0
#include "firmware/pipeline.hpp"

#include <array>
#include <numeric>

#include "algorithms/core/time.hpp"
#include "firmware/schedule.hpp"

namespace polygmap {
namespace {

static_assert(1e6 * kTick_s == kCycle_us, "the gait counts cycles");

constexpr std::size_t kControlStages_bytes = sizeof(Estimator) + sizeof(Gait);
constexpr std::size_t kPerceptionStages_bytes =
    sizeof(SurfaceExtractor) + sizeof(CameraExtrinsicsEstimator) + sizeof(PolygonMap) + sizeof(FootholdSearch);

// What Pipeline is made of. The lanes: what they hold beside their stages.
constexpr auto kPipelineMemory = std::to_array<StageMemory>({
    {"estimation", sizeof(Estimator)},
    {"perception", sizeof(SurfaceExtractor)},
    {"camera_extrinsics", sizeof(CameraExtrinsicsEstimator)},
    {"polygon_map", sizeof(PolygonMap)},
    {"foothold", sizeof(FootholdSearch)},
    {"gait", sizeof(Gait)},
    {"control_lane", sizeof(ControlLane) - kControlStages_bytes},
    {"perception_lane", sizeof(PerceptionLane) - kPerceptionStages_bytes},
    {"lane_link", sizeof(ControlPerceptionLink)},
    {"health", sizeof(LaneHealths)},
    {"params", sizeof(Params)},
});
constexpr std::size_t sum_bytes(std::span<const StageMemory> parts) noexcept {
  return std::accumulate(parts.begin(), parts.end(), std::size_t{0},
                         [](std::size_t sum, const StageMemory& part) { return sum + part.bytes; });
}
// Alignment takes the rest; a part that the list lacks would be larger.
constexpr std::size_t kPadding_bytes = sizeof(Pipeline) - sum_bytes(kPipelineMemory);
static_assert(kPadding_bytes < 2 * alignof(Pipeline) * (kPipelineMemory.size()), "a part is not in the list");

// As the robot runs it; all rows in one lane take less.
template <std::size_t... Lanes>
constexpr std::size_t executives_bytes(std::index_sequence<Lanes...>) noexcept {
  return (sizeof(LaneExecutive<Lanes>) + ...);
}
constexpr auto kMemory = [] {
  std::array<StageMemory, kPipelineMemory.size() + 3> table{};
  auto end = std::ranges::copy(kPipelineMemory, table.begin()).out;
  *end++ = {"padding", kPadding_bytes};
  *end++ = {"executive", executives_bytes(std::make_index_sequence<kLaneCount>{})};
  *end = {"stacks", kLaneCount * kLaneStack_bytes};
  return table;
}();
static_assert(sum_bytes(kMemory) <= kMemoryBudget_bytes);

// Rows of a lane, as bits.
constexpr auto kLaneRows = [] {
  std::array<std::uint32_t, kLaneCount> rows{};
  for (std::size_t row = 0; row < kTasks.size(); ++row) rows[kTasks[row].row.lane] |= 1U << row;
  return rows;
}();
// The first row of a lane looks across; and each cycle has rows by which cycle_done() knows the lane.
static_assert([] {
  bool good = true;
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
    const auto first = std::ranges::find(kSchedule, lane, &ScheduleRow::lane);
    good = good && first->slots == kEverySlot && first->shed_order == 0;
  }
  return good;
}());

}  // namespace

Progress Pipeline::run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
  return kTasks[row].function.run(*this, cycle_ns, budget);
}

// An executive of one lane runs the rows of all: the rows say whose cycle it was.
void Pipeline::cycle_done(std::size_t, const CycleReport& report) noexcept {
  const std::uint32_t rows = report.ran | report.shed | report.deferred;
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
    if ((rows & kLaneRows[lane]) != 0) lane_finished(lane, report.due_ns);
  }
  if ((rows & kLaneRows[kControlLane]) == 0) return;
  const bool late = report.caught_up || report.overrun || (report.overran & kLaneRows[kControlLane]) != 0;
  control_.count_cycle(report.skipped_before + (late ? 1U : 0U));
}

Telemetry Pipeline::telemetry(std::int64_t now_ns, PerceptionTelemetry& perception) const noexcept {
  (void)perception.surfaces.try_take(control_.view().last_ns());  // the newest, or the last one again
  (void)perception.map.try_take(control_.view().last_ns());
  return {now_ns,
          control_.state(),
          control_.estimator().quality(),
          perception.surfaces.front(),
          perception.map.front(),
          control_.gait_status(),
          control_.module_state(),
          control_.arming_waits_for(),
          control_.drives()};
}

std::span<const StageMemory> static_memory() noexcept { return kMemory; }

}  // namespace polygmap
