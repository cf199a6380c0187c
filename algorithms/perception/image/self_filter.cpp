// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/image/self_filter.hpp"

#include <algorithm>

namespace polygmap {
namespace {

// A capsule is drawn as this many spheres: 20 mm apart on a 0.35 m shank the scallops are under 1 mm deep.
constexpr int kSpheresPerCapsule = 18;
constexpr double kNear_m = 0.02;

}  // namespace

LegShapes transformed(const Transform& to_T_from, const LegShapes& shapes) noexcept {
  return {{to_T_from * shapes.thigh.a_m, to_T_from * shapes.thigh.b_m, shapes.thigh.radius_m},
          {to_T_from * shapes.shank.a_m, to_T_from * shapes.shank.b_m, shapes.shank.radius_m},
          {to_T_from * shapes.foot.centre, shapes.foot.half_m}};
}

BodyMargin body_margin(const BodyUncertainty& uncertainty, const LegGeometry& legs, double turn_rad) noexcept {
  const double reach_m = legs.thigh_m + legs.shank_m + legs.ankle_to_sole_m;
  // Of the hip's three joints two move the foot sideways or ahead, and the knee half as far.
  const double turned_m = 1.5 * uncertainty.encoder_rad * reach_m, longer_m = uncertainty.leg_length * reach_m;
  const double position_m = math::sqrt(math::square(turned_m) + math::square(longer_m));
  return {uncertainty.shape_m + uncertainty.sigmas * position_m, turn_rad};
}

void SelfFilter::clear() noexcept {
  for (Outline& outline : outlines_) outline.fill(Interval{});
}

void SelfFilter::extend(Outline& outline, std::int32_t row, std::int32_t width_px, double first, double last) noexcept {
  if (!(last >= -1.0) || !(first <= width_px)) return;
  // Half a pixel outwards: a pixel is body when any part of it may be.
  const auto a = static_cast<std::int16_t>(math::clamp(std::floor(first), 0.0, width_px - 1.0));
  const auto b = static_cast<std::int16_t>(math::clamp(std::ceil(last), 0.0, width_px - 1.0));
  Interval& interval = outline[static_cast<std::size_t>(row)];
  if (interval.last < interval.first) {
    interval = {a, b};
  } else {
    interval = {std::min(interval.first, a), std::max(interval.last, b)};
  }
}

// The cone around a sphere, cut row by row: (ray . c)^2 >= |ray|^2 (|c|^2 - r^2) is quadratic in the ray's x.
void SelfFilter::add_sphere(Outline& outline, const HalfRays& rays, const Vec3& c, double radius_m) noexcept {
  const double g = c.squaredNorm() - math::square(radius_m);
  if (!(g > 1e-6)) return;  // the camera is inside the grown shape: nothing can be said
  const double a = math::square(c.x()) - g;
  if (!(a < -1e-9)) return;  // beside the camera, at 90 degrees: out of any picture
  for (std::int32_t row = 0; row < rays.height_px; ++row) {
    const double y = static_cast<double>(rays.y[static_cast<std::size_t>(row)]);
    const double k = y * c.y() + c.z();
    const double discriminant = math::square(c.x() * k) - a * (k * k - (y * y + 1.0) * g);
    if (!(discriminant >= 0.0)) continue;
    const double root = math::sqrt(discriminant);
    const double x0 = (-c.x() * k + root) / a, x1 = (-c.x() * k - root) / a;
    if (!(0.5 * (x0 + x1) * c.x() + k > 0.0)) continue;  // behind the camera
    extend(outline, row, rays.width_px, std::min(x0, x1) * rays.fx_px + rays.cx_px,
           std::max(x0, x1) * rays.fx_px + rays.cx_px);
  }
}

void SelfFilter::add_segment(Outline& outline, const HalfRays& rays, const Vec3& a_m, const Vec3& b_m) noexcept {
  Vec3 a = a_m, b = b_m;
  if (a.z() < kNear_m && b.z() < kNear_m) return;
  if (a.z() < kNear_m) a += (b - a) * ((kNear_m - a.z()) / (b.z() - a.z()));
  if (b.z() < kNear_m) b += (a - b) * ((kNear_m - b.z()) / (a.z() - b.z()));
  double u0 = a.x() / a.z() * rays.fx_px + rays.cx_px, v0 = a.y() / a.z() * rays.fy_px + rays.cy_px;
  double u1 = b.x() / b.z() * rays.fx_px + rays.cx_px, v1 = b.y() / b.z() * rays.fy_px + rays.cy_px;
  if (v0 > v1) {
    std::swap(u0, u1);
    std::swap(v0, v1);
  }
  const double height = rays.height_px;
  const auto first = static_cast<std::int32_t>(math::clamp(std::floor(v0), 0.0, height - 1.0));
  const auto last = static_cast<std::int32_t>(math::clamp(std::ceil(v1), 0.0, height - 1.0));
  for (std::int32_t row = first; row <= last; ++row) {
    if (row + 1.0 < v0 || row - 1.0 > v1) continue;
    // The row's whole band, not its middle: the ends of nearly level edges count.
    const double lo = math::clamp(row - 0.5, v0, v1), hi = math::clamp(row + 0.5, v0, v1);
    const double slope = v1 - v0 > 1e-9 ? (u1 - u0) / (v1 - v0) : 0.0;
    const double ua = v1 - v0 > 1e-9 ? u0 + slope * (lo - v0) : u0;
    const double ub = v1 - v0 > 1e-9 ? u0 + slope * (hi - v0) : u1;
    extend(outline, row, rays.width_px, std::min(ua, ub), std::max(ua, ub));
  }
}

void SelfFilter::add_shape(const HalfRays& rays, const std::array<LegShapes, kFootCount>& body,
                           const BodyMargin& margin, std::size_t slot) noexcept {
  if (slot >= kShapes) return;
  const LegShapes& leg = body[slot / 3];
  Outline& outline = outlines_[slot];
  if (slot % 3 != 2) {
    const Capsule& capsule = slot % 3 == 0 ? leg.thigh : leg.shank;
    if (!(capsule.radius_m > 0.0)) return;
    for (int i = 0; i < kSpheresPerCapsule; ++i) {
      const double along = static_cast<double>(i) / (kSpheresPerCapsule - 1);
      const Vec3 centre_m = capsule.a_m + along * (capsule.b_m - capsule.a_m);
      add_sphere(outline, rays, centre_m, capsule.radius_m + margin.at(centre_m.norm()));
    }
    return;
  }
  if (!(leg.foot.half_m.minCoeff() > 0.0)) return;
  std::array<Vec3, 8> corners;
  const double farthest_m = leg.foot.centre.p_m.norm() + leg.foot.half_m.norm();
  const Vec3 half = leg.foot.half_m + Vec3::Constant(margin.at(farthest_m));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 sign{(i & 1U) != 0 ? 1.0 : -1.0, (i & 2U) != 0 ? 1.0 : -1.0, (i & 4U) != 0 ? 1.0 : -1.0};
    corners[i] = leg.foot.centre * half.cwiseProduct(sign);
  }
  // All pairs: the outline of a convex shape needs no hull when every chord is drawn.
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = i + 1; j < corners.size(); ++j) add_segment(outline, rays, corners[i], corners[j]);
  }
}

bool SelfFilter::try_mark_row(std::int32_t row, std::int32_t width_px, std::uint8_t* flags) const noexcept {
  bool any = false;
  for (const Outline& outline : outlines_) {
    const Interval interval = outline[static_cast<std::size_t>(row)];
    const std::int32_t last = std::min<std::int32_t>(interval.last, width_px - 1);
    if (interval.first > last) continue;
    if (!any) std::fill(flags, flags + width_px, std::uint8_t{0});
    any = true;
    std::fill(flags + interval.first, flags + last + 1, static_cast<std::uint8_t>(kPixelBody));
  }
  return any;
}

}  // namespace polygmap
