// SPDX-License-Identifier: Apache-2.0
#include "firmware/link/instance.hpp"

#include "firmware/link/config/apply_config.hpp"
#include "firmware/robot_camera.hpp"

namespace polygmap::link {

bool Instance::try_begin(const char* config) noexcept {
  CameraIntrinsics camera = robot_camera_intrinsics();
  if (config != nullptr && !apply_config(config, params, camera, wrong)) return false;
  depth.set_intrinsics(camera);
  pipeline.emplace(Ports{depth, imu, joints, lio, &operations}, params);
  pipeline->watch(watched);
  executive.emplace(*pipeline, clock, pipeline->lane_health(kControlLane));
  return true;
}

bool Instance::try_step(std::int64_t now_ns) noexcept {
  const bool first = !clock.runs();
  if (!clock.try_advance(now_ns)) return false;
  if (first) {
    imu.queue.begin();
    joints.begin();
    lio.queue.begin();
    depth.begin();
    executive->start(clock.now_ns());
  }
  if (clock.now_ns() < executive->next_due_ns()) return true;
  joints.begin_cycle();
  (void)executive->tick(clock.now_ns());
  (void)pipeline->telemetry(clock.now_ns(), watched);  // takes over what perception has finished
  return true;
}

}  // namespace polygmap::link
