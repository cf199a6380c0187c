// SPDX-License-Identifier: Apache-2.0
#include "firmware/pipeline.hpp"

#include "algorithms/core/time.hpp"
#include "scheduler/cyclic_executive.hpp"

namespace polygmap {

namespace {

static_assert(1e6 * kTick_s == kMinorFrame_us, "the gait counts minor frames");

// As the robot runs it; all rows in one lane take less.
constexpr std::size_t kExecutives_bytes =
    sizeof(CyclicExecutive<Pipeline, kSchedule, 0>) + sizeof(CyclicExecutive<Pipeline, kSchedule, 1>);
constexpr std::size_t kStacks_bytes = lane_count(kSchedule) * kLaneStack_bytes;
static_assert(lane_count(kSchedule) == 2);
static_assert(sizeof(Pipeline) + kExecutives_bytes + kStacks_bytes <= kMemoryBudget_bytes);

}  // namespace

Progress Pipeline::run_row(std::size_t row, std::int64_t frame_ns, WorkBudget& budget) noexcept {
  switch (static_cast<Row>(row)) {
    case kSense:
      return control_.sense(frame_ns);
    case kEstimate:
      return control_.estimate(frame_ns);
    case kGait:
      return control_.gait(frame_ns);
    case kCommand:
      return control_.command(frame_ns);
    case kHealth:
      return control_.health(frame_ns);
    case kIntake:
      return perception_.intake(frame_ns);
    case kSurfaces:
      return perception_.surfaces(frame_ns, budget);
    case kMap:
      return perception_.map(frame_ns, budget);
    case kFootholds:
      return perception_.footholds(frame_ns, budget);
    case kRowCount:
      break;
  }
  return Progress::kIdle;
}

Telemetry Pipeline::telemetry(std::int64_t now_ns) const noexcept {
  return {now_ns,
          control_.state(),
          control_.estimator().quality(),
          perception_.surface_frame(),
          perception_.map_snapshot(),
          control_.gait_status()};
}

std::array<StageMemory, kMemoryStages> static_memory() noexcept {
  constexpr std::size_t kHealth = sizeof(Health) * 3;  // of either lane and of both
  constexpr std::size_t kStages = sizeof(Estimator) + sizeof(SurfaceExtractor) + sizeof(PolygonMap) +
                                  sizeof(FootholdSearch) + sizeof(Gait) + sizeof(LaneLink) + kHealth;
  return {{{"estimation", sizeof(Estimator)},
           {"perception", sizeof(SurfaceExtractor)},
           {"polygon_map", sizeof(PolygonMap)},
           {"foothold", sizeof(FootholdSearch)},
           {"gait", sizeof(Gait)},
           {"lane_link", sizeof(LaneLink)},
           {"health", kHealth},
           {"other", sizeof(Pipeline) - kStages},
           {"executive", kExecutives_bytes},
           {"stacks", kStacks_bytes}}};
}

}  // namespace polygmap
