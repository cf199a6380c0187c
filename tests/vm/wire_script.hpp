// SPDX-License-Identifier: Apache-2.0
// What goes over a robot's wires in a climb, tick by tick, as text: what the drives are commanded, what they answer,
// and what the sensors send. toolchain/vm/wire_script.py makes it of what the host's simulation logged.
//
//   TICK expect BUS ID#HEX     a command, the n-th of its identifier in tick n
//   TICK answer BUS ID#HEX     what the drive of the last expected command says to it
//   TICK say BUS ID#HEX        said by itself, when the first command of the tick has come
//   TICK datagram PORT HEX     sent to 127.0.0.1 when all commands of the tick have come; at the start when TICK is -1
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace polygmap::vm {

struct Drive {
  int bus = 0;
  canid_t id = 0;
  std::vector<can_frame> expected, answers;  // one a tick
};
struct Datagram {
  int port = 0;
  std::vector<unsigned char> bytes;
};
struct ScriptTick {
  std::vector<std::pair<int, can_frame>> said;  // bus and frame
  std::vector<Datagram> datagrams;
};
struct WireScript {
  std::vector<std::string> buses;
  std::vector<Drive> drives;
  std::vector<ScriptTick> ticks;
  std::vector<Datagram> first;  // before the first tick

  // Empty, or what is wrong: the line's number and why.
  [[nodiscard]] std::string read(const std::string& path);

 private:
  [[nodiscard]] bool add(long tick, const std::string& kind, const std::string& where, const std::string& what);
  [[nodiscard]] int bus_of(const std::string& name);
  [[nodiscard]] std::size_t drive_of(int bus, canid_t id);
  std::map<std::pair<int, canid_t>, std::size_t> drive_index_;
  std::size_t last_drive_ = SIZE_MAX;
};

// false: not an even number of hexadecimal digits.
[[nodiscard]] inline bool parse_hex(const std::string& text, std::vector<unsigned char>& bytes) {
  if (text.size() % 2 != 0 || text.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos) return false;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    bytes.push_back(static_cast<unsigned char>(std::strtoul(text.substr(i, 2).c_str(), nullptr, 16)));
  }
  return true;
}
// As can-utils write a classic frame.
[[nodiscard]] inline bool parse_frame(const std::string& text, can_frame& frame) {
  const std::size_t hash = text.find('#');
  std::vector<unsigned char> bytes;
  if (hash == std::string::npos || hash == 0 || !parse_hex(text.substr(hash + 1), bytes) || bytes.size() > 8)
    return false;
  char* end = nullptr;
  frame = {};
  frame.can_id = static_cast<canid_t>(std::strtoul(text.c_str(), &end, 16));
  frame.len = static_cast<__u8>(bytes.size());
  std::memcpy(frame.data, bytes.data(), bytes.size());
  return end == text.c_str() + hash && frame.can_id <= CAN_SFF_MASK;
}

inline int WireScript::bus_of(const std::string& name) {
  for (std::size_t i = 0; i < buses.size(); ++i) {
    if (buses[i] == name) return static_cast<int>(i);
  }
  buses.push_back(name);
  return static_cast<int>(buses.size()) - 1;
}
inline std::size_t WireScript::drive_of(int bus, canid_t id) {
  const auto [place, is_new] = drive_index_.try_emplace({bus, id}, drives.size());
  if (is_new) drives.push_back({bus, id, {}, {}});
  return place->second;
}

inline bool WireScript::add(long tick, const std::string& kind, const std::string& where, const std::string& what) {
  if (kind == "datagram") {
    Datagram datagram;
    datagram.port = std::atoi(where.c_str());
    if (datagram.port <= 0 || datagram.port > 65535 || !parse_hex(what, datagram.bytes)) return false;
    (tick < 0 ? first : ticks[static_cast<std::size_t>(tick)].datagrams).push_back(std::move(datagram));
    return true;
  }
  can_frame frame;
  if (tick < 0 || !parse_frame(what, frame)) return false;
  const int bus = bus_of(where);
  if (kind == "say") {
    ticks[static_cast<std::size_t>(tick)].said.emplace_back(bus, frame);
  } else if (kind == "expect") {
    last_drive_ = drive_of(bus, frame.can_id);
    Drive& drive = drives[last_drive_];
    if (drive.expected.size() != static_cast<std::size_t>(tick)) return false;  // a tick without a command for it
    drive.expected.push_back(frame);
  } else if (kind == "answer" && last_drive_ != SIZE_MAX) {
    Drive& drive = drives[last_drive_];
    if (drive.bus != bus || drive.answers.size() + 1 != drive.expected.size()) return false;
    drive.answers.push_back(frame);
  } else {
    return false;
  }
  return true;
}

inline std::string WireScript::read(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "r");
  if (file == nullptr) return path + " cannot be read";
  static char line[8192], kind[16], where[32], what[8192];
  std::string wrong;
  for (int number = 1; wrong.empty() && std::fgets(line, sizeof line, file) != nullptr; ++number) {
    long tick = 0;
    constexpr long kMostTicks = 1'000'000;
    const bool whole = std::sscanf(line, "%ld %15s %31s %8191s", &tick, kind, where, what) == 4;
    if (whole && tick >= 0 && tick < kMostTicks && ticks.size() <= static_cast<std::size_t>(tick)) {
      ticks.resize(static_cast<std::size_t>(tick) + 1);
    }
    if (!whole || tick < -1 || tick >= kMostTicks || !add(tick, kind, where, what)) {
      wrong = path + ":" + std::to_string(number) + ": no line of a wire script, or out of order";
    }
  }
  std::fclose(file);
  for (const Drive& drive : drives) {
    if (wrong.empty() && drive.answers.size() != drive.expected.size())
      wrong = path + ": a drive has no answer to a command";
  }
  return wrong.empty() && drives.empty() ? path + ": no drive is commanded" : wrong;
}

}  // namespace polygmap::vm
