// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/world_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <set>

#include "algorithms/core/math/transform.hpp"
#include "firmware/config/param_table.hpp"
#include "firmware/config/toml_reader.hpp"
#include "sim_stub/world/clearance.hpp"
#include "sim_stub/world/tops.hpp"

namespace polygmap::sim {
namespace {

constexpr double kFarthest_m = 1000.0, kLargest_m = 100.0, kSmallest_m = 0.001, kRadPerDeg = kPi / 180.0;
constexpr double kSteepest_rad = 0.5;  // of a top that is walkable
constexpr std::string_view kFloor = "floor";
constexpr std::size_t kMostSolids = 500;

using Line = toml::source_index;

std::string in_quotes(std::string_view text) { return std::string("\"").append(text).append("\""); }

class WorldReader {
 public:
  explicit WorldReader(config::FileName name) : name_(std::move(name)) {}

  WorldFile read(std::string_view text) {
    const toml::table root = config::parse_toml(name_, text);
    only(root, {"start", "goal", "solid"}, "a world");
    file_.world.is_staircase = false;
    if (const toml::node* solids = root.get("solid")) take_solids(*solids);
    file_.start = place(root, "start").value_or(WorldPlace{});
    if (!root.contains("start")) throw config::FileError(name_.text() + ": [start] is missing.");
    file_.world.goal = place(root, "goal");
    group_tops(file_.world);
    if (file_.start.step != kFloorStep) {
      file_.start_height_m = file_.world.point_m(file_.start).z();
    }
    check_start(root.get("start")->source().begin.line);
    return file_;
  }

 private:
  [[noreturn]] void fail(Line line, const std::string& what) const { name_.fail(line, what); }

  void only(const toml::table& table, std::initializer_list<std::string_view> keys, std::string_view of) const {
    for (const auto& entry : table) {
      if (std::ranges::find(keys, entry.first.str()) != keys.end()) continue;
      std::string all;
      for (const std::string_view key : keys) all.append(all.empty() ? "" : ", ").append(key);
      fail(entry.first.source().begin.line,
           in_quotes(entry.first.str()) + " is no key of " + std::string(of) + "; there are " + all);
    }
  }
  [[nodiscard]] double number(const toml::node& node, const std::string& what, double least, double most) const {
    if (!node.is_number()) fail(node.source().begin.line, what + " must be a number");
    const double value = node.is_integer() ? static_cast<double>(node.as_integer()->get()) : *node.value<double>();
    if (!(value >= least && value <= most)) {
      fail(node.source().begin.line, what + " must be from " + config::text_of(least) + " to " + config::text_of(most) +
                                         ", not " + config::text_of(value));
    }
    return value;
  }
  [[nodiscard]] const toml::node& find(const toml::table& table, std::string_view key, std::string_view of) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) fail(table.source().begin.line, std::string(of) + ": " + std::string(key) + " is missing");
    return *node;
  }
  [[nodiscard]] std::string text(const toml::node& node, const std::string& what) const {
    const auto* value = node.as_string();
    const auto is_control = [](unsigned char byte) { return byte < 0x20 || byte == 0x7F; };
    if (value == nullptr || value->get().empty() || std::ranges::any_of(value->get(), is_control)) {
      fail(node.source().begin.line, what + " must be a text in quotes, without control characters");
    }
    return value->get();
  }
  [[nodiscard]] Vec3 three(const toml::node& node, const std::string& what, double least, double most) const {
    const toml::array* numbers = node.as_array();
    if (numbers == nullptr || numbers->size() != 3) {
      fail(node.source().begin.line, what + " must be three numbers in brackets");
    }
    Vec3 out;
    for (std::size_t i = 0; i < 3; ++i) {
      out[static_cast<Eigen::Index>(i)] = number((*numbers)[i], what, least, most);
    }
    return out;
  }

  void take_solids(const toml::node& node) {
    const toml::array* list = node.as_array();
    if (list == nullptr || !list->is_homogeneous<toml::table>()) {
      fail(node.source().begin.line, "each solid must be a table, [[solid]]");
    }
    if (list->size() > kMostSolids) {
      fail(node.source().begin.line,
           "there are " + std::to_string(list->size()) + " solids, at most " + std::to_string(kMostSolids));
    }
    for (const toml::node& entry : *list) take_solid(*entry.as_table());
  }
  void take_solid(const toml::table& table) {
    only(table, {"name", "centre", "size", "rpy_deg", "walkable", "depth"}, "a solid");
    const std::string name = text(find(table, "name", "a solid"), "name");
    const Line line = table.get("name")->source().begin.line;
    if (name == kFloor || !names_.insert(name).second) {
      fail(line, in_quotes(name) + (name == kFloor ? " is z = 0, and no solid" : " is the name of two solids"));
    }
    const Vec3 half_m = 0.5 * three(find(table, "size", name), name + ": size", kSmallest_m, kLargest_m);
    Transform true_T_solid;
    true_T_solid.p_m = three(find(table, "centre", name), name + ": centre", -kFarthest_m, kFarthest_m);
    if (const toml::node* rpy = table.get("rpy_deg")) {
      const Vec3 turn_rad = kRadPerDeg * three(*rpy, name + ": rpy_deg", -360.0, 360.0);
      true_T_solid.R = rotation_zyx(turn_rad.z(), turn_rad.y(), turn_rad.x());
    }
    bool is_walkable = true, is_glass = false;
    if (const toml::node* walkable = table.get("walkable")) {
      if (!walkable->is_boolean()) fail(walkable->source().begin.line, name + ": walkable must be true or false");
      is_walkable = walkable->as_boolean()->get();
    }
    if (const toml::node* depth = table.get("depth")) {
      const std::string kind = text(*depth, name + ": depth");
      if (kind != "seen" && kind != "glass") {
        fail(depth->source().begin.line, name + R"(: depth must be "seen" or "glass", not )" + in_quotes(kind));
      }
      is_glass = kind == "glass";
    }
    Step top = top_of(true_T_solid, half_m);
    top.name = name;
    top.is_walkable = is_walkable && top.true_T_step.R(2, 2) >= std::cos(kSteepest_rad);
    file_.world.solids.push_back(
        {-half_m, half_m, static_cast<int>(file_.world.steps.size()), true_T_solid, 0.0, is_glass});
    file_.world.steps.push_back(top);
  }
  // Of the face that is turned up most.
  [[nodiscard]] static Step top_of(const Transform& true_T_solid, const Vec3& half_m) {
    Eigen::Index up = 0;
    true_T_solid.R.row(2).cwiseAbs().maxCoeff(&up);
    const Eigen::Index x = (up + 1) % 3, y = (up + 2) % 3;
    const double sign = true_T_solid.R(2, up) < 0.0 ? -1.0 : 1.0;
    Step top;
    top.true_T_step.R << true_T_solid.R.col(x), sign * true_T_solid.R.col(y), sign * true_T_solid.R.col(up);
    top.true_T_step.p_m = true_T_solid.p_m + half_m[up] * top.true_T_step.R.col(2);
    top.riser_x_m = top.nosing_x_m = -half_m[x];
    top.back_x_m = half_m[x];
    top.half_width_m = half_m[y];
    return top;
  }

  // Physics puts it there with level soles, as it would stand on a floor.
  void check_start(Line line) const {
    const WorldPlace& start = file_.start;
    const Mat3 turn = rotation_z(start.yaw_rad.value_or(0.0));
    const Vec3 middle_m{start.x_m, start.y_m, file_.start_height_m};
    constexpr double kLevel_rad = 0.02;
    if (start.step >= 0 && step_of(start).true_T_step.R(2, 2) < std::cos(kLevel_rad)) {
      fail(line, "start: " + in_quotes(step_of(start).name) + " slopes, and the robot starts on what is level");
    }
    const double aside_m = nominal_robot().stance.half_width_m;
    for (const double side : {1.0, -1.0}) {
      const Transform true_T_sole{turn, middle_m + turn * Vec3(0.0, side * aside_m, 0.0)};
      if (margin_on_tops_m(true_T_sole, file_.world, start.step, nominal_robot().sole) < 0.0) {
        fail(line, "start: a sole would reach over an edge");
      }
    }
    // What a robot that stands takes up, above its soles.
    const Vec3 half_m{0.2, 0.25, 0.8}, above_m{0.0, 0.0, half_m.z() + 0.02};
    const OrientedBox body{{turn, middle_m + above_m}, half_m};
    for (const SolidBox& solid : file_.world.solids) {
      if (signed_distance_m(body, solid) > 0.0 || file_.world.are_one(solid.step, start.step)) continue;
      fail(line, "start: the robot would stand in " +
                     in_quotes(file_.world.steps[static_cast<std::size_t>(solid.step)].name));
    }
  }
  [[nodiscard]] const Step& step_of(const WorldPlace& at) const {
    return file_.world.steps[static_cast<std::size_t>(at.step)];
  }
  [[nodiscard]] std::optional<WorldPlace> place(const toml::table& root, std::string_view key) const {
    const toml::node* node = root.get(key);
    if (node == nullptr) return {};
    const std::string label(key);
    const toml::table* table = node->as_table();
    if (table == nullptr) fail(node->source().begin.line, label + " must be a table, [" + label + "]");
    only(*table, {"x", "y", "yaw_deg", "surface"}, "[" + label + "]");
    WorldPlace at;
    at.x_m = number(find(*table, "x", label), label + ": x", -kFarthest_m, kFarthest_m);
    at.y_m = number(find(*table, "y", label), label + ": y", -kFarthest_m, kFarthest_m);
    const toml::node* yaw = table->get("yaw_deg");
    if (yaw != nullptr) at.yaw_rad = kRadPerDeg * number(*yaw, label + ": yaw_deg", -360.0, 360.0);
    if (yaw == nullptr && key == "start") static_cast<void>(find(*table, "yaw_deg", label));
    const toml::node& surface = find(*table, "surface", label);
    const std::string name = text(surface, label + ": surface");
    if (name == kFloor) return at;
    const auto named = std::ranges::find(file_.world.steps, name, &Step::name);
    if (named == file_.world.steps.end() || !named->is_walkable) {
      fail(surface.source().begin.line, label + ": " + in_quotes(name) + " is no walkable solid and not \"floor\"");
    }
    at.step = static_cast<int>(named - file_.world.steps.begin());
    const Vec3 p_m = named->true_T_step.inverse() * Vec3(at.x_m, at.y_m, named->top_m(at.x_m, at.y_m));
    if (std::abs(p_m.x()) > named->back_x_m || std::abs(p_m.y()) > named->half_width_m) {
      fail(surface.source().begin.line, label + ": x and y are not on " + in_quotes(name));
    }
    return at;
  }

  config::FileName name_;
  WorldFile file_;
  std::set<std::string> names_;
};

}  // namespace

std::optional<Destination> destination_in(const WorldFile& file) {
  if (!file.world.goal) return std::nullopt;
  const WorldPlace &from = file.start, &to = *file.world.goal;
  const double yaw_rad = from.yaw_rad.value_or(0.0);
  const Vec3 way_m = rotation_z(yaw_rad).transpose() * (file.world.point_m(to) - file.world.point_m(from));
  return Destination{
      way_m.x(), way_m.y(), math::wrap_angle(to.yaw_rad.value_or(yaw_rad) - yaw_rad), to.yaw_rad.has_value(),
      way_m.z(), true};
}

WorldFile parse_world(const std::string& path, std::string_view text) {
  return WorldReader({"world", path}).read(text);
}
WorldFile read_world(const std::string& path) { return parse_world(path, config::read_text({"world", path})); }

}  // namespace polygmap::sim
