// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/config/daemon_config.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "algorithms/core/capacities.hpp"
#include "algorithms/core/math/transform.hpp"
#include "firmware/config/camera_file.hpp"
#include "firmware/config/param_file.hpp"
#include "firmware/config/toml_reader.hpp"
#include "firmware/daemon/config/toml_section.hpp"

namespace polygmap::daemon {
namespace {

constexpr std::size_t kMostSocketPath_bytes = 107;  // sockaddr_un holds so many and a null
constexpr std::size_t kMostMailbox_bytes = 201;
constexpr double kMostProcessor = 1023;  // CPU_SETSIZE - 1
constexpr Range kPort{1, 65535, ""};
constexpr Range kAngle{-7.0, 7.0, "rad"};
constexpr Range kImuRate{100, 1000, "Hz"};  // what imu_interval_ns may be
constexpr double kLivoxRate_hz = 200.0;     // of a Mid-360
constexpr double kSerialRate_hz = 500.0;

void check_path(const TomlSection& section, const char* key, bool is_wrong) {
  if (is_wrong) section.fail(key, "must be a path of 1 to 63 characters");
}

std::string operator_socket_of(const std::string& path, const TomlSection& root) {
  std::string socket = (std::filesystem::path(path).parent_path() / root.text("operator")).string();
  check_path(root, "operator", root.text("operator").empty() || socket.size() > kMostSocketPath_bytes);
  return socket;
}

std::string mailbox_of(const TomlSection& root) {
  const std::string name = root.text("mailbox");
  const bool good = name.size() > 1 && name.size() <= kMostMailbox_bytes && name.rfind('/') == 0;
  if (!good) root.fail("mailbox", "must be a name as in \"/polygmap\", a slash and 1 to 200 characters without one");
  return name;
}

// The line that gives the file's own key; lines before it are left empty, so that it keeps its number. Empty:
// there is none that stands by itself.
std::string line_of(std::string_view key, std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const auto trimmed = [=](std::string_view words) {
    words.remove_prefix(std::min(words.find_first_not_of(kBlank), words.size()));
    return words.substr(0, words.find_last_not_of(kBlank) + 1);
  };
  for (std::string before; !text.empty(); before += '\n') {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    if (line.starts_with('[')) return {};  // a table begins, and what follows is its
    if (line.starts_with(key) && trimmed(line.substr(key.size())).starts_with('=')) return before.append(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return {};
}

class DaemonFile {
 public:
  DaemonFile(const std::string& path, const toml::table& root) : path_(path), root_(path, "", root, 1) {}

  DaemonConfig read() {
    root_.only({"bus", "params", "lanes", "real_time", "hold_s", "control", "perception", "camera", "imu", "lio",
                "operator", "mailbox", "mailbox_group"});
    config_.path = path_;
    config_.lanes = static_cast<std::size_t>(root_.whole("lanes", {1, kLaneCount, ""}, kLaneCount));
    config_.needs_real_time = root_.choice("real_time", {"required", "preferred"}, 0) == 0;
    config_.hold_ns = std::llround(1e9 * root_.number("hold_s", {0.0, 86400.0, "s"}, 10.0));
    take_placement("control", kControlLane);
    take_placement("perception", kPerceptionLane);
    if (config_.lanes == 1 && root_.has("perception")) {
      root_.fail("perception", "places a lane that lanes = 1 does not have");
    }
    check_placement();
    take_camera(*root_.section("camera", true));
    if (root_.has("params")) config::read_params(file("params"), config_.params);
    if (root_.has("operator")) {
      config_.operator_socket = operator_socket_of(path_, root_);
      config_.params.supervisor.autostart = false;
    } else if (!config_.params.supervisor.autostart) {
      root_.fail("params", "switches supervisor.autostart off, and there is no key operator: it would never arm");
    }
    if (root_.has("mailbox")) config_.mailbox = mailbox_of(root_);
    if (root_.has("mailbox_group")) config_.mailbox_group = root_.text("mailbox_group");
    if (config_.mailbox.empty() && root_.has("mailbox_group")) root_.fail("mailbox_group", "needs the key mailbox");
    take_bus();
    take_imu(*root_.section("imu", true));
    if (const auto lio = root_.section("lio", false)) take_lio(*lio);
    return config_;
  }

 private:
  // A file that this one names, from this one's folder.
  [[nodiscard]] std::string file(std::string_view key) const { return from_here(root_, key); }
  [[nodiscard]] std::string from_here(const TomlSection& section, std::string_view key) const {
    const std::filesystem::path named = section.text(key);
    const std::filesystem::path found = std::filesystem::path(path_).parent_path() / named;
    std::error_code none;
    if (named.empty() || !std::filesystem::is_regular_file(found, none)) {
      section.fail(key, "names no file: \"" + found.string() + "\"");
    }
    return found.string();
  }

  void take_placement(const char* key, Lane lane) {
    constexpr std::array kPriorities{80, 75};
    LaneThread::Placement& placement = config_.placement[lane];
    placement.priority = kPriorities[lane];
    const auto section = root_.section(key, false);
    if (!section) return;
    section->only({"cpu", "priority"});
    placement.processor = static_cast<int>(section->whole("cpu", {0, kMostProcessor, ""}, -1));
    placement.priority = static_cast<int>(section->whole("priority", {1, kMostPriority, ""}, placement.priority));
  }

  // On one processor the lane of the higher priority runs, and of two alike the one that runs already.
  void check_placement() const {
    const LaneThread::Placement& control = config_.placement[kControlLane];
    const LaneThread::Placement& perception = config_.placement[kPerceptionLane];
    const bool is_shared = control.processor >= 0 && control.processor == perception.processor;
    if (config_.lanes == 1 || !is_shared || perception.priority < control.priority) return;
    const auto section = root_.section("perception", true);
    section->fail(section->has("priority") ? "priority" : "cpu",
                  "lets perception hold control up: on processor " + std::to_string(control.processor) +
                      ", which is control's, its priority must be below control's " + std::to_string(control.priority));
  }

  void take_bus() {
    const std::string path = file("bus");
    config_.bus = config::read_bus(path);
    config::limit_by_drives(config_.bus, config_.params.robot);
    for (const std::uint32_t line : config_.bus.bus_lines) {
      config_.places.buses.push_back(path + ", line " + std::to_string(line) + ", bus");
    }
  }

  void take_camera(const TomlSection& section) {
    section.only({"device", "file", "format", "frames_per_s", "buffers", "latency_ms", "exposure_ms", "timeout_ms"});
    hal::V4l2Camera::Config& camera = config_.camera;
    camera.device = section.text("device");
    check_path(section, "device", camera.device.too_long() || camera.device.empty());
    const config::CameraProfile profile = config::read_camera(from_here(section, "file"));
    camera.intrinsics = profile.intrinsics;
    const CameraIntrinsics& k = profile.intrinsics;
    if (k.width_px > kDepthWidth_px || k.height_px > kDepthHeight_px || k.width_px % 8 != 0 || k.height_px % 2 != 0) {
      section.fail("file", "has a camera of " + std::to_string(k.width_px) + " x " + std::to_string(k.height_px) +
                               " pixels; columns are a multiple of 8 up to " + std::to_string(kDepthWidth_px) +
                               ", rows even up to " + std::to_string(kDepthHeight_px));
    }
    config_.params.surfaces.noise = profile.noise;
    config_.params.surfaces.limits = {profile.min_depth_m, profile.max_depth_m};
    camera.format = section.choice("format", {"Z16", "Y16"}, 0) == 0 ? hal::V4l2Camera::PixelFormat::kZ16
                                                                     : hal::V4l2Camera::PixelFormat::kY16;
    camera.frames_per_s = static_cast<std::uint32_t>(section.whole("frames_per_s", {0, 1000, "1/s"}, 0));
    camera.buffers =
        static_cast<std::uint32_t>(section.whole("buffers", {4, hal::BufferBook::kMostBuffers, ""}, camera.buffers));
    camera.latency_ns = section.milliseconds("latency_ms", 1000.0, 0);
    camera.exposure_ns = section.milliseconds("exposure_ms", 1000.0, 0);
    camera.timeout_ns = section.milliseconds("timeout_ms", 60'000.0, camera.timeout_ns);
    if (camera.timeout_ns < 10 * kNsPerMs) section.fail("timeout_ms", "must be at least 10 ms");
    config_.places.camera = section.place_of("device");
  }

  void take_imu(const TomlSection& section) {
    const bool is_livox = section.choice("driver", {"livox", "serial"}) == 0;
    const Vec3 rpy_rad = section.vector("base_rpy_rad", kAngle);
    const Mat3 base_R_imu = rotation_zyx(rpy_rad.z(), rpy_rad.y(), rpy_rad.x());
    const double rate_hz = section.number("rate_hz", kImuRate, is_livox ? kLivoxRate_hz : kSerialRate_hz);
    config_.params.imu_interval_ns = std::llround(1e9 / rate_hz);
    if (is_livox) {
      section.only(
          {"driver", "base_rpy_rad", "rate_hz", "port", "address", "sender", "check_crc", "clock", "least_delay_ms"});
      hal::LivoxImu::Config imu;
      imu.udp = udp_of(section, imu.udp.port);
      warn_of_sender(section, imu.udp);
      imu.check_crc = section.flag("check_crc", imu.check_crc);
      take_clock(section, imu.time);
      imu.base_R_imu = base_R_imu;
      config_.imu = imu;
      config_.places.imu = section.place_of("port");
    } else {
      section.only({"driver", "base_rpy_rad", "rate_hz", "device", "baud", "clock", "least_delay_ms"});
      hal::SerialImu::Config imu;
      imu.device = section.text("device");
      check_path(section, "device", imu.device.too_long() || imu.device.empty());
      imu.baud = static_cast<std::uint32_t>(section.whole("baud", {9600, 4'000'000, "baud"}, imu.baud));
      take_clock(section, imu.time);
      imu.base_R_imu = base_R_imu;
      config_.imu = imu;
      config_.places.imu = section.place_of("device");
    }
  }

  void take_lio(const TomlSection& section) {
    section.only({"port", "address", "sender", "clock", "least_delay_ms"});
    hal::LioUdp::Config lio;
    lio.udp = udp_of(section, std::nullopt);
    warn_of_sender(section, lio.udp);
    take_clock(section, lio.time);
    config_.lio = lio;
    config_.places.lio = section.place_of("port");
  }

  // "monotonic": the sender stamps in this machine's clock. "own": in its own, whose offset is estimated.
  static void take_clock(const TomlSection& section, hal::SampleClock::Params& time) {
    const bool is_own = section.choice("clock", {"monotonic", "own"}, time.base == hal::TimeBase::kEstimated) == 1;
    time.base = is_own ? hal::TimeBase::kEstimated : hal::TimeBase::kMonotonic;
    time.offset.least_delay_ns = section.milliseconds("least_delay_ms", 1000.0, 0);
  }
  [[nodiscard]] static hal::UdpConfig udp_of(const TomlSection& section, std::optional<std::int64_t> otherwise) {
    hal::UdpConfig udp;
    udp.port = static_cast<std::uint16_t>(section.whole("port", kPort, otherwise));
    udp.address = address_of(section, "address");
    udp.sender = address_of(section, "sender");
    return udp;
  }
  // Who may say where the robot is. Of this machine it is any process, whatever is configured.
  void warn_of_sender(const TomlSection& section, const hal::UdpConfig& udp) {
    if (!udp.sender.empty()) return;
    config_.warnings.push_back(section.place_of("port") + ": without a sender in that table whoever reaches UDP port " +
                               std::to_string(udp.port) + " is believed; name the one that sends.");
  }
  [[nodiscard]] static std::string address_of(const TomlSection& section, const char* key) {
    const std::string said = section.text(key, "");
    in_addr parsed{};
    if (!said.empty() && ::inet_pton(AF_INET, said.c_str(), &parsed) != 1) {
      section.fail(key, "must be an address such as \"192.168.1.50\", not \"" + said + "\"");
    }
    return said;
  }

  std::string path_;
  TomlSection root_;
  DaemonConfig config_;
};

}  // namespace

DaemonConfig parse_daemon_config(const std::string& path, std::string_view text) {
  const toml::table root = config::parse_toml({"daemon", path}, text);
  return DaemonFile(path, root).read();
}
DaemonConfig read_daemon_config(const std::string& path) {
  return parse_daemon_config(path, config::read_text({"daemon", path}));
}
std::string read_operator_socket(const std::string& path) {
  const std::string text = config::read_text({"daemon", path});
  const std::string line = line_of("operator", text);
  const toml::table root = config::parse_toml({"daemon", path}, line.empty() ? text : line);
  const TomlSection section(path, "", root, 1);
  return section.has("operator") ? operator_socket_of(path, section) : std::string();
}
std::string read_mailbox_name(const std::string& path) {
  const std::string text = config::read_text({"daemon", path});
  const std::string line = line_of("mailbox", text);
  const toml::table root = config::parse_toml({"daemon", path}, line.empty() ? text : line);
  const TomlSection section(path, "", root, 1);
  return section.has("mailbox") ? mailbox_of(section) : std::string();
}

}  // namespace polygmap::daemon
