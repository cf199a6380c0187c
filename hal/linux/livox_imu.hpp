// SPDX-License-Identifier: Apache-2.0
// The IMU of a Livox Mid-360 from UDP datagrams (hal/codec/livox_packet.hpp). The lidar sends once it is told to, which
// is not done here: what starts its points starts its IMU.
#pragma once

#include <cstdint>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/codec/livox_packet.hpp"
#include "hal/linux/system/udp_socket.hpp"
#include "hal/ports/imu.hpp"

namespace polygmap::hal {

class LivoxImu final : public Imu {
 public:
  struct Config {
    UdpConfig udp{.port = 56401};  // the lidar's 56400, plus one
    bool check_crc = true;
    // The lidar's clock runs since its start, or is PTP's or GPS's: an estimate serves them all. 200 Hz.
    SampleClock::Params time{.base = TimeBase::kEstimated};
    Mat3 base_R_imu = Mat3::Identity();  // a rotation; what the lever arm adds to the acceleration is not taken off
  };
  struct Counters {  // saturate; of every datagram one rises, clock_changed, missing and overwritten beside
    std::uint32_t good = 0;
    std::uint32_t foreign = 0;  // another header version, or points
    std::uint32_t too_short = 0;
    std::uint32_t too_long = 0;
    std::uint32_t corrupted = 0;
    std::uint32_t invalid = 0;
    std::uint32_t repeated = 0;      // the last stamp again
    std::uint32_t out_of_order = 0;  // an earlier stamp
    TimeCounters time{};
    std::uint32_t clock_changed = 0;  // to another time_type: the offset is estimated anew
    std::uint32_t missing = 0;        // numbers (udp_count) that no datagram had
    std::uint32_t overwritten = 0;    // good samples that nobody read
  };
  static constexpr std::size_t kQueue = 16;
  static constexpr std::uint16_t kFarthest =
      100;  // in datagrams: beyond that the lidar started anew, nothing is missing

  explicit LivoxImu(const SystemCalls& calls = kernel_calls()) noexcept : calls_(calls) {}
  [[nodiscard]] DeviceError open(const Config& config) noexcept;
  void close() noexcept { socket_.close(); }

  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const UdpCounters& udp_counters() const noexcept { return socket_.counters(); }

 private:
  void take(const Datagram& datagram) noexcept;
  void count_missing(std::uint16_t udp_count) noexcept;
  [[nodiscard]] bool decoded(const Datagram& datagram, codec::LivoxImuPacket& packet) noexcept;

  const SystemCalls& calls_;
  UdpSocket socket_;
  bool check_crc_ = true;
  Mat3 base_R_imu_ = Mat3::Identity();
  SampleClock clock_;
  bool started_ = false;
  codec::LivoxTime time_ = codec::LivoxTime::kNone;
  std::uint16_t udp_count_ = 0;  // of the newest datagram
  std::int64_t last_stamp_ns_ = INT64_MIN;
  RingBuffer<ImuSample, kQueue> waiting_;
  bool cut_short_ = false;  // the socket has more, which waits for the next cycle
  Counters counters_;
};

}  // namespace polygmap::hal
