// SPDX-License-Identifier: Apache-2.0
// link_stream SECONDS FILE: a simulated climb, as a stream of what the module's ports said and what it commanded
// (stream.h). The module runs on ports of its own here, and not behind the C interface: what that gives is compared
// with it.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "firmware/link/abi.hpp"
#include "firmware/schedule.hpp"
#include "sim_stub/sim_robot.hpp"

#define polygmap polygmap_handle
#include "tests/installed/stream.h"
#undef polygmap

namespace {

using namespace polygmap;

class Tap final : public hal::DepthCamera, public hal::Imu, public hal::JointBus, public hal::LidarOdometry {
 public:
  Tap(sim::SimRobot& robot, FILE* to) : robot_(robot), to_(to) {}

  void end_step(std::int64_t now_ns) {
    put(STREAM_STEP, now_ns);
    if (commanded_) {
      put(STREAM_COMMAND, command_);
    } else {
      put_kind(STREAM_NO_COMMAND);
    }
    commanded_ = false;
  }

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return robot_.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    if (!robot_.try_acquire(frame)) return false;
    auto depth = sized<polygmap_depth>();
    depth.sequence = frame.sequence;
    depth.stamp_ns = frame.stamp_ns;
    depth.width_px = frame.width_px;
    depth.height_px = frame.height_px;
    put(STREAM_DEPTH, depth);
    std::fwrite(frame.depth, sizeof *frame.depth, STREAM_PIXELS, to_);
    return true;
  }
  void release() noexcept override { robot_.release(); }
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override {
    if (!robot_.try_read(sample)) return false;
    auto imu = sized<polygmap_imu>();
    imu.stamp_ns = sample.stamp_ns;
    copy(sample.gyro_radps, imu.gyro_radps);
    copy(sample.accel_mps2, imu.accel_mps2);
    put(STREAM_IMU, imu);
    return true;
  }
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    if (!robot_.try_read(feedback)) return false;
    auto joints = sized<polygmap_joints>();
    joints.stamp_ns = feedback.stamp_ns;
    copy(feedback.q_rad, joints.q_rad);
    copy(feedback.dq_radps, joints.dq_radps);
    copy(feedback.tau_nm, joints.tau_nm);
    for (std::size_t n = 0; n < kJointCount; ++n) {
      joints.silent_cycles[n] = feedback.silent_cycles[n];
      joints.drive_degc[n] = POLYGMAP_NOT_TOLD_DEGC;
    }
    for (std::size_t foot = 0; foot < kFootCount; ++foot) joints.foot_force_n[foot] = feedback.foot_force_n[foot];
    put(STREAM_JOINTS, joints);
    return true;
  }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    command_ = sized<polygmap_command>();
    command_.stamp_ns = command.stamp_ns;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      command_.q_rad[n] = command.joints[n].q_rad;
      command_.dq_radps[n] = command.joints[n].dq_radps;
      command_.tau_ff_nm[n] = command.joints[n].tau_ff_nm;
      command_.kp_nmprad[n] = command.joints[n].kp_nmprad;
      command_.kd_nmsprad[n] = command.joints[n].kd_nmsprad;
    }
    commanded_ = true;
    return robot_.try_write(command);
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return robot_.status(); }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    if (!robot_.try_read(sample)) return false;
    auto lio = sized<polygmap_lio>();
    lio.stamp_ns = sample.stamp_ns;
    for (int i = 0; i < 9; ++i) lio.lio_R_lidar[i] = sample.lio_T_lidar.R(i / 3, i % 3);
    copy(sample.lio_T_lidar.p_m, lio.lio_p_lidar_m);
    copy(sample.position_sigma_m, lio.position_sigma_m);
    copy(sample.rotation_sigma_rad, lio.rotation_sigma_rad);
    put(STREAM_LIO, lio);
    return true;
  }

 private:
  // Padding included: nothing of this program's memory is in the stream.
  template <class Struct>
  static Struct sized() {
    Struct value;
    std::memset(&value, 0, sizeof value);
    value.size = sizeof value;
    return value;
  }
  static void copy(const auto& from, auto& to) {
    for (Eigen::Index i = 0; i < from.size(); ++i) to[i] = from[i];
  }
  void put_kind(std::uint32_t kind) { std::fwrite(&kind, sizeof kind, 1, to_); }
  void put(std::uint32_t kind, const auto& value) {
    put_kind(kind);
    std::fwrite(&value, sizeof value, 1, to_);
  }

  sim::SimRobot& robot_;
  FILE* to_;
  polygmap_command command_{};
  bool commanded_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  const double duration_s = argc == 3 ? std::atof(argv[1]) : 0.0;
  FILE* to = duration_s > 0.0 ? std::fopen(argv[2], "wb") : nullptr;
  if (to == nullptr) {
    std::fputs("usage: link_stream SECONDS FILE\n", stderr);
    return 2;
  }
  sim::SimOptions options;
  options.start = sim::StartPose{.distance_m = 0.4, .lateral_m = 0.0, .yaw_rad = 0.0};
  sim::SimRobot robot(options);
  Tap tap(robot, to);
  const auto pipeline = std::make_unique<Pipeline>(Ports{tap, tap, tap, tap}, Params{});
  const auto executive = std::make_unique<OneLaneExecutive<>>(*pipeline, robot, pipeline->lane_health(kControlLane));
  executive->start(robot.now_ns() + kCycle_ns);
  const std::int64_t end_ns = robot.now_ns() + static_cast<std::int64_t>(duration_s * kNsPerS);
  while (robot.now_ns() < end_ns) {
    robot.advance();
    executive->tick(robot.now_ns());
    tap.end_step(robot.now_ns());
  }
  // A foot on the stairs at least, or the stream is not worth the comparison.
  const LatchedStep& step = pipeline->control().gait_status().step;
  std::printf("%u swings, %s\n", step.sequence, step.onto_tread ? "on the stairs" : "not yet on the stairs");
  const bool written = std::ferror(to) == 0;
  return std::fclose(to) == 0 && written && step.onto_tread ? 0 : 1;
}
