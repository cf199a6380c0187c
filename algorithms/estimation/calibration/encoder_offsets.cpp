// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/encoder_offsets.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace polygmap {
namespace {

// Joints of a leg that tilt its sole, by axis; the yaw of hip and foot is too small to mix them.
constexpr std::array<LegJoint, 2> kRollJoints{kHipRoll, kAnkleRoll};
constexpr std::array<LegJoint, 3> kPitchJoints{kHipPitch, kKnee, kAnklePitch};
constexpr auto kLeft = index_of(Foot::kLeft), kRight = index_of(Foot::kRight);

}  // namespace

void EncoderOffsets::reset(const Params& params) noexcept {
  *this = {};
  params_ = params;
  const double joint_rad2 = math::square(params.encoder_sigma_rad);
  apart_variance_rad2_ = kFootCount * joint_rad2 * Vec2{kRollJoints.size(), kPitchJoints.size()};
}

void EncoderOffsets::learn_anew() noexcept {
  if (offset_rad_.isZero()) reset(Params{params_});
}

double EncoderOffsets::share_rad(double apart_rad, std::size_t joints) const noexcept {
  const auto all = static_cast<double>(kFootCount * joints);
  return std::abs(apart_rad) <= params_.most_sigmas * params_.encoder_sigma_rad * math::sqrt(all) ? apart_rad / all
                                                                                                  : 0.0;
}

void EncoderOffsets::update(const std::array<LegMeasurement, kFootCount>& legs,
                            const std::array<FootContact, kFootCount>& contacts, const JointVector& torque_nm,
                            double dt_s) noexcept {
  if (!(contacts[kLeft].probability >= 1.0 && contacts[kRight].probability >= 1.0)) {
    stood_s_ = 0.0;
    return;
  }
  stood_s_ += dt_s;
  if (stood_s_ < params_.settle_s || !(dt_s > 0.0)) return;

  if (apart_sigma_rad().maxCoeff() > params_.enough_sigma_rad) {
    // The turn from the right sole's normal to the left one's.
    Vec2 turn_rad = legs[kRight].base_T_sole.R.col(2).cross(legs[kLeft].base_T_sole.R.col(2)).head<2>();
    const double leaning_nm = torque_nm[kAnkleRoll] - torque_nm[kJointsPerLeg + kAnkleRoll];
    if (std::isfinite(leaning_nm)) turn_rad.x() -= params_.give_radpnm * leaning_nm;
    const double noise_rad2 = math::square(params_.level_noise_radprs) / dt_s;
    for (int axis = 0; axis < 2; ++axis) {
      const double gain = apart_variance_rad2_[axis] / (apart_variance_rad2_[axis] + noise_rad2);
      apart_rad_[axis] += gain * (turn_rad[axis] - apart_rad_[axis]);
      apart_variance_rad2_[axis] *= 1.0 - gain;
    }
    return;
  }

  const double step_rad = params_.slew_radps * dt_s;
  const auto follow = [&](LegJoint joint, double left_rad) {
    double& offset_rad = offset_rad_[static_cast<Eigen::Index>(joint_index(Foot::kLeft, joint))];
    offset_rad += math::clamp(left_rad - offset_rad, -step_rad, step_rad);
    offset_rad_[static_cast<Eigen::Index>(joint_index(Foot::kRight, joint))] = -offset_rad;
  };
  for (const LegJoint joint : kRollJoints) follow(joint, share_rad(apart_rad_.x(), kRollJoints.size()));
  for (const LegJoint joint : kPitchJoints) follow(joint, share_rad(apart_rad_.y(), kPitchJoints.size()));
}

}  // namespace polygmap
