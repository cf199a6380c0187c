// SPDX-License-Identifier: Apache-2.0
// An IMU on a serial line (hal/codec/imu_frame.hpp).
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/codec/imu_frame.hpp"
#include "hal/linux/sequence_watch.hpp"
#include "hal/linux/system/descriptor.hpp"
#include "hal/linux/system/device_error.hpp"
#include "hal/linux/system/time_base.hpp"
#include "hal/ports/imu.hpp"

namespace polygmap::hal {

class SerialImu final : public Imu {
 public:
  struct Config {
    FixedText<63> device{};        // "/dev/ttyTHS1"
    std::uint32_t baud = 921'600;  // one of the kernel's; a frame takes 440 bits
    SampleClock::Params time{.base = TimeBase::kEstimated};
    SequenceWatch::Params sequence{};
    Mat3 base_R_imu = Mat3::Identity();  // a rotation
  };
  struct Counters {  // saturate; of every whole frame one rises, missing, restarts and overwritten beside
    std::uint32_t good = 0;
    SequenceCounters sequence{};  // a stamp that does not increase counts as out of order
    TimeCounters time{};
    std::uint32_t overwritten = 0;  // good samples that nobody read
    std::uint32_t hang_ups = 0;     // the line's other end, or the adapter, is gone
    std::uint32_t interrupted = 0;
    std::uint32_t failed_calls = 0;
  };
  static constexpr std::size_t kQueue = 32;

  explicit SerialImu(const SystemCalls& calls = kernel_calls()) noexcept : calls_(calls) {}
  [[nodiscard]] DeviceError open(const Config& config) noexcept;
  void close() noexcept;
  // Opens a line anew that was lost; each call tries once. Outside the lanes: a serial adapter takes its time.
  void maintain() noexcept;

  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override;
  [[nodiscard]] bool is_lost() const noexcept { return owner_.is_lost(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const codec::ImuFrameCounters& frame_counters() const noexcept { return finder_.counters(); }
  [[nodiscard]] const ReopenCounters& reopen_counters() const noexcept { return reopens_; }

 private:
  static constexpr std::size_t kRead_bytes = 1024;
  static constexpr int kMostReads = 4;  // of one port call

  [[nodiscard]] DeviceError open_line() noexcept;
  [[nodiscard]] DeviceError set_line(int fd) noexcept;
  // One read; true: there may be more.
  [[nodiscard]] bool read_some() noexcept;
  void lose() noexcept;
  void take(const codec::ImuFrame& frame, std::int64_t arrival_ns) noexcept;

  const SystemCalls& calls_;
  Config config_;
  DeviceOwner owner_;
  Descriptor line_;
  codec::ImuFrameFinder finder_;
  SampleClock clock_;
  SequenceWatch watch_;
  std::int64_t last_stamp_ns_ = INT64_MIN;
  RingBuffer<ImuSample, kQueue> waiting_;
  std::array<std::uint8_t, kRead_bytes> bytes_{};
  Counters counters_;
  ReopenCounters reopens_;
};

}  // namespace polygmap::hal
