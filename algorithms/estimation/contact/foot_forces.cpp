// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/foot_forces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polygmap {

void FootForces::reset(const Params& params) noexcept {
  *this = FootForces{};
  params_ = params;
  observer_.reset(params.observer);
  for (NoiseLevel& noise_n : observer_noise_n_) noise_n.reset(params.observer_noise);
  for (Sensor& sensor : sensors_) {
    sensor.noise_n.reset(params.sensor_noise);
    sensor.zero_variance_n2 = math::square(params.zero_sigma_n);
  }
}

// An error that stays is not averaged away: the zero is never known better than what it was measured by.
void FootForces::learn_zero(Sensor& sensor, double off_n, double least_sigma_n, double dt_s) noexcept {
  const double averaged = std::max(params_.zero_s / std::max(dt_s, 1e-6), 1.0);
  const double variance_n2 = math::square(least_sigma_n) + averaged * math::square(sensor.noise_n.sigma());
  const double least_n2 = math::square(least_sigma_n);
  if (sensor.zero_variance_n2 <= least_n2) return;
  const double gain = (sensor.zero_variance_n2 - least_n2) / (sensor.zero_variance_n2 + variance_n2);
  sensor.zero_n += gain * (off_n - sensor.zero_n);
  sensor.zero_variance_n2 = std::max((1.0 - gain) * sensor.zero_variance_n2, least_n2);
}

FootForces::Weighed FootForces::sense(Sensor& sensor, double read_n, const Weighed& observed, bool hangs,
                                      double dt_s) noexcept {
  if (!std::isfinite(read_n)) return {};
  if (++sensor.samples > 2) {  // a force that rises steadily is no noise
    const double bend_n = read_n - 2.0 * sensor.last_n + sensor.before_n;
    sensor.noise_n.take(math::square(bend_n) / 6.0, dt_s);
  }
  sensor.before_n = sensor.last_n;
  sensor.last_n = read_n;
  if (hangs) {
    learn_zero(sensor, read_n, params_.zero_in_air_sigma_n, dt_s);
  } else if (observed.weight_pn2 > 0.0 && torque_scale_.is_settled(params_.torque_scale)) {
    learn_zero(sensor, read_n - observed.force_n, params_.zero_by_torque_sigma_n, dt_s);
  }
  return {read_n - sensor.zero_n, 1.0 / (math::square(sensor.noise_n.sigma()) + sensor.zero_variance_n2)};
}

bool FootForces::hangs(std::size_t foot, bool stands, double dt_s) noexcept {
  InAir& in_air = in_air_[foot];
  in_air.stood = in_air.stood || stands;
  in_air.since_s = stands ? 0.0 : std::min(in_air.since_s + dt_s, 1e3);
  return in_air.stood && in_air.since_s > params_.lifted_s;
}

void FootForces::update(const RobotModel& robot, const BodyFrames& frames, const JointFeedback& joints,
                        const ImuSample& base, const Vec3& base_up,
                        const std::array<bool, kFootCount>& stands) noexcept {
  const double since_s = stamp_ns_ < 0 ? 0.0 : seconds(joints.stamp_ns - stamp_ns_);
  for (Sensor& sensor : sensors_) sensor.zero_variance_n2 += math::square(params_.zero_walk_nprs) * since_s;
  const double dt_s = std::min(since_s, params_.most_gap_s);  // nobody knows what was in a gap
  stamp_ns_ = joints.stamp_ns;
  const bool torques_told = math::all_finite(joints.tau_nm) && joints.tau_nm.cwiseAbs().maxCoeff() > 0.0;
  std::array<bool, kFootCount> told{}, lifted{};
  for (std::size_t f = 0; f < kFootCount; ++f) {
    told[f] = torques_told;
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      told[f] = told[f] && !joints.is_mute(joint_index(static_cast<Foot>(f), j));
    }
    lifted[f] = hangs(f, stands[f], dt_s) && told[f];
  }
  std::array<double, kFootCount> observed_n{};
  if (torques_told) observed_n = observer_.update(robot, frames, joints, base, base_up, lifted);
  if (std::min(observed_n[0], observed_n[1]) > params_.torque_scale.pressed_n && told[0] && told[1] && stands[0] &&
      stands[1]) {
    const double weight_n = robot.masses.total_kg() * base_up.dot(base.accel_mps2);
    torque_scale_.update(params_.torque_scale, observed_n[0] + observed_n[1], weight_n, dt_s);
  }
  for (std::size_t f = 0; f < kFootCount; ++f) {
    NoiseLevel& noise_n = observer_noise_n_[f];
    if (lifted[f]) noise_n.take(math::square(observed_n[f]), dt_s);
    const Weighed observed{observed_n[f], told[f] ? 1.0 / math::square(noise_n.sigma()) : 0.0};
    const Weighed sensed =
        sense(sensors_[f], joints.foot_force_n[f], observed, lifted[f] && observed_n[f] < params_.light_n, dt_s);
    const double weight_pn2 = observed.weight_pn2 + sensed.weight_pn2;
    if (!(weight_pn2 > 0.0)) {
      up_n_[f] = sigma_n_[f] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    const double mean_n = (observed.weight_pn2 * observed.force_n + sensed.weight_pn2 * sensed.force_n) / weight_pn2;
    sigma_n_[f] = 1.0 / math::sqrt(weight_pn2);
    up_n_[f] = mean_n > std::min(params_.light_n, params_.light_sigmas * sigma_n_[f]) ? mean_n : 0.0;
  }
}

}  // namespace polygmap
