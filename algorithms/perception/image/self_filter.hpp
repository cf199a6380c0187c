// SPDX-License-Identifier: Apache-2.0
// Which pixels may show the robot's own legs, by forward kinematics.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/depth_image.hpp"
#include "algorithms/robot/body_shapes.hpp"

namespace polygmap {

// The shapes moved to another frame.
[[nodiscard]] LegShapes transformed(const Transform& to_T_from, const LegShapes& shapes) noexcept;

// What is not known of the legs. One sigma each, as a data sheet has it.
struct BodyUncertainty {
  double shape_m = 0.008;
  double leg_length = 0.005;
  double encoder_rad = 2e-3;
  double sigmas = 2.5;

  static void visit(auto& p, auto& field) {
    field("shape_m", p.shape_m, 0.0, 0.1, "Covers beyond the shapes, and a leg's way in half an exposure; no sigma.");
    field("leg_length", p.leg_length, 0.0, 0.1, "Lengths of the legs, relative.");
    field("encoder_rad", p.encoder_rad, 0.0, 0.05, "Offset of a joint's encoder.");
    field("sigmas", p.sigmas, 0.0, 10.0, "The shapes are grown by as many sigmas.");
  }
};
// At the foot, which is worst off. turn_rad: of the camera's mount.
[[nodiscard]] BodyMargin body_margin(const BodyUncertainty& uncertainty, const LegGeometry& legs,
                                     double turn_rad) noexcept;

// The image of convex shapes, each grown by a margin: one range of columns per row and shape. A pixel whose ray meets
// a grown shape is body whatever depth it measured, so that flying pixels around a leg go with it.
class SelfFilter {
 public:
  static constexpr std::size_t kShapes = 3 * kFootCount;

  SelfFilter() noexcept { clear(); }
  void clear() noexcept;
  // Slots 0..2 of a foot: thigh, shank, foot. Camera frame, m. Draws a part of the shape; true when it is whole.
  [[nodiscard]] bool add_some(const HalfRays& rays, const std::array<LegShapes, kFootCount>& body,
                              const BodyMargin& margin, std::size_t slot) noexcept;
  // Since it was last paid.
  [[nodiscard]] WorkCount& work() noexcept { return outline_.work; }
  // Writes one row of flags, of kPixelBody; false, and nothing written, when there is none in it.
  [[nodiscard]] bool try_mark_row(std::int32_t row, std::int32_t width_px, std::uint8_t* flags) const noexcept;

 private:
  struct ColumnRange {
    std::int16_t first = 1;
    std::int16_t last = 0;  // inclusive; empty when before first
  };
  struct Rows {
    std::int32_t first, last;
  };
  static constexpr std::int32_t kBeyond = 8;  // rows after the last, into which a register may reach
  struct Outline {                            // of one shape, by row, real columns; none where first is beyond last
    std::array<double, kHalfHeight_px + kBeyond> first_px, last_px;
    Rows touched{0, kHalfHeight_px + kBeyond - 1};  // the others have none
    WorkCount work;

    void clear() noexcept;
    void touch(std::int32_t first, std::int32_t last) noexcept;
    // A register of rows, where seen has all bits set.
    template <typename Wide>
    void extend(std::int32_t row, const Wide& seen, const Wide& first, const Wide& last) noexcept;
  };

  [[nodiscard]] static Rows rows_of(const HalfRays& rays, const Vec3& centre_m, double a) noexcept;
  static void add_sphere(Outline& outline, const HalfRays& rays, const Vec3& centre_m, double radius_m) noexcept;
  static void add_segment(Outline& outline, const HalfRays& rays, const Vec3& a_m, const Vec3& b_m) noexcept;

  [[nodiscard]] bool add_capsule(const HalfRays& rays, const Capsule& capsule, const BodyMargin& margin) noexcept;
  [[nodiscard]] bool add_foot(const HalfRays& rays, const OrientedBox& foot, const BodyMargin& margin) noexcept;

  Outline outline_{};
  int next_ = 0;  // sphere of a capsule, chord of a foot
  std::array<std::array<ColumnRange, kHalfHeight_px>, kShapes> covered_{};
  std::array<bool, kHalfHeight_px> any_{};  // rows in which one is not empty
};

}  // namespace polygmap
