// SPDX-License-Identifier: Apache-2.0
// A robot whose camera sees clutter in every second picture, later in all, and whose lidar odometry has a pose for
// every tick: what takes the module most.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "sim_stub/sim_robot.hpp"
#include "tests/support/tiled_depths.hpp"

namespace polygmap::vm {

class AdverseSensors final : public hal::DepthCamera, public hal::LidarOdometry {
 public:
  using Raw = std::vector<std::uint16_t>;

  // real: cluttered pictures of the camera's size; may be empty. robot outlives this.
  AdverseSensors(sim::SimRobot& robot, std::vector<Raw> real) : robot_(robot), real_(std::move(real)) {}

  // From here on no other picture comes.
  void only_clutter() noexcept { only_clutter_ = true; }

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return robot_.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    if (!robot_.try_acquire(frame)) return false;
    ++pictures_;
    if (pictures_ < kStairsFirst || (!only_clutter_ && pictures_ % 2 == 0)) return true;
    clutter_ = next_clutter();
    frame.depth = clutter_.data();
    return true;
  }
  void release() noexcept override { robot_.release(); }

  // Its own pose where it has one, else the last, as old as that was.
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    const std::int64_t now_ns = robot_.now_ns();
    if (static_cast<hal::LidarOdometry&>(robot_).try_read(last_)) {
      age_ns_ = now_ns - last_.stamp_ns;
      has_pose_ = true;
    } else if (!has_pose_ || last_.stamp_ns + age_ns_ == now_ns) {
      return false;
    } else {
      last_.stamp_ns = now_ns - age_ns_;
    }
    sample = last_;
    return true;
  }

 private:
  static constexpr std::int64_t kStairsFirst = 60;  // pictures, in which the robot finds them

  [[nodiscard]] Raw next_clutter() {
    struct Tile {
      std::int32_t width_px, height_px;
      bool steps;
    };
    static constexpr std::array kTiles{Tile{64, 48, false}, Tile{32, 32, false}, Tile{80, 40, true},
                                       Tile{640, 20, true}};
    const std::size_t which = clutters_++ % (kTiles.size() + real_.size());
    if (which >= kTiles.size()) return real_[which - kTiles.size()];
    const Tile& tile = kTiles[which];
    return test::tiled_depths(robot_.intrinsics(), tile.width_px, tile.height_px, tile.steps,
                              static_cast<std::uint32_t>(clutters_));
  }

  sim::SimRobot& robot_;
  std::vector<Raw> real_;
  Raw clutter_;
  std::int64_t pictures_ = 0;
  std::size_t clutters_ = 0;
  bool only_clutter_ = false;
  LioSample last_;
  std::int64_t age_ns_ = 0;
  bool has_pose_ = false;
};

}  // namespace polygmap::vm
