// SPDX-License-Identifier: Apache-2.0
// One frame on a CAN bus, as a driver or the simulation has it.
#pragma once

#include <array>
#include <cstdint>

namespace polygmap::hal {

struct CanFrame {
  std::uint32_t id = 0;     // 11 bits, or 29 when extended; of an error frame: the kernel's error class bits
  std::uint8_t length = 0;  // bytes of data: up to 8, with fd up to 64
  bool extended = false;
  bool fd = false;
  bool error = false;                   // the controller tells of an error; data as <linux/can/error.h> has it
  std::int64_t stamp_ns = 0;            // of the driver, monotonic; 0: none. Judges age only: it enters no result
  std::array<std::uint8_t, 64> data{};  // behind length: of no meaning
};

}  // namespace polygmap::hal
