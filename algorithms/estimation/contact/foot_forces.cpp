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

const std::array<FootForces::Pressed, kFootCount>& FootForces::update(
    const RobotModel& robot, const JointFeedback& joints, const ImuSample& base, const Vec3& base_up,
    const std::array<bool, kFootCount>& in_air) noexcept {
  const double dt_s = stamp_ns_ < 0 ? 0.0 : seconds(joints.stamp_ns - stamp_ns_);
  stamp_ns_ = joints.stamp_ns;
  const bool torques_told = math::all_finite(joints.tau_nm) && joints.tau_nm.cwiseAbs().maxCoeff() > 0.0;
  std::array<double, kFootCount> observed_n{};
  if (torques_told) observed_n = observer_.update(robot, joints, base, base_up);
  for (std::size_t f = 0; f < kFootCount; ++f) {
    Sensor& sensor = sensors_[f];
    Pressed& foot = feet_[f];
    const double read_n = joints.foot_force_n[f];
    const double observed_weight = torques_told ? 1.0 / math::square(params_.observer_sigma_n) : 0.0;
    double sensor_weight = 0.0;
    if (std::isfinite(read_n)) {
      if (++sensor.samples > 2) {  // a force that rises steadily is no noise
        const double bend_n = read_n - 2.0 * sensor.last_n + sensor.before_n;
        sensor.noise_n.take(math::square(bend_n) / 6.0, dt_s);
      }
      sensor.before_n = sensor.last_n;
      sensor.last_n = read_n;
      sensor.zero_variance_n2 += math::square(params_.zero_walk_nprs) * dt_s;
      if (in_air[f]) {
        learn_zero(sensor, read_n, params_.zero_in_air_sigma_n, dt_s);
      } else if (torques_told) {
        learn_zero(sensor, read_n - observed_n[f], params_.zero_by_torque_sigma_n, dt_s);
      }
      sensor_weight = 1.0 / (math::square(sensor.noise_n.sigma()) + sensor.zero_variance_n2);
    }
    const double weight = observed_weight + sensor_weight;
    if (!(weight > 0.0)) {
      foot = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
      continue;
    }
    const double sensed_n = sensor_weight > 0.0 ? read_n - sensor.zero_n : 0.0;
    foot.up_n = std::max((observed_weight * observed_n[f] + sensor_weight * sensed_n) / weight, 0.0);
    foot.sigma_n = 1.0 / math::sqrt(weight);
  }
  return feet_;
}

}  // namespace polygmap
