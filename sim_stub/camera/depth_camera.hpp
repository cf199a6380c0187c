// SPDX-License-Identifier: Apache-2.0
// The simulated depth camera as a device: exposes at 30 Hz, delivers 30 ms later or as its errors say, renders
// meanwhile on a second core.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <future>
#include <vector>

#include "algorithms/core/messages/samples.hpp"
#include "sim_stub/camera/camera_errors.hpp"
#include "sim_stub/camera/depth_holes.hpp"
#include "sim_stub/camera/depth_noise.hpp"
#include "sim_stub/camera/depth_renderer.hpp"
#include "sim_stub/sensors/virtual_clock.hpp"

namespace polygmap::sim {

// From (included) to (excluded), module time.
struct Window {
  std::int64_t from_ns = 0;
  std::int64_t to_ns = 0;
  [[nodiscard]] bool contains(std::int64_t stamp_ns) const noexcept { return stamp_ns >= from_ns && stamp_ns < to_ns; }
};
[[nodiscard]] inline bool any_contains(const std::vector<Window>& windows, std::int64_t stamp_ns) noexcept {
  for (const Window& window : windows) {
    if (window.contains(stamp_ns)) return true;
  }
  return false;
}

struct DepthCameraOptions {
  Vec3 stairs_shift_m = Vec3::Zero();  // of the rendered staircase against the true one; the floor stays
  int missing_step = -1;               // index of a step that the camera does not see: an open hole down to the floor
  bool legs_visible = true;
  // From the first row of a picture to its last; the stamp is their middle, and both ends are ticks: scan_s() is what
  // becomes of it. The L515 scans.
  double scan_s = 0.016;
  std::vector<Window> blank;   // frames exposed then have no valid pixel
  std::vector<Window> silent;  // frames exposed then never arrive
  bool threaded = true;        // the pictures are the same either way
  CameraErrors errors{};
};

class SimDepthCamera {
 public:
  SimDepthCamera(const DepthCameraOptions& options, const CameraNoise::Params& noise,
                 const CameraIntrinsics& intrinsics, const Transform& base_T_camera, const StairWorld& world,
                 std::uint64_t seed);
  ~SimDepthCamera();
  SimDepthCamera(const SimDepthCamera&) = delete;
  SimDepthCamera& operator=(const SimDepthCamera&) = delete;

  // The middle of frame k's exposure is the tick nearest to k / 30 s; it is stamped with that tick's time.
  [[nodiscard]] static constexpr std::int64_t exposure_tick(std::int64_t frame) noexcept {
    return (50 * frame + 1) / 3;
  }
  static constexpr std::int64_t kLatency_ticks = 15;

  // Once per tick, in order: starts a picture when its exposure has ended, and delivers the one that arrives.
  void tick(std::int64_t tick, const Transform& true_T_base, const std::array<LegShapes, kFootCount>& base_legs);

  [[nodiscard]] const CameraIntrinsics& intrinsics() const noexcept { return stated_; }  // by the data sheet
  [[nodiscard]] double scan_s() const noexcept { return seconds(2 * half_scan_ticks_ * VirtualClock::kTick_ns); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept;
  void release() noexcept;
  // A second holder keeps the picture that is held until let_go() of its pixels, also after release().
  static constexpr std::size_t kMostKept = 4;
  [[nodiscard]] bool try_keep() noexcept;
  void let_go(const std::uint16_t* pixels) noexcept;
  [[nodiscard]] std::uint32_t overwritten() const noexcept { return overwritten_; }  // arrived, but never acquired

 private:
  enum class SlotState : std::uint8_t { kFree, kExposed, kArrived, kHeld };
  struct Slot {
    SlotState state = SlotState::kFree;
    std::int64_t stamp_ns = 0;
    std::int64_t arrival_tick = 0;
    std::uint32_t sequence = 0;
    bool kept = false;
    std::vector<std::uint16_t> depth;
  };
  // Memory that takes the place of a kept picture's in its slot: how many slots there are decides which picture is lost
  // when nobody fetches any.
  struct Spare {
    bool keeps = false;
    std::vector<std::uint16_t> depth;
  };
  void expose();
  [[nodiscard]] std::int64_t arrival_tick(std::int64_t frame) const;
  [[nodiscard]] Slot& free_slot();
  // The first in the order of arrival.
  [[nodiscard]] Slot* oldest(SlotState state) noexcept;

  DepthCameraOptions options_;
  CameraIntrinsics stated_;
  std::int64_t half_scan_ticks_;
  Transform base_T_camera_;
  std::vector<SolidBox> solids_;
  std::deque<DepthScene> past_;  // as long as an exposure
  DepthRenderer renderer_;
  CameraNoise noise_;
  DepthHoles holes_;
  CounterNoise frame_draws_, edge_draws_;
  std::vector<Slot> slots_;
  std::array<Spare, kMostKept> spares_;
  std::future<void> rendering_;
  std::int64_t next_frame_ = 0;
  std::uint32_t overwritten_ = 0;
};

}  // namespace polygmap::sim
