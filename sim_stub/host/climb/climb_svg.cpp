// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/climb_svg.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

#include "sim_stub/host/climb/picture/svg_canvas.hpp"
#include "sim_stub/host/climb/picture/world_picture.hpp"
#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

using namespace svg;

constexpr double kWidth_px = 1440.0;
constexpr double kBorder_px = 36.0;
constexpr double kMaxView_px = 1000.0;  // height of the side view of a tall staircase

constexpr const char* kTreadColour = "#1f9d57";
constexpr const char* kRiserColour = "#2b8ca8";
constexpr const char* kOtherColour = "#e08a1e";
constexpr const char* kBaseColour = "#30343b";
constexpr std::array<const char*, kFootCount> kFootColour{"#cf3f36", "#7a45b8"};

enum class Layer { kAll, kFloor, kStairs };

// The floor's convex polygon may run beneath the stairs.
bool is_floor(const ClimbDrawing::Polygon& polygon) {
  constexpr double kFloorHeight_m = 0.03;
  return polygon.kind == SurfaceKind::kTread &&
         std::all_of(polygon.vertices_m.begin(), polygon.vertices_m.end(),
                     [](const Vec3& vertex_m) { return vertex_m.z() < kFloorHeight_m; });
}

void add_map(std::string& out, const View& view, const ClimbDrawing& drawing, Layer layer) {
  for (const ClimbDrawing::Polygon& polygon : drawing.polygons) {
    if (layer != Layer::kAll && is_floor(polygon) != (layer == Layer::kFloor)) continue;
    const char* colour = polygon.kind == SurfaceKind::kTread   ? kTreadColour
                         : polygon.kind == SurfaceKind::kRiser ? kRiserColour
                                                               : kOtherColour;
    char style[200];
    if (polygon.remembered) {
      std::snprintf(style, sizeof style, "fill=\"%s\" fill-opacity=\"0.16\" stroke=\"%s\" stroke-width=\"1.6\"", colour,
                    colour);
    } else {
      std::snprintf(style, sizeof style,
                    "fill=\"none\" stroke=\"%s\" stroke-width=\"1\" stroke-dasharray=\"2 3\" stroke-opacity=\"0.6\"",
                    colour);
    }
    add_polygon(out, view, polygon.vertices_m, style);
  }
}

std::array<Vec3, 4> rectangle_m(const Transform& T, double heel_x_m, double toe_x_m, const Vec3& to_side_m) {
  return {T * Vec3(heel_x_m, 0, 0) - to_side_m, T * Vec3(toe_x_m, 0, 0) - to_side_m,
          T * Vec3(toe_x_m, 0, 0) + to_side_m, T * Vec3(heel_x_m, 0, 0) + to_side_m};
}

// From above the contact rectangle; from the side the foot's box standing on its sole.
std::array<Vec3, 4> foot_outline_m(const View& view, const Transform& true_T_sole) {
  const SoleModel& sole = nominal_robot().sole;
  if (view.up == 1) {
    const SoleRectangle& contact = sole.contact;
    return rectangle_m(true_T_sole, contact.heel_x_m, contact.toe_x_m, true_T_sole.R.col(1) * contact.half_width_m);
  }
  const Vec3 up_m = true_T_sole.R.col(2) * (0.5 * sole.collision_height_m);
  std::array<Vec3, 4> box = rectangle_m(true_T_sole, sole.collision.heel_x_m, sole.collision.toe_x_m, up_m);
  for (Vec3& corner_m : box) corner_m += up_m;
  return box;
}

void add_footsteps(std::string& out, const View& view, const std::vector<Footstep>& footsteps) {
  for (const Footstep& f : footsteps) {
    const char* colour = kFootColour[index_of(f.foot)];
    char style[200];
    if (f.landed) {
      std::snprintf(style, sizeof style, "fill=\"%s\" fill-opacity=\"%.2f\" stroke=\"%s\" stroke-width=\"1.2\"", colour,
                    view.up == 1 ? 0.22 : 0.12, colour);
      add_polygon(out, view, foot_outline_m(view, f.true_T_landed), style);
    }
    std::snprintf(style, sizeof style,
                  "fill=\"none\" stroke=\"%s\" stroke-width=\"1.4\" stroke-dasharray=\"5 3\" stroke-opacity=\"0.9\"",
                  "#1d3f8f");
    add_polygon(out, view, foot_outline_m(view, f.true_T_planned), style);
  }
  if (view.up != 1 || view.scale_pxpm < kLabelScale_pxpm) return;
  for (const Footstep& f : footsteps) {
    if (!f.landed || !std::isfinite(f.sole_margin_m)) continue;
    const Vec3 centre_m = f.true_T_landed * Vec3(nominal_robot().sole.contact.centre_x_m(), 0, 0);
    std::string margin;
    add(margin, "%.1f", f.sole_margin_m * 1e3);
    char style[120];
    std::snprintf(style, sizeof style, "text-anchor=\"middle\" font-weight=\"600\" fill=\"%s\"",
                  f.sole_margin_m < 0.0 ? "#c00000" : "#26282c");
    add_text(out, view.x_px(centre_m), view.y_px(centre_m) + 4.0, 11.0, style, margin);
  }
}

void add_scale_bar(std::string& out, const View& view, double right_px, double y_px) {
  double length_m = 0.5;
  while (length_m * view.scale_pxpm < 60.0) length_m *= 2.0;
  const double left_px = right_px - length_m * view.scale_pxpm;
  add(out, "<path d=\"M%.1f %.1fv8m0 -4H%.1fm0 -4v8\" fill=\"none\" stroke=\"#444\" stroke-width=\"1.5\"/>\n", left_px,
      y_px - 4.0, right_px);
  std::string label;
  add(label, "%g m", length_m);
  add_text(out, 0.5 * (left_px + right_px), y_px - 8.0, 12.0, "text-anchor=\"middle\" fill=\"#444\"", label);
}

void add_legend(std::string& out, double y_px) {
  struct Entry {
    const char* text;
    const char* colour;
    const char* shape;  // printf style of an area 26 px wide around (x, y): x, y, colour, colour
  };
  constexpr const char* kArea =
      "<rect x=\"%.1f\" y=\"%.1f\" width=\"26\" height=\"12\" fill=\"%s\" fill-opacity=\"0.22\" stroke=\"%s\" "
      "stroke-width=\"1.4\"/>\n";
  const std::array<Entry, 9> entries{{{"true stairs", kStairLine, "solid"},
                                      {"mapped tread", kTreadColour, "area"},
                                      {"mapped riser", kRiserColour, "area"},
                                      {"other mapped surface", kOtherColour, "area"},
                                      {"planned foothold", "#1d3f8f", "dash"},
                                      {"left foot", kFootColour[0], "area"},
                                      {"right foot", kFootColour[1], "area"},
                                      {"foot trails", kFootColour[0], "thin"},
                                      {"base trail", kBaseColour, "line"}}};
  double x_px = kBorder_px;
  for (const Entry& e : entries) {
    const std::string shape = e.shape;
    if (shape == "area") {
      add(out, kArea, x_px, y_px - 10.0, e.colour, e.colour);
    } else if (shape == "solid") {
      add(out, "<rect x=\"%.1f\" y=\"%.1f\" width=\"26\" height=\"12\" fill=\"%s\" stroke=\"%s\"/>\n", x_px,
          y_px - 10.0, kStairFill, e.colour);
    } else if (shape == "dash") {
      add(out,
          "<rect x=\"%.1f\" y=\"%.1f\" width=\"26\" height=\"12\" fill=\"none\" stroke=\"%s\" stroke-width=\"1.4\" "
          "stroke-dasharray=\"5 3\"/>\n",
          x_px, y_px - 10.0, e.colour);
    } else if (shape == "thin") {
      add(out, "<path d=\"M%.1f %.1fh26\" stroke=\"%s\" stroke-width=\"1\"/>\n", x_px, y_px - 6.0, kFootColour[0]);
      add(out, "<path d=\"M%.1f %.1fh26\" stroke=\"%s\" stroke-width=\"1\"/>\n", x_px, y_px - 1.0, kFootColour[1]);
    } else {
      add(out, "<path d=\"M%.1f %.1fh26\" stroke=\"%s\" stroke-width=\"2.2\"/>\n", x_px, y_px - 4.0, e.colour);
    }
    add_text(out, x_px + 33.0, y_px, 13.0, "fill=\"#333\"", e.text);
    x_px += 33.0 + 7.2 * static_cast<double>(std::string(e.text).size()) + 22.0;
  }
  add_text(
      out, kBorder_px, y_px + 22.0, 12.0, "fill=\"#6b6b6b\"",
      "Mapped surfaces and planned footholds are in the module's own world, laid on the true one once at the start. "
      "Dotted: dropped from the map. Numbers in the feet: least sole margin on that tread, mm.");
}

std::vector<std::string> wrapped(const std::string& text, std::size_t columns) {
  std::vector<std::string> lines{""};
  std::size_t from = 0;
  while (from < text.size()) {
    std::size_t to = text.find(' ', from);
    if (to == std::string::npos) to = text.size();
    const std::string word = text.substr(from, to - from);
    if (!lines.back().empty() && lines.back().size() + 1 + word.size() > columns) lines.emplace_back();
    if (!lines.back().empty()) lines.back() += ' ';
    lines.back() += word;
    from = to + 1;
  }
  return lines;
}

std::string value(const char* name, double figure, const char* unit) {
  std::string out = name;
  if (std::isfinite(figure)) {
    add(out, " %.1f %s", figure, unit);
  } else {
    out += " \u2013";
  }
  return out;
}

}  // namespace

std::string climb_svg(const StairWorld& world, const ClimbDrawing& drawing, const ClimbSummary& s) {
  Range x_m{-0.5, 0.5}, y_m{-0.5, 0.5}, z_m{-0.06, 0.5};
  if (world.is_staircase) y_m = {-world.half_width_m, world.half_width_m};
  for (const Step& step : world.steps) {
    if (!world.is_staircase) break;
    x_m.include(step.back_x_m);
    z_m.include(step.height_m);
  }
  const WorldFile* file = s.options.world ? &*s.options.world : nullptr;
  const Mat3 view_R_true = file != nullptr ? view_turn(*file) : Mat3::Identity();
  const auto include_point = [&](const Vec3& true_p_m) {
    const Vec3 p_m = view_R_true * true_p_m;
    x_m.include(p_m.x());
    y_m.include(p_m.y());
    z_m.include(p_m.z());
  };
  for (const Vec3& p_m : drawing.base_trail_m) include_point(p_m);
  for (const auto& trail_m : drawing.sole_trail_m) {
    for (const Vec3& p_m : trail_m) include_point(p_m);
  }
  if (file != nullptr) {
    constexpr double kLabel_m = 0.3;  // above the ground
    include_point(world.point_m(file->start));
    if (file->world.goal) include_point(world.point_m(*file->world.goal) + kLabel_m * Vec3::UnitZ());
  }
  // What is farther from the robot's way than this is no part of the picture.
  constexpr double kAround_m = 2.0;
  const Range near_x_m{x_m.low - kAround_m, x_m.high + kAround_m}, near_y_m{y_m.low - kAround_m, y_m.high + kAround_m},
      near_z_m{z_m.low, z_m.high + kAround_m};
  for (const SolidBox& solid : world.solids) {
    const OrientedBox box = solid.box();
    const Vec3 reach_m = (view_R_true * box.centre.R).cwiseAbs() * box.half_m;
    const Vec3 middle_m = view_R_true * box.centre.p_m;
    for (const Vec3& p_m : {Vec3(middle_m - reach_m), Vec3(middle_m + reach_m)}) {
      x_m.include(std::clamp(p_m.x(), near_x_m.low, near_x_m.high));
      y_m.include(std::clamp(p_m.y(), near_y_m.low, near_y_m.high));
      z_m.include(std::clamp(p_m.z(), near_z_m.low, near_z_m.high));
    }
  }
  x_m.grow(0.22);
  y_m.grow(0.08);
  z_m.high += 0.08;

  const double room_px = kWidth_px - 2.0 * kBorder_px;
  const double scale = std::min(room_px / x_m.length(), kMaxView_px / z_m.length());
  const std::vector<std::string> reason = wrapped(s.reason, 170);

  const double header_px = 84.0 + 19.0 * static_cast<double>(reason.size());
  const double side_top_px = header_px + 26.0;
  const double side_px = z_m.length() * scale;
  const double above_top_px = side_top_px + side_px + 46.0;
  const double above_px = y_m.length() * scale;
  const double legend_px = above_top_px + above_px + 36.0;
  const double height_px = legend_px + 44.0;
  const View side{2, kBorder_px, side_top_px + side_px, scale, x_m.low, z_m.low, view_R_true};
  const View above{1, kBorder_px, above_top_px + above_px, scale, x_m.low, y_m.low, view_R_true};
  const double view_px = x_m.length() * scale;

  std::string out;
  add(out,
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" viewBox=\"0 0 %.0f %.0f\" "
      "font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n",
      kWidth_px, height_px, kWidth_px, height_px);
  add(out, "<title>%s</title>\n", s.pass ? "Climb passed" : "Climb failed");
  add(out, "<rect width=\"%.0f\" height=\"%.0f\" fill=\"#fcfbf9\"/>\n<defs>\n", kWidth_px, height_px);
  add(out, "<clipPath id=\"side\"><rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/></clipPath>\n",
      kBorder_px, side_top_px, view_px, side_px);
  add(out, "<clipPath id=\"above\"><rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/></clipPath>\n</defs>\n",
      kBorder_px, above_top_px, view_px, above_px);

  add(out, "<rect x=\"%.1f\" y=\"22\" width=\"74\" height=\"30\" rx=\"5\" fill=\"%s\"/>\n", kBorder_px,
      s.pass ? "#1c8a4b" : "#c0312b");
  add_text(out, kBorder_px + 37.0, 43.0, 18.0, "text-anchor=\"middle\" font-weight=\"700\" fill=\"#fff\"",
           s.pass ? "PASS" : "FAIL");
  const std::string title =
      world.is_staircase ? std::to_string(s.steps_climbed) + " of " + std::to_string(s.steps_total) + " steps climbed"
                         : std::to_string(s.footsteps.size()) + " footsteps";
  add_text(out, kBorder_px + 90.0, 44.0, 21.0, "font-weight=\"600\" fill=\"#222\"", title);
  add_text(out, kWidth_px - kBorder_px, 44.0, 13.0, "text-anchor=\"end\" fill=\"#6b6b6b\"",
           "gait " + name_of(s.options.gait) + ", seed " + std::to_string(s.options.seed) + ", " +
               name_of(s.options.plant) + " plant");
  double text_px = 75.0;
  for (const std::string& line : reason) {
    add_text(out, kBorder_px, text_px, 14.5, "fill=\"#333\"", line);
    text_px += 19.0;
  }
  add_text(out, kBorder_px, text_px + 2.0, 13.0, "fill=\"#6b6b6b\"",
           value("foothold error max", s.foothold_error_m.max * 1e3, "mm") + "   \u00b7   " +
               value("execution error max", s.execution_error_m.max * 1e3, "mm") + "   \u00b7   " +
               value("sole margin min", s.sole_margin_min_m * 1e3, "mm") + "   \u00b7   " +
               value("swing clearance min", s.swing_clearance_min_m * 1e3, "mm") + "   \u00b7   " +
               value("odometry RMSE base / fused", s.odometry.rmse_base_m * 1e3, "") +
               value("/", s.odometry.rmse_fused_m * 1e3, "mm") + "   \u00b7   " +
               value("planes", s.plane_rate_hz, "Hz"));

  add_text(out, kBorder_px, side_top_px - 8.0, 13.0, "font-weight=\"600\" fill=\"#555\"", "Side");
  out += "<g clip-path=\"url(#side)\">\n";
  add_stairs_from_the_side(out, side, world, x_m, z_m.low - 1.0);
  add_solids(out, side, world);
  add_step_numbers(out, side, world, true);
  add_map(out, side, drawing, Layer::kAll);
  add_footsteps(out, side, s.footsteps);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    add_trail(out, side, drawing.sole_trail_m[foot], kFootColour[foot], 1.0);
  }
  add_trail(out, side, drawing.base_trail_m, kBaseColour, 2.2);
  if (file != nullptr) add_places(out, side, *file);
  out += "</g>\n";
  add_scale_bar(out, side, kBorder_px + view_px, side_top_px - 6.0);

  add_text(out, kBorder_px, above_top_px - 8.0, 13.0, "font-weight=\"600\" fill=\"#555\"", "From above");
  out += "<g clip-path=\"url(#above)\">\n";
  add_map(out, above, drawing, Layer::kFloor);
  add_stairs_from_above(out, above, world);
  add_solids(out, above, world);
  add_step_numbers(out, above, world, false);
  add_map(out, above, drawing, Layer::kStairs);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    add_trail(out, above, drawing.sole_trail_m[foot], kFootColour[foot], 1.0);
  }
  add_trail(out, above, drawing.base_trail_m, kBaseColour, 2.2);
  add_footsteps(out, above, s.footsteps);
  if (file != nullptr) add_places(out, above, *file);
  out += "</g>\n";
  add_legend(out, legend_px);
  out += "</svg>\n";
  return out;
}

}  // namespace polygmap::sim
