// SPDX-License-Identifier: Apache-2.0
// One CAN interface of the kernel (docs/drivers.md has what each error does).
#pragma once

#include <linux/can.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>

#include "algorithms/core/containers/static_vector.hpp"
#include "hal/linux/system/descriptor.hpp"
#include "hal/linux/system/device_error.hpp"
#include "hal/linux/system/time_base.hpp"
#include "hal/ports/can_channel.hpp"

namespace polygmap::hal {

struct CanId {
  std::uint32_t id = 0;
  bool extended = false;
};

class SocketCan final : public CanChannel {
 public:
  static constexpr std::size_t kMostIds = 64;
  struct Config {
    FixedText<15> interface {};               // "can0"; bit rates are set where it is brought up
    bool fd = false;                          // takes and sends CAN FD frames beside classic ones
    bool bit_rate_switch = true;              // of FD frames sent
    StaticVector<CanId, kMostIds> receive{};  // data frames of these only; empty: of all
  };
  struct Counters {  // beside the port's; saturate
    std::uint32_t wrong_size = 0;
    std::uint32_t remote_frames = 0;  // nobody here answers one
    std::uint32_t unsendable = 0;     // ids, lengths or kinds that the bus has not
    std::uint32_t interrupted = 0;
    std::uint32_t interface_down = 0;
    std::uint32_t interface_gone = 0;
  };

  explicit SocketCan(const SystemCalls& calls = kernel_calls()) noexcept;
  SocketCan(const SocketCan&) = delete;  // messages point into it
  SocketCan& operator=(const SocketCan&) = delete;
  [[nodiscard]] DeviceError open(const Config& config) noexcept;
  void close() noexcept;
  // Opens an interface anew that went away; each call tries once. Outside the lanes.
  void maintain() noexcept;

  [[nodiscard]] std::size_t read(std::span<CanFrame> frames) noexcept override;
  // Stops at the first frame that the bus cannot carry.
  [[nodiscard]] std::size_t write(std::span<const CanFrame> frames) noexcept override;
  [[nodiscard]] CanChannelStatus status() const noexcept override { return status_; }
  [[nodiscard]] bool is_lost() const noexcept { return owner_.is_lost(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const ReopenCounters& reopen_counters() const noexcept { return reopens_; }

 private:
  static constexpr std::size_t kBatch = 32;
  struct Batch {
    std::array<canfd_frame, kBatch> frames{};
    std::array<iovec, kBatch> vectors{};
    std::array<mmsghdr, kBatch> messages{};
    alignas(8) std::array<std::array<std::uint8_t, 64>, kBatch> control{};
  };
  enum class After : std::uint8_t { kRetry, kStop };

  [[nodiscard]] DeviceError open_socket() noexcept;
  [[nodiscard]] DeviceError set_socket(int fd) noexcept;
  // What to do after a call that failed with this errno; counts it.
  [[nodiscard]] After failed(int error_number, int& attempts) noexcept;
  void prepare_read(std::size_t count) noexcept;
  [[nodiscard]] bool convert(std::size_t i, const ClockReading& now, CanFrame& frame) noexcept;
  void read_control(const msghdr& header, const ClockReading& now, CanFrame& frame) noexcept;
  void note_error(const canfd_frame& frame) noexcept;
  // False: the bus cannot carry it.
  [[nodiscard]] bool prepare_write(std::size_t i, const CanFrame& frame) noexcept;

  const SystemCalls& calls_;
  Config config_;
  DeviceOwner owner_;
  Descriptor socket_;
  std::uint32_t dropped_ = 0;  // as the kernel counts
  bool was_down_ = false;      // the interface; frames from before may still wait to be read
  CanChannelStatus status_;
  Counters counters_;
  ReopenCounters reopens_;
  Batch in_;
  Batch out_;
};

}  // namespace polygmap::hal
