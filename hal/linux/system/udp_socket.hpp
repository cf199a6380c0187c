// SPDX-License-Identifier: Apache-2.0
// Small datagrams of one sender, read in batches, with the kernel's time of arrival.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <span>

#include "hal/codec/byte_order.hpp"
#include "hal/linux/system/descriptor.hpp"
#include "hal/linux/system/device_error.hpp"
#include "hal/linux/system/time_base.hpp"

namespace polygmap::hal {

struct UdpConfig {
  std::uint16_t port = 0;   // of this machine
  FixedText<15> address{};  // of this machine, IPv4, to listen on; empty: every one
  FixedText<15> sender{};   // the only one to listen to, IPv4; empty: anyone
};

struct UdpCounters {  // saturate
  std::uint32_t datagrams = 0;
  std::uint32_t foreign_sender = 0;  // what the kernel let through of others, where it takes no filter
  std::uint32_t lost = 0;            // by the kernel: its buffer was full, or its filter kept another sender out
  std::uint32_t cut_short = 0;       // port calls that read as much as one may: the rest waits
  std::uint32_t interrupted = 0;
  std::uint32_t failed_calls = 0;
};

struct Datagram {
  codec::Bytes bytes;           // of one over UdpSocket::kMostBytes, its beginning
  std::int64_t arrival_ns = 0;  // monotonic
};

class UdpSocket {
 public:
  static constexpr std::size_t kBatch = 16;
  static constexpr std::size_t kMostBytes = 256;
  // Of one port call: a flood must not hold a lane. An IMU of 1 kHz has two datagrams in a cycle.
  static constexpr int kMostBatches = 2;

  [[nodiscard]] DeviceError open(const UdpConfig& config, const SystemCalls& calls) noexcept;
  void close() noexcept { socket_.close(); }
  // Gives each datagram that has arrived to take(const Datagram&), at most kMostBatches * kBatch of them. True: there
  // may be more, and who calls in every cycle leaves them to the next. Never blocks.
  template <typename Take>
  [[nodiscard]] bool drain(Take&& take) noexcept {
    bool more = socket_.valid();
    for (int batch = 0; more && batch < kMostBatches; ++batch) {
      for (const Datagram& datagram : receive(more)) take(datagram);
    }
    if (more) count_up(counters_.cut_short);
    return more;
  }
  [[nodiscard]] const UdpCounters& counters() const noexcept { return counters_; }

 private:
  struct Slot {
    alignas(8) std::array<std::uint8_t, kMostBytes> bytes;
    alignas(8) std::array<std::uint8_t, 64> control;
    sockaddr_in sender;
    iovec vector;
  };

  // Has the kernel drop what is not the sender's before it takes room in the socket's buffer.
  void keep_others_out(int fd) const noexcept;
  // The batch's datagrams; more: the kernel may have others.
  [[nodiscard]] std::span<const Datagram> receive(bool& more) noexcept;
  void prepare() noexcept;
  [[nodiscard]] std::int64_t arrival_of(const msghdr& header, const ClockReading& now) noexcept;

  const SystemCalls* calls_ = nullptr;
  Descriptor socket_;
  in_addr_t sender_ = 0;       // network order, 0: anyone
  std::uint32_t dropped_ = 0;  // as the kernel counts
  UdpCounters counters_;
  std::array<Slot, kBatch> slots_{};
  std::array<mmsghdr, kBatch> messages_{};
  std::array<Datagram, kBatch> datagrams_{};
};

}  // namespace polygmap::hal
