// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/convex_outline.hpp"

namespace polygmap {
namespace {

double cross(const Vec2& a, const Vec2& b, const Vec2& c) noexcept {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

}  // namespace

double twice_area(const Outline2& outline) noexcept {
  double sum = 0.0;
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 &a = outline[i], &b = outline[(i + 1) % n];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum;
}

Vec2 centroid(const Outline2& outline) noexcept {
  Vec2 sum = Vec2::Zero();
  const std::size_t n = outline.size();
  if (n == 0) return sum;
  double total = 0.0;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double area = cross(outline[0], outline[i], outline[i + 1]);
    sum += area / 3.0 * (outline[0] + outline[i] + outline[i + 1]);
    total += area;
  }
  return std::abs(total) > 1e-12 ? Vec2{sum / total} : outline[0];
}

void clip(Outline2& outline, const Vec2& point, const Vec2& normal) noexcept {
  const Outline2 source = outline;
  outline.clear();
  const std::size_t n = source.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 &a = source[i], &b = source[(i + 1) % n];
    const double da = normal.dot(a - point), db = normal.dot(b - point);
    if (da >= 0.0) static_cast<void>(outline.try_push_back(a));
    if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0)) {
      static_cast<void>(outline.try_push_back(a + da / (da - db) * (b - a)));
    }
  }
}

void reduce(Outline2& outline, std::size_t count, double min_area) noexcept {
  while (outline.size() > 3) {
    const std::size_t n = outline.size();
    std::size_t least = 0;
    double least_area = 1e18;
    for (std::size_t i = 0; i < n; ++i) {
      const double area = 0.5 * std::abs(cross(outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]));
      if (area < least_area) {
        least_area = area;
        least = i;
      }
    }
    if (n <= count && least_area >= min_area) return;
    for (std::size_t i = least; i + 1 < n; ++i) outline[i] = outline[i + 1];
    static_cast<void>(outline.try_pop_back());
  }
}

}  // namespace polygmap
