// SPDX-License-Identifier: Apache-2.0
// What polygmapd is told in its TOML file (docs/deploy.md has the keys).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "firmware/config/bus_file.hpp"
#include "firmware/config/file_error.hpp"
#include "firmware/daemon/system/lane_thread.hpp"
#include "firmware/lane_link.hpp"
#include "firmware/params.hpp"
#include "hal/linux/lio_udp.hpp"
#include "hal/linux/livox_imu.hpp"
#include "hal/linux/serial_imu.hpp"
#include "hal/linux/v4l2_camera.hpp"

namespace polygmap::daemon {

// Where a device was named, as "robot.toml, line 7, camera.device": for who cannot open it.
struct DevicePlaces {
  std::string camera, imu, lio;
  std::vector<std::string> buses;  // of the bus file, in its order
};

// Of a lane; 99 is the kernel's own threads'. The unit's LimitRTPRIO= is the same (daemon_config_test).
inline constexpr int kMostPriority = 98;

struct DaemonConfig {
  std::string path;
  config::BusFile bus;
  Params params;  // the limits of the drives and the camera's noise are in them
  hal::V4l2Camera::Config camera;
  std::variant<hal::LivoxImu::Config, hal::SerialImu::Config> imu;
  std::optional<hal::LioUdp::Config> lio;
  std::string operator_socket;         // its path; empty: the module arms and starts by itself
  std::string mailbox, mailbox_group;  // names; empty: there is none; the process's own
  std::size_t lanes = kLaneCount;
  std::array<LaneThread::Placement, kLaneCount> placement{};  // of one lane, the first
  bool needs_real_time = true;
  std::int64_t hold_ns = 10 * kNsPerS;  // after it stopped by itself the module holds the robot for so long
  DevicePlaces places;
  std::vector<std::string> warnings;  // what is allowed and seldom meant, a sentence each
};

// Throws config::FileError, one sentence that names file, line and key, for whatever is wrong with the file or with one
// that it names. Paths in it are relative to its folder. Opens no device.
[[nodiscard]] DaemonConfig read_daemon_config(const std::string& path);
// path: where the text is said to be.
[[nodiscard]] DaemonConfig parse_daemon_config(const std::string& path, std::string_view text);
// The key operator alone, as operator_socket; whatever else the file holds may be wrong, since who asks a robot to stop
// must not be held up by it. Throws config::FileError when there is no file, or when that key's line is wrong.
[[nodiscard]] std::string read_operator_socket(const std::string& path);
// The key mailbox likewise.
[[nodiscard]] std::string read_mailbox_name(const std::string& path);

}  // namespace polygmap::daemon
