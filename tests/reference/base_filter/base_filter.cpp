// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/base_filter/base_filter.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace polygmap {

void BaseFilter::initialise(const Vec3& odom_p_base_m, const Vec3& odom_v_base_mps, const ContactRows& rows) noexcept {
  for (int a = 0; a < 3; ++a) {
    AxisFilter::State x = AxisFilter::State::Zero();
    AxisFilter::State variance = AxisFilter::State::Constant(math::square(params_.initial_contact_sigma_m));
    x[0] = odom_p_base_m[a];
    x[1] = odom_v_base_mps[a];
    variance[0] = 0.0;  // the origin is defined here
    variance[1] = math::square(params_.initial_velocity_sigma_mps);
    for (std::size_t c = 0; c < kContactCount; ++c) {
      x[2 + static_cast<int>(c)] = odom_p_base_m[a] + rows[c].odom_r_contact_m[a];
    }
    axes_[static_cast<std::size_t>(a)].initialise(x, variance);
  }
}

ContactRows BaseFilter::make_rows(const Mat3& odom_R_base, const Vec3& base_w_base_radps,
                                  const std::array<LegMeasurement, kFootCount>& legs,
                                  const std::array<FootContact, kFootCount>& contacts,
                                  const std::array<TouchDown, kFootCount>& touch_downs,
                                  const std::array<KnownHeight, kFootCount>& heights, double dt_s) const noexcept {
  const Vec3 odom_p_predicted_m = odom_p_base_m() + dt_s * odom_v_base_mps();
  ContactRows rows;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const LegMeasurement& leg = legs[foot];
    const TouchDown& touch_down = touch_downs[foot];
    const bool stands = contacts[foot].stands && !touch_down.now;
    const Vec3 walk_mprs = stands ? Vec3{params_.stance_walk_mprs, params_.stance_walk_mprs, params_.stance_walk_z_mprs}
                                  : Vec3::Constant(params_.swing_walk_mprs);
    const double position_m = touch_down.now ? params_.anchor_sigma_m : params_.position_sigma_m;
    const double velocity_mps = stands ? params_.velocity_sigma_mps : params_.swing_velocity_sigma_mps;
    const KnownHeight& height = heights[foot];
    const bool height_counts = height.sigma_m > 0.0 && stands;
    for (std::size_t i = 0; i < kContactsPerFoot; ++i) {
      const Vec3 base_r_m = leg.base_T_sole.R * sole_p_contact_m_[i];  // from the sole's origin
      const Vec3 base_p_m = leg.base_T_sole.p_m + base_r_m;
      ContactRow& row = rows[foot * kContactsPerFoot + i];
      row.odom_r_contact_m = touch_down.now ? Vec3(touch_down.odom_T_sole * sole_p_contact_m_[i] - odom_p_predicted_m)
                                            : Vec3(odom_R_base * base_p_m);
      row.odom_dr_contact_mps = odom_R_base * (leg.base_v_sole_mps + leg.base_w_sole_radps.cross(base_r_m) +
                                               base_w_base_radps.cross(base_p_m));
      row.process_m2 = (walk_mprs.cwiseAbs2().array() + contacts[foot].walk_m2ps) * dt_s;
      row.position_m2 = math::square(position_m);
      row.velocity_m2ps2 = math::square(velocity_mps);
      row.height_m = height.odom_z_m;
      if (height_counts) {
        row.height_m2 = math::square(height.sigma_m) * kContactsPerFoot * params_.height_correlation_s / dt_s;
      }
    }
  }
  const bool both_stand = contacts[0].stands && contacts[1].stands && !touch_downs[0].now && !touch_downs[1].now;
  if (both_stand) share_closure(contacts, rows);
  return rows;
}

void BaseFilter::share_closure(const std::array<FootContact, kFootCount>& contacts, ContactRows& rows) const noexcept {
  std::array<Vec3, kFootCount> odom_p_base_by_leg_m{Vec3::Zero(), Vec3::Zero()};
  for (std::size_t c = 0; c < kContactCount; ++c) {
    odom_p_base_by_leg_m[c / kContactsPerFoot] +=
        (odom_p_contact_m(c) - rows[c].odom_r_contact_m) / static_cast<double>(kContactsPerFoot);
  }
  const double left = contacts[0].load_share;
  const Vec3 shared_m = left * odom_p_base_by_leg_m[0] + (1.0 - left) * odom_p_base_by_leg_m[1];
  for (std::size_t c = 0; c < kContactCount; ++c) {
    rows[c].odom_r_contact_m += params_.closure_share * (odom_p_base_by_leg_m[c / kContactsPerFoot] - shared_m);
  }
}

Vec2 BaseFilter::base_process(double dt_s) const noexcept {
  const double velocity_m2ps2 = math::square(params_.accel_noise_mpsrs) * dt_s;
  return {0.25 * velocity_m2ps2 * dt_s * dt_s, velocity_m2ps2};
}

void BaseFilter::predict(const Vec3& odom_a_base_mps2, double dt_s, const ContactRows& rows) noexcept {
  AxisFilter::State process;
  process.head<2>() = base_process(dt_s);
  for (int a = 0; a < 3; ++a) {
    for (std::size_t c = 0; c < kContactCount; ++c) process[2 + static_cast<int>(c)] = rows[c].process_m2[a];
    axes_[static_cast<std::size_t>(a)].predict(odom_a_base_mps2[a], dt_s, process);
  }
}

void BaseFilter::correct(const ContactRows& rows) noexcept {
  velocity_rows_ = height_rows_ = {};
  AxisFilter::PerContact value, variance;
  for (int a = 0; a < 3; ++a) {
    AxisFilter& axis = axes_[static_cast<std::size_t>(a)];
    for (std::size_t c = 0; c < kContactCount; ++c) {
      value[c] = rows[c].odom_r_contact_m[a];
      variance[c] = rows[c].position_m2;
    }
    axis.correct_positions(value, variance);
    for (std::size_t c = 0; c < kContactCount; ++c) {
      value[c] = rows[c].odom_dr_contact_mps[a];
      variance[c] = rows[c].velocity_m2ps2;
    }
    velocity_rows_.take(axis.correct_velocities(value, variance), 1);
  }
  for (std::size_t c = 0; c < kContactCount; ++c) {
    value[c] = rows[c].height_m;
    variance[c] = rows[c].height_m2;
  }
  const auto known =
      std::count_if(rows.begin(), rows.end(), [](const ContactRow& row) { return row.height_m2 >= 0.0; });
  height_rows_.take(axes_[2].correct_heights(value, variance), static_cast<std::uint32_t>(known));
}

}  // namespace polygmap
