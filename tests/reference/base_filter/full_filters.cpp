// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/base_filter/full_filters.hpp"

#include <Eigen/Dense>

namespace polygmap::reference {

void DenseFilter::predict(const Vec3& accel_mps2, double dt_s, const FullStep& step) {
  const FullCovariance A = transition(dt_s);
  x_ = A * x_ + input(dt_s) * accel_mps2;
  P_ = A * P_ * A.transpose() + step.Q;
}

void DenseFilter::correct(const FullStep& step) {
  FullObservation H = observation();
  FullMeasurements y = step.y;
  FullNoise R = step.R;
  for (int row = 0; row < kFullRows; ++row) {
    if (step.known[static_cast<std::size_t>(row)]) continue;
    H.row(row).setZero();
    y[row] = 0.0;
    R.row(row).setZero();
    R.col(row).setZero();
    R(row, row) = 1.0;
  }
  const FullNoise S = H * P_ * H.transpose() + R;
  const Eigen::Matrix<double, kFullStates, kFullRows> K = S.llt().solve(H * P_).transpose();
  x_ += K * (y - H * x_);
  const FullCovariance J = FullCovariance::Identity() - K * H;
  P_ = J * P_ * J.transpose() + K * R * K.transpose();
}

void SequentialFilter::predict(const Vec3& accel_mps2, double dt_s, const FullStep& step) {
  x_.segment<3>(0) += dt_s * x_.segment<3>(3) + 0.5 * dt_s * dt_s * accel_mps2;
  x_.segment<3>(3) += dt_s * accel_mps2;
  P_.topRows<3>() += dt_s * P_.middleRows<3>(3);
  P_.leftCols<3>() += dt_s * P_.middleCols<3>(3);
  P_ += step.Q;
}

void SequentialFilter::correct(const FullStep& step) {
  if (step.R.isDiagonal(0.0)) {
    correct_known_rows(step);
  } else {
    correct_whitened(step);
  }
}

void SequentialFilter::correct_row(const FullRow& row, double measurement, double variance) {
  const FullState PHt = P_ * row.transpose();
  const FullState gain = PHt / (row * PHt + variance);
  x_ += gain * (measurement - row * x_);
  P_ -= gain * PHt.transpose();
}

void SequentialFilter::correct_known_rows(const FullStep& step) {
  const FullObservation H = observation();
  for (int row = 0; row < kFullRows; ++row) {
    if (step.known[static_cast<std::size_t>(row)]) correct_row(H.row(row), step.y[row], step.R(row, row));
  }
}

void SequentialFilter::correct_whitened(const FullStep& step) {
  const FullObservation H = observation();
  FullObservation whitened;
  FullMeasurements y;
  FullNoise L = FullNoise::Zero();  // Cholesky's factor of the known rows' noise, row by row
  int count = 0;
  std::array<int, kFullRows> known{};
  for (int row = 0; row < kFullRows; ++row) {
    if (!step.known[static_cast<std::size_t>(row)]) continue;
    whitened.row(count) = H.row(row);
    y[count] = step.y[row];
    for (int k = 0; k < count; ++k) {
      L(count, k) =
          (step.R(row, known[static_cast<std::size_t>(k)]) - L.row(count).head(k).dot(L.row(k).head(k))) / L(k, k);
      whitened.row(count) -= L(count, k) * whitened.row(k);
      y[count] -= L(count, k) * y[k];
    }
    L(count, count) = math::sqrt(step.R(row, row) - L.row(count).head(count).squaredNorm());
    whitened.row(count) /= L(count, count);
    y[count] /= L(count, count);
    known[static_cast<std::size_t>(count++)] = row;
  }
  for (int k = 0; k < count; ++k) correct_row(whitened.row(k), y[k], 1.0);
}

void DynamicFilter::initialise(const BaseFilter& axes) {
  FullState x;
  FullCovariance P;
  take_over(axes, x, P);
  x_ = x;
  P_ = P;
  H_ = observation();
}

void DynamicFilter::predict(const Vec3& accel_mps2, double dt_s, const FullStep& step) {
  const Eigen::MatrixXd A = transition(dt_s), B = input(dt_s);
  x_ = A * x_ + B * accel_mps2;
  P_ = A * P_ * A.transpose() + step.Q;
}

void DynamicFilter::correct(const FullStep& step) {
  const Eigen::MatrixXd S = H_ * P_ * H_.transpose() + step.R;
  const Eigen::MatrixXd PHt = P_ * H_.transpose();
  const Eigen::VectorXd innovation = step.y - H_ * x_;
  x_ += PHt * S.lu().solve(innovation);
  const Eigen::MatrixXd SHP = S.lu().solve(H_ * P_);
  P_ -= PHt * SHP;
  P_ = Eigen::MatrixXd(0.5 * (P_ + P_.transpose()));
}

}  // namespace polygmap::reference
