// SPDX-License-Identifier: Apache-2.0
// Scalar measurements of one moment, taken one after the other as a Kalman filter does, but with the covariance changed
// only once for all of them: its rows and columns are read and written once, not once per measurement. The result is
// that of the measurements one by one. Its loops are plain: the compiler makes vectors of them.
#pragma once

#include <algorithm>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

template <int States, int MaxRows>
class RowBatch {
 public:
  using Vector = Eigen::Matrix<double, States, 1>;
  using Covariance = Eigen::Matrix<double, States, States>;

  // P H' of the covariance before the batch becomes that after the rows taken so far. row: double(const Vector&), H x.
  void condition(Vector& PHt, const auto& row, int first = 0) const noexcept {
    for (int k = first; k < rows_; ++k) {
      const double share = row(column(k));
      const double* const taken = column(k).data();
      double* const out = PHt.data();
      for (int i = 0; i < States; ++i) out[i] -= share * taken[i];
    }
  }
  // A conditioned row. innovation: of the state before the batch; variance: of the measurement.
  void take(const Vector& PHt, const auto& row, double innovation, double variance) noexcept {
    const double s = row(PHt) + variance;
    if (!(s > 0.0)) return;
    const double inverse_root = 1.0 / math::sqrt(s);
    Vector& scaled = columns_[static_cast<std::size_t>(rows_++)];
    scaled = inverse_root * PHt;
    error_ += (inverse_root * (innovation - row(error_))) * scaled;
  }
  [[nodiscard]] int rows() const noexcept { return rows_; }
  // By what the state is off, as the rows taken so far tell.
  [[nodiscard]] const Vector& error() const noexcept { return error_; }
  void shrink(Covariance& P) const noexcept {
    int k = 0;
    if constexpr (MaxRows >= 6) {
      for (; k + 6 <= rows_; k += 6) subtract<6>(k, P);
    }
    if constexpr (MaxRows >= 4) {
      for (; k + 4 <= rows_; k += 4) subtract<4>(k, P);
    }
    for (; k < rows_; ++k) subtract<1>(k, P);
    mirror(P);
  }

 private:
  // P is symmetric: it is changed from its diagonal on downwards, in bands of columns, and copied above in the end.
  static constexpr int kBand = 8;

  template <int Count, int First = 0>
  void subtract(int first, Covariance& P) const noexcept {
    constexpr int kEnd = std::min(First + kBand, States);
    std::array<const double*, Count> taken;
    for (int k = 0; k < Count; ++k) taken[static_cast<std::size_t>(k)] = column(first + k).data();
    int j = First;
    for (; j + 1 < kEnd; j += 2) subtract_from_two<Count, First>(taken, j, P.col(j).data(), P.col(j + 1).data());
    for (int i = First; i < States && j < kEnd; ++i) {  // an odd one
      double sum = 0.0;
      for (const double* const t : taken) sum += t[i] * t[j];
      P(i, j) -= sum;
    }
    if constexpr (kEnd < States) subtract<Count, kEnd>(first, P);
  }
  // Two columns at once: what is taken is read once for both. Apart from each other, which the compiler is told.
  template <int Count, int First>
  static void subtract_from_two(const std::array<const double*, Count>& taken, int j, double* __restrict left,
                                double* __restrict right) noexcept {
    for (int i = First; i < States; ++i) {
      double left_sum = 0.0, right_sum = 0.0;
      for (const double* const t : taken) {
        left_sum += t[i] * t[j];
        right_sum += t[i] * t[j + 1];
      }
      left[i] -= left_sum;
      right[i] -= right_sum;
    }
  }
  template <int First = 0>
  static void mirror(Covariance& P) noexcept {
    constexpr int kEnd = std::min(First + kBand, States), kBelow = States - kEnd;
    if constexpr (kBelow > 0) {
      P.template block<kEnd - First, kBelow>(First, kEnd) =
          P.template block<kBelow, kEnd - First>(kEnd, First).transpose();
      mirror<kEnd>(P);
    }
  }
  [[nodiscard]] const Vector& column(int k) const noexcept { return columns_[static_cast<std::size_t>(k)]; }

  std::array<Vector, MaxRows> columns_;  // P H' / sqrt(s)
  Vector error_ = Vector::Zero();
  int rows_ = 0;
};

}  // namespace polygmap
