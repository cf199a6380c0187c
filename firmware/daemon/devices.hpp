// SPDX-License-Identifier: Apache-2.0
// The robot's devices as the daemon's file has them, as the module's ports.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "firmware/daemon/config/daemon_config.hpp"
#include "firmware/daemon/service/device_counts.hpp"
#include "firmware/pipeline.hpp"
#include "firmware/recording/recorder.hpp"
#include "hal/can/can_joint_bus.hpp"
#include "hal/linux/socket_can.hpp"

namespace polygmap::daemon {

class Devices {
 public:
  explicit Devices(const hal::SystemCalls& calls = hal::kernel_calls()) : calls_(calls), camera_(calls) {}
  Devices(const Devices&) = delete;
  Devices& operator=(const Devices&) = delete;

  // Opens all of them, once. Empty, or one sentence that names file, line and key, and the device.
  [[nodiscard]] std::string open(const DaemonConfig& config);

  // After open().
  [[nodiscard]] Ports ports() noexcept;
  // Whom a recorder asks to keep pictures.
  [[nodiscard]] hal::PictureKeeper& picture_keeper() noexcept { return keeper_; }
  // After open(): all counters of all devices. They refer to this.
  void count_in(DeviceCounts& counts) const;
  // Opens anew what was lost; each call tries once. Some ten times a second, outside the lanes.
  void maintain() noexcept;
  // The drives leave motor mode: a joint that carries gives way. No lane may run.
  void let_go() noexcept;

 private:
  class NoLidar final : public hal::LidarOdometry {
   public:
    [[nodiscard]] bool try_read(LioSample&) noexcept override { return false; }
  };
  // The camera's second holder.
  class Keeper final : public hal::PictureKeeper {
   public:
    explicit Keeper(hal::V4l2Camera& camera) noexcept : camera_(camera) {}
    [[nodiscard]] bool try_keep(const DepthFrameView&) noexcept override { return camera_.try_share(); }
    void let_go(const std::uint16_t* pixels) noexcept override { camera_.release_shared(pixels); }

   private:
    hal::V4l2Camera& camera_;
  };
  [[nodiscard]] std::string open_buses(const DaemonConfig& config);
  [[nodiscard]] std::string open_imu(const DaemonConfig& config);

  const hal::SystemCalls& calls_;
  hal::DriveTable table_;
  std::vector<std::string> buses_;                        // their interfaces
  std::vector<std::unique_ptr<hal::SocketCan>> sockets_;  // one a bus of the table
  std::optional<hal::CanJointBus> joints_;
  hal::V4l2Camera camera_;
  Keeper keeper_{camera_};
  std::unique_ptr<hal::LivoxImu> livox_;  // one of the two
  std::unique_ptr<hal::SerialImu> serial_;
  std::unique_ptr<hal::LioUdp> lio_;
  NoLidar no_lidar_;
};

}  // namespace polygmap::daemon
