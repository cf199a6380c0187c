// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/world/kinds/world_plan.hpp"

#include <cmath>
#include <cstdio>

namespace polygmap::sim {
namespace {

std::string rounded(double value, double per_unit) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.10g", std::round(value * per_unit) / per_unit + 0.0);  // no -0
  return buffer;
}
std::string length(double value_m) { return rounded(value_m, 1e4); }
std::string angle(double value_deg) { return rounded(std::remainder(value_deg, 360.0), 1e3); }

std::string three(const char* key, const Vec3& values, std::string (*text)(double)) {
  return std::string(key) + " = [" + text(values.x()) + ", " + text(values.y()) + ", " + text(values.z()) + "]\n";
}

std::string place(const char* key, const PlannedPlace& at) {
  std::string text = "\n[" + std::string(key) + "]\nx = " + length(at.x_m) + "\ny = " + length(at.y_m) + "\n";
  if (at.yaw_deg) text += "yaw_deg = " + angle(*at.yaw_deg) + "\n";
  return text + "surface = \"" + at.surface + "\"\n";
}

}  // namespace

std::string to_toml(const WorldPlan& plan) {
  std::string text = "# " + plan.what + "\n" + place("start", plan.start);
  if (plan.goal) text += place("goal", *plan.goal);
  for (const PlannedSolid& solid : plan.solids) {
    text += "\n[[solid]]\nname = \"" + solid.name + "\"\n";
    text += three("centre", solid.centre_m, length) + three("size", solid.size_m, length);
    if (!solid.rpy_deg.isZero()) text += three("rpy_deg", solid.rpy_deg, angle);
    if (!solid.is_walkable) text += "walkable = false\n";
    if (solid.is_glass) text += "depth = \"glass\"\n";
  }
  return text;
}

}  // namespace polygmap::sim
