// SPDX-License-Identifier: Apache-2.0
#include "firmware/config/bus_file.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string_view>

#include "algorithms/robot/leg_dynamics.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "firmware/config/param_table.hpp"
#include "firmware/config/toml_reader.hpp"

namespace polygmap::config {
namespace {

struct Range {
  double least, most;
  std::string_view unit;
};
constexpr Range kAngle{0.1, 1000.0, "rad"};
constexpr Range kSpeed{0.1, 1000.0, "rad/s"};
constexpr Range kTorque{0.1, 10000.0, "Nm"};
constexpr Range kStiffness{0.1, 100000.0, "Nm/rad"};
constexpr Range kDamping{0.001, 10000.0, "Nm s/rad"};
constexpr Range kUnit{1e-4, 100.0, "N"};
constexpr Range kBitrate{10'000.0, 1'000'000.0, "bit/s"};
constexpr std::size_t kMaxBusName = 15;  // what Linux takes for an interface

std::string in_quotes(std::string_view text) { return std::string("\"").append(text).append("\""); }

class BusReader {
 public:
  explicit BusReader(FileName name) : name_(std::move(name)) { file_.path = name_.path; }

  BusFile read(std::string_view text) {
    const toml::table root = parse_toml(name_, text);
    only(root, {"bitrate", "drive", "feet"}, "a bus file");
    if (root.contains("bitrate")) {
      file_.table.bitrate_bps = static_cast<std::uint32_t>(whole(root, "", "bitrate", kBitrate, 1));
    }
    take_drives(root);
    if (const toml::node* feet = root.get("feet")) take_feet(*feet);
    file_.table.bus_count = static_cast<std::uint8_t>(file_.buses.size());
    check_loads();
    return file_;
  }

 private:
  [[noreturn]] void fail(toml::source_index line, const std::string& what) const { name_.fail(line, what); }
  [[noreturn]] void fail(const std::string& what) const { throw FileError(name_.text() + ": " + what + "."); }

  void only(const toml::table& table, std::initializer_list<std::string_view> keys, const char* of) const {
    for (const auto& entry : table) {
      if (std::ranges::find(keys, entry.first.str()) != keys.end()) continue;
      std::string all;
      for (const std::string_view key : keys) all.append(all.empty() ? "" : ", ").append(key);
      fail(entry.first.source().begin.line,
           in_quotes(entry.first.str()) + " is no key of " + of + "; there are " + all);
    }
  }

  // label: "left_knee: ", or empty. line: of the table, for what is missing.
  [[nodiscard]] const toml::node& find(const toml::table& table, const std::string& label, std::string_view key,
                                       toml::source_index line) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) fail(line, label + std::string(key) + " is missing");
    return *node;
  }
  [[nodiscard]] double number(const toml::table& table, const std::string& label, std::string_view key, Range range,
                              toml::source_index line) const {
    const toml::node& node = find(table, label, key, line);
    const auto at = node.source().begin.line;
    const std::string said = label + std::string(key) + " must be ";
    if (!node.is_number()) fail(at, said + "a number");
    const double value = node.is_integer() ? static_cast<double>(node.as_integer()->get()) : *node.value<double>();
    if (!(value >= range.least && value <= range.most)) {
      fail(at, said + "from " + text_of(range.least) + " to " + text_of(range.most) + (range.unit.empty() ? "" : " ") +
                   std::string(range.unit) + ", not " + text_of(value));
    }
    return value;
  }
  [[nodiscard]] std::uint64_t whole(const toml::table& table, const std::string& label, std::string_view key,
                                    Range range, toml::source_index line) const {
    const double value = number(table, label, key, range, line);
    if (value != std::floor(value)) {
      fail(table.get(key)->source().begin.line,
           label + std::string(key) + " must be a whole number, not " + text_of(value));
    }
    return static_cast<std::uint64_t>(value);
  }
  [[nodiscard]] std::string text(const toml::table& table, const std::string& label, std::string_view key,
                                 toml::source_index line) const {
    const toml::node& node = find(table, label, key, line);
    if (!node.is_string()) fail(node.source().begin.line, label + std::string(key) + " must be a text in quotes");
    return *node.value<std::string>();
  }

  [[nodiscard]] std::uint8_t bus(const toml::table& table, const std::string& label, toml::source_index line) {
    const std::string bus = text(table, label, "bus", line);
    const auto at = table.get("bus")->source().begin.line;
    const auto good = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-'; };
    if (bus.empty() || bus.size() > kMaxBusName || !std::ranges::all_of(bus, good)) {
      fail(at, label + "bus must name an interface such as \"can0\", not " + in_quotes(bus));
    }
    const auto known = std::ranges::find(file_.buses, bus);
    const auto index = static_cast<std::size_t>(known - file_.buses.begin());
    if (known == file_.buses.end()) {
      if (file_.buses.size() == hal::kMaxBuses) {
        fail(at,
             label + in_quotes(bus) + " is one bus more than the " + std::to_string(hal::kMaxBuses) + " there may be");
      }
      file_.buses.push_back(bus);
      file_.bus_lines.push_back(at);
    }
    return static_cast<std::uint8_t>(index);
  }

  void take_drives(const toml::table& root) {
    const toml::node* node = root.get("drive");
    const toml::array* drives = node == nullptr ? nullptr : node->as_array();
    const std::size_t count = drives == nullptr ? 0 : drives->size();
    if (drives == nullptr || !std::ranges::all_of(*drives, [](const toml::node& n) { return n.is_table(); })) {
      fail(node == nullptr ? 1 : node->source().begin.line, "there must be a [[drive]] table for each joint");
    }
    if (count != kJointCount) {
      fail("there are " + std::to_string(count) + " [[drive]] tables, and the robot has " +
           std::to_string(kJointCount) + " joints, " + std::string(kJointNames.front()) + " to " +
           std::string(kJointNames.back()));
    }
    std::size_t n = 0;
    for (const toml::node& drive : *drives) {
      take_drive(*drive.as_table(), n, drive.source().begin.line);
      ++n;
    }
  }

  void take_drive(const toml::table& table, std::size_t n, toml::source_index line) {
    const std::string label = std::string(kJointNames[n]) + ": ";
    only(table, {"bus", "id", "reply_id", "p", "v", "t", "kp", "kd", "reply"}, "a drive");
    hal::CanDrive& drive = file_.table.drives[n];
    drive.bus = bus(table, label, line);
    if (table.contains("reply")) {
      const std::string rule = text(table, label, "reply", line);
      if (rule != "id" && rule != "status_nibble") {
        fail(table.get("reply")->source().begin.line,
             label + "reply must be \"id\" or \"status_nibble\", not " + in_quotes(rule));
      }
      drive.reply = rule == "id" ? hal::MitReplyRule::kId : hal::MitReplyRule::kStatusNibble;
    }
    // Byte 0 of a reply has no more room for the drive's name.
    const double most_id = drive.reply == hal::MitReplyRule::kStatusNibble ? 15 : 255;
    drive.id = static_cast<std::uint16_t>(whole(table, label, "id", {1, most_id, ""}, line));
    drive.reply_id = static_cast<std::uint16_t>(whole(table, label, "reply_id", {0, hal::kMaxCanId, ""}, line));
    drive.ranges = {number(table, label, "p", kAngle, line), number(table, label, "v", kSpeed, line),
                    number(table, label, "t", kTorque, line), number(table, label, "kp", kStiffness, line),
                    number(table, label, "kd", kDamping, line)};
    check_ids(n, line);
  }

  void check_ids(std::size_t n, toml::source_index line) const {
    const hal::CanDrive& drive = file_.table.drives[n];
    const std::string own = std::string(kJointNames[n]) + ": ";
    for (std::size_t m = 0; m < n; ++m) {
      const hal::CanDrive& other = file_.table.drives[m];
      if (other.bus != drive.bus) continue;
      const std::string others = std::string(kJointNames[m]) + "'s on " + file_.buses[drive.bus];
      if (other.id == drive.id) fail(line, own + "id " + std::to_string(drive.id) + " is " + others);
      if (drive.reply_id == other.id || drive.id == other.reply_id) {
        fail(line, own + (drive.reply_id == other.id ? "reply_id " : "id ") +
                       std::to_string(drive.reply_id == other.id ? drive.reply_id : drive.id) + " is the " +
                       (drive.reply_id == other.id ? "id" : "reply_id") + " of " + others + ", too");
      }
      if (drive.reply_id == other.reply_id &&
          hal::reply_name(drive.id, drive.reply) == hal::reply_name(other.id, other.reply)) {
        fail(line, own + "its replies cannot be told from " + others);
      }
      if (drive.reply_id == other.reply_id && drive.reply != other.reply) {
        fail(line, own + "reply must be as " + others + ", whose reply_id it shares");
      }
    }
  }

  void take_feet(const toml::node& node) {
    const auto line = node.source().begin.line;
    if (!node.is_table()) fail(line, "feet must be a table, [feet]");
    const toml::table& table = *node.as_table();
    only(table, {"bus", "id", "unit_n"}, "[feet]");
    hal::CanFeet& feet = file_.table.feet;
    feet.present = true;
    feet.bus = bus(table, "feet: ", line);
    feet.id = static_cast<std::uint16_t>(whole(table, "feet: ", "id", {1, hal::kMaxCanId, ""}, line));
    feet.unit_n = number(table, "feet: ", "unit_n", kUnit, line);
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const hal::CanDrive& drive = file_.table.drives[n];
      if (drive.bus == feet.bus && (drive.id == feet.id || drive.reply_id == feet.id)) {
        fail(line, "feet: id " + std::to_string(feet.id) + " is " + std::string(kJointNames[n]) + "'s on " +
                       file_.buses[feet.bus]);
      }
    }
  }

  void check_loads() const {
    for (std::size_t i = 0; i < file_.buses.size(); ++i) {
      const double load = hal::bus_load(file_.table, i);
      if (load <= hal::kMaxBusLoad) continue;
      fail("the frames of a cycle can take " + std::to_string(std::lround(100.0 * load)) + " % of " + file_.buses[i] +
           "'s time, more than " + std::to_string(std::lround(100.0 * hal::kMaxBusLoad)) +
           " %: fewer drives must share it");
    }
  }

  FileName name_;
  BusFile file_;
};

// The whole robot at rest on one leg, in its nominal stance, the sole below the middle of the base.
LegVector torques_on_one_leg_nm(const RobotModel& robot, Foot leg) {
  const Transform base_T_sole{Mat3::Identity(), Vec3{0.0, 0.0, -robot.stance.base_height_m}};
  const LegFrames frames = leg_frames(robot.legs, leg, solve_leg(robot.legs, leg, base_T_sole).q_rad);
  std::array<Vec3, kJointsPerLeg> specific_mps2;
  specific_mps2.fill(Vec3{0.0, 0.0, -kGravity_mps2});
  const Vec3 weight_n{0.0, 0.0, robot.masses.total_kg() * kGravity_mps2};
  return leg_torques_nm(robot.masses, leg, frames, specific_mps2, {weight_n, Vec3::Zero()});
}

}  // namespace

BusFile parse_bus(const std::string& path, std::string_view text) { return BusReader({"bus", path}).read(text); }
BusFile read_bus(const std::string& path) { return parse_bus(path, read_text({"bus", path})); }

void limit_by_drives(const BusFile& bus, RobotModel& robot) {
  const std::string name = FileName{"bus", bus.path}.text() + ": ";
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const hal::MitRanges& drive = bus.table.drives[n].ranges;
    JointLimits& limits = robot.drives.limits[n];
    const double most_rad = std::max(std::abs(limits.min_rad), std::abs(limits.max_rad));
    if (drive.p_rad < most_rad) {
      throw FileError(name + std::string(kJointNames[n]) + "'s p, " + text_of(drive.p_rad) +
                      " rad, does not reach the joint's " + text_of(most_rad) + " rad.");
    }
    limits.speed_radps = std::min(limits.speed_radps, drive.v_radps);
    limits.torque_nm = std::min(limits.torque_nm, drive.t_nm);
    robot.drives.gain_limits[n] = {drive.kp_nmprad, drive.kd_nmsprad};
  }
  JointVector needed_nm;
  needed_nm << torques_on_one_leg_nm(robot, Foot::kLeft), torques_on_one_leg_nm(robot, Foot::kRight);
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const double given_nm = robot.drives.limits[n].torque_nm;
    const double asked_nm = std::abs(needed_nm[static_cast<Eigen::Index>(n)]);
    if (asked_nm <= given_nm) continue;
    throw FileError(name + "with these drives the robot cannot stand on one leg: " + std::string(kJointNames[n]) +
                    " needs " + text_of(std::ceil(asked_nm)) + " Nm, and its drive gives " + text_of(given_nm) +
                    " Nm.");
  }
}

}  // namespace polygmap::config
