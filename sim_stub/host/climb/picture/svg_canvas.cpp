// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/picture/svg_canvas.hpp"

#include <cstdarg>
#include <cstdio>

namespace polygmap::sim::svg {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return out;
}

}  // namespace

void add(std::string& out, const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  char buffer[512];
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  out += buffer;
}

std::string points(const View& view, std::span<const Vec3> path_m, double min_gap_px) {
  std::string out;
  double x = 0.0, y = 0.0;
  for (const Vec3& p_m : path_m) {
    if (!math::all_finite(p_m)) continue;
    const double next_x = view.x_px(p_m), next_y = view.y_px(p_m);
    if (!out.empty() && std::hypot(next_x - x, next_y - y) < min_gap_px) continue;
    x = next_x;
    y = next_y;
    add(out, "%.1f,%.1f ", x, y);
  }
  return out;
}

void add_trail(std::string& out, const View& view, std::span<const Vec3> path_m, const char* colour, double width_px) {
  out += "<polyline points=\"" + points(view, path_m, 1.2);
  add(out, "\" fill=\"none\" stroke=\"%s\" stroke-width=\"%.1f\" stroke-linejoin=\"round\"/>\n", colour, width_px);
}

void add_polygon(std::string& out, const View& view, std::span<const Vec3> vertices_m, const char* style) {
  out += "<polygon points=\"" + points(view, vertices_m) + "\" " + style + "/>\n";
}

void add_text(std::string& out, double x_px, double y_px, double size_px, const char* more, const std::string& text) {
  add(out, "<text x=\"%.1f\" y=\"%.1f\" font-size=\"%.1f\" %s>", x_px, y_px, size_px, more);
  out += escaped(text) + "</text>\n";
}

}  // namespace polygmap::sim::svg
