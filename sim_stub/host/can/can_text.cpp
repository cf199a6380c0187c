// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/can/can_text.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "sim_stub/bus/candump_log.hpp"

namespace polygmap::sim {
namespace {

using Json = nlohmann::ordered_json;
using hal::CanDrive;
using hal::MitReplyRule;

// Indices of the buses that count.
std::vector<std::size_t> buses_of(const config::BusFile& bus, const std::string& on) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < bus.buses.size(); ++i) {
    if (on.empty() || bus.buses[i] == on) indices.push_back(i);
  }
  if (indices.empty()) throw config::FileError("Bus file \"" + bus.path + "\" has no bus \"" + on + "\".");
  return indices;
}
bool counts(const std::vector<std::size_t>& buses, std::size_t bus) {
  return std::ranges::find(buses, bus) != buses.end();
}

const char* name_of(hal::MitSpecial special) {
  switch (special) {
    case hal::MitSpecial::kClearErrors:
      return "clear_errors";
    case hal::MitSpecial::kEnter:
      return "enter";
    case hal::MitSpecial::kExit:
      return "exit";
    case hal::MitSpecial::kZero:
      return "zero";
  }
  return "?";
}

// What a reader of a frame makes of it; one of the two is empty.
struct Values {
  Json json;
  std::string doubt;  // why the frame is none of the kind, in the words that follow its name
};

// Three hexadecimal digits.
std::string id_text(const hal::CanFrame& frame) {
  const std::string text = frame_text(frame);
  return text.substr(0, text.find('#'));
}
std::string bytes_of(const hal::CanFrame& frame) {
  return std::to_string(frame.length) + (frame.length == 1 ? " byte" : " bytes");
}

Values command_values(const CanDrive& drive, const hal::CanFrame& frame) {
  if (frame.length != 8) return {{}, "a command has 8 bytes"};
  hal::MitBytes bytes{};
  std::copy_n(frame.data.begin(), bytes.size(), bytes.begin());
  if (hal::is_special_frame(bytes)) return {{{"special", name_of(static_cast<hal::MitSpecial>(bytes[7]))}}, ""};
  JointSetpoint command;
  (void)hal::try_decode_command(bytes, drive.ranges, command);
  return {{{"q_rad", command.q_rad},
           {"dq_radps", command.dq_radps},
           {"kp_nmprad", command.kp_nmprad},
           {"kd_nmsprad", command.kd_nmsprad},
           {"tau_nm", command.tau_ff_nm}},
          ""};
}

// Both empty when it names another drive.
Values reply_values(const CanDrive& drive, const hal::CanFrame& frame) {
  const std::span<const std::uint8_t> bytes(frame.data.data(), frame.length);
  if (bytes.empty() || hal::name_in_reply(bytes, drive.reply) != hal::reply_name(drive.id, drive.reply)) return {};
  hal::MitReply reply;
  if (!hal::try_decode_reply(bytes, drive.id, drive.ranges, drive.reply, reply)) {
    return {{}, "a reply has 6 or 8 bytes"};
  }
  Json json{{"q_rad", reply.p_rad},   {"dq_radps", reply.v_radps}, {"tau_nm", reply.t_nm},
            {"status", reply.status}, {"enabled", reply.enabled},  {"drive_error", reply.error}};
  if (reply.mos_degc != kNotTold_degc) json["mos_degc"] = reply.mos_degc;
  if (reply.motor_degc != kNotTold_degc) json["motor_degc"] = reply.motor_degc;
  return {std::move(json), ""};
}

// Why a frame under the identifier of these joints' replies is none of theirs, whatever drive it names.
std::string complaint_of_reply(const config::BusFile& bus, const std::vector<std::size_t>& joints,
                               const hal::CanFrame& frame) {
  const CanDrive& drive = bus.table.drives[joints.front()];
  const std::string text = frame_text(frame), id = id_text(frame);
  const bool one = joints.size() == 1;
  const std::string who = one ? std::string(kJointNames[joints.front()]) + " on " + bus.buses[drive.bus] + " replies"
                              : std::to_string(joints.size()) + " drives reply";
  if (frame.length != 6 && frame.length != 8) {
    return text + " has " + bytes_of(frame) + ", but under " + id + " " + who + ", and a reply has 6 or 8 bytes.";
  }
  const auto named = hal::name_in_reply({frame.data.data(), frame.length}, drive.reply);
  return text + " names drive " + std::to_string(named) + " in its first byte, but under " + id + " " + who +
         (one ? ", as drive " + std::to_string(hal::reply_name(drive.id, drive.reply)) : ", none as that") + ".";
}

Values feet_values(const hal::CanFeet& feet, const hal::CanFrame& frame) {
  std::array<double, kFootCount> force_n{};
  if (!hal::try_decode_feet({frame.data.data(), frame.length}, feet.unit_n, force_n)) {
    return {{}, "the feet's frame has 4 bytes"};
  }
  return {{{"left_n", force_n[0]}, {"right_n", force_n[1]}}, ""};
}

// Of a DBC: the number of the signal's first bit, the most significant one.
std::size_t start_bit(std::size_t first_bit) { return first_bit / 8 * 8 + 7 - first_bit % 8; }

std::string number(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.17g", value);
  return buffer;
}

struct Signal {
  std::string name;  // with its place in a multiplex: "left_knee_position m4"
  std::size_t first_bit, bits;
  double factor, offset;
  const char* unit;
  bool has_sign = false;
};

std::string signal_line(const Signal& s) {
  const double steps = static_cast<double>(1U << s.bits), lowest = s.has_sign ? -0.5 * steps : 0.0;
  const double least = s.offset + s.factor * lowest, most = s.offset + s.factor * (lowest + steps - 1.0);
  return " SG_ " + s.name + " : " + std::to_string(start_bit(s.first_bit)) + "|" + std::to_string(s.bits) +
         (s.has_sign ? "@0- (" : "@0+ (") + number(s.factor) + "," + number(s.offset) + ") [" + number(least) + "|" +
         number(most) + "] \"" + s.unit + "\" Vector__XXX\n";
}

Signal spanning(const std::string& name, hal::detail::MitField field, double least, double most, const char* unit) {
  return {name, field.first_bit, field.bits, (most - least) / hal::detail::steps_of(field), least, unit};
}

std::string message_line(std::uint32_t id, const std::string& name, std::size_t bytes) {
  return "BO_ " + std::to_string(id) + " " + name + ": " + std::to_string(bytes) + " Vector__XXX\n";
}

std::string command_message(std::size_t joint, const CanDrive& drive) {
  const hal::MitRanges& r = drive.ranges;
  std::string text = message_line(drive.id, std::string(kJointNames[joint]) + "_command", 8);
  for (const Signal& signal : {spanning("position", hal::detail::kCommandP, -r.p_rad, r.p_rad, "rad"),
                               spanning("velocity", hal::detail::kCommandV, -r.v_radps, r.v_radps, "rad/s"),
                               spanning("kp", hal::detail::kCommandKp, 0.0, r.kp_nmprad, "Nm/rad"),
                               spanning("kd", hal::detail::kCommandKd, 0.0, r.kd_nmsprad, "Nm s/rad"),
                               spanning("torque", hal::detail::kCommandT, -r.t_nm, r.t_nm, "Nm")}) {
    text += signal_line(signal);
  }
  return text;
}

// Of all drives that send under one identifier: byte 0 says which, where there are several.
std::string reply_message(const config::BusFile& bus, std::uint32_t id, const std::vector<std::size_t>& joints) {
  const bool several = joints.size() > 1;
  const MitReplyRule rule = bus.table.drives[joints.front()].reply;
  const bool nibble = rule == MitReplyRule::kStatusNibble;
  std::string text = message_line(
      id, several ? "replies_" + std::to_string(id) : std::string(kJointNames[joints.front()]) + "_reply", 8);
  text += signal_line({several ? "drive M" : "drive", nibble ? 4U : 0U, nibble ? 4U : 8U, 1.0, 0.0, ""});
  if (nibble) text += signal_line({"status", 0, 4, 1.0, 0.0, ""});
  for (const std::size_t n : joints) {
    const CanDrive& drive = bus.table.drives[n];
    const hal::MitRanges& r = drive.ranges;
    const std::string prefix = several ? std::string(kJointNames[n]) + "_" : "";
    const std::string place = several ? " m" + std::to_string(hal::reply_name(drive.id, rule)) : "";
    for (const Signal& signal : {spanning("position", hal::detail::kReplyP, -r.p_rad, r.p_rad, "rad"),
                                 spanning("velocity", hal::detail::kReplyV, -r.v_radps, r.v_radps, "rad/s"),
                                 spanning("torque", hal::detail::kReplyT, -r.t_nm, r.t_nm, "Nm")}) {
      Signal placed = signal;
      placed.name = prefix + signal.name + place;
      text += signal_line(placed);
    }
  }
  if (nibble) {
    text += signal_line({"mos_temperature", 48, 8, 1.0, 0.0, "degC"});
    text += signal_line({"motor_temperature", 56, 8, 1.0, 0.0, "degC"});
  } else {
    text += signal_line({"motor_temperature", 48, 8, 1.0, 0.0, "degC", true});
    text += signal_line({"error", 56, 8, 1.0, 0.0, ""});
  }
  return text;
}

}  // namespace

std::optional<hal::CanFrame> read_frame(const std::string& text) {
  const auto digit = [](char c) -> int {
    if (c >= '0' && c <= '9') return c - '0';
    const int lower = std::tolower(static_cast<unsigned char>(c));
    return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
  };
  const std::size_t hash = text.find('#');
  if (hash == std::string::npos || hash == 0 || hash > 3) return {};
  hal::CanFrame frame;
  for (std::size_t i = 0; i < hash; ++i) {
    if (digit(text[i]) < 0) return {};
    frame.id = frame.id << 4U | static_cast<std::uint32_t>(digit(text[i]));
  }
  const std::size_t digits = text.size() - hash - 1;
  if (frame.id > hal::kMaxCanId || digits % 2 != 0 || digits > 16) return {};
  for (std::size_t i = 0; i < digits / 2; ++i) {
    const int high = digit(text[hash + 1 + 2 * i]), low = digit(text[hash + 2 + 2 * i]);
    if (high < 0 || low < 0) return {};
    frame.data[i] = static_cast<std::uint8_t>(high << 4 | low);
  }
  frame.length = static_cast<std::uint8_t>(digits / 2);
  return frame;
}

FrameReading frame_reading(const config::BusFile& bus, const std::string& on, const hal::CanFrame& frame) {
  const std::vector<std::size_t> buses = buses_of(bus, on);
  Json readings = Json::array();
  FrameReading read;
  std::vector<std::size_t> repliers;  // under the frame's identifier
  const auto take = [&](Json head, const std::string& whose, const Values& values) {
    if (!values.json.is_null()) {
      head.update(values.json);
      readings.push_back(std::move(head));
    } else if (!values.doubt.empty()) {
      read.doubts.push_back(frame_text(frame) + " has " + bytes_of(frame) + ", but it would be " + whose + ", and " +
                            values.doubt + ".");
    }
  };
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const CanDrive& drive = bus.table.drives[n];
    if (!counts(buses, drive.bus)) continue;
    const std::string& name = bus.buses[drive.bus];
    const std::string of_joint = std::string(kJointNames[n]) + " on " + name;
    const auto head = [&](const char* kind) { return Json{{"bus", name}, {"joint", kJointNames[n]}, {"kind", kind}}; };
    if (drive.reply_id == frame.id) {
      repliers.push_back(n);
      take(head("reply"), "a reply of " + of_joint, reply_values(drive, frame));
    }
    if (drive.id == frame.id) take(head("command"), "a command to " + of_joint, command_values(drive, frame));
  }
  const hal::CanFeet& feet = bus.table.feet;
  if (feet.present && feet.id == frame.id && counts(buses, feet.bus)) {
    const std::string& name = bus.buses[feet.bus];
    take(Json{{"bus", name}, {"kind", "feet"}}, "the feet's on " + name, feet_values(feet, frame));
  }
  if (readings.empty() && !read.doubts.empty()) throw config::FileError(read.doubts.front());
  if (readings.empty() && !repliers.empty()) throw config::FileError(complaint_of_reply(bus, repliers, frame));
  if (readings.empty()) {
    throw config::FileError("Nothing on " + (on.empty() ? "the buses" : on) + " of bus file \"" + bus.path +
                            "\" sends or takes frames under " + id_text(frame) + ".");
  }
  read.json = Json{{"frame", frame_text(frame)}, {"readings", readings}}.dump(2) + "\n";
  return read;
}

std::string dbc_text(const config::BusFile& bus, const std::string& on) {
  const std::vector<std::size_t> buses = buses_of(bus, on);
  std::map<std::uint32_t, std::string> messages;
  const auto add = [&](std::uint32_t id, const std::string& text) {
    if (messages.emplace(id, text).second) return;
    throw config::FileError("Bus file \"" + bus.path + "\": identifier " + std::to_string(id) +
                            " means two frames, which a DBC cannot say" +
                            (buses.size() > 1 ? "; name one bus with --on." : "."));
  };
  std::map<std::uint32_t, std::vector<std::size_t>> repliers;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const CanDrive& drive = bus.table.drives[n];
    if (!counts(buses, drive.bus)) continue;
    add(drive.id, command_message(n, drive));
    repliers[drive.reply_id].push_back(n);
  }
  for (const auto& [id, joints] : repliers) {
    for (std::size_t i = 0; i < joints.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const CanDrive &a = bus.table.drives[joints[i]], &b = bus.table.drives[joints[j]];
        if (a.reply != b.reply || hal::reply_name(a.id, a.reply) == hal::reply_name(b.id, b.reply)) add(b.id, "");
      }
    }
    add(id, reply_message(bus, id, joints));
  }
  const hal::CanFeet& feet = bus.table.feet;
  if (feet.present && counts(buses, feet.bus)) {
    add(feet.id, message_line(feet.id, "feet", hal::kFootFrame_bytes) +
                     signal_line({"left_force", 0, 16, feet.unit_n, 0.0, "N"}) +
                     signal_line({"right_force", 16, 16, feet.unit_n, 0.0, "N"}));
  }
  std::string text = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_:\n\n";
  for (const auto& entry : messages) text += entry.second + "\n";
  return text;
}

}  // namespace polygmap::sim
