// SPDX-License-Identifier: Apache-2.0
// The drives behind a robot's CAN buses, from a TOML file (firmware/buses has some; docs/bus.md says what is in it).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/robot/robot_model.hpp"
#include "firmware/config/file_error.hpp"
#include "hal/can/drive_table.hpp"

namespace polygmap::config {

struct BusFile {
  std::string path;
  hal::DriveTable table;
  std::vector<std::string> buses;        // names of the table's buses, as "can0"; table.bus_count of them
  std::vector<std::uint32_t> bus_lines;  // where the file names each of them first
};

// Throws FileError, one sentence that names file, line and key, for what is no bus file, and for buses whose load would
// exceed hal::kMaxBusLoad.
[[nodiscard]] BusFile read_bus(const std::string& path);
// path: what the text is called.
[[nodiscard]] BusFile parse_bus(const std::string& path, std::string_view text);

// The joints' limits become what the drives can do as well: speed, torque, gains. Throws FileError, one sentence, for
// drives that do not reach their joint's angles, or that give less torque than standing on one leg takes.
void limit_by_drives(const BusFile& bus, RobotModel& robot);

}  // namespace polygmap::config
