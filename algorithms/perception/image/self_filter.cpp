// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/image/self_filter.hpp"

#include <algorithm>
#include <limits>

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {
namespace {

// A capsule is drawn as this many spheres: 20 mm apart on a 0.35 m shank the scallops are under 1 mm deep.
constexpr int kSpheresPerCapsule = 18;
constexpr double kNear_m = 0.02;     // edges are cut off there: what is behind the camera has no place in the image
constexpr double kOutside_px = 1.0;  // a shape that ends farther from the image covers none of its pixels

using Doubles = cv::v_float64;

Doubles doubles(double x) noexcept { return cv::vx_setall_f64(x); }

}  // namespace

LegShapes transformed(const Transform& to_T_from, const LegShapes& shapes) noexcept {
  return {{to_T_from * shapes.thigh.a_m, to_T_from * shapes.thigh.b_m, shapes.thigh.radius_m},
          {to_T_from * shapes.shank.a_m, to_T_from * shapes.shank.b_m, shapes.shank.radius_m},
          {to_T_from * shapes.foot.centre, shapes.foot.half_m}};
}

BodyMargin body_margin(const BodyUncertainty& uncertainty, const LegGeometry& legs, double turn_rad) noexcept {
  const double reach_m = legs.thigh_m + legs.shank_m + legs.ankle_to_sole_m;
  // Of the hip's three joints two move the foot sideways or ahead, and the knee half as far: root of 2 + 1/4, by
  // geometry.
  const double turned_m = 1.5 * uncertainty.encoder_rad * reach_m, longer_m = uncertainty.leg_length * reach_m;
  const double position_m = math::sqrt(math::square(turned_m) + math::square(longer_m));
  return {uncertainty.shape_m + uncertainty.sigmas * position_m, turn_rad};
}

void SelfFilter::clear() noexcept {
  for (auto& ranges : covered_) ranges.fill(ColumnRange{});
  any_.fill(false);
  outline_.clear();
  next_ = 0;
}

void SelfFilter::Outline::touch(std::int32_t first, std::int32_t last) noexcept {
  touched.first = std::min(touched.first, first);
  touched.last = std::max(touched.last, last);
}

void SelfFilter::Outline::clear() noexcept {
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  const auto count = std::max(touched.last - touched.first + 1, 0);
  std::fill_n(first_px.begin() + touched.first, count, kNowhere);
  std::fill_n(last_px.begin() + touched.first, count, -kNowhere);
  touched = {kHalfHeight_px, -1};
}

template <typename Wide>
void SelfFilter::Outline::extend(std::int32_t row, const Wide& seen, const Wide& first, const Wide& last) noexcept {
  double *firsts = &first_px[static_cast<std::size_t>(row)], *lasts = &last_px[static_cast<std::size_t>(row)];
  const Wide first0 = cv::vx_load(firsts), last0 = cv::vx_load(lasts);
  cv::v_store(firsts, cv::v_select(seen, cv::v_min(first0, first), first0));
  cv::v_store(lasts, cv::v_select(seen, cv::v_max(last0, last), last0));
}

// The rows whose plane of rays may meet the cone around a sphere: where its discriminant, over g a quadratic in the
// ray's y, is not negative. A row to each side is added for what rounding does.
SelfFilter::Rows SelfFilter::rows_of(const HalfRays& rays, const Vec3& c, double a) noexcept {
  const Rows all{0, rays.height_px - 1};
  const double square = math::square(c.y()) + a, half = c.y() * c.z(), constant = math::square(c.z()) + a;
  if (!(square < -1e-9)) return all;  // up to the image's end, at least to one side
  const double discriminant = math::square(half) - square * constant;
  if (!(discriminant >= 0.0)) return {0, -1};
  const double root = math::sqrt(discriminant), top = (-half + root) / square, bottom = (-half - root) / square;
  const auto row_of = [&](double y) { return math::clamp(y * rays.fy_px + rays.cy_px, -2.0, rays.height_px + 1.0); };
  return {std::max(static_cast<std::int32_t>(std::floor(row_of(top))) - 1, all.first),
          std::min(static_cast<std::int32_t>(std::ceil(row_of(bottom))) + 1, all.last)};
}

// The cone around a sphere, cut row by row: (ray . c)^2 >= |ray|^2 (|c|^2 - r^2) is quadratic in the ray's x. Several
// rows at once: most of what the filter costs is here.
void SelfFilter::add_sphere(Outline& outline, const HalfRays& rays, const Vec3& c, double radius_m) noexcept {
  outline.work.add(250);
  const double g = c.squaredNorm() - math::square(radius_m);
  if (!(g > 1e-6)) return;  // the camera is inside the grown shape: nothing can be said
  const double a = math::square(c.x()) - g;
  if (!(a < -1e-9)) return;  // beside the camera, at 90 degrees: out of any image
  const Doubles cx = doubles(c.x()), cy = doubles(c.y()), cz = doubles(c.z()), wide_a = doubles(a), wide_g = doubles(g);
  const Doubles zero = doubles(0.0), half = doubles(0.5), one = doubles(1.0), fx = doubles(rays.fx_px),
                centre = doubles(rays.cx_px);
  const Doubles least = doubles(-kOutside_px), most = doubles(rays.width_px - 1 + kOutside_px);
  const Rows rows = rows_of(rays, c, a);
  if (rows.first > rows.last) return;
  outline.work.add(rows.last - rows.first + 2, 33);
  constexpr std::int32_t kAtOnce = 4;  // whatever the register's width: what is touched is paid for
  static_assert(kAtOnce % Doubles::nlanes == 0 && kHalfHeight_px % kAtOnce == 0);
  const std::int32_t first_row = rows.first / kAtOnce * kAtOnce, last_row = rows.last / kAtOnce * kAtOnce + kAtOnce - 1;
  outline.touch(first_row, last_row);
  for (std::int32_t row = first_row; row <= last_row; row += Doubles::nlanes) {
    const auto at = static_cast<std::size_t>(row);
    const Doubles y = cv::v_cvt_f64(cv::vx_load_low(&rays.y[at]));
    const Doubles k = y * cy + cz, cx_k = cx * k;
    const Doubles discriminant = cx_k * cx_k - wide_a * (k * k - (y * y + one) * wide_g);
    const Doubles root = cv::v_sqrt(cv::v_max(discriminant, zero));
    const Doubles x0 = (root - cx_k) / wide_a, x1 = (zero - cx_k - root) / wide_a;
    const Doubles first = cv::v_min(x0, x1) * fx + centre, last = cv::v_max(x0, x1) * fx + centre;
    // Met at all, before the camera and in the image.
    const Doubles seen =
        (discriminant >= zero) & (half * (x0 + x1) * cx + k > zero) & (last >= least) & (first <= most);
    outline.extend(row, seen, first, last);
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
  outline.work.add(140);
  if (first + 1.0 < v0 || last - 1.0 > v1) return;  // below or above the image
  outline.work.add(last - first + 2, 17);
  outline.touch(first, last);
  const bool level = !(v1 - v0 > 1e-9);
  const double slope = level ? 0.0 : (u1 - u0) / (v1 - v0);
  static_assert(Doubles::nlanes <= kBeyond);
  const Doubles wide_v0 = doubles(v0), wide_v1 = doubles(v1), wide_u0 = doubles(u0), wide_slope = doubles(slope),
                half = doubles(0.5);
  const Doubles least = doubles(-kOutside_px), most = doubles(rays.width_px - 1 + kOutside_px), end = doubles(last);
  const Doubles level_end = doubles(u1), step = doubles(Doubles::nlanes);
  static constexpr std::array<double, 4> kSteps{0.0, 1.0, 2.0, 3.0};
  static_assert(Doubles::nlanes <= static_cast<int>(kSteps.size()));
  Doubles y = doubles(first) + cv::vx_load(kSteps.data());
  for (std::int32_t row = first; row <= last; row += Doubles::nlanes, y += step) {
    // The row's whole band, not its middle: the ends of nearly level edges count.
    const Doubles low = cv::v_min(cv::v_max(y - half, wide_v0), wide_v1);
    const Doubles high = cv::v_min(cv::v_max(y + half, wide_v0), wide_v1);
    const Doubles at_low = wide_u0 + wide_slope * (low - wide_v0);
    const Doubles at_high = level ? level_end : wide_u0 + wide_slope * (high - wide_v0);
    const Doubles left = cv::v_min(at_low, at_high), right = cv::v_max(at_low, at_high);
    outline.extend(row, (y <= end) & (right >= least) & (left <= most), left, right);
  }
}

bool SelfFilter::add_some(const HalfRays& rays, const std::array<LegShapes, kFootCount>& body, const BodyMargin& margin,
                          std::size_t slot) noexcept {
  if (slot >= kShapes) return true;
  const LegShapes& leg = body[slot / 3];
  outline_.work.add(100);
  const bool whole = slot % 3 == 2 ? add_foot(rays, leg.foot, margin)
                                   : add_capsule(rays, slot % 3 == 0 ? leg.thigh : leg.shank, margin);
  if (!whole) return false;
  next_ = 0;
  const Rows rows{outline_.touched.first, std::min(outline_.touched.last, rays.height_px - 1)};
  outline_.work.add(300);
  outline_.work.add(std::max(rows.last - rows.first + 1, 0), 26);
  // Outwards to whole pixels: a pixel is body when any part of it may be.
  for (auto row = static_cast<std::size_t>(rows.first); static_cast<std::int32_t>(row) <= rows.last; ++row) {
    const double first = outline_.first_px[row], last = outline_.last_px[row];
    if (!(first <= last)) continue;
    const auto to_pixel = [&](double column) {
      return static_cast<std::int16_t>(math::clamp(column, 0.0, rays.width_px - 1.0));
    };
    any_[row] = true;
    covered_[slot][row] = {to_pixel(std::floor(first)), to_pixel(std::ceil(last))};
  }
  outline_.clear();
  return true;
}

bool SelfFilter::add_capsule(const HalfRays& rays, const Capsule& capsule, const BodyMargin& margin) noexcept {
  constexpr int kAtOnce = 3;
  if (!(capsule.radius_m > 0.0)) return true;
  for (const int end = std::min(next_ + kAtOnce, kSpheresPerCapsule); next_ < end; ++next_) {
    const double along = static_cast<double>(next_) / (kSpheresPerCapsule - 1);
    const Vec3 centre_m = capsule.a_m + along * (capsule.b_m - capsule.a_m);
    add_sphere(outline_, rays, centre_m, capsule.radius_m + margin.at(centre_m.norm()));
  }
  return next_ == kSpheresPerCapsule;
}

bool SelfFilter::add_foot(const HalfRays& rays, const OrientedBox& foot, const BodyMargin& margin) noexcept {
  constexpr int kAtOnce = 7, kChords = 28;
  if (!(foot.half_m.minCoeff() > 0.0)) return true;
  outline_.work.add(500);
  std::array<Vec3, 8> corners;
  const double farthest_m = foot.centre.p_m.norm() + foot.half_m.norm();
  const Vec3 half = foot.half_m + Vec3::Constant(margin.at(farthest_m));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 sign{(i & 1U) != 0 ? 1.0 : -1.0, (i & 2U) != 0 ? 1.0 : -1.0, (i & 4U) != 0 ? 1.0 : -1.0};
    corners[i] = foot.centre * half.cwiseProduct(sign);
  }
  // All pairs: the outline of a convex shape needs no hull when every chord is drawn.
  int chord = 0;
  const int first = next_, end = std::min(next_ + kAtOnce, kChords);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = i + 1; j < corners.size(); ++j, ++chord) {
      if (chord >= first && chord < end) add_segment(outline_, rays, corners[i], corners[j]);
    }
  }
  next_ = end;
  return next_ == kChords;
}

bool SelfFilter::try_mark_row(std::int32_t row, std::int32_t width_px, std::uint8_t* flags) const noexcept {
  if (!any_[static_cast<std::size_t>(row)]) return false;
  bool any = false;
  for (const auto& ranges : covered_) {
    const ColumnRange range = ranges[static_cast<std::size_t>(row)];
    const std::int32_t last = std::min<std::int32_t>(range.last, width_px - 1);
    if (range.first > last) continue;
    if (!any) std::fill(flags, flags + width_px, std::uint8_t{0});
    any = true;
    std::fill(flags + range.first, flags + last + 1, static_cast<std::uint8_t>(kPixelBody));
  }
  return any;
}

}  // namespace polygmap
