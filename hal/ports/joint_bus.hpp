// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::hal {

[[nodiscard]] constexpr std::array<std::int16_t, kJointCount> all_not_told_degc() noexcept {
  std::array<std::int16_t, kJointCount> degc{};
  degc.fill(kNotTold_degc);
  return degc;
}

// What a bus knows of itself and its drives. Counters saturate.
struct JointBusStatus {
  JointSet drive_errors{};                             // drives whose last reply told of an error
  std::array<std::uint8_t, kJointCount> drive_code{};  // what it told, in the drive's own code
  // The hottest that a drive's last reply told of itself, in whole degrees, or kNotTold_degc.
  std::array<std::int16_t, kJointCount> drive_degc = all_not_told_degc();
  bool bus_off = false;                   // a controller has left its bus: nothing is sent or heard on it
  bool senses_feet = true;                // JointFeedback::foot_force_n is measured, else not a number
  bool feet_silent = false;               // it should be, and is not a number for want of a frame
  std::uint32_t bus_offs = 0;             // times that a bus went off
  std::uint32_t refused = 0;              // commands that a queue did not take
  std::uint32_t unknown_ids = 0;          // frames that no drive of the table sends
  std::uint32_t bad_frames = 0;           // frames of a known id whose length or kind is wrong
  std::uint32_t drive_error_replies = 0;  // replies that told of an error
  std::uint32_t clamped = 0;              // values of commands that a drive's range could not hold
  std::uint32_t not_finite = 0;           // commands that no frame was made of
  std::uint32_t lost = 0;                 // frames lost on the way from the controller
  std::uint32_t failed_calls = 0;         // of the driver, for another reason than a full queue
  std::uint32_t stale = 0;                // replies that had waited too long to count as answers
};

class JointBus {
 public:
  // The feedback of all joints, each with the age of its own reply; false, and feedback untouched, when no drive
  // replied since the last call. One silent drive hides no other. Never blocks.
  [[nodiscard]] virtual bool try_read(JointFeedback& feedback) noexcept = 0;
  // Hands one command for every joint to the drives and says whose were taken: where a bus would not take more, those
  // behind are not sent, and never later. Never blocks.
  [[nodiscard]] virtual JointSet try_write(const JointCommand& command) noexcept = 0;
  // As of the last call of the other two.
  [[nodiscard]] virtual JointBusStatus status() const noexcept = 0;

 protected:
  ~JointBus() = default;
};

}  // namespace polygmap::hal
