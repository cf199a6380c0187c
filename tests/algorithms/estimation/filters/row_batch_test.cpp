// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/filters/row_batch.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace polygmap {
namespace {

constexpr int kStates = 5, kRows = 7;  // one batch of six rows and one more
using Batch = RowBatch<kStates, kRows>;

TEST(RowBatch, ManyRows_AreThoseOfAKalmanFilterThatTakesThemAllAtOnce) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, kStates, kStates> A;
  Eigen::Matrix<double, kRows, kStates> H;
  Eigen::Matrix<double, kRows, 1> innovation, variance;
  for (double& a : A.reshaped()) a = normal(random);
  for (double& h : H.reshaped()) h = normal(random);
  for (double& i : innovation) i = normal(random);
  for (double& v : variance) v = 0.1 + std::abs(normal(random));
  const Batch::Covariance before = A * A.transpose();

  Batch batch;
  for (int i = 0; i < kRows; ++i) {
    const auto row = [&, i](const Batch::Vector& x) { return H.row(i).dot(x); };
    Batch::Vector PHt = before * H.row(i).transpose();
    batch.condition(PHt, row);
    batch.take(PHt, row, innovation[i], variance[i]);
  }
  Batch::Covariance after = before;
  batch.shrink(after);

  Eigen::Matrix<double, kRows, kRows> S = H * before * H.transpose();
  S.diagonal() += variance;
  const Eigen::Matrix<double, kStates, kRows> gain = before * H.transpose() * S.inverse();
  EXPECT_EQ(batch.rows(), kRows);
  EXPECT_LT((batch.error() - gain * innovation).norm(), 1e-9);
  EXPECT_LT((after - (before - gain * H * before)).norm(), 1e-9);
  EXPECT_EQ(after, Batch::Covariance(after.transpose()));
}

TEST(RowBatch, RowOfNoVariance_IsLeftOut) {
  Batch batch;
  batch.take(
      Batch::Vector::Zero(), [](const Batch::Vector& x) { return x[0]; }, 1.0, 0.0);
  EXPECT_EQ(batch.rows(), 0);
  EXPECT_EQ(batch.error(), Batch::Vector(Batch::Vector::Zero()));
}

}  // namespace
}  // namespace polygmap
