// SPDX-License-Identifier: Apache-2.0
// Weighted least squares of a line through points.
#pragma once

namespace polygmap {

// y = a + b x. T: a number, or a vector of as many lines side by side.
template <typename T>
struct LineSums {
  T n, x, y, xx, xy;  // sums of the weight, and of it times these
  void add(const T& g, const T& px, const T& py) noexcept {
    n = n + g, x = x + g * px, y = y + g * py, xx = xx + g * px * px, xy = xy + g * px * py;
  }
};

// False when the points lie at one x.
[[nodiscard]] inline bool try_solve(const LineSums<double>& sums, double& a, double& b) noexcept {
  const double determinant = sums.n * sums.xx - sums.x * sums.x;
  if (!(sums.n > 0.0) || !(determinant > 1e-12 * sums.n * sums.n)) return false;
  b = (sums.n * sums.xy - sums.x * sums.y) / determinant;
  a = (sums.y - b * sums.x) / sums.n;
  return true;
}

}  // namespace polygmap
