// SPDX-License-Identifier: Apache-2.0
// Where a line of pixels passes from one plane to another.
#pragma once

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {

// Every pixel gains cost(first plane) - cost(second plane), nothing without data; the most likely change-point is where
// the sum of the gains so far is least. T: a number, or a vector of as many searches side by side.
template <typename T>
struct ChangePoint {
  T sum;    // of the gains so far
  T least;  // that it was, 0 before the first pixel
  T at;     // the last pixel before the change

  // The next pixel. Whether the sum is now less than ever before.
  auto add(const T& gain, const T& pixel) noexcept {
    sum = sum + gain;
    return offer(sum, pixel, sum < least);
  }
  // A sum that was made elsewhere. better: less than the least, and whatever else it must be.
  template <typename Mask>
  Mask offer(const T& offered, const T& pixel, const Mask& better) noexcept {
    least = choose(better, offered, least);
    at = choose(better, pixel, at);
    return better;
  }

 private:
  static double choose(bool first, double a, double b) noexcept { return first ? a : b; }
  template <typename V>
  static V choose(const V& first, const V& a, const V& b) noexcept {
    return cv::v_select(first, a, b);
  }
};

}  // namespace polygmap
