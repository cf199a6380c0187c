// SPDX-License-Identifier: Apache-2.0
// The IMU datagram of a Livox Mid-360 (Livox-SDK2's LivoxLidarEthernetPacket with data type 0): a header of 36 bytes
// and six floats, little-endian (docs/drivers.md has the table).
#pragma once

#include <array>
#include <cstdint>

#include "hal/codec/byte_order.hpp"
#include "hal/codec/crc32.hpp"
#include "hal/codec/imu_limits.hpp"

namespace polygmap::codec {

enum class LivoxTime : std::uint8_t { kNone = 0, kPtp = 1, kGps = 2 };  // what the lidar's clock is synchronised to

struct LivoxImuPacket {
  std::uint16_t udp_count = 0;
  LivoxTime time = LivoxTime::kNone;
  std::int64_t stamp_ns = 0;  // the lidar's clock; of kNone since its start
  std::array<float, 3> gyro_radps{};
  std::array<float, 3> accel_mps2{};

  [[nodiscard]] bool operator==(const LivoxImuPacket&) const noexcept = default;
};

inline constexpr std::size_t kLivoxHeader_bytes = 36;
inline constexpr std::size_t kLivoxImuPacket_bytes = 60;
// The lidar measures acceleration in standard gravity.
inline constexpr float kStandardGravity_mps2 = 9.80665F;

enum class LivoxDecode : std::uint8_t {
  kGood,
  kShort,
  kLong,
  kForeign,    // another version of the header, or points instead of an IMU sample
  kCorrupted,  // CRC-32 over the stamp and the data
  kInvalid,    // a value that is not finite or out of its range
};

constexpr void encode(const LivoxImuPacket& packet, std::span<std::uint8_t, kLivoxImuPacket_bytes> out) noexcept {
  for (std::uint8_t& byte : out) byte = 0;
  store_le(out, 1, static_cast<std::uint16_t>(kLivoxImuPacket_bytes));
  store_le(out, 5, std::uint16_t{1});  // samples
  store_le(out, 7, packet.udp_count);
  out[11] = static_cast<std::uint8_t>(packet.time);
  store_le(out, 28, static_cast<std::uint64_t>(packet.stamp_ns));
  for (std::size_t i = 0; i < 3; ++i) {
    store_f32(out, 36 + 4 * i, packet.gyro_radps[i]);
    store_f32(out, 48 + 4 * i, packet.accel_mps2[i] / kStandardGravity_mps2);
  }
  store_le(out, 24, crc32(Bytes(out).subspan(28)));
}

// Any bytes. packet is written when the answer is kGood, and only then. With check_crc off whatever stands in the CRC's
// place is believed: Livox's own SDK does not look at it.
[[nodiscard]] constexpr LivoxDecode decode(Bytes bytes, bool check_crc, LivoxImuPacket& packet) noexcept {
  if (bytes.size() < kLivoxHeader_bytes) return LivoxDecode::kShort;
  if (bytes[0] != 0 || bytes[10] != 0) return LivoxDecode::kForeign;
  if (bytes.size() < kLivoxImuPacket_bytes) return LivoxDecode::kShort;
  if (bytes.size() > kLivoxImuPacket_bytes) return LivoxDecode::kLong;
  if (check_crc && load_le<std::uint32_t>(bytes, 24) != crc32(bytes.subspan(28))) return LivoxDecode::kCorrupted;
  const bool one_whole =
      load_le<std::uint16_t>(bytes, 1) == kLivoxImuPacket_bytes && load_le<std::uint16_t>(bytes, 5) == 1;
  const auto stamp_ns = load_le<std::uint64_t>(bytes, 28);
  if (!one_whole || bytes[11] > 2 || stamp_ns >= (std::uint64_t{1} << 62)) return LivoxDecode::kInvalid;
  LivoxImuPacket read;
  read.udp_count = load_le<std::uint16_t>(bytes, 7);
  read.time = static_cast<LivoxTime>(bytes[11]);
  read.stamp_ns = static_cast<std::int64_t>(stamp_ns);
  for (std::size_t i = 0; i < 3; ++i) {
    read.gyro_radps[i] = load_f32(bytes, 36 + 4 * i);
    const float accel_g = load_f32(bytes, 48 + 4 * i);
    // Before the product: it must not overflow.
    if (!within(read.gyro_radps[i], kLargestImuRate_radps)) return LivoxDecode::kInvalid;
    if (!within(accel_g, kLargestImuAccel_mps2 / kStandardGravity_mps2)) return LivoxDecode::kInvalid;
    read.accel_mps2[i] = accel_g * kStandardGravity_mps2;
  }
  packet = read;
  return LivoxDecode::kGood;
}

}  // namespace polygmap::codec
