// SPDX-License-Identifier: Apache-2.0
// The paper's Kalman filter, eqs (1)-(4), which the module's one filter is measured against: 30 states (base position
// and velocity, eight contact points, all in odom) and 56 rows (contact positions and velocities relative to the base,
// contact heights).
#pragma once

#include "algorithms/estimation/filters/contact_inekf.hpp"
#include "algorithms/estimation/quality/innovation.hpp"
#include "tests/reference/base_filter/axis_filter.hpp"

namespace polygmap {

// Where a foot met the ground, known a few ticks later.
struct TouchDown {
  bool now = false;
  Transform odom_T_sole;
};

// One contact's seven rows of eqs (3)-(4), turned into odom axes, with their noise.
struct ContactRow {
  Vec3 odom_r_contact_m = Vec3::Zero();     // contact minus base
  Vec3 odom_dr_contact_mps = Vec3::Zero();  // its rate
  double height_m = 0.0;
  Vec3 process_m2 = Vec3::Zero();  // random walk of the contact in this step
  double position_m2 = 0.0;        // variances of the rows
  double velocity_m2ps2 = 0.0;
  double height_m2 = -1.0;  // negative: height unknown
};
using ContactRows = std::array<ContactRow, kContactCount>;  // left foot first

class BaseFilter {
 public:
  struct Params {
    double accel_noise_mpsrs = 0.0134;
    double velocity_sigma_mps = 0.2;
    double position_sigma_m = 4e-4;
    double closure_share = 0.97;
    double stance_walk_mprs = 1e-4;
    double stance_walk_z_mprs = 5e-4;
    double anchor_sigma_m = 1e-5;
    double swing_walk_mprs = 2.0;
    double swing_velocity_sigma_mps = 200.0;
    double height_correlation_s = 1.0;
    double initial_contact_sigma_m = 1e-3;
    double initial_velocity_sigma_mps = 1e-2;

    static void visit(auto& p, auto& field) {
      field("accel_noise_mpsrs", p.accel_noise_mpsrs, 1e-4, 1.0,
            "Noise of the acceleration: 0.0134 is 0.3 m/s^2 at 500 Hz and puts 6 Hz between legs and acceleration.");
      field("velocity_sigma_mps", p.velocity_sigma_mps, 0.001, 10.0, "Noise of one contact's velocity row.");
      field("position_sigma_m", p.position_sigma_m, 1e-5, 0.1,
            "Noise of one contact's position row; four of a foot share their error.");
      field("closure_share", p.closure_share, 0.0, 1.0,
            "Share of two legs' disagreement that is shared by load instead of filtered away.");
      field("stance_walk_mprs", p.stance_walk_mprs, 1e-6, 0.1,
            "A standing foot creeps like this, which is also how soon a wrong anchor is forgiven.");
      field("stance_walk_z_mprs", p.stance_walk_z_mprs, 1e-6, 0.1,
            "A standing foot creeps like this vertically, so that a tread's height is believed within about 6 s.");
      field("anchor_sigma_m", p.anchor_sigma_m, 1e-7, 0.1, "Place of a contact at touch-down against the legs.");
      field("swing_walk_mprs", p.swing_walk_mprs, 0.01, 100.0,
            "A swinging foot walks like this, so that a landing one is a new contact.");
      field("swing_velocity_sigma_mps", p.swing_velocity_sigma_mps, 1.0, 1e4,
            "Noise of a swinging foot's velocity row, which says nothing of the base.");
      field("height_correlation_s", p.height_correlation_s, 0.002, 100.0,
            "A frozen height errs alike in every step of this time.");
      field("initial_contact_sigma_m", p.initial_contact_sigma_m, 1e-6, 0.1, "Place of a contact at the start.");
      field("initial_velocity_sigma_mps", p.initial_velocity_sigma_mps, 1e-5, 1.0,
            "Velocity of the base at the start.");
    }
  };
  void reset(const Params& params, const SoleModel& sole) noexcept { *this = BaseFilter{params, sole}; }
  BaseFilter() noexcept = default;

  // Contacts by kinematics.
  void initialise(const Vec3& odom_p_base_m, const Vec3& odom_v_base_mps, const ContactRows& rows) noexcept;
  // Eqs (3)-(4) with noise by contact and load.
  [[nodiscard]] ContactRows make_rows(const Mat3& odom_R_base, const Vec3& base_w_base_radps,
                                      const std::array<LegMeasurement, kFootCount>& legs,
                                      const std::array<FootContact, kFootCount>& contacts,
                                      const std::array<TouchDown, kFootCount>& touch_downs,
                                      const std::array<KnownHeight, kFootCount>& heights, double dt_s) const noexcept;
  void predict(const Vec3& odom_a_base_mps2, double dt_s, const ContactRows& rows) noexcept;  // eq. (2)
  void correct(const ContactRows& rows) noexcept;                                             // eqs (3)-(4)

  [[nodiscard]] Vec3 odom_p_base_m() const noexcept { return per_axis(&AxisFilter::position_m); }
  [[nodiscard]] Vec3 odom_v_base_mps() const noexcept { return per_axis(&AxisFilter::velocity_mps); }
  [[nodiscard]] Vec3 odom_p_contact_m(std::size_t contact) const noexcept {
    return {axes_[0].contact_m(contact), axes_[1].contact_m(contact), axes_[2].contact_m(contact)};
  }
  // Of the last correction.
  [[nodiscard]] const NormalisedRows& velocity_rows() const noexcept { return velocity_rows_; }
  [[nodiscard]] const NormalisedRows& height_rows() const noexcept { return height_rows_; }
  [[nodiscard]] const AxisFilter& axis(std::size_t i) const noexcept { return axes_[i]; }
  [[nodiscard]] const Params& params() const noexcept { return params_; }
  // Variances of one step of the base's own states: position, velocity.
  [[nodiscard]] Vec2 base_process(double dt_s) const noexcept;

 private:
  BaseFilter(const Params& params, const SoleModel& sole) noexcept
      : params_(params), sole_p_contact_m_(sole.contacts_m()) {}
  [[nodiscard]] Vec3 per_axis(double (AxisFilter::*value)() const noexcept) const noexcept {
    return {(axes_[0].*value)(), (axes_[1].*value)(), (axes_[2].*value)()};
  }

  // Two standing legs disagree about the base by millimetres (lengths, encoder offsets, feet that come down flat). As
  // rows they would drag each other's contacts; the base really goes over from the one to the other as the weight does.
  // This makes both legs' rows say that.
  void share_closure(const std::array<FootContact, kFootCount>& contacts, ContactRows& rows) const noexcept;

  Params params_;
  std::array<Vec3, kContactsPerFoot> sole_p_contact_m_{Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  std::array<AxisFilter, 3> axes_;
  NormalisedRows velocity_rows_, height_rows_;
};

}  // namespace polygmap
