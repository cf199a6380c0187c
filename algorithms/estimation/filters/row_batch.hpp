// SPDX-License-Identifier: Apache-2.0
// Scalar measurements of one moment, taken one after the other as a Kalman filter does, but with the covariance changed
// only once for all of them: its rows and columns are read and written once, not once per measurement. The result is
// that of the measurements one by one. Its loops are plain: the compiler makes vectors of them.
#pragma once

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
    for (; k + 2 <= rows_; k += 2) subtract<2>(k, P);
    if (k < rows_) subtract<1>(k, P);
  }

 private:
  template <int Count>
  void subtract(int first, Covariance& P) const noexcept {
    std::array<const double*, Count> taken;
    for (int k = 0; k < Count; ++k) taken[static_cast<std::size_t>(k)] = column(first + k).data();
    for (int j = 0; j < States; ++j) {
      double* const out = P.data() + j * States;
      for (int i = 0; i < States; ++i) {
        double sum = 0.0;
        for (const double* const t : taken) sum += t[i] * t[j];
        out[i] -= sum;  // symmetric to the last bit
      }
    }
  }
  [[nodiscard]] const Vector& column(int k) const noexcept { return columns_[static_cast<std::size_t>(k)]; }

  std::array<Vector, MaxRows> columns_;  // P H' / sqrt(s)
  Vector error_ = Vector::Zero();
  int rows_ = 0;
};

}  // namespace polygmap
