// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/estimate/estimate_replay.hpp"

#include <algorithm>
#include <memory>

#include "algorithms/geometry/so3.hpp"
#include "firmware/sensor_reading.hpp"
#include "sim_stub/host/estimate/log_ports.hpp"

namespace polygmap::sim {
namespace {

constexpr double kSlip_mps = 0.15;  // a standing foot that seems faster moves

// Standing still at the start, for so long at least and at most. What is noise is smoothed away, and the last of it is
// left out: it was motion before it could be seen.
constexpr double kMinStill_s = 0.25, kMaxStill_s = 2.0, kSmoothing_s = 0.05, kUnseenMotion_s = 0.15;
constexpr double kStillRate_radps = 0.1, kStillAccel_mps2 = 1.0, kStillMove_m = 0.004;
constexpr double kUnseenTurn_rad = 2e-3, kUnseenSpeed_mps = 5e-3;  // in that time

Mat3 level_R_base(const Vec3& up) {
  const double roll_rad = std::atan2(up.y(), up.z());
  const double pitch_rad = std::atan2(-up.x(), std::hypot(up.y(), up.z()));
  return rotation_y(pitch_rad) * rotation_x(roll_rad);
}

// What the standstill at the start tells. What the legs know of a sway in that time is taken off what the IMU feels.
struct Opening {
  Vec3 gyro_radps = Vec3::Zero();  // bias
  Vec3 accel_mps2 = Vec3::Zero();  // gravity and bias, in axes of the base at the first row
  double still_s = 0.0;
  double gyro_sigma_radps = 0.0;  // of the bias: noise, and a turn too slow to be seen
};

// Signals of one row, smoothed.
struct Smoothed {
  Vec3 gyro_radps = Vec3::Zero(), accel_mps2 = Vec3::Zero();
  std::array<Vec3, kFootCount> base_p_foot_m{Vec3::Zero(), Vec3::Zero()};
  void take(const LogRow& row, double share) {
    gyro_radps += share * (row.gyro_radps - gyro_radps);
    accel_mps2 += share * (row.accel_mps2 - accel_mps2);
    for (std::size_t f = 0; f < kFootCount; ++f) {
      base_p_foot_m[f] += share * (row.base_p_foot_m[f] - base_p_foot_m[f]);
    }
  }
};

std::int64_t end_of_standstill_ns(const EstimateLog& log) {
  Smoothed now, mean;
  double count = 0.0;
  std::int64_t last_ns = 0;
  for (const LogRow& row : log.rows) {
    count += 1.0;
    const double dt_s = seconds(row.stamp_ns - last_ns);
    now.take(row, std::max(1.0 / count, dt_s / (kSmoothing_s + dt_s)));
    mean.take(row, 1.0 / count);
    bool still = now.gyro_radps.cwiseAbs().maxCoeff() < kStillRate_radps &&
                 std::abs(now.accel_mps2.norm() - kGravity_mps2) < kStillAccel_mps2 &&
                 seconds(row.stamp_ns) < kMaxStill_s;
    for (std::size_t f = 0; f < kFootCount; ++f) {
      still = still && row.contact[f] >= 0.5 && (now.base_p_foot_m[f] - mean.base_p_foot_m[f]).norm() < kStillMove_m;
    }
    if (!still) break;
    last_ns = row.stamp_ns;
  }
  return last_ns;
}

// Coefficients of a polynomial in time through the columns, by least squares.
Eigen::MatrixX3d fitted(const Eigen::VectorXd& times_s, const Eigen::MatrixX3d& values, int degree) {
  Eigen::MatrixXd powers(times_s.size(), degree + 1);
  powers.col(0).setOnes();
  for (int i = 1; i <= degree; ++i) powers.col(i) = powers.col(i - 1).cwiseProduct(times_s);
  return powers.colPivHouseholderQr().solve(values);
}

Opening opening(const EstimateLog& log) {
  const std::int64_t end_ns = end_of_standstill_ns(log) - static_cast<std::int64_t>(kUnseenMotion_s * 1e9);
  const auto past =
      std::find_if(log.rows.begin(), log.rows.end(), [&](const LogRow& row) { return row.stamp_ns > end_ns; });
  const Eigen::Index rows = past - log.rows.begin();
  Opening o;
  if (rows < 4) return o;
  const LogRow& first = log.rows.front();
  Eigen::VectorXd times_s(rows);
  Eigen::MatrixX3d unturned_rad(rows, 3), first_p_base_m(rows, 3);  // felt less seen by the legs; seen
  Vec3 felt_rad = Vec3::Zero(), squares = Vec3::Zero(), mean_radps = Vec3::Zero();
  for (Eigen::Index i = 0; i < rows; ++i) {
    const LogRow& row = log.rows[static_cast<std::size_t>(i)];
    Vec3 turn_rad = Vec3::Zero(), place_m = Vec3::Zero();
    for (std::size_t f = 0; f < kFootCount; ++f) {
      const Mat3 first_R_base =
          log.has_soles ? Mat3(first.base_R_foot[f] * row.base_R_foot[f].transpose()) : Mat3::Identity();
      turn_rad += so3_log(first_R_base) / kFootCount;
      place_m += (first.base_p_foot_m[f] - first_R_base * row.base_p_foot_m[f]) / kFootCount;
    }
    times_s[i] = seconds(row.stamp_ns);
    if (i > 0) felt_rad += (times_s[i] - times_s[i - 1]) * row.gyro_radps;
    unturned_rad.row(i) = felt_rad - turn_rad;
    first_p_base_m.row(i) = place_m;
    o.accel_mps2 += so3_exp(turn_rad) * row.accel_mps2 / static_cast<double>(rows);
    const Vec3 off_radps = row.gyro_radps - mean_radps;
    mean_radps += off_radps / static_cast<double>(i + 1);
    squares += off_radps.cwiseProduct(row.gyro_radps - mean_radps);
  }
  o.still_s = times_s[rows - 1];
  o.gyro_radps = fitted(times_s, unturned_rad, 1).row(1);
  o.accel_mps2 -= 2.0 * fitted(times_s, first_p_base_m, 2).row(2).transpose();
  o.gyro_sigma_radps =
      std::hypot(std::sqrt(squares.maxCoeff()) / static_cast<double>(rows), kUnseenTurn_rad / o.still_s);
  return o;
}

// The feet of a row, whose contact the log states; where it has no soles they are points.
LegSample legs_of(const LogRow& row, bool has_soles) {
  LegSample sample;
  sample.stamp_ns = row.stamp_ns;
  sample.stated_contact = row.contact;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    LegMeasurement& leg = sample.legs[f];
    leg.base_T_sole.p_m = row.base_p_foot_m[f];
    leg.sole_known = has_soles;
    leg.base_T_sole.R = row.base_R_foot[f];
    leg.base_w_sole_radps = row.base_w_foot_radps[f];
  }
  return sample;
}

struct KnownStart {
  StartSource source = StartSource::kTruth;
  ContactInEkf::Start state;
  Vec3 world_p_odom_m = Vec3::Zero();
};

// Of the truth's velocity, by its second differences in the first second: that of a camera system is differenced
// places, and smoothed, so it errs by three times as much as that shows (chosen on iCub's walk, cut where one foot
// stands).
double true_velocity_noise_mps(const EstimateLog& log) {
  double squares = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 2; i < log.rows.size() && seconds(log.rows[i].stamp_ns) < 1.0; ++i) {
    const auto v_mps = [&](std::size_t back) -> const Vec3& { return log.rows[i - back].truth.true_v_base_mps; };
    squares += (v_mps(0) - 2.0 * v_mps(1) + v_mps(2)).squaredNorm();
    ++count;
  }
  constexpr double kRows = 3.0 * 6.0;  // variance of a second difference: 1 + 4 + 1
  constexpr double kSmoothed = 3.0;
  return count > 0 ? kSmoothed * std::sqrt(squares / (kRows * static_cast<double>(count))) : 0.0;
}

KnownStart start_of(const EstimateLog& log, const ReplayOptions& options) {
  const LogRow& first = log.rows.front();
  const Opening o = opening(log);
  const bool stood = o.still_s >= kMinStill_s;
  KnownStart known;
  ContactInEkf::Start& start = known.state;
  start.gyro_bias_sigma_radps = stood ? o.gyro_sigma_radps : options.gyro_bias_sigma_radps;
  start.accel_bias_sigma_mps2 = options.accel_bias_sigma_mps2;
  if (stood) start.gyro_bias_radps = o.gyro_radps;
  if (log.has_truth) {
    start.odom_R_base = first.truth.true_T_base.R;
    // The filter's errors turn about its origin, so that is the start, wherever on earth the truth counts from.
    known.world_p_odom_m = first.truth.true_T_base.p_m;
    start.odom_v_base_mps = first.truth.true_v_base_mps;
    if (!stood) start.velocity_sigma_mps = std::hypot(start.velocity_sigma_mps, true_velocity_noise_mps(log));
    if (stood) {
      start.accel_bias_mps2 = o.accel_mps2 - start.odom_R_base.transpose() * Vec3{0, 0, kGravity_mps2};
      start.accel_bias_sigma_mps2 = std::hypot(kUnseenSpeed_mps / o.still_s, kUnseenTurn_rad * kGravity_mps2);
    }
    return known;
  }
  known.source = stood ? StartSource::kStandstill : StartSource::kFirstAcceleration;
  start.odom_R_base = level_R_base(stood ? o.accel_mps2 : first.accel_mps2);
  for (const Vec3& foot_m : first.base_p_foot_m) {  // the feet's mean at height 0
    start.odom_p_base_m.z() -= (start.odom_R_base * foot_m).z() / static_cast<double>(kFootCount);
  }
  start.tilt_sigma_rad = stood ? start.accel_bias_sigma_mps2 / kGravity_mps2 : 0.2;
  start.velocity_sigma_mps = stood ? 0.01 : 1.0;
  return known;
}

class LogReplay {
 public:
  LogReplay(const EstimateLog& log, const std::vector<LioRow>& lio, const ReplayOptions& options)
      : has_soles_(log.has_soles), imu_(log.rows), lio_(lio), robot_(options.robot), start_(start_of(log, options)) {
    Estimator::Params params = options.estimator;
    params.max_step_s = std::max(params.max_step_s, log.gap_s());
    estimator_.reset(params, robot_);
    result_.start = start_.source;
  }

  void step(const LogRow& row) {
    const std::int64_t now_ns = row.stamp_ns;
    imu_.advance(now_ns);
    lio_.advance(now_ns);
    (void)read_imu(imu_, now_ns, estimator_);
    estimator_.add_legs(legs_of(row, has_soles_));
    if (estimator_.state().initialised) {
      estimator_.tick({true, true});
    } else {
      estimator_.start(start_.state);
    }
    keep();
    read_lio(lio_, now_ns, estimator_);
    result_.ticks.back().lio = estimator_.counters().lio;
  }

  [[nodiscard]] Replay take() {
    const ProprioceptiveOdometry& odometry = estimator_.odometry();
    const Estimator::Counters& counters = estimator_.counters();
    result_.gyro_bias_radps = odometry.filter().gyro_bias_radps();
    result_.accel_bias_mps2 = odometry.filter().accel_bias_mps2();
    result_.imu_invalid = counters.imu_invalid;
    result_.gaps = counters.gaps;
    result_.lio = counters.lio;
    result_.lio_not_arrived = lio_.unread();
    return std::move(result_);
  }

 private:
  void keep() {
    const StateEstimate& state = estimator_.state();
    const Mat3& world_R_odom = state.world_T_odom.R;
    ReplayTick tick;
    tick.stamp_ns = state.stamp_ns;
    tick.odom_T_base = {state.odom_T_base.R, start_.world_p_odom_m + state.odom_T_base.p_m};
    tick.world_T_base = {world_R_odom * state.odom_T_base.R, start_.world_p_odom_m + state.world_T_base().p_m};
    tick.world_v_base_mps = world_R_odom * state.odom_v_base_mps;
    tick.base_w_base_radps = state.base_w_base_radps;
    tick.quality = estimator_.quality();
    tick.contact_probability = state.contact_probability;
    tick.lio_age_ns = state.lio_age_ns;
    tick.imu_invalid = estimator_.counters().imu_invalid;
    if (!result_.ticks.empty()) {  // as the fusion's limit counts: the new offset against the old one, at one place
      const double slew_m = (state.world_T_base().p_m - last_world_T_odom_ * state.odom_T_base.p_m).norm();
      result_.largest_slew_m = std::max(result_.largest_slew_m, slew_m);
    }
    result_.ticks.push_back(tick);
    last_world_T_odom_ = state.world_T_odom;
    const auto& feet = estimator_.contacts();
    if (!feet[0].stands && !feet[1].stands) ++result_.rows_without_contact;
    bool& slips = result_.ticks.back().slips;
    for (std::size_t f = 0; f < kFootCount; ++f) {
      slips = slips || (feet[f].stands && estimator_.odometry().motion().speed_mps(f) > kSlip_mps);
    }
    if (slips) ++result_.slipping_rows;
  }

  bool has_soles_;
  LogImu imu_;
  LogLidarOdometry lio_;
  RobotModel robot_;
  KnownStart start_;
  Estimator estimator_;
  Transform last_world_T_odom_;
  Replay result_;
};

}  // namespace

Estimator::Params log_params() {
  Estimator::Params params;
  params.imu_of_moments = true;
  params.filter.imu_delay_start_sigma_s = 0.01;  // the truth of the first row is that of another time than its IMU's
  params.fusion.uncertainty.initial_sigma_m = 1e-4;  // the start is the truth's, or defined there
  params.fusion.uncertainty.initial_sigma_rad = 1e-4;
  // What comes through grows with LIO's noise, drift does not. Nearly as the module's 4 s are to its lidar's 10 mm: of
  // 300 to 400 s/m on climbs of seeds 201 to 212 the least followed best.
  params.fusion.tau_s = 1.0;
  params.fusion.tau_spm = 300.0;
  return params;
}

RobotModel log_robot() {
  RobotModel robot;
  robot.mounts.base_T_lidar = {};
  return robot;
}

bool is_finite(const Replay& replay) {
  return std::all_of(replay.ticks.begin(), replay.ticks.end(), [](const ReplayTick& tick) {
    return math::all_finite(tick.world_T_base.p_m) && math::all_finite(tick.world_T_base.R) &&
           math::all_finite(tick.world_v_base_mps) && math::all_finite(tick.quality.covariance);
  });
}

Replay replay(const EstimateLog& log, const std::vector<LioRow>& lio, const ReplayOptions& options) {
  const auto whole = std::make_unique<LogReplay>(log, lio, options);  // the estimator is too large for a stack
  for (const LogRow& row : log.rows) {
    throw_if_interrupted(options.interrupt);
    whole->step(row);
  }
  return whole->take();
}

}  // namespace polygmap::sim
