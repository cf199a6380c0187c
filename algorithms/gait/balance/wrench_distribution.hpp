// SPDX-License-Identifier: Apache-2.0
// What each standing sole must press, so that together they give one force through the centre of mass.
#pragma once

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/robot/leg_dynamics.hpp"

namespace polygmap {

// Where the centre of pressure may be in a sole, about the sole frame's origin, and what follows when it may not.
struct PressureLimits {
  double ahead_m = 0.066;
  double toe_m = 0.155;
  double behind_m = 0.066;
  double inward_m = 0.03;
  double aside_m = 0.045;
  double missed_m = 0.005;
  double gained_m = 0.0005;

  static void visit(auto& p, auto& field) {
    field("ahead_m", p.ahead_m, 0.001, 0.17,
          "Centre of pressure ahead of the ankle of a foot that carries all: 36 Nm hold 67 mm of 540 N.");
    field("toe_m", p.toe_m, 0.001, 0.17,
          "Centre of pressure ahead of the ankle of a foot with a small share: the contact ends at 171 mm.");
    field("behind_m", p.behind_m, 0.001, 0.07, "Centre of pressure behind the ankle of a foot that carries all.");
    field("inward_m", p.inward_m, 0.001, 0.048,
          "Centre of pressure from a sole's middle line towards the other sole, where it carries all.");
    field("aside_m", p.aside_m, 0.001, 0.048,
          "Centre of pressure from the middle line at most, of a half width of 48 mm.");
    field("missed_m", p.missed_m, 0.0, 0.1,
          "Other shares of the soles are tried where the pressure misses the force's line by more.");
    field("gained_m", p.gained_m, 0.0, 0.1, "Other shares of the soles are taken where they miss it by so much less.");
  }
};

struct Support {
  std::array<Transform, kFootCount> odom_T_sole;
  std::array<bool, kFootCount> stands{true, true};
  std::array<bool, kFootCount> on_toe{};  // carried by the toe's edge alone
  double toe_x_m = 0.17;                  // of that edge, from the sole's origin

  // Where the sole carries without any turning of its own.
  [[nodiscard]] Vec3 odom_p_carrier_m(std::size_t foot) const noexcept {
    return on_toe[foot] ? odom_T_sole[foot] * Vec3{toe_x_m, 0.0, 0.0} : odom_T_sole[foot].p_m;
  }
};

struct Pressure {
  std::array<double, kFootCount> share{};                             // of the force
  std::array<Vec3, kFootCount> centre_m{Vec3::Zero(), Vec3::Zero()};  // odom
  Vec3 zmp_m = Vec3::Zero();                                          // what comes of it, odom
};

// The split of a ground force whose line meets the ground at the zero-moment point p_zmp(z) = p_com - (z_com - z)
// slope, slope = horizontal over vertical force. Shares by the place between the soles, what remains by the centres of
// pressure, clamped to their limits; where those miss the line, by the shares that come closest. Feet on different
// treads: the line is cut where the shares put the ground.
[[nodiscard]] Pressure distribute(const Support& support, const PressureLimits& limits, const Vec3& odom_p_com_m,
                                  const Vec2& slope) noexcept;

// One foot's part of force_n (odom axes) as a wrench at its sole's origin, base axes.
[[nodiscard]] SoleWrench sole_wrench(const Pressure& pressure, const Support& support, Foot foot, const Vec3& force_n,
                                     const Mat3& odom_R_base) noexcept;

}  // namespace polygmap
