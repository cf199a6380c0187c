// SPDX-License-Identifier: Apache-2.0
// The least that a controller needs to run the module: five ports, one pipeline, one executive, a tick every 2 ms.
#include <array>
#include <cstdint>
#include <memory>

#include "firmware/pipeline.hpp"
#include "firmware/schedule.hpp"

namespace {

// This project's own style is none of the module's business: with its warnings this would not compile.
int careless(int unused) { return 0; }

// A robot whose sensors are silent.
class Robot final : public polygmap::hal::Clock,
                    public polygmap::hal::DepthCamera,
                    public polygmap::hal::Imu,
                    public polygmap::hal::JointBus,
                    public polygmap::hal::LidarOdometry {
 public:
  std::int64_t now_ns() const noexcept override { return now; }
  std::uint64_t count() const noexcept override { return static_cast<std::uint64_t>(now); }
  double counts_per_us() const noexcept override { return 1000.0; }
  polygmap::CameraIntrinsics intrinsics() const noexcept override {
    return {640, 480, 390.0, 390.0, 320.0, 240.0, 0.001};
  }
  bool try_acquire(polygmap::DepthFrameView&) noexcept override { return false; }
  void release() noexcept override {}
  bool try_read(polygmap::ImuSample&) noexcept override { return false; }
  bool try_read(polygmap::JointFeedback&) noexcept override { return false; }
  polygmap::JointSet try_write(const polygmap::JointCommand&) noexcept override { return polygmap::JointSet::all(); }
  polygmap::hal::JointBusStatus status() const noexcept override { return {}; }
  bool try_read(polygmap::LioSample&) noexcept override { return false; }

  std::int64_t now = polygmap::kNsPerS;
};

}  // namespace

int main() {
  Robot robot;
  const auto pipeline =
      std::make_unique<polygmap::Pipeline>(polygmap::Ports{robot, robot, robot, robot}, polygmap::Params{});
  polygmap::OneLaneExecutive<polygmap::Pipeline> executive(*pipeline, robot, pipeline->lane_health(0));
  executive.start(robot.now + polygmap::kCycle_ns);
  for (int tick = 0; tick < 500; ++tick) {
    robot.now += polygmap::kCycle_ns;
    executive.tick(robot.now);
  }
  // Silent sensors are named.
  const bool told = pipeline->health().count(polygmap::Fault::kImuMissing).count > 0;
  return told ? careless(1) : 1;
}
