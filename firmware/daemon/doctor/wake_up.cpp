// SPDX-License-Identifier: Apache-2.0
#include "algorithms/core/time.hpp"
#include "firmware/daemon/doctor/doctor.hpp"
#include "firmware/daemon/system/lane_thread.hpp"
#include "firmware/daemon/system/monotonic_clock.hpp"
#include "firmware/schedule.hpp"

namespace polygmap::daemon {
namespace {

struct Measurement {
  WakeUps wake_ups;
  std::uint32_t cycles = 0;
  int refused = 0;  // why the thread has not the processor and priority that it was to have, an errno
};
void* measure(void* argument) noexcept {
  auto& measurement = *static_cast<Measurement*>(argument);
  std::int64_t due_ns = monotonic_ns();
  for (std::uint32_t i = 0; i < measurement.cycles; ++i) {
    due_ns += kCycle_ns;
    sleep_until(due_ns);
    const std::int64_t late_ns = monotonic_ns() - due_ns;
    measurement.wake_ups.add(static_cast<std::uint64_t>(late_ns > 0 ? late_ns : 0));
    if (late_ns > kCycle_ns) due_ns = monotonic_ns();  // each wake-up by itself
  }
  return nullptr;
}

}  // namespace

void WakeUps::add(std::uint64_t late_ns) noexcept {
  std::size_t bucket = 0;
  while (bucket + 1 < kBuckets && late_ns >= 1000ULL * below_us(bucket)) ++bucket;
  ++counts[bucket];
  ++woken;
  if (late_ns > max_ns) max_ns = late_ns;
}

void measure_wake_ups(std::vector<LaneWakeUps>& lanes, std::uint32_t cycles) {
  std::vector<Measurement> measurements(lanes.size(), Measurement{.wake_ups = {}, .cycles = cycles});
  std::vector<LaneThread> threads(lanes.size());
  for (std::size_t n = 0; n < lanes.size(); ++n) {
    measurements[n].refused = threads[n].start(lanes[n].placement, &measure, &measurements[n]);
    if (measurements[n].refused != 0) (void)threads[n].start({}, &measure, &measurements[n]);
  }
  for (std::size_t n = 0; n < lanes.size(); ++n) {
    threads[n].join();
    lanes[n].wake_ups = measurements[n].wake_ups;
    lanes[n].wake_ups.was_real_time = measurements[n].refused == 0;
    lanes[n].wake_ups.lacks_processor = measurements[n].refused == EINVAL;
  }
}

std::uint64_t slack_ns(std::size_t lanes) noexcept {
  const std::int64_t worst_us = lanes == 1 ? worst_cycle_us(kOneLaneSchedule) : worst_cycle_us(kSchedule);
  return static_cast<std::uint64_t>(kCycle_ns - 1000 * worst_us);
}

Finding finding_of(const LaneWakeUps& lane, std::uint64_t slack_ns) {
  const WakeUps& wake_ups = lane.wake_ups;
  const std::string latest = std::to_string((wake_ups.max_ns + 999) / 1000) + " us";
  const int processor = lane.placement.processor;
  Finding finding{lane.lane.empty() ? "wake-up" : "wake-up " + lane.lane,
                  Verdict::kGood,
                  "Of " + std::to_string(wake_ups.woken) + " wake-ups on " +
                      (processor < 0 ? "any processor" : "processor " + std::to_string(processor)) +
                      " the latest came " + latest + " late, and a lane's rows leave " +
                      std::to_string(slack_ns / 1000) + " us of a cycle" +
                      (wake_ups.was_real_time ? "." : ", on an ordinary thread anywhere."),
                  {}};
  if (wake_ups.max_ns <= slack_ns / 2 && wake_ups.was_real_time) return finding;
  finding.verdict = wake_ups.max_ns <= slack_ns ? Verdict::kWarning : Verdict::kBad;
  finding.to_do = wake_ups.was_real_time
                      ? "Mend what is found above (kernel, governor, isolation) and look again; cyclictest of rt-tests "
                        "measures for longer."
                  : wake_ups.lacks_processor
                      ? "Give the lane a processor of /sys/devices/system/cpu/online, to see what it would."
                      : "Run it as root, or as the shipped service runs, to see what a lane would.";
  // Without a priority it says nothing of what a lane would have.
  if (!wake_ups.was_real_time) finding.verdict = Verdict::kWarning;
  return finding;
}

}  // namespace polygmap::daemon
