// SPDX-License-Identifier: Apache-2.0
// Random numbers by counting: a pure function of (seed, stream, index). Any order of calls and any number of threads
// give the same values, and one consumer drawing more never shifts what another one draws.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "algorithms/core/math/math.hpp"

namespace polygmap::sim {

enum class Stream : std::uint64_t {
  kStairs = 1,
  kStart,
  kLegLengths,
  kEncoderOffsets,
  kEncoders,
  kJointRates,
  kImuMount,
  kGyroBias,
  kAccelBias,
  kGyro,
  kAccel,
  kLioWorld,
  kLioPosition,
  kLioRotation,
  kDepthScale,
  kDepthFrame,
  kDepthRows,
  kDepthEdges,
  kDepthWarp,
  kTables,
  kCameraMount,
  kTorques,
  kFootForces,
  kLioWalk,
  kReality,
  kStairErrors,
  kCameraFrames,
  kFatEdges,
  kTreadHoles,
  kSunPatch,
  kLidarMount,
  kWorld,
};

// Finaliser of SplitMix64 (Steele, Lea, Flood 2014): a bijection that passes the usual statistical batteries.
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t x) noexcept {
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31U);
}

class CounterNoise {
 public:
  constexpr CounterNoise(std::uint64_t seed, Stream stream) noexcept
      : key_(mix64(mix64(seed + kWeyl) ^ (static_cast<std::uint64_t>(stream) * kWeyl))) {}

  [[nodiscard]] constexpr std::uint64_t bits(std::uint64_t index) const noexcept { return mix64(key_ + index * kWeyl); }
  // In [0, 1), 53 bits.
  [[nodiscard]] constexpr double uniform(std::uint64_t index) const noexcept {
    return static_cast<double>(bits(index) >> 11U) * 0x1p-53;
  }
  [[nodiscard]] constexpr double uniform(std::uint64_t index, double low, double high) const noexcept {
    return low + (high - low) * uniform(index);
  }
  // Standard normal (Box-Muller, cosine branch).
  [[nodiscard]] double normal(std::uint64_t index) const noexcept {
    const std::uint64_t first = bits(index);
    const double u = (static_cast<double>(first >> 11U) + 0.5) * 0x1p-53;
    const double angle = static_cast<double>(mix64(first ^ kWeyl) >> 11U) * 0x1p-53 * 2.0 * std::numbers::pi;
    return std::sqrt(-2.0 * std::log(u)) * std::cos(angle);
  }
  // Three independent standard normals.
  [[nodiscard]] Vec3 normal3(std::uint64_t index) const noexcept {
    return {normal(3 * index), normal(3 * index + 1), normal(3 * index + 2)};
  }

 private:
  static constexpr std::uint64_t kWeyl = 0x9E3779B97F4A7C15ULL;
  std::uint64_t key_;
};

}  // namespace polygmap::sim
