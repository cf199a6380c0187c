// SPDX-License-Identifier: Apache-2.0
// One pose of a lidar odometry in a UDP datagram of 132 bytes, little-endian (docs/drivers.md has the table). The
// format is this project's own: a lidar odometry's node sends it by some twenty lines.
#pragma once

#include <array>
#include <cstdint>

#include "hal/codec/byte_order.hpp"
#include "hal/codec/crc32.hpp"

namespace polygmap::codec {

struct LioPacket {
  std::uint32_t sequence = 0;                       // one more with every packet, wraps around
  std::int64_t stamp_ns = 0;                        // of the scan, in the sender's clock
  std::array<double, 3> position_m{};               // lio_T_lidar
  std::array<double, 4> rotation_wxyz{1, 0, 0, 0};  // lio_T_lidar, unit quaternion
  std::array<double, 3> position_sigma_m{};
  std::array<double, 3> rotation_sigma_rad{};

  [[nodiscard]] bool operator==(const LioPacket&) const noexcept = default;
};

inline constexpr std::uint32_t kLioMagic = 0x4F494C50;  // the bytes "PLIO"
inline constexpr std::uint16_t kLioVersion = 1;
inline constexpr std::size_t kLioPacket_bytes = 132;
inline constexpr std::int64_t kLargestStamp_ns = std::int64_t{1} << 62;  // 146 years: sums of two do not overflow
inline constexpr double kLioLargestPosition_m = 1e5;
inline constexpr double kLioLargestSigma = 100.0;  // m, rad
inline constexpr double kLioNormTolerance = 1e-3;  // of the squared norm of the quaternion

enum class LioDecode : std::uint8_t {
  kGood,
  kShort,
  kForeign,  // another magic
  kWrongVersion,
  kLong,
  kCorrupted,  // CRC-32
  kInvalid,    // a value that is not finite or out of its range
};

constexpr void encode(const LioPacket& packet, std::span<std::uint8_t, kLioPacket_bytes> out) noexcept {
  store_le(out, 0, kLioMagic);
  store_le(out, 4, kLioVersion);
  store_le(out, 6, static_cast<std::uint16_t>(kLioPacket_bytes));
  store_le(out, 8, packet.sequence);
  store_le(out, 12, std::uint32_t{0});
  store_le(out, 16, static_cast<std::uint64_t>(packet.stamp_ns));
  for (std::size_t i = 0; i < 3; ++i) {
    store_f64(out, 24 + 8 * i, packet.position_m[i]);
    store_f64(out, 80 + 8 * i, packet.position_sigma_m[i]);
    store_f64(out, 104 + 8 * i, packet.rotation_sigma_rad[i]);
  }
  for (std::size_t i = 0; i < 4; ++i) store_f64(out, 48 + 8 * i, packet.rotation_wxyz[i]);
  store_le(out, 128, crc32(Bytes(out).first(128)));
}

namespace detail {
[[nodiscard]] constexpr bool valid(const LioPacket& p) noexcept {
  double norm2 = 0.0;
  for (const double q : p.rotation_wxyz) {
    if (!within(q, 2.0)) return false;
    norm2 += q * q;
  }
  if (!within(norm2 - 1.0, kLioNormTolerance)) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!within(p.position_m[i], kLioLargestPosition_m)) return false;
    if (!(p.position_sigma_m[i] > 0.0 && p.position_sigma_m[i] <= kLioLargestSigma)) return false;
    if (!(p.rotation_sigma_rad[i] > 0.0 && p.rotation_sigma_rad[i] <= kLioLargestSigma)) return false;
  }
  return p.stamp_ns >= 0 && p.stamp_ns < kLargestStamp_ns;
}
}  // namespace detail

// Any bytes. packet is written when the answer is kGood, and only then.
[[nodiscard]] constexpr LioDecode decode(Bytes bytes, LioPacket& packet) noexcept {
  if (bytes.size() < 4) return LioDecode::kShort;
  if (load_le<std::uint32_t>(bytes, 0) != kLioMagic) return LioDecode::kForeign;
  if (bytes.size() < 8) return LioDecode::kShort;
  if (load_le<std::uint16_t>(bytes, 4) != kLioVersion) return LioDecode::kWrongVersion;
  if (bytes.size() < kLioPacket_bytes) return LioDecode::kShort;
  if (bytes.size() > kLioPacket_bytes) return LioDecode::kLong;
  if (load_le<std::uint32_t>(bytes, 128) != crc32(bytes.first(128))) return LioDecode::kCorrupted;
  if (load_le<std::uint16_t>(bytes, 6) != kLioPacket_bytes) return LioDecode::kInvalid;
  LioPacket read;
  read.sequence = load_le<std::uint32_t>(bytes, 8);
  read.stamp_ns = static_cast<std::int64_t>(load_le<std::uint64_t>(bytes, 16));
  for (std::size_t i = 0; i < 3; ++i) {
    read.position_m[i] = load_f64(bytes, 24 + 8 * i);
    read.position_sigma_m[i] = load_f64(bytes, 80 + 8 * i);
    read.rotation_sigma_rad[i] = load_f64(bytes, 104 + 8 * i);
  }
  for (std::size_t i = 0; i < 4; ++i) read.rotation_wxyz[i] = load_f64(bytes, 48 + 8 * i);
  if (!detail::valid(read)) return LioDecode::kInvalid;
  packet = read;
  return LioDecode::kGood;
}

}  // namespace polygmap::codec
