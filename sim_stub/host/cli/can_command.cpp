// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/can_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <ostream>
#include <string_view>

#include "sim_stub/bus/candump_log.hpp"
#include "sim_stub/host/can/can_text.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/cli/command_words.hpp"

namespace polygmap::sim {
namespace {

constexpr std::string_view kExampleFrame = "001#7FFF7FF7FF0007FF";

// By number, from 0, or by name.
std::size_t joint_of(const std::string& text) {
  const auto named = std::ranges::find(kJointNames, text);
  if (named != kJointNames.end()) return static_cast<std::size_t>(named - kJointNames.begin());
  std::size_t number = kJointCount;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size() || number >= kJointCount) {
    throw config::FileError("--joint must be a number from 0 to " + std::to_string(kJointCount - 1) +
                            " or a name such as left_knee, not \"" + text + "\".");
  }
  return number;
}

struct Value {
  const char* option;
  double value, least, most;  // least and most: of the drive
  const char* unit;
};

// In the frame, what is beyond the drive's range is at its end, as in the module: each such value gets a line on err.
std::string encoded(const CanArguments& a, const config::BusFile& bus, std::ostream& err) {
  const std::size_t joint = joint_of(a.joint);
  const hal::CanDrive& drive = bus.table.drives[joint];
  const hal::MitRanges& r = drive.ranges;
  for (const Value& v : {Value{"--q", a.command.q_rad, -r.p_rad, r.p_rad, "rad"},
                         Value{"--dq", a.command.dq_radps, -r.v_radps, r.v_radps, "rad/s"},
                         Value{"--kp", a.command.kp_nmprad, 0.0, r.kp_nmprad, "Nm/rad"},
                         Value{"--kd", a.command.kd_nmsprad, 0.0, r.kd_nmsprad, "Nm s/rad"},
                         Value{"--tau", a.command.tau_ff_nm, -r.t_nm, r.t_nm, "Nm"}}) {
    const std::string range = "the range of " + std::string(kJointNames[joint]) + "'s drive, " + number(v.least) +
                              " to " + number(v.most) + " " + v.unit;
    if (!std::isfinite(v.value)) {
      throw config::FileError(std::string(v.option) + " must be a finite number in " + range + ", not " +
                              number(v.value) + ".");
    }
    if (v.value >= v.least && v.value <= v.most) continue;
    err << "polygmap: warning: " << v.option << " " << number(v.value) << " is beyond " << range << ": the frame has "
        << number(v.value < v.least ? v.least : v.most) << ".\n";
  }
  hal::MitBytes bytes{};
  std::uint32_t clamped = 0;
  if (!hal::try_encode_command(a.command, r, bytes, clamped)) {
    throw config::FileError("The command cannot be encoded.");
  }
  hal::CanFrame frame;
  frame.id = drive.id;
  frame.length = 8;
  std::ranges::copy(bytes, frame.data.begin());
  return frame_text(frame) + "\n";
}

}  // namespace

CLI::App* declare_can(CLI::App& app, CanArguments& a) {
  CLI::App* can = app.add_subcommand("can", "CAN frames of a bus file's drives: make one, read one, describe all");
  can->require_subcommand(1);
  a.encode = can->add_subcommand("encode",
                                 "Print the frame of a command as ID#HEX, as cansend takes it; a value beyond the "
                                 "drive's range is put at its end, with a warning");
  a.decode = can->add_subcommand(
      "decode",
      "Print what a frame says as JSON; exit code 2 and no JSON when no drive of the file can have sent or taken it");
  a.dbc = can->add_subcommand("dbc", "Print all frames as a DBC");
  for (CLI::App* command : {a.encode, a.decode, a.dbc}) {
    command->add_option("--bus", a.bus, "The drives and their buses")->required()->type_name("BUS.toml");
  }
  a.encode->add_option("--joint", a.joint, "The joint, 0 to 11 or by name")->required()->type_name("N");
  a.encode->add_option("--q", a.command.q_rad, "Angle, rad")->capture_default_str();
  a.encode->add_option("--dq", a.command.dq_radps, "Speed, rad/s")->capture_default_str();
  a.encode->add_option("--kp", a.command.kp_nmprad, "Stiffness, Nm/rad")->capture_default_str();
  a.encode->add_option("--kd", a.command.kd_nmsprad, "Damping, Nm s/rad")->capture_default_str();
  a.encode->add_option("--tau", a.command.tau_ff_nm, "Torque, Nm")->capture_default_str();
  a.decode->add_option("FRAME", a.frame, "The frame, as " + std::string(kExampleFrame))
      ->required()
      ->type_name("ID#HEX");
  for (CLI::App* command : {a.decode, a.dbc}) {
    command->add_option("--on", a.on, "Of this bus alone")->type_name("BUS");
  }
  return can;
}

int run_can(const CanArguments& a, std::ostream& out, std::ostream& err) {
  try {
    const config::BusFile bus = config::read_bus(a.bus);
    if (a.encode->parsed()) {
      out << encoded(a, bus, err);
    } else if (a.decode->parsed()) {
      const std::optional<hal::CanFrame> frame = read_frame(a.frame);
      if (!frame) {
        throw config::FileError(
            "A frame is an identifier up to 7FF, # and up to 8 bytes in hexadecimal digits, as in " +
            std::string(kExampleFrame) + ", not \"" + a.frame + "\".");
      }
      const FrameReading read = frame_reading(bus, a.on, *frame);
      out << read.json;
      for (const std::string& doubt : read.doubts) err << "polygmap: warning: " << doubt << "\n";
    } else {
      out << dbc_text(bus, a.on);
    }
  } catch (const config::FileError& error) {
    err << "polygmap: " << error.what() << "\n";
    return kExitUsage;
  }
  return written(out, err);
}

}  // namespace polygmap::sim
