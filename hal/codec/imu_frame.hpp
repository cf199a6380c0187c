// SPDX-License-Identifier: Apache-2.0
// One IMU sample on a serial line, a frame of 44 bytes, little-endian (docs/drivers.md has the table), and what finds
// frames in a stream of bytes. The format is this project's own: a microcontroller beside the IMU sends it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "hal/codec/byte_order.hpp"
#include "hal/codec/crc32.hpp"
#include "hal/codec/imu_limits.hpp"

namespace polygmap::codec {

struct ImuFrame {
  std::uint32_t sequence = 0;  // one more with every frame, wraps around
  std::int64_t stamp_ns = 0;   // the sender's clock
  std::array<float, 3> gyro_radps{};
  std::array<float, 3> accel_mps2{};

  [[nodiscard]] bool operator==(const ImuFrame&) const noexcept = default;
};

inline constexpr std::size_t kImuFrame_bytes = 44;
inline constexpr std::array<std::uint8_t, 4> kImuFrameStart{0xA5, 0x5A, 1, kImuFrame_bytes};  // mark, version, size

constexpr void encode(const ImuFrame& frame, std::span<std::uint8_t, kImuFrame_bytes> out) noexcept {
  std::copy(kImuFrameStart.begin(), kImuFrameStart.end(), out.begin());
  store_le(out, 4, frame.sequence);
  store_le(out, 8, static_cast<std::uint64_t>(frame.stamp_ns));
  for (std::size_t i = 0; i < 3; ++i) {
    store_f32(out, 16 + 4 * i, frame.gyro_radps[i]);
    store_f32(out, 28 + 4 * i, frame.accel_mps2[i]);
  }
  store_le(out, 40, crc32(Bytes(out).first(40)));
}

struct ImuFrameCounters {           // saturate
  std::uint32_t garbage_bytes = 0;  // between frames, and those of frames that were not good
  std::uint32_t corrupted = 0;      // a whole frame's length after a start, with another CRC-32
  std::uint32_t invalid = 0;        // a good CRC-32 around values that are not finite or out of range
};

// Finds frames in a stream. After garbage, a cut or a flipped bit it looks for the next start within what it has, so
// that at most the frames that were hit are lost.
class ImuFrameFinder {
 public:
  // The next byte of the stream. True when it completed a good frame.
  [[nodiscard]] constexpr bool push(std::uint8_t byte, ImuFrame& frame) noexcept {
    held_[size_++] = byte;
    if (size_ <= kImuFrameStart.size() && !starts_at(0)) drop_to_next_start();
    if (size_ < kImuFrame_bytes) return false;
    const Bytes bytes(held_);
    if (load_le<std::uint32_t>(bytes, 40) != crc32(bytes.first(40))) {
      count_up(counters_.corrupted);
      drop_to_next_start();
      return false;
    }
    size_ = 0;
    return read_values(bytes, frame);
  }
  // The line was cut: what is held belongs to no frame.
  constexpr void restart() noexcept {
    count_up(counters_.garbage_bytes, size_);
    size_ = 0;
  }
  [[nodiscard]] constexpr const ImuFrameCounters& counters() const noexcept { return counters_; }

 private:
  static constexpr void count_up(std::uint32_t& counter, std::size_t by = 1) noexcept {
    counter = static_cast<std::uint32_t>(std::min<std::uint64_t>(std::uint64_t{counter} + by, UINT32_MAX));
  }
  // What is held from there on may be the beginning of a frame.
  [[nodiscard]] constexpr bool starts_at(std::size_t at) const noexcept {
    const std::size_t known = std::min(size_ - at, kImuFrameStart.size());
    return std::equal(held_.begin() + at, held_.begin() + at + known, kImuFrameStart.begin());
  }
  constexpr void drop_to_next_start() noexcept {
    std::size_t at = 1;
    while (at < size_ && !starts_at(at)) ++at;
    count_up(counters_.garbage_bytes, at);
    std::copy(held_.begin() + at, held_.begin() + size_, held_.begin());
    size_ -= at;
  }
  [[nodiscard]] constexpr bool read_values(Bytes bytes, ImuFrame& frame) noexcept {
    ImuFrame read;
    read.sequence = load_le<std::uint32_t>(bytes, 4);
    const auto stamp_ns = load_le<std::uint64_t>(bytes, 8);
    bool good = stamp_ns < (std::uint64_t{1} << 62);
    read.stamp_ns = static_cast<std::int64_t>(stamp_ns);
    for (std::size_t i = 0; i < 3; ++i) {
      read.gyro_radps[i] = load_f32(bytes, 16 + 4 * i);
      read.accel_mps2[i] = load_f32(bytes, 28 + 4 * i);
      good = good && within(read.gyro_radps[i], kLargestImuRate_radps) &&
             within(read.accel_mps2[i], kLargestImuAccel_mps2);
    }
    if (good) {
      frame = read;
    } else {
      count_up(counters_.invalid);
    }
    return good;
  }

  std::array<std::uint8_t, kImuFrame_bytes> held_{};
  std::size_t size_ = 0;
  ImuFrameCounters counters_;
};

}  // namespace polygmap::codec
