// SPDX-License-Identifier: Apache-2.0
// One CAN bus in memory: one frame at a time at the bit rate, the lowest identifier first, queues that fill up.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/can_channel.hpp"

namespace polygmap::sim {

// The host is the channel. Everything else on the bus sends by send() and is told of the host's frames. Neither end of
// the channel allocates; run() is not for module time.
class SimCanBus final : public hal::CanChannel {
 public:
  // Linux gives a CAN interface that many places unless told otherwise.
  static constexpr std::size_t kTransmitQueue = 10, kReceiveQueue = 256;
  // A frame of the host has gone over the bus: at done_ns.
  using Received = std::function<void(const hal::CanFrame& frame, std::int64_t done_ns)>;
  // Any frame has, the bus's log.
  using Logged = std::function<void(const hal::CanFrame& frame)>;

  explicit SimCanBus(std::uint32_t bitrate_bps) : bitrate_bps_(bitrate_bps) {}

  [[nodiscard]] std::size_t read(std::span<hal::CanFrame> frames) noexcept override;
  [[nodiscard]] std::size_t write(std::span<const hal::CanFrame> frames) noexcept override;
  [[nodiscard]] hal::CanChannelStatus status() const noexcept override { return status_; }

  // Of a node: takes part in the arbitration from ready_ns on.
  void send(const hal::CanFrame& frame, std::int64_t ready_ns) { nodes_.push_back({frame, ready_ns}); }
  // The bus's time goes on from from_ns, where it stands, to to_ns. A frame that is not through by then goes on next
  // time.
  void run(std::int64_t from_ns, std::int64_t to_ns, const Received& received, const Logged& logged);

  // Injected: the controller leaves the bus, what waited is lost; or comes back.
  void set_bus_off(bool off) noexcept;
  // Injected: as many places in the transmit queue, kTransmitQueue at most.
  void set_transmit_queue(std::size_t places) noexcept { places_ = places; }

 private:
  struct Waiting {
    hal::CanFrame frame;
    std::int64_t ready_ns = 0;
  };
  struct InFlight {
    hal::CanFrame frame;
    std::int64_t done_ns = 0;
    bool by_host = false;
  };
  void begin_next(std::int64_t now_ns);
  void finish(const Received& received, const Logged& logged);

  std::uint32_t bitrate_bps_;
  std::size_t places_ = kTransmitQueue;
  RingBuffer<hal::CanFrame, kTransmitQueue> to_bus_;
  RingBuffer<hal::CanFrame, kReceiveQueue> to_host_;
  std::vector<Waiting> nodes_;
  std::optional<InFlight> in_flight_;
  hal::CanChannelStatus status_;
};

}  // namespace polygmap::sim
