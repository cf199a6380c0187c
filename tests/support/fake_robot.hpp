// SPDX-License-Identifier: Apache-2.0
// A robot before a staircase, on the fakes of the ports: its legs follow the commands, its base hangs on the foot that
// carries, its sensors are perfect and fall silent when told. For tests of the wiring in the cross build too, where
// there is no simulation.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "firmware/pipeline.hpp"
#include "sim_stub/sensors/imu_interval.hpp"
#include "tests/support/depth_scene.hpp"
#include "tests/support/fakes/fake_clock.hpp"
#include "tests/support/fakes/fake_depth_camera.hpp"
#include "tests/support/fakes/fake_imu.hpp"
#include "tests/support/fakes/fake_joint_bus.hpp"
#include "tests/support/fakes/fake_lidar_odometry.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::test {

// Half as wide and high, each pixel four times: exact at the module's own half resolution, at a quarter of the price.
[[nodiscard]] std::vector<std::uint16_t> render_for_robot(DepthScene scene);
// No stamp is near 0 on a robot's clock.
[[nodiscard]] fakes::FakeClock three_days_up();
// Joint angles of a robot standing upright.
[[nodiscard]] JointVector standing_joints();
inline constexpr double kWeight_n = 540.0;

class FakeRobot {
 public:
  // toe_gap_m: from the collision toes to the first riser. Four steps of 0.13 x 0.28 m.
  explicit FakeRobot(double toe_gap_m);
  [[nodiscard]] Ports ports() noexcept { return {camera, imu, joints, lidar}; }
  // 2 ms: the legs follow the newest command, then the sensors speak. What the camera sees it has at once.
  void advance();

  [[nodiscard]] const Transform& true_T_base() const noexcept { return true_T_base_; }
  [[nodiscard]] const Transform& true_T_sole(Foot foot) const noexcept { return feet_[index_of(foot)].true_T_sole; }
  [[nodiscard]] double first_riser_x_m() const noexcept { return stairs_.first_riser_x_m; }
  [[nodiscard]] bool stands(Foot foot) const noexcept { return feet_[index_of(foot)].stands; }

  fakes::FakeClock clock;
  fakes::FakeDepthCamera camera;
  fakes::FakeImu imu;
  fakes::FakeJointBus joints;
  fakes::FakeLidarOdometry lidar;
  bool imu_speaks = true;
  std::int64_t imu_interval_ns = kCycle_ns;  // from one sample to the next, no less; before the first advance()
  bool joints_speak = true;
  bool camera_speaks = true;
  int picture_ticks = kSlowMachine ? 48 : 16;  // from one picture to the next
  std::size_t silent_joint = kJointCount;  // whose drive follows its commands and does not answer; kJointCount: none
  JointVector encoder_offset_rad = JointVector::Zero();  // reading minus true angle

 private:
  struct FootState {
    Transform true_T_sole;
    bool stands = true;
  };
  void move();
  void sense();
  [[nodiscard]] double ground_m(const Transform& true_T_sole) const;

  StairSpec stairs_;
  DepthScene scene_;
  std::array<FootState, kFootCount> feet_;
  std::size_t support_ = 0;
  JointVector q_rad_, dq_radps_ = JointVector::Zero(), followed_rad_;
  std::array<Transform, 3> true_T_base_before_;  // newest first
  Transform true_T_base_;
  std::int64_t tick_ = 0;
  std::optional<sim::ImuInterval> imu_interval_;
  // What a drive said last before it fell silent.
  JointVector q_rad_before_ = JointVector::Zero(), dq_radps_before_ = JointVector::Zero();
  std::array<double, 2> last_heard_{};
  std::uint16_t silent_cycles_ = 0;
};

}  // namespace polygmap::test
