// SPDX-License-Identifier: Apache-2.0
// What went wrong (faults) and what ran into a bound and was held there (limits): number, name and meaning, in one
// table each. A number is in logs and manuals: it stays with its line, and that of a line that goes is not used again.
#pragma once

#include "scheduler/event_counters.hpp"
#include "scheduler/executive_event.hpp"

namespace polygmap {

// Something does not work as it should; the module degrades. Numbers 1-99.
#define POLYGMAP_FAULTS(X)                                                                                           \
  X(1, kCycleOverrun, "cycle_overrun", "A lane's cycle took longer than kCycle_us.")                                 \
  X(2, kRowOverrun, "row_overrun", "A row took longer than its budget.")                                             \
  X(3, kCycleSlip, "cycle_slip", "A tick came so late that cycles were skipped.")                                    \
  X(4, kClockRate, "clock_rate", "The clock's counter has a rate outside CounterScale's range.")                     \
  X(5, kImuMissing, "imu_missing", "An IMU sample was due and did not come.")                                        \
  X(6, kImuRejected, "imu_rejected", "An IMU sample was not finite, out of range or order, or of the future.")       \
  X(7, kJointFeedbackMissing, "joint_feedback_missing", "No joint feedback came in a cycle.")                        \
  X(8, kJointFeedbackRejected, "joint_feedback_rejected",                                                            \
    "Joint feedback was not finite, out of range or order, of the future, or jumped.")                               \
  X(9, kJointCommandRefused, "joint_command_refused", "The bus did not take a command.")                             \
  X(10, kJointCommandInvalid, "joint_command_invalid", "The module's own command was not finite: not sent.")         \
  X(11, kDepthMissing, "depth_missing", "No depth frame came within the camera's time-out.")                         \
  X(12, kDepthRejected, "depth_rejected",                                                                            \
    "A depth frame had a wrong size, no data, an old stamp, or a camera that cannot be.")                            \
  X(13, kLioMissing, "lio_missing", "No lidar pose was accepted for two seconds.")                                   \
  X(14, kLioRejected, "lio_rejected",                                                                                \
    "A lidar pose was not finite, out of order, from before the start, or too far from the odometry.")               \
  X(15, kPoseMissing, "pose_missing", "Control did not say in time where a frame was exposed; it was given back.")   \
  X(16, kMapStale, "map_stale", "The newest fused frame was too old to step on.")                                    \
  X(17, kStateStale, "state_stale", "IMU or joints were silent for so long that the gait stopped.")                  \
  X(18, kGaitStopped, "gait_stopped", "The gait stopped in double support, not on top.")                             \
  X(19, kLaneBehind, "lane_behind",                                                                                  \
    "A lane had not finished a cycle when the other one began the next: it is seen a cycle later.")                  \
  X(20, kTimeShort, "time_short", "Control lost cycles or overran so often that the module stops.")                  \
  X(21, kCommandsRefused, "commands_refused",                                                                        \
    "So many commands in a row were refused by the bus, or not finite, that the module stops.")                      \
  X(22, kFallen, "fallen", "The torso leans so far that the robot falls: its joints are damped.")                    \
  X(23, kSolesDisagree, "soles_disagree",                                                                            \
    "While arming, the soles were not parallel by the encoders: a zero or a sign is wrong, or a foot hangs.")        \
  X(24, kGravityDisagrees, "gravity_disagrees",                                                                      \
    "While arming, the IMU felt gravity elsewhere than the soles have it, or not as strong: its mount or its unit.") \
  X(30, kDriveSilent, "drive_silent", "A drive was silent for more than five cycles; telemetry says which joint's.") \
  X(31, kDriveError, "drive_error", "A drive told of an error, or left its motor mode.")                             \
  X(32, kBusOff, "bus_off", "A CAN controller left its bus.")                                                        \
  X(33, kBusUnknownId, "bus_unknown_id", "A CAN frame came that no drive of the bus file sends.")                    \
  X(34, kBusBadFrame, "bus_bad_frame", "A CAN frame had a wrong length or kind, or another drive's name in it.")     \
  X(35, kBusFrameLost, "bus_frame_lost", "CAN frames were lost between controller and module.")                      \
  X(36, kBusCallFailed, "bus_call_failed", "A CAN driver's call failed, and not for a full queue.")                  \
  X(37, kFeetSilent, "feet_silent", "The feet's sensors were silent for more than five cycles.")                     \
  X(38, kBusReplyStale, "bus_reply_stale", "A CAN reply had waited for more than two cycles: it was left out.")      \
  X(39, kJointOutOfRange, "joint_out_of_range",                                                                      \
    "While arming, a joint was farther beyond its range than its encoder may be off; telemetry says which.")         \
  X(40, kDriveHot, "drive_hot", "A drive told that it is hotter than it may be; telemetry says which joint's.")

// A bound was met; the module goes on with what it has. Numbers 101-199.
#define POLYGMAP_LIMITS(X)                                                                                          \
  X(101, kRowShed, "row_shed", "A slot was given up for lack of time.")                                             \
  X(102, kRowDeferred, "row_deferred", "A slot paid back an overdraft of work units.")                              \
  X(103, kCycleCaughtUp, "cycle_caught_up", "A cycle was run late.")                                                \
  X(104, kPlanesFull, "planes_full", "A plane or surface of a frame found no room.")                                \
  X(105, kMapFull, "map_full", "A polygon found no room in the map.")                                               \
  X(106, kStateRingMissed, "state_ring_missed", "The past states do not cover a frame's stamp.")                    \
  X(107, kDepthUnplaced, "depth_unplaced", "A frame was given back: no past state covers its stamp.")               \
  X(108, kReachLimited, "reach_limited", "A leg could not reach the pose asked for.")                               \
  X(109, kContactEarly, "contact_early", "A foot touched before its planned time.")                                 \
  X(110, kContactLate, "contact_late", "A foot touched after its planned time.")                                    \
  X(111, kSegmentsFull, "segments_full", "A scanline segment, a span or a pair of planes found no room.")           \
  X(112, kHeightRejected, "height_rejected", "A mapped tread's height disagreed with the sole that landed on it.")  \
  X(113, kFootPutBack, "foot_put_back", "A foot in the air went back to where it had stood.")                       \
  X(114, kFrameLost, "frame_lost", "A frame never reached the map: it was unusable, or the last one still waited.") \
  X(115, kHandOverLost, "hand_over_lost", "A lane was so late that what it should have seen was overwritten.")      \
  X(116, kOperatorRefused, "operator_refused",                                                                      \
    "The operator asked for what the module did not do; the answer says why.")                                      \
  X(117, kImuTurned, "imu_turned",                                                                                  \
    "Soles and weight say that the IMU is not mounted as configured: its samples are turned.")                      \
  X(118, kPictureBad, "picture_bad",                                                                                \
    "The last pictures had no depth on much of the way ahead, or were noisier than the camera is to be.")           \
  X(119, kRecordingLost, "recording_lost", "A frame or a picture found no room in the recording's memory.")         \
  X(130, kDriveClamped, "drive_clamped", "A command's value was beyond its drive's range and became the nearest end.")

#define POLYGMAP_ENUMERATOR(number, code, name, text) code = number,
#define POLYGMAP_FAULT_LINE(number, code, name, text) EventInfo<Fault>{Fault::code, name, text},
#define POLYGMAP_LIMIT_LINE(number, code, name, text) EventInfo<Limit>{Limit::code, name, text},

enum class Fault : std::uint8_t { POLYGMAP_FAULTS(POLYGMAP_ENUMERATOR) };
enum class Limit : std::uint8_t { POLYGMAP_LIMITS(POLYGMAP_ENUMERATOR) };

inline constexpr std::array kFaultTable{POLYGMAP_FAULTS(POLYGMAP_FAULT_LINE)};
inline constexpr std::array kLimitTable{POLYGMAP_LIMITS(POLYGMAP_LIMIT_LINE)};

#undef POLYGMAP_FAULTS
#undef POLYGMAP_LIMITS
#undef POLYGMAP_ENUMERATOR
#undef POLYGMAP_FAULT_LINE
#undef POLYGMAP_LIMIT_LINE

template <>
inline constexpr auto kEventTable<Fault> = kFaultTable;
template <>
inline constexpr auto kEventTable<Limit> = kLimitTable;
static_assert(bad_event_lines<Fault>(1, 99) == 0 && bad_event_lines<Limit>(101, 199) == 0);

[[nodiscard]] constexpr std::string_view name_of(Fault fault) noexcept { return name_of_event(fault); }
[[nodiscard]] constexpr std::string_view name_of(Limit limit) noexcept { return name_of_event(limit); }

// Faults and limits of a lane, those of its executive among them.
class Health : public EventCounters<Fault, Limit> {
 public:
  using EventCounters::raise;
  constexpr void raise(ExecutiveEvent event, std::int64_t now_ns, std::uint32_t times = 1) noexcept {
    switch (event) {
      case ExecutiveEvent::kCycleOverrun:
        return raise(Fault::kCycleOverrun, now_ns, times);
      case ExecutiveEvent::kRowOverrun:
        return raise(Fault::kRowOverrun, now_ns, times);
      case ExecutiveEvent::kCycleSlip:
        return raise(Fault::kCycleSlip, now_ns, times);
      case ExecutiveEvent::kClockRate:
        return raise(Fault::kClockRate, now_ns, times);
      case ExecutiveEvent::kRowShed:
        return raise(Limit::kRowShed, now_ns, times);
      case ExecutiveEvent::kRowDeferred:
        return raise(Limit::kRowDeferred, now_ns, times);
      case ExecutiveEvent::kCycleCaughtUp:
        return raise(Limit::kCycleCaughtUp, now_ns, times);
    }
  }
  [[nodiscard]] constexpr bool any_fault() const noexcept { return any<Fault>(); }
  [[nodiscard]] constexpr bool any_limit() const noexcept { return any<Limit>(); }
};

}  // namespace polygmap
