// SPDX-License-Identifier: Apache-2.0
// One number for all bits of what the module puts out, field by field: what two builds must have in common.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/surfaces.hpp"

namespace polygmap::test {

// FNV-1a.
class BitHash {
 public:
  void add(std::uint64_t value) {
    for (int shift = 0; shift < 64; shift += 8) {
      value_ = (value_ ^ (value >> shift & 0xFFU)) * 0x100000001B3U;
    }
  }
  // Every NaN is the same: its sign and payload are the processor's.
  void add(double value) { add(std::isnan(value) ? ~std::uint64_t{0} : std::bit_cast<std::uint64_t>(value)); }
  template <typename Matrix>
  void add_all(const Matrix& matrix) {
    for (Eigen::Index i = 0; i < matrix.size(); ++i) add(matrix.data()[i]);
  }
  void add(const Transform& a_T_b) { add_all(a_T_b.R), add_all(a_T_b.p_m); }
  void add(const EdgeLine& line) {
    add(std::uint64_t{line.valid});
    if (!line.valid) return;
    add_all(line.a_m), add_all(line.b_m), add(line.sigma_m);
  }
  void add(const SurfacePatch& s) {
    add(static_cast<std::uint64_t>(s.kind)), add(std::uint64_t{s.plane}), add(s.d_m), add(s.offset_sigma_m);
    add(s.tilt_sigma_rad), add(s.area_m2), add(s.rmse_m), add(s.invalid_fraction);
    add_all(s.normal), add_all(s.centroid_m), add_all(s.covariance);
    add(s.nosing), add(s.back), add(std::uint64_t{s.polygon.size()});
    for (std::size_t i = 0; i < s.polygon.size(); ++i) {
      add_all(s.polygon[i]), add(static_cast<std::uint64_t>(s.edges[i]));
    }
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325U;
};

}  // namespace polygmap::test
