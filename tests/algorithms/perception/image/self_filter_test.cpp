// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/image/self_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "sim_stub/robot_camera.hpp"
#include "tests/support/depth_scene.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

LegVector bent(double hip_rad) {
  LegVector q = LegVector::Zero();
  q[kHipPitch] = hip_rad;
  q[kKnee] = -2.0 * hip_rad;
  q[kAnklePitch] = hip_rad;
  return q;
}

std::array<LegShapes, kFootCount> camera_legs(double left_hip_rad, double right_hip_rad) {
  const Transform camera_T_base = base_T_camera().inverse();
  return {transformed(camera_T_base, base_leg_shapes({}, Foot::kLeft, bent(left_hip_rad))),
          transformed(camera_T_base, base_leg_shapes({}, Foot::kRight, bent(right_hip_rad)))};
}

HalfImage<std::uint8_t> mask_of(const HalfRays& rays, const std::array<LegShapes, kFootCount>& legs,
                                const BodyMargin& margin) {
  SelfFilter filter;
  filter.clear();
  for (std::size_t i = 0; i < SelfFilter::kShapes; ++i) {
    while (!filter.add_some(rays, legs, margin, i)) {
    }
  }
  HalfImage<std::uint8_t> flags;
  for (std::int32_t r = 0; r < rays.height_px; ++r)
    static_cast<void>(filter.try_mark_row(r, rays.width_px, flags.row(r)));
  return flags;
}

bool hits(const std::array<LegShapes, kFootCount>& legs, const Vec3& ray, double margin_m) {
  const double length = ray.norm();
  for (double z = 0.02; z < 2.0;) {
    double clear_m = 2.0;
    for (const LegShapes& leg : legs) {
      clear_m = std::min({clear_m, signed_distance_m(leg.thigh, ray * z), signed_distance_m(leg.shank, ray * z),
                          signed_distance_m(leg.foot, ray * z)});
    }
    if (clear_m < margin_m) return true;
    z += std::max(0.005, (clear_m - margin_m) / length);  // nothing is nearer
  }
  return false;
}

TEST(SelfFilter, Mask_LegsOfSeveralPoses_CoversEveryRayThatHitsThemAndLittleElse) {
  HalfRays rays;
  rays.set(robot_camera_intrinsics());
  for (const double hip : {-0.3, -0.8, -1.2}) {
    const auto legs = camera_legs(hip, -0.4);
    const HalfImage<std::uint8_t> mask = mask_of(rays, legs, {0.02, 0.0});
    int hit = 0, missed = 0, needless = 0;
    for (std::int32_t r = 0; r < rays.height_px; r += 5) {
      for (std::int32_t c = 0; c < rays.width_px; c += 5) {
        const bool body = (mask(c, r) & kPixelBody) != 0;
        hit += hits(legs, rays.ray(c, r), 0.0) ? 1 : 0;
        missed += !body && hits(legs, rays.ray(c, r), 0.015) ? 1 : 0;
        // The box grows by its margin along its axes: its corners reach 1.73 times as far.
        needless += body && !hits(legs, rays.ray(c, r), 0.042) ? 1 : 0;
      }
    }
    EXPECT_GT(hit, 50) << hip;
    EXPECT_EQ(missed, 0) << hip;
    EXPECT_LT(needless, 22) << hip;
  }
}

// Rays that meet the true legs and are not masked, of a robot that differs from its data sheet by two sigmas.
int unmasked(double hip_rad, double sign, const BodyMargin& margin) {
  HalfRays rays;
  rays.set(robot_camera_intrinsics());
  RobotModel longer;
  longer.legs.thigh_m *= 1.0 + sign * 0.01;
  longer.legs.shank_m *= 1.0 + sign * 0.01;
  const double turn_rad = sign * kPi / 180.0;
  const Transform nominal = base_T_camera();
  const Transform mount{rotation_y(turn_rad) * rotation_z(turn_rad) * nominal.R, nominal.p_m};
  std::array<LegShapes, kFootCount> legs;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const LegVector q_rad = bent(foot == Foot::kLeft ? hip_rad : -0.4) + LegVector::Constant(sign * 2e-3);
    legs[index_of(foot)] = transformed(mount.inverse(), base_leg_shapes(longer, foot, q_rad));
  }
  const HalfImage<std::uint8_t> mask = mask_of(rays, camera_legs(hip_rad, -0.4), margin);
  int count = 0;
  for (std::int32_t r = 0; r < rays.height_px; r += 3) {
    for (std::int32_t c = 0; c < rays.width_px; c += 3) {
      count += (mask(c, r) & kPixelBody) == 0 && hits(legs, rays.ray(c, r), 0.0) ? 1 : 0;
    }
  }
  return count;
}

TEST(SelfFilter, Margin_OfKinematicsAndMount_CoversARobotThatIsNotItsDataSheet) {
  const BodyMargin margin = body_margin({}, {}, kPi / 180.0);
  int without = 0;
  for (const double hip_rad : {-0.3, -0.8, -1.2}) {
    for (const double sign : {1.0, -1.0}) {
      EXPECT_EQ(unmasked(hip_rad, sign, margin), 0) << hip_rad << " " << sign;
      without += unmasked(hip_rad, sign, {});
    }
  }
  EXPECT_GT(without, 100);
}

TEST(SelfFilter, Mask_ShapesBehindTheCamera_IsEmpty) {
  HalfRays rays;
  rays.set(robot_camera_intrinsics());
  std::array<LegShapes, kFootCount> legs{};
  legs[0].thigh = {{0, 0, -0.5}, {0.1, 0, -0.6}, 0.07};
  legs[0].foot = {{Mat3::Identity(), Vec3{0, 0, -0.8}}, Vec3{0.1, 0.05, 0.05}};
  const HalfImage<std::uint8_t> mask = mask_of(rays, legs, {0.02, 0.0});
  for (std::int32_t r = 0; r < rays.height_px; ++r) {
    for (std::int32_t c = 0; c < rays.width_px; ++c) ASSERT_EQ(mask(c, r), 0);
  }
}

bool meets(const Vec3& ray, const Vec3& centre_m, double radius_m) {
  const double along = ray.dot(centre_m);
  return along > 0.0 && along * along >= ray.squaredNorm() * (centre_m.squaredNorm() - radius_m * radius_m);
}

// Also of those whose cone goes on beyond the image, upwards or downwards.
TEST(SelfFilter, Mask_OneSphere_IsEveryRayThatMeetsItToAPixel) {
  HalfRays rays;
  rays.set(robot_camera_intrinsics());
  constexpr double kRadius_m = 0.1;
  for (const Vec3& centre_m : {Vec3{0.0, 0.25, 0.3}, Vec3{0.1, 0.15, 0.15}, Vec3{-0.4, 0.1, 0.5}, Vec3{0.0, -0.2, 0.5},
                               Vec3{0.05, -0.13, 0.12}, Vec3{0.2, 0.6, 0.9}, Vec3{0.0, 0.1, 0.0999}}) {
    std::array<LegShapes, kFootCount> legs{};
    legs[1].shank = {centre_m, centre_m, kRadius_m};
    const HalfImage<std::uint8_t> mask = mask_of(rays, legs, {0.0, 0.0});
    int hit = 0, wrong = 0;
    for (std::int32_t r = 0; r < rays.height_px; ++r) {
      for (std::int32_t c = 0; c < rays.width_px; ++c) {
        const bool body = (mask(c, r) & kPixelBody) != 0;
        const auto near = [&](double off) { return meets(rays.ray(c + off, r), centre_m, kRadius_m); };
        hit += near(0.0) ? 1 : 0;
        wrong += body ? (near(-1.0) || near(0.0) || near(1.0) ? 0 : 1) : (near(0.0) ? 1 : 0);
      }
    }
    EXPECT_GT(hit, 100) << centre_m.transpose();
    EXPECT_LE(wrong, 2) << centre_m.transpose();  // rows where the cone is narrower than two pixels
  }
}

TEST(SelfFilter, Mask_AbsentShapes_IsEmpty) {
  HalfRays rays;
  rays.set(robot_camera_intrinsics());
  std::array<LegShapes, kFootCount> legs{};
  for (LegShapes& leg : legs) {
    leg.thigh = {{0, 0, 1}, {0, 0, 1}, 0.0};
    leg.shank = leg.thigh;
    leg.foot = {{Mat3::Identity(), Vec3{0, 0, 1}}, Vec3::Zero()};
  }
  EXPECT_EQ(mask_of(rays, legs, {0.05, 0.0})(160, 120), 0);
}

// To the instruction: less is seldom seen in the units. Recorded on x86 and AArch64 alike.
TEST(SelfFilter, Shapes_ArePaidForWhateverTheRegistersWidth) {
  HalfRays rays;
  rays.set(robot_camera_intrinsics());
  SelfFilter filter;
  std::vector<std::int32_t> paid;
  for (const double hip : {-0.3, -0.8, -1.2}) {
    const auto legs = camera_legs(hip, -0.4);
    filter.clear();
    for (std::size_t i = 0; i < SelfFilter::kShapes; ++i) {
      while (!filter.add_some(rays, legs, {0.02, 0.0}, i)) {
      }
    }
    paid.push_back(filter.work().instructions());
    static_cast<void>(filter.work().take_units());
  }
  EXPECT_EQ(paid, (std::vector<std::int32_t>{100561, 134828, 159369}));
}

}  // namespace
}  // namespace polygmap
