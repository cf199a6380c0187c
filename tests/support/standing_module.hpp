// SPDX-License-Identifier: Apache-2.0
// The whole module on fakes fed by hand, with what firmware says of it.
#pragma once

#include <gtest/gtest.h>

#include "sim_stub/robot_camera.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/trapped_module.hpp"

namespace polygmap::test {

// A robot that stands still on level floor whatever it is told, fed by hand.
class StandingModule : public testing::Test {
 protected:
  explicit StandingModule(const Params& params = {}, hal::OperatorInput* operator_input = nullptr)
      : camera_(robot_camera_intrinsics()),
        module_({camera_, imu_, joints_, lidar_, operator_input}, arming_at_once(params), clock_) {}
  // What it is to do next is not the tenth of a second that it listens for.
  [[nodiscard]] static Params arming_at_once(Params params) {
    params.estimator.rest_ns = 0;
    return params;
  }

  [[nodiscard]] ImuSample imu_at(std::int64_t stamp_ns) const {
    return {stamp_ns, Vec3::Zero(), Vec3{0, 0, kGravity_mps2}};
  }
  [[nodiscard]] JointFeedback joints_at(std::int64_t stamp_ns) const {
    JointFeedback feedback;
    feedback.stamp_ns = stamp_ns;
    feedback.q_rad = standing_q_rad_;
    feedback.foot_force_n = foot_force_n_;
    return feedback;
  }
  void tick_with(const ImuSample* imu, const JointFeedback* joints) {
    if (imu != nullptr) imu_.feed(*imu);
    if (joints != nullptr) joints_.feed(*joints);
    module_.tick();
  }
  void stand(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      clock_.advance_ns(kCycle_ns);
      const ImuSample imu = imu_at(clock_.now_ns());
      const JointFeedback joints = joints_at(clock_.now_ns());
      tick_with(&imu, &joints);
    }
  }
  [[nodiscard]] const ControlLane& control() const { return module_.pipeline().control(); }
  [[nodiscard]] std::uint32_t count(Fault fault) const { return module_.pipeline().health().count(fault).count; }
  [[nodiscard]] std::uint32_t count(Limit limit) const { return module_.pipeline().health().count(limit).count; }

  static constexpr int kInitialised_ticks = 700;  // the standstill takes a second

  JointVector standing_q_rad_ = standing_joints();
  std::array<double, kFootCount> foot_force_n_{270.0, 270.0};
  fakes::FakeClock clock_ = three_days_up();
  fakes::FakeDepthCamera camera_;
  fakes::FakeImu imu_;
  fakes::FakeJointBus joints_;
  fakes::FakeLidarOdometry lidar_;
  TrappedModule module_;
};

}  // namespace polygmap::test
