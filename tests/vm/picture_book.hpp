// SPDX-License-Identifier: Apache-2.0
// Pictures of a climb, rendered beforehand on the host, each with the pose that it was taken from: the robot in the
// guest, which cannot render in time, shows the one that was taken from where it is.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap::vm {

inline constexpr std::uint64_t kBookMagic = 0x31'4B'4F'4F'42'4D'50'50;  // "PPMBOOK1"

// Where the robot was in the middle of the exposure.
struct PictureKey {
  std::array<double, 3> p_m{};
  std::array<double, 9> R{};
  std::array<double, kJointCount> q_rad{};

  [[nodiscard]] static PictureKey of(const Transform& true_T_base, const JointVector& true_q_rad) noexcept {
    PictureKey key;
    for (int i = 0; i < 3; ++i) key.p_m[static_cast<std::size_t>(i)] = true_T_base.p_m[i];
    for (int i = 0; i < 9; ++i) key.R[static_cast<std::size_t>(i)] = true_T_base.R(i / 3, i % 3);
    for (std::size_t j = 0; j < kJointCount; ++j) key.q_rad[j] = true_q_rad[static_cast<Eigen::Index>(j)];
    return key;
  }
  // By how much the pictures of both differ, m: what turns is weighted with how far off it is seen, or is seen to move.
  [[nodiscard]] double distance2_m2(const PictureKey& other) const noexcept {
    constexpr double kSeen_m = 0.7, kLeg_m = 0.2;
    return sum2(p_m, other.p_m) + 0.5 * kSeen_m * kSeen_m * sum2(R, other.R) +
           kLeg_m * kLeg_m * sum2(q_rad, other.q_rad);
  }

 private:
  template <std::size_t N>
  [[nodiscard]] static double sum2(const std::array<double, N>& a, const std::array<double, N>& b) noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < N; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum;
  }
};
static_assert(sizeof(PictureKey) == 24 * sizeof(double), "written as it lies in memory");

struct BookHeader {
  std::uint64_t magic = kBookMagic;
  std::uint64_t count = 0;
  std::uint64_t picture_px = 0;
};

// The file in memory: the header, all keys, all pixels.
class PictureBook {
 public:
  // False: it is no such file.
  [[nodiscard]] bool open(std::span<const char> file) noexcept {
    BookHeader header;
    if (file.size() < sizeof header) return false;
    std::memcpy(&header, file.data(), sizeof header);
    const std::uint64_t each = sizeof(PictureKey) + sizeof(std::uint16_t) * header.picture_px;
    if (header.magic != kBookMagic || header.count == 0 || header.count > file.size() / each ||
        file.size() != sizeof header + header.count * each)
      return false;
    keys_.resize(header.count);
    std::memcpy(keys_.data(), file.data() + sizeof header, header.count * sizeof(PictureKey));
    pixels_ = file.data() + sizeof header + header.count * sizeof(PictureKey);
    picture_px_ = header.picture_px;
    return true;
  }
  [[nodiscard]] std::size_t count() const noexcept { return keys_.size(); }
  [[nodiscard]] std::size_t picture_px() const noexcept { return picture_px_; }
  // Of the n-th picture, sizeof(uint16_t) * picture_px() bytes.
  [[nodiscard]] const char* pixels(std::size_t n) const noexcept {
    return pixels_ + n * sizeof(std::uint16_t) * picture_px_;
  }
  // The picture nearest to where the robot is, not far from the one shown last; of several as near the first that was
  // not shown: a robot that stands sees another noise in every picture.
  [[nodiscard]] std::size_t nearest(const PictureKey& now, std::size_t last, double& distance2_m2) const noexcept {
    constexpr std::size_t kBack = 40, kAhead = 200;
    constexpr double kAsNear_m = 5e-4;
    const std::size_t from = last < kBack ? 0 : last - kBack, to = std::min(last + kAhead, keys_.size());
    std::size_t best = from;
    distance2_m2 = keys_[from].distance2_m2(now);
    for (std::size_t n = from + 1; n < to; ++n) {
      const double d2 = keys_[n].distance2_m2(now);
      if (d2 < distance2_m2) distance2_m2 = d2, best = n;
    }
    const double as_near_m = std::sqrt(distance2_m2) + kAsNear_m;
    for (std::size_t n = last + 1; n < to; ++n) {
      if (keys_[n].distance2_m2(now) <= as_near_m * as_near_m) return n;
    }
    return best;
  }

 private:
  std::vector<PictureKey> keys_;
  const char* pixels_ = nullptr;
  std::size_t picture_px_ = 0;
};

}  // namespace polygmap::vm
