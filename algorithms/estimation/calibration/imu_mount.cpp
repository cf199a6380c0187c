// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/imu_mount.hpp"

#include <algorithm>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {
namespace {

struct Guess {
  double variance_rad2 = 0.0;
  double chance = 0.0;
};
std::array<Guess, 2> guesses(const ImuMount::Prior& prior) noexcept {
  return {{{math::square(prior.usual_rad), 1.0 - prior.off_chance}, {math::square(prior.off_rad), prior.off_chance}}};
}

}  // namespace

void ImuMount::reset(const Params& params) noexcept {
  params_ = params;
  forget();
}

void ImuMount::forget() noexcept {
  samples_ = 0.0;
  accel_mps2_.setZero();
  q_rad_.setZero();
  tau_nm_.setZero();
  foot_force_n_ = {};
}

void ImuMount::add(const Vec3& base_accel_mps2, const JointFeedback& joints) noexcept {
  samples_ += 1.0;
  accel_mps2_ += base_accel_mps2;
  q_rad_ += joints.q_rad;
  tau_nm_ += joints.tau_nm;
  for (std::size_t f = 0; f < kFootCount; ++f) foot_force_n_[f] += joints.foot_force_n[f];
}

bool ImuMount::try_turns(const RobotModel& robot, Turns& turns) const noexcept {
  if (!(samples_ > 0.0)) return false;
  JointFeedback mean;
  mean.q_rad = q_rad_ / samples_;
  mean.tau_nm = tau_nm_ / samples_;
  for (std::size_t f = 0; f < kFootCount; ++f) mean.foot_force_n[f] = foot_force_n_[f] / samples_;
  Vec3 statics;
  if (!try_up_by_statics(params_.standing, robot, mean, statics)) return false;
  const Vec3 felt = accel_mps2_.normalized();
  turns = {felt.cross(up_by_soles(robot.legs, mean.q_rad)).head<2>(), felt.cross(statics).head<2>()};
  return true;
}

// Felt gravity is off by m, the soles by s, statics by c: turns.soles = m - s and turns.statics = m - c, each axis by
// itself. For three Gaussians the mean of m and how well they explain the turns are in closed form.
Vec2 ImuMount::turn_rad(const Params& params, const Turns& turns) noexcept {
  Vec2 mean_rad = Vec2::Zero();
  double sum = 0.0;
  const std::array<Guess, 2> imu = guesses(params.imu);
  for (const Guess& m : imu) {
    for (const Guess& s : guesses(params.soles)) {
      for (const Guess& c : guesses(params.statics)) {
        const double ms = m.variance_rad2 * s.variance_rad2, mc = m.variance_rad2 * c.variance_rad2;
        const double all = ms + mc + s.variance_rad2 * c.variance_rad2;
        const double far =
            (s.variance_rad2 * turns.statics_rad.squaredNorm() + c.variance_rad2 * turns.soles_rad.squaredNorm() +
             m.variance_rad2 * (turns.statics_rad - turns.soles_rad).squaredNorm()) /
            all;
        const double weight = m.chance * s.chance * c.chance * math::exp(-0.5 * far) / all;  // two axes
        sum += weight;
        if (&m != &imu.front()) mean_rad += weight / all * (mc * turns.soles_rad + ms * turns.statics_rad);
      }
    }
  }
  // Turns that nothing explains are nothing's.
  return sum > 0.0 ? Vec2(mean_rad / sum) : Vec2::Zero();
}

Mat3 ImuMount::base_R_felt(const RobotModel& robot) const noexcept {
  Turns turns;
  if (!try_turns(robot, turns)) return Mat3::Identity();
  const Vec2 all_rad = turn_rad(params_, turns);
  const double share = std::min(1.0, params_.most_rad / std::max(all_rad.norm(), 1e-9));
  return so3_exp(Vec3{share * all_rad.x(), share * all_rad.y(), 0.0});
}

}  // namespace polygmap
