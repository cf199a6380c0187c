// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/devices.hpp"

#include <algorithm>

namespace polygmap::daemon {
namespace {

std::string sentence(const std::string& place, const hal::DeviceError& error) {
  return error.failed() ? place + ": " + error.sentence() + "." : std::string();
}

// What a bus is listened to for: its drives' replies and the feet. What others send never wakes the lane.
void add_ids(const hal::DriveTable& table, std::size_t bus, hal::SocketCan::Config& config) {
  const auto add = [&config](std::uint32_t id) {
    const bool known = std::ranges::any_of(config.receive, [id](const hal::CanId& other) { return other.id == id; });
    if (!known) (void)config.receive.try_push_back({.id = id});
  };
  for (const hal::CanDrive& drive : table.drives) {
    if (drive.bus == bus) add(drive.reply_id);
  }
  if (table.feet.present && table.feet.bus == bus) add(table.feet.id);
}

}  // namespace

std::string Devices::open(const DaemonConfig& config) {
  if (std::string wrong = open_buses(config); !wrong.empty()) return wrong;
  if (std::string wrong = sentence(config.places.camera, camera_.open(config.camera)); !wrong.empty()) return wrong;
  if (std::string wrong = open_imu(config); !wrong.empty()) return wrong;
  if (!config.lio) return {};
  lio_ = std::make_unique<hal::LioUdp>(calls_);
  return sentence(config.places.lio, lio_->open(*config.lio));
}

std::string Devices::open_buses(const DaemonConfig& config) {
  table_ = config.bus.table;
  buses_ = config.bus.buses;
  std::vector<hal::CanChannel*> channels;
  for (std::size_t bus = 0; bus < config.bus.buses.size(); ++bus) {
    hal::SocketCan::Config can;
    can.interface = config.bus.buses[bus];
    add_ids(config.bus.table, bus, can);
    sockets_.push_back(std::make_unique<hal::SocketCan>(calls_));
    const hal::DeviceError error = sockets_.back()->open(can);
    if (error.failed()) return sentence(config.places.buses[bus], error);
    channels.push_back(sockets_.back().get());
  }
  joints_.emplace(table_, channels);
  return {};
}

std::string Devices::open_imu(const DaemonConfig& config) {
  if (const auto* livox = std::get_if<hal::LivoxImu::Config>(&config.imu)) {
    livox_ = std::make_unique<hal::LivoxImu>(calls_);
    return sentence(config.places.imu, livox_->open(*livox));
  }
  serial_ = std::make_unique<hal::SerialImu>(calls_);
  return sentence(config.places.imu, serial_->open(std::get<hal::SerialImu::Config>(config.imu)));
}

Ports Devices::ports() noexcept {
  hal::Imu& imu = livox_ ? static_cast<hal::Imu&>(*livox_) : *serial_;
  hal::LidarOdometry& lio = lio_ ? static_cast<hal::LidarOdometry&>(*lio_) : no_lidar_;
  return {camera_, imu, *joints_, lio};
}

void Devices::let_go() noexcept {
  const hal::MitBytes exit = hal::special_frame(hal::MitSpecial::kExit);
  for (const hal::CanDrive& drive : table_.drives) {
    hal::CanFrame frame;
    frame.id = drive.id;
    frame.length = static_cast<std::uint8_t>(exit.size());
    std::ranges::copy(exit, frame.data.begin());
    (void)sockets_[drive.bus]->write({&frame, 1});
  }
}

void Devices::maintain() noexcept {
  for (const auto& socket : sockets_) socket->maintain();
  camera_.maintain();
  if (serial_) serial_->maintain();
}

}  // namespace polygmap::daemon
