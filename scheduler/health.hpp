// SPDX-License-Identifier: Apache-2.0
// What went wrong (faults) and what ran into a bound and was held there (limits), counted by name.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>

namespace polygmap {

// Something does not work as it should; the module degrades. Codes 1-99.
enum class Fault : std::uint8_t {
  kFrameOverrun = 1,  // a lane's minor frame took longer than kMinorFrame_us
  kRowOverrun,        // a row took longer than its budget
  kFrameSlip,         // a tick came so late that minor frames were skipped
  kClockRate,         // the cycle counter's rate is outside CycleScale's range
  kImuMissing,        // no sample in a slot, and none read ahead
  kImuRejected,       // not finite, out of range, out of order or of the future
  kJointFeedbackMissing,
  kJointFeedbackRejected,
  kJointCommandRefused,  // the bus would not take a command
  kJointCommandInvalid,  // the module's own command was not finite and was not sent
  kDepthMissing,         // no frame within the camera's time-out
  kDepthRejected,        // wrong size, out of order, no data, or of a camera that cannot be
  kLioMissing,
  kLioRejected,  // not finite, out of order, or too far from the odometry
  kPoseMissing,  // control did not say in time where a frame was exposed; the frame was given back
  kMapStale,     // the newest fused frame is too old to step on
  kStateStale,   // IMU or joints silent for so long that the gait stopped
  kGaitStopped,  // held in double support for a reason other than being on top
  kEnd,          // not a fault
};

// A bound was met; the module goes on with what it has. Codes 101-199.
enum class Limit : std::uint8_t {
  kRowShed = 101,    // a slot given up for lack of time
  kRowDeferred,      // a slot that paid back an overdraft of work units
  kFrameCaughtUp,    // a frame run late
  kPlanesFull,       // planes and surfaces of a frame that found no room
  kMapFull,          // polygons that found no room in the map
  kStateRingMissed,  // a frame's stamp that the ring of past states does not cover
  kDepthUnplaced,    // a frame given back for that, or from before the start
  kReachLimited,     // a leg could not reach the pose asked for
  kContactEarly,     // a foot touched before its planned time
  kContactLate,
  kRunsFull,        // runs, intervals and pairs of planes of a frame that found no room
  kHeightRejected,  // a mapped tread's height that disagrees with the sole that landed on it
  kFootPutBack,     // a foot went back in the air to where it had stood
  kFrameLost,       // a frame that never reached the map: the last one still waited for it, or it was not usable
  kEnd,             // not a limit
};

template <typename Code>
inline constexpr std::size_t kFirstCode = 0;
template <>
inline constexpr std::size_t kFirstCode<Fault> = static_cast<std::size_t>(Fault::kFrameOverrun);
template <>
inline constexpr std::size_t kFirstCode<Limit> = static_cast<std::size_t>(Limit::kRowShed);
template <typename Code>
inline constexpr std::size_t kCodeCount = static_cast<std::size_t>(Code::kEnd) - kFirstCode<Code>;

inline constexpr std::array<std::string_view, kCodeCount<Fault>> kFaultNames{"frame_overrun",
                                                                             "row_overrun",
                                                                             "frame_slip",
                                                                             "clock_rate",
                                                                             "imu_missing",
                                                                             "imu_rejected",
                                                                             "joint_feedback_missing",
                                                                             "joint_feedback_rejected",
                                                                             "joint_command_refused",
                                                                             "joint_command_invalid",
                                                                             "depth_missing",
                                                                             "depth_rejected",
                                                                             "lio_missing",
                                                                             "lio_rejected",
                                                                             "pose_missing",
                                                                             "map_stale",
                                                                             "state_stale",
                                                                             "gait_stopped"};
inline constexpr std::array<std::string_view, kCodeCount<Limit>> kLimitNames{
    "row_shed",          "row_deferred",    "frame_caught_up", "planes_full",   "map_full",
    "state_ring_missed", "depth_unplaced",  "reach_limited",   "contact_early", "contact_late",
    "runs_full",         "height_rejected", "foot_put_back",   "frame_lost"};
static_assert(!kFaultNames.back().empty() && !kLimitNames.back().empty(), "a code without a name");

// "unknown" outside the enumeration.
[[nodiscard]] constexpr std::string_view name_of(Fault fault) noexcept {
  const std::size_t i = static_cast<std::size_t>(fault) - kFirstCode<Fault>;
  return i < kFaultNames.size() ? kFaultNames[i] : "unknown";
}
[[nodiscard]] constexpr std::string_view name_of(Limit limit) noexcept {
  const std::size_t i = static_cast<std::size_t>(limit) - kFirstCode<Limit>;
  return i < kLimitNames.size() ? kLimitNames[i] : "unknown";
}

struct CodeCount {
  std::uint32_t count = 0;  // saturates
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
};

// One per lane, written by that lane's thread only (its tasks and its executive); a copy crosses lanes through an
// Exchange and is merged by the reader.
class Health {
 public:
  constexpr void raise(Fault fault, std::int64_t now_ns, std::uint32_t times = 1) noexcept {
    raise_in(faults_, fault, now_ns, times);
  }
  constexpr void raise(Limit limit, std::int64_t now_ns, std::uint32_t times = 1) noexcept {
    raise_in(limits_, limit, now_ns, times);
  }

  // Zero outside the enumeration.
  [[nodiscard]] constexpr CodeCount count(Fault fault) const noexcept { return count_in(faults_, fault); }
  [[nodiscard]] constexpr CodeCount count(Limit limit) const noexcept { return count_in(limits_, limit); }
  [[nodiscard]] constexpr bool any_fault() const noexcept { return any_in(faults_); }
  [[nodiscard]] constexpr bool any_limit() const noexcept { return any_in(limits_); }

  constexpr void clear(Fault fault) noexcept { clear_in(faults_, fault); }
  constexpr void clear(Limit limit) noexcept { clear_in(limits_, limit); }
  constexpr void clear() noexcept { *this = Health{}; }

  // Adds another lane's counts.
  constexpr void merge(const Health& other) noexcept {
    merge_in(faults_, other.faults_);
    merge_in(limits_, other.limits_);
  }

 private:
  template <typename Code>
  using Counts = std::array<CodeCount, kCodeCount<Code>>;

  static constexpr std::uint32_t saturating_sum(std::uint32_t a, std::uint32_t b) noexcept {
    return b > std::numeric_limits<std::uint32_t>::max() - a ? std::numeric_limits<std::uint32_t>::max() : a + b;
  }
  template <typename Code>
  static constexpr std::size_t index(Code code) noexcept {  // a code below the first wraps and is out of range
    return static_cast<std::size_t>(code) - kFirstCode<Code>;
  }
  template <typename Code>
  static constexpr void raise_in(Counts<Code>& counts, Code code, std::int64_t now_ns, std::uint32_t times) noexcept {
    if (index(code) >= counts.size() || times == 0) return;
    CodeCount& c = counts[index(code)];
    if (c.count == 0) c.first_ns = now_ns;
    c.last_ns = now_ns;
    c.count = saturating_sum(c.count, times);
  }
  template <typename Code>
  static constexpr CodeCount count_in(const Counts<Code>& counts, Code code) noexcept {
    return index(code) < counts.size() ? counts[index(code)] : CodeCount{};
  }
  template <typename Code>
  static constexpr void clear_in(Counts<Code>& counts, Code code) noexcept {
    if (index(code) < counts.size()) counts[index(code)] = {};
  }
  template <std::size_t N>
  static constexpr bool any_in(const std::array<CodeCount, N>& counts) noexcept {
    return std::any_of(counts.begin(), counts.end(), [](const CodeCount& c) { return c.count > 0; });
  }
  template <std::size_t N>
  static constexpr void merge_in(std::array<CodeCount, N>& counts, const std::array<CodeCount, N>& other) noexcept {
    for (std::size_t i = 0; i < N; ++i) {
      if (other[i].count == 0) continue;
      CodeCount& c = counts[i];
      c.first_ns = c.count == 0 ? other[i].first_ns : std::min(c.first_ns, other[i].first_ns);
      c.last_ns = c.count == 0 ? other[i].last_ns : std::max(c.last_ns, other[i].last_ns);
      c.count = saturating_sum(c.count, other[i].count);
    }
  }

  Counts<Fault> faults_{};
  Counts<Limit> limits_{};
};

}  // namespace polygmap
