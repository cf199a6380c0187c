// SPDX-License-Identifier: Apache-2.0
// Poses of a lidar odometry from UDP datagrams (hal/codec/lio_packet.hpp).
#pragma once

#include <cstdint>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/codec/lio_packet.hpp"
#include "hal/linux/sequence_watch.hpp"
#include "hal/linux/system/udp_socket.hpp"
#include "hal/ports/lidar_odometry.hpp"

namespace polygmap::hal {

class LioUdp final : public LidarOdometry {
 public:
  struct Config {
    UdpConfig udp{};
    // kMonotonic: the odometry runs on this machine and stamps in CLOCK_MONOTONIC. What it takes to compute varies by
    // up to a scan; later than that it leaves scans out.
    SampleClock::Params time{.offset = {.jump_ns = 100 * kNsPerMs}};
    SequenceWatch::Params sequence{};
  };
  struct Counters {  // saturate; of every datagram one rises, missing, restarts and overwritten beside
    std::uint32_t good = 0;
    std::uint32_t foreign = 0;  // another magic
    std::uint32_t wrong_version = 0;
    std::uint32_t too_short = 0;
    std::uint32_t too_long = 0;
    std::uint32_t corrupted = 0;
    std::uint32_t invalid = 0;
    SequenceCounters sequence{};  // a stamp that does not increase counts as out of order
    TimeCounters time{};
    std::uint32_t overwritten = 0;  // good poses that nobody read
  };
  static constexpr std::size_t kQueue = 16;

  explicit LioUdp(const SystemCalls& calls = kernel_calls()) noexcept : calls_(calls) {}
  [[nodiscard]] DeviceError open(const Config& config) noexcept;
  void close() noexcept { socket_.close(); }

  [[nodiscard]] bool try_read(LioSample& sample) noexcept override;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const UdpCounters& udp_counters() const noexcept { return socket_.counters(); }

 private:
  void take(const Datagram& datagram) noexcept;
  [[nodiscard]] bool decoded(const Datagram& datagram, codec::LioPacket& packet) noexcept;

  const SystemCalls& calls_;
  UdpSocket socket_;
  SampleClock clock_;
  SequenceWatch watch_;
  bool stamped_here_ = true;
  std::int64_t last_stamp_ns_ = INT64_MIN;
  RingBuffer<LioSample, kQueue> waiting_;
  bool cut_short_ = false;  // the socket has more, which waits for the next cycle
  Counters counters_;
};

}  // namespace polygmap::hal
