// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/estimate_replay.hpp"

#include <algorithm>
#include <memory>

#include "algorithms/geometry/so3.hpp"

namespace polygmap::sim {
namespace {

constexpr std::int64_t kRingPeriod_ns = 2 * kNsPerMs;  // the ring holds half a second at this rate
// A start without truth: still for this long, or the first acceleration must do.
constexpr double kMinStill_s = 0.25, kMaxStill_s = 2.0;
constexpr double kStillRate_radps = 0.1, kStillAccel_mps2 = 1.0, kStillMove_m = 0.01;

Mat3 level_R_base(const Vec3& up) {
  const double roll_rad = std::atan2(up.y(), up.z());
  const double pitch_rad = std::atan2(-up.x(), std::hypot(up.y(), up.z()));
  return rotation_y(pitch_rad) * rotation_x(roll_rad);
}

// How the log begins, where no truth says so.
struct Opening {
  Vec3 gyro_radps = Vec3::Zero(), accel_mps2 = Vec3::Zero();
  double still_s = 0.0;
};
Opening opening(const EstimateLog& log) {
  Opening o;
  double count = 0.0;
  const LogRow& first = log.rows.front();
  for (const LogRow& row : log.rows) {
    bool still = row.gyro_radps.cwiseAbs().maxCoeff() < kStillRate_radps &&
                 std::abs(row.accel_mps2.norm() - kGravity_mps2) < kStillAccel_mps2 &&
                 seconds(row.stamp_ns) < kMaxStill_s;
    for (std::size_t f = 0; f < kFootCount; ++f) {
      still = still && row.contact[f] >= 0.5 && (row.base_p_foot_m[f] - first.base_p_foot_m[f]).norm() < kStillMove_m;
    }
    if (!still) break;
    count += 1.0;
    o.gyro_radps += (row.gyro_radps - o.gyro_radps) / count;
    o.accel_mps2 += (row.accel_mps2 - o.accel_mps2) / count;
    o.still_s = seconds(row.stamp_ns);
  }
  return o;
}

using Covariance = Eigen::Matrix<double, 9, 9>;
constexpr int kYaw = 8;

// Of x, y, z besides what the heading does, and of yaw.
FusionUncertainty::Quantities variances_of(const Covariance& P) {
  FusionUncertainty::Quantities v;
  v.head<3>() = P.diagonal().head<3>() - P.col(kYaw).head<3>().cwiseAbs2() / P(kYaw, kYaw);
  v[3] = P(kYaw, kYaw);
  return v;
}

class LogReplay {
 public:
  LogReplay(const EstimateLog& log, const ReplayOptions& options) : log_(log), options_(options) {
    felt_.stamp_ns = -1;
    odometry_.reset(options.odometry);
    contacts_.reset({});
    begin();
  }

  void add_lio(const LioRow& row, std::int64_t now_ns) {
    LioSample sample;
    sample.stamp_ns = row.stamp_ns;
    sample.lio_T_lidar = row.pose;
    LioVerdict verdict = odometry_.fusion().check(sample, now_ns);
    StateEstimate then;
    if (verdict == LioVerdict::kAccepted) {
      if (sample.stamp_ns > last_ring_ns_) keep();  // as young as this row
      verdict = ring_.try_at(sample.stamp_ns, then) ? odometry_.fusion().fuse(sample, then.odom_T_base)
                                                    : LioVerdict::kNoOdometry;
    }
    ++result_.lio[static_cast<std::size_t>(verdict)];
  }

  void step(std::size_t i) {
    const LogRow& row = log_.rows[i];
    contacts_.update_stated(row.contact, row.stamp_ns);
    const LogRow before = felt_;
    if (odometry_.is_valid_imu(row.gyro_radps, row.accel_mps2)) {
      felt_ = row;
    } else {
      ++result_.imu_invalid;
    }
    if (i > 0) {
      Odometry::Step step;
      step.dt_s = seconds(row.stamp_ns - log_.rows[i - 1].stamp_ns);
      if (step.dt_s > options_.odometry.max_step_s) ++result_.gaps;
      // Samples of a moment: over the step, the mean of both its ends. The last ones bridge some that are invalid.
      step.gyro_radps = 0.5 * (felt_.gyro_radps + before.gyro_radps);
      step.accel_mps2 = 0.5 * (felt_.accel_mps2 + before.accel_mps2);
      step.felt = felt_.stamp_ns >= 0 && seconds(row.stamp_ns - felt_.stamp_ns) <= options_.odometry.max_step_s;
      odometry_.step(step, legs_of(row), contacts_.feet(), {});
      const FusionUncertainty::Quantities variances = variances_of(odometry_.attitude().covariance());
      odometry_.fusion().grow((variances - variances_).cwiseMax(0.0));
      variances_ = variances;
    }
    publish(row, i);
  }

  [[nodiscard]] Replay take() {
    result_.gyro_bias_radps = odometry_.attitude().gyro_bias_radps();
    result_.accel_bias_mps2 = odometry_.attitude().accel_bias_mps2();
    result_.foot_position_sigma_m = odometry_.motion().position_sigma_m();
    result_.contact_walk_mprs = odometry_.attitude().contact_walk_mprs();
    result_.outliers = odometry_.attitude().outliers();
    result_.innovation_ratio_mean /= static_cast<double>(log_.rows.size());
    return std::move(result_);
  }

 private:
  [[nodiscard]] Odometry::Legs legs_of(const LogRow& row) const {
    Odometry::Legs legs;
    for (std::size_t f = 0; f < kFootCount; ++f) {
      legs[f].base_T_sole.p_m = row.base_p_foot_m[f];
      legs[f].sole_known = false;
      legs[f].position_sigma_m = odometry_.motion().position_sigma_m();
    }
    return legs;
  }

  void begin() {
    const LogRow& first = log_.rows.front();
    AttitudeFilter::Start start;
    start.gyro_bias_sigma_radps = 0.005;
    start.accel_bias_sigma_mps2 = 0.1;
    if (log_.has_truth) {
      start.odom_R_base = first.truth.true_T_base.R;
      // The filter's errors turn about its origin, so that is the start, wherever on earth the truth counts from.
      start_m_ = first.truth.true_T_base.p_m;
      start.odom_v_base_mps = first.truth.true_v_base_mps;
    } else {
      const Opening o = opening(log_);
      const bool stood = o.still_s >= kMinStill_s;
      result_.start = stood ? StartSource::kStandstill : StartSource::kFirstAcceleration;
      start.odom_R_base = level_R_base(stood ? o.accel_mps2 : first.accel_mps2);
      for (const Vec3& foot_m : first.base_p_foot_m) {  // the feet's mean at height 0
        start.odom_p_base_m.z() -= (start.odom_R_base * foot_m).z() / static_cast<double>(kFootCount);
      }
      if (stood) start.gyro_bias_radps = o.gyro_radps;
      start.gyro_bias_sigma_radps = stood ? 1e-3 : start.gyro_bias_sigma_radps;
      start.tilt_sigma_rad = stood ? start.accel_bias_sigma_mps2 / kGravity_mps2 : 0.2;
      start.velocity_sigma_mps = stood ? 0.01 : 1.0;
    }
    contacts_.update_stated(first.contact, 0);
    odometry_.initialise(start, legs_of(first), 0.01);
    variances_ = variances_of(odometry_.attitude().covariance());
  }

  void keep() {
    ring_.push(now_);
    last_ring_ns_ = now_.stamp_ns;
  }

  void publish(const LogRow& row, std::size_t i) {
    StateEstimate& state = now_;
    state.stamp_ns = row.stamp_ns;
    odometry_.describe(row.stamp_ns, state);
    if (row.stamp_ns - last_ring_ns_ >= kRingPeriod_ns || i == 0) keep();
    const Mat3& world_R_odom = state.world_T_odom.R;
    ReplayTick tick;
    tick.stamp_ns = row.stamp_ns;
    tick.odom_T_base = {state.odom_T_base.R, start_m_ + state.odom_T_base.p_m};
    tick.world_T_base = {world_R_odom * state.odom_T_base.R, start_m_ + state.world_T_base().p_m};
    tick.world_v_base_mps = world_R_odom * state.odom_v_base_mps;
    tick.base_w_base_radps = state.base_w_base_radps;
    tick.covariance = fused_covariance(state);
    tick.contact_probability = state.contact_probability;
    tick.lio_age_ns = state.lio_age_ns;
    result_.ticks.push_back(tick);
    if (i > 0) {  // as the fusion's limit counts: the new offset against the old one, at the same place
      const double slew_m = (state.world_T_base().p_m - last_world_T_odom_ * state.odom_T_base.p_m).norm();
      result_.largest_slew_m = std::max(result_.largest_slew_m, slew_m);
    }
    last_world_T_odom_ = state.world_T_odom;
    result_.innovation_ratio_mean += odometry_.attitude().innovation_ratio();
    const auto& feet = contacts_.feet();
    if (!feet[0].stands && !feet[1].stands) ++result_.rows_without_contact;
    for (std::size_t f = 0; f < kFootCount; ++f) {
      if (contacts_.feet()[f].stands && odometry_.motion().walk_m2ps(f) > 0.0) ++result_.slipping_rows;
    }
  }

  // Until LIO corrects anything the odometry's own; then its correlations, with the fusion's sigmas for what LIO
  // corrects.
  [[nodiscard]] Covariance fused_covariance(const StateEstimate& state) const {
    const Covariance P = odometry_.attitude().covariance();
    if (!odometry_.fusion().aligned()) return P;
    Eigen::Matrix<double, 9, 1> scale = Eigen::Matrix<double, 9, 1>::Ones();
    for (int i = 0; i < 3; ++i) scale[i] = state.position_sigma_m[i] / std::sqrt(P(i, i));
    scale[kYaw] = state.yaw_sigma_rad / std::sqrt(P(kYaw, kYaw));
    return scale.asDiagonal() * P * scale.asDiagonal();
  }

  const EstimateLog& log_;
  const ReplayOptions& options_;
  LogRow felt_;  // the last whose IMU was valid; before there is one: stamp -1
  FusionUncertainty::Quantities variances_;
  Odometry odometry_;
  ContactEstimator contacts_;
  StateRing ring_;
  StateEstimate now_;
  Vec3 start_m_ = Vec3::Zero();  // world minus the filter's axes
  std::int64_t last_ring_ns_ = 0;
  Transform last_world_T_odom_;
  Replay result_;
};

}  // namespace

Odometry::Params log_params() {
  Odometry::Params params;
  params.attitude.gyro_noise_radprs = 3e-4;
  params.attitude.contact_walk_mprs = 1e-2;
  params.fusion.base_T_lidar = {};
  params.fusion.uncertainty = {0.0, 0.0, 1e-4, 1e-4};  // grows as the filter's own does, from the start's sigmas
  params.fusion.tau_s = 2.0;                           // odometry of point feet turns away sooner than that of soles
  params.fusion.default_position_sigma_m = 0.007;      // a log's LIO states none: between 5 and 10 mm
  return params;
}

bool is_finite(const Replay& replay) {
  return std::all_of(replay.ticks.begin(), replay.ticks.end(), [](const ReplayTick& tick) {
    return math::all_finite(tick.world_T_base.p_m) && math::all_finite(tick.world_T_base.R) &&
           math::all_finite(tick.world_v_base_mps) && math::all_finite(tick.covariance);
  });
}

Replay replay(const EstimateLog& log, const std::vector<LioRow>& lio, const ReplayOptions& options) {
  const auto estimator = std::make_unique<LogReplay>(log, options);  // its ring is too large for a stack
  std::size_t next = 0;
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    const std::int64_t now_ns = log.rows[i].stamp_ns;
    estimator->step(i);  // first, so that a pose stamped with this row finds it
    for (; next < lio.size() && lio[next].arrival_ns <= now_ns; ++next) estimator->add_lio(lio[next], now_ns);
  }
  Replay result = estimator->take();
  result.lio_not_arrived = lio.size() - next;
  return result;
}

}  // namespace polygmap::sim
