// SPDX-License-Identifier: Apache-2.0
// The simulated robot on its stairs: plant and sensors behind the module's ports. Deterministic per seed and options,
// byte for byte, with or without the rendering thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "hal/ports/clock.hpp"
#include "hal/ports/depth_camera.hpp"
#include "hal/ports/imu.hpp"
#include "hal/ports/joint_bus.hpp"
#include "hal/ports/lidar_odometry.hpp"
#include "hal/ports/picture_keeper.hpp"
#include "sim_stub/camera/depth_camera.hpp"
#include "sim_stub/plant/kinematic_plant.hpp"
#include "sim_stub/plant/mujoco_plant.hpp"
#include "sim_stub/robot_camera.hpp"
#include "sim_stub/sensors/imu_interval.hpp"
#include "sim_stub/sensors/robot_errors.hpp"
#include "sim_stub/sensors/sensor_models.hpp"
#include "sim_stub/sensors/virtual_clock.hpp"
#include "sim_stub/stand_controller.hpp"
#include "sim_stub/world/stair_world.hpp"
#include "sim_stub/world/truth.hpp"

namespace polygmap::sim {

// Where the robot starts.
struct StartPose {
  double distance_m = 0.5;  // from the base to x = 0, the first riser
  double lateral_m = 0.0;
  double yaw_rad = 0.0;
  double height_m = 0.0;  // of what it stands on
};
// 0.35-0.8 m, +-0.15 m, +-10 degrees.
[[nodiscard]] StartPose draw_start(std::uint64_t seed);

struct SimOptions {
  std::uint64_t seed = 1;
  StairParams stairs;
  StairErrors stair_errors;
  std::optional<StairWorld> world;  // in the stead of stairs
  NoiseKind noise = NoiseKind::kWhite;
  CameraIntrinsics intrinsics = robot_camera_intrinsics();
  DepthNoiseModel depth_sigma;
  ErrorParams errors;
  std::optional<StartPose> start;  // drawn from the seed when absent
  DepthCameraOptions camera;
  std::int64_t imu_interval_ns = VirtualClock::kTick_ns;  // from one sample to the next, no less than a tick
  bool force_sensors = true;                              // false: no foot force is measured, NaN
  PlantKind plant_kind = PlantKind::kKinematic;
  KinematicPlant::Params plant;
  MujocoPlant::Params mujoco;
  std::vector<Push> pushes;
};

class SimRobot final : public hal::Clock,
                       public hal::DepthCamera,
                       public hal::Imu,
                       public hal::JointBus,
                       public hal::LidarOdometry,
                       public hal::PictureKeeper {
 public:
  explicit SimRobot(const SimOptions& options);
  SimRobot(const SimRobot&) = delete;
  SimRobot& operator=(const SimRobot&) = delete;

  // 2 ms: the command written last tick moves the drives, then the sensors sample. Host code, not for module time.
  void advance();
  [[nodiscard]] const Truth& truth() const noexcept { return truth_; }
  [[nodiscard]] const StairWorld& stairs() const noexcept { return stairs_; }
  [[nodiscard]] const StartPose& start() const noexcept { return start_; }
  [[nodiscard]] const RobotErrors& errors() const noexcept { return errors_; }
  [[nodiscard]] const SimDepthCamera& depth_camera() const noexcept { return camera_; }
  [[nodiscard]] JointVector true_q_rad() const noexcept { return plant_->true_q_rad(); }
  [[nodiscard]] Plant& plant() noexcept { return *plant_; }  // for tests that push it
  // Who held the robot before the module's first command takes it over as it stands; the module has to be silent.
  void hold_again();
  // The last command as the module wrote it.
  [[nodiscard]] const std::optional<JointCommand>& last_command() const noexcept { return command_; }
  [[nodiscard]] VirtualClock& clock() noexcept { return clock_; }  // for tests that inject work

  [[nodiscard]] std::int64_t now_ns() const noexcept override { return clock_.now_ns(); }
  [[nodiscard]] std::uint64_t count() const noexcept override { return clock_.count(); }
  [[nodiscard]] double counts_per_us() const noexcept override { return VirtualClock::kCountsPerUs; }
  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return camera_.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override { return camera_.try_acquire(frame); }
  void release() noexcept override { camera_.release(); }
  [[nodiscard]] bool try_keep(const DepthFrameView&) noexcept override { return camera_.try_keep(); }
  void let_go(const std::uint16_t* pixels) noexcept override { camera_.let_go(pixels); }
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override { return imu_queue_.try_pop(sample); }
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override;
  // Takes every command; the drives are wired directly.
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override;
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return {.senses_feet = force_sensors_}; }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override;

 private:
  static constexpr std::int64_t kLioPeriod_ticks = 50;

  [[nodiscard]] Vec3 push_force_n() const;
  void sense();
  void update_truth();

  StairWorld stairs_;
  StartPose start_;
  ErrorParams error_params_;
  RobotErrors errors_;
  std::vector<Push> pushes_;
  VirtualClock clock_;
  StandController holder_;  // until the module's first command that asks something of a drive, and from hold_again() on
  std::unique_ptr<Plant> plant_;
  SimDepthCamera camera_;
  ImuModel imu_;
  ImuInterval imu_interval_;
  JointModel joints_;
  FootForceModel forces_;
  TorqueModel torques_;
  bool force_sensors_;
  LioModel lio_;
  RingBuffer<ImuSample, 64> imu_queue_;
  RingBuffer<LioSample, 16> lio_queue_;  // sampled; readable once they have arrived
  JointFeedback feedback_;
  bool feedback_fresh_ = false;
  std::optional<JointCommand> command_;  // by the module, in this tick or before
  std::optional<JointCommand> active_;   // what the drives follow; none: the holder's
  Truth truth_;
};

}  // namespace polygmap::sim
