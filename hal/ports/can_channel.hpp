// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/codec/can_frame.hpp"

namespace polygmap::hal {

struct CanChannelStatus {  // counters saturate
  bool bus_off = false;
  bool error_passive = false;
  std::uint32_t received = 0, sent = 0;
  std::uint32_t refused = 0;  // frames the queue did not take (ENOBUFS, EAGAIN)
  std::uint32_t lost = 0;     // frames the kernel dropped before we read them
  std::uint32_t error_frames = 0;
  std::uint32_t failed_calls = 0;  // any other errno
};

class CanChannel {  // one bus
 public:
  // Frames that have arrived, oldest first; how many. Never blocks.
  [[nodiscard]] virtual std::size_t read(std::span<CanFrame> frames) noexcept = 0;
  // In order; how many were taken. Never blocks.
  [[nodiscard]] virtual std::size_t write(std::span<const CanFrame> frames) noexcept = 0;
  [[nodiscard]] virtual CanChannelStatus status() const noexcept = 0;

 protected:
  ~CanChannel() = default;
};

}  // namespace polygmap::hal
