// SPDX-License-Identifier: Apache-2.0
// What an SVG of a climb is drawn with: numbers, shapes, and views of the world.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "algorithms/core/math/transform.hpp"

namespace polygmap::sim::svg {

constexpr const char* kStairFill = "#ddd8cf";
constexpr const char* kStairLine = "#8b8376";
constexpr double kLabelScale_pxpm = 150.0;  // below, numbers in the feet would not be readable

// Appends printf-style: an SVG is mostly numbers.
[[gnu::format(printf, 2, 3)]] void add(std::string& out, const char* format, ...);

struct Range {
  double low = 0.0, high = 0.0;
  void include(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  void grow(double by) {
    low -= by;
    high += by;
  }
  [[nodiscard]] double length() const { return high - low; }
};

// One view: x to the right, `up` (2: z, the side view; 1: y, the view from above) upwards, of a world that is turned
// about the vertical first.
struct View {
  int up;
  double left_px, bottom_px, scale_pxpm, x_low_m, up_low_m;
  Mat3 view_R_true = Mat3::Identity();
  [[nodiscard]] double x_px(const Vec3& p_m) const {
    return left_px + (view_R_true.row(0).dot(p_m) - x_low_m) * scale_pxpm;
  }
  [[nodiscard]] double y_px(const Vec3& p_m) const {
    return bottom_px - (view_R_true.row(up).dot(p_m) - up_low_m) * scale_pxpm;
  }
};

// "x,y x,y ". With min_gap_px, points closer than that to the last one are left out.
[[nodiscard]] std::string points(const View& view, std::span<const Vec3> path_m, double min_gap_px = 0.0);
void add_trail(std::string& out, const View& view, std::span<const Vec3> path_m, const char* colour, double width_px);
void add_polygon(std::string& out, const View& view, std::span<const Vec3> vertices_m, const char* style);
void add_text(std::string& out, double x_px, double y_px, double size_px, const char* more, const std::string& text);

}  // namespace polygmap::sim::svg
