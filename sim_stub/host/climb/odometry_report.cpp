// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/odometry_report.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/plant/plant.hpp"

namespace polygmap::sim {
namespace {

constexpr std::int64_t kTruthPast_ns = 2 * kNsPerS;
constexpr std::size_t kSecond_ticks = static_cast<std::size_t>(1.0 / kPlantTick_s);
// Two-sided 95 % bounds of chi squared with three degrees of freedom.
constexpr double kPositionNeesLow = 0.2158, kPositionNeesHigh = 9.3484;

// World a in world b, from two poses of one body: heading and place.
Transform aligned_worlds(const Transform& a_T_body, const Transform& b_T_body) {
  const Mat3 R = rotation_z(yaw_of(a_T_body.R) - yaw_of(b_T_body.R));
  return {R, a_T_body.p_m - R * b_T_body.p_m};
}

// In the mean of the last second.
double drift_m(const std::vector<Vec3>& errors_m) {
  if (errors_m.size() < kSecond_ticks) return kNotMeasured;
  Vec3 sum_m = Vec3::Zero();
  for (std::size_t i = errors_m.size() - kSecond_ticks; i < errors_m.size(); ++i) sum_m += errors_m[i];
  return sum_m.norm() / static_cast<double>(kSecond_ticks);
}

}  // namespace

double band_rms_m(const std::vector<Vec3>& signal_m, double low_hz, double high_hz) {
  if (signal_m.size() < kSecond_ticks) return kNotMeasured;
  const auto n = static_cast<double>(signal_m.size());
  Vec3 mean_m = Vec3::Zero();
  for (const Vec3& x_m : signal_m) mean_m += x_m / n;
  const double bin_hz = 1.0 / (n * kPlantTick_s);
  double power_m2 = 0.0;
  for (int k = static_cast<int>(std::ceil(low_hz / bin_hz)); k * bin_hz <= high_hz; ++k) {
    // One turn after the other instead of a sine for each sample.
    const std::complex<double> step = std::polar(1.0, -2.0 * kPi * k / n), window_step = std::polar(1.0, 2.0 * kPi / n);
    std::complex<double> turn = 1.0, window = 1.0;
    Eigen::Vector3cd sum = Eigen::Vector3cd::Zero();
    for (const Vec3& x_m : signal_m) {
      const double hann = std::sqrt(2.0 / 3.0) * (1.0 - window.real());  // of unit mean power
      sum += hann * turn * (x_m - mean_m).cast<std::complex<double>>();
      turn *= step;
      window *= window_step;
    }
    power_m2 += 2.0 * (sum / n).squaredNorm();
  }
  return std::sqrt(power_m2);
}

void OdometryReport::SquaredError::add(const Vec3& error_m) {
  sum_m2 += error_m.squaredNorm();
  ++count;
}

double OdometryReport::SquaredError::rmse_m() const {
  return count > 0 ? std::sqrt(sum_m2 / static_cast<double>(count)) : kNotMeasured;
}

std::optional<Transform> OdometryReport::true_T_base_at(std::int64_t stamp_ns) const {
  const auto after = std::lower_bound(past_.begin(), past_.end(), stamp_ns,
                                      [](const TruePose& p, std::int64_t stamp) { return p.stamp_ns < stamp; });
  if (after == past_.end()) return std::nullopt;
  if (after->stamp_ns == stamp_ns) return after->true_T_base;
  if (after == past_.begin()) return std::nullopt;
  const TruePose& a = *std::prev(after);
  const TruePose& b = *after;
  const double s = seconds(stamp_ns - a.stamp_ns) / seconds(b.stamp_ns - a.stamp_ns);
  const Eigen::Quaterniond qa(a.true_T_base.R), qb(b.true_T_base.R);
  return Transform{qa.slerp(s, qb).toRotationMatrix(), a.true_T_base.p_m + s * (b.true_T_base.p_m - a.true_T_base.p_m)};
}

void OdometryReport::observe(const Truth& truth, const StateEstimate& state, GaitPhase phase) {
  past_.push_back({truth.stamp_ns, truth.true_T_base});
  while (truth.stamp_ns - past_.front().stamp_ns > kTruthPast_ns) past_.pop_front();
  if (!aligned_) {
    if (!state.initialised) return;
    true_T_odom_ = aligned_worlds(truth.true_T_base, state.odom_T_base);
    true_T_world_ = aligned_worlds(truth.true_T_base, state.world_T_base());
    aligned_ = true;
    aligned_stamp_ns_ = truth.stamp_ns;
  }
  true_T_odom_now_ = aligned_worlds(truth.true_T_base, state.odom_T_base);
  const Vec3& true_p_m = truth.true_T_base.p_m;
  const Vec3 base_error_m = true_T_odom_ * state.odom_T_base.p_m - true_p_m;
  const Vec3 fused_error_m = true_T_world_ * state.world_T_base().p_m - true_p_m;
  base_.add(base_error_m);
  fused_.add(fused_error_m);
  climbing_ = climbing_ || phase == GaitPhase::kSwing;
  if (!climbing_ || !held_lio_m_) return;
  base_errors_m_.push_back(base_error_m);
  held_lio_errors_m_.push_back(*held_lio_m_ - true_p_m);
  fused_errors_m_.push_back(fused_error_m);
  const Vec3 world_error_m = true_T_world_.R.transpose() * fused_error_m;
  const double nees = world_error_m.cwiseQuotient(state.position_sigma_m).squaredNorm();
  nees_sum_ += nees;
  nees_in_bounds_ += nees > kPositionNeesLow && nees < kPositionNeesHigh ? 1 : 0;
}

void OdometryReport::observe_lio(const LioSample& sample) {
  const std::optional<Transform> true_T_base = true_T_base_at(sample.stamp_ns);
  if (!true_T_base) return;
  // Through the nominal mount to the base: all three errors are about the same point.
  const Transform lio_T_base = sample.lio_T_lidar * nominal_robot().mounts.base_T_lidar.inverse();
  if (!true_T_lio_) true_T_lio_ = aligned_worlds(*true_T_base, lio_T_base);
  held_lio_m_ = *true_T_lio_ * lio_T_base.p_m;
  lio_.add(*held_lio_m_ - true_T_base->p_m);
}

OdometryFigures OdometryReport::figures() const {
  constexpr double kLow_hz = 1.0, kHigh_hz = 5.0;
  OdometryFigures f;
  f.rmse_base_m = base_.rmse_m();
  f.rmse_lio_m = lio_.rmse_m();
  f.rmse_fused_m = fused_.rmse_m();
  f.drift_base_m = drift_m(base_errors_m_);
  f.drift_fused_m = drift_m(fused_errors_m_);
  f.jitter_lio_m = band_rms_m(held_lio_errors_m_, kLow_hz, kHigh_hz);
  f.jitter_fused_m = band_rms_m(fused_errors_m_, kLow_hz, kHigh_hz);
  if (!fused_errors_m_.empty()) {
    const auto ticks = static_cast<double>(fused_errors_m_.size());
    f.nees_mean = nees_sum_ / ticks;
    f.nees_in_bounds = static_cast<double>(nees_in_bounds_) / ticks;
  }
  return f;
}

}  // namespace polygmap::sim
