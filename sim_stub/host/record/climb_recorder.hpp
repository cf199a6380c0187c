// SPDX-License-Identifier: Apache-2.0
// What the sensors of a climb said, in the files that `polygmap perceive` and `polygmap estimate` read.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "algorithms/core/messages/state.hpp"
#include "hal/ports/depth_camera.hpp"
#include "hal/ports/imu.hpp"
#include "hal/ports/joint_bus.hpp"
#include "hal/ports/lidar_odometry.hpp"
#include "sim_stub/host/estimate/estimate_log.hpp"
#include "sim_stub/world/truth.hpp"

namespace polygmap::sim {

// Stands between the robot's ports and the module, and allocates nothing while the module calls.
class ClimbRecorder final : public hal::DepthCamera, public hal::Imu, public hal::JointBus, public hal::LidarOdometry {
 public:
  ClimbRecorder(hal::DepthCamera& camera, hal::Imu& imu, hal::JointBus& joints, hal::LidarOdometry& lidar);

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return camera_.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override;
  void release() noexcept override { camera_.release(); }
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override;
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override;
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override { return joints_.try_write(command); }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return joints_.status(); }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override;

  // After each tick: one row of the log. The contacts are the module's own.
  void observe(const Truth& truth, const StateEstimate& state);
  // log.csv, lio.csv and depth_NN.png, one every two seconds, into a folder that exists. Throws config::FileError.
  void write(const std::string& folder) const;

 private:
  struct Picture {
    std::int64_t width_px = 0, height_px = 0;
    std::vector<std::uint16_t> depth;
  };

  hal::DepthCamera& camera_;
  hal::Imu& imu_;
  hal::JointBus& joints_;
  hal::LidarOdometry& lidar_;
  ImuSample last_imu_;
  JointFeedback last_joints_;
  LioSample last_lio_;
  bool has_new_lio_ = false, has_new_picture_ = false;
  std::int64_t next_picture_ns_ = 0;
  Picture picture_;  // as it was acquired; a copy is kept after the tick
  std::vector<LogRow> rows_;
  std::vector<LioRow> lio_rows_;
  std::vector<Picture> pictures_;
};

}  // namespace polygmap::sim
