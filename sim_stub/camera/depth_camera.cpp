// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/camera/depth_camera.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace polygmap::sim {
namespace {

std::vector<SolidBox> rendered_solids(const StairWorld& world, const DepthCameraOptions& options) {
  std::vector<SolidBox> solids;
  for (SolidBox solid : solids_of(world)) {
    if (solid.step == options.missing_step || solid.is_glass) continue;
    solid.true_T_solid.p_m += options.stairs_shift_m;
    solids.push_back(solid);
  }
  return solids;
}

constexpr std::int64_t ticks_of(double duration_s) {
  return std::llround(duration_s / seconds(VirtualClock::kTick_ns));
}

CameraIntrinsics true_intrinsics(CameraIntrinsics k, const CameraErrors& errors) {
  k.fx_px *= 1.0 + errors.focal_share;
  k.fy_px *= 1.0 + errors.focal_share;
  k.cx_px += errors.centre_px[0];
  k.cy_px += errors.centre_px[1];
  return k;
}

// Of a frame that comes after its successor, and two ticks of jitter to spare.
constexpr std::int64_t kOvertaken_ticks = 19;

// One arrived, one held, one to spare, and those that are on their way.
std::size_t slot_count(const CameraErrors& errors) {
  constexpr std::int64_t kFrame_ticks = 16;
  const std::int64_t latest_ticks = SimDepthCamera::kLatency_ticks + ticks_of(errors.latency_s) +
                                    ticks_of(errors.jitter_s) +
                                    (errors.reorder_share > 0.0 ? ticks_of(errors.jitter_s) + kOvertaken_ticks : 0);
  return 3 + static_cast<std::size_t>(latest_ticks / kFrame_ticks + 1);
}

}  // namespace

SimDepthCamera::SimDepthCamera(const DepthCameraOptions& options, const CameraNoise::Params& noise,
                               const CameraIntrinsics& intrinsics, const Transform& base_T_camera,
                               const StairWorld& world, std::uint64_t seed)
    : options_(options),
      stated_(intrinsics),
      half_scan_ticks_(
          std::llround(0.5 * std::max(options.scan_s + options.errors.scan_s, 0.0) / seconds(VirtualClock::kTick_ns))),
      base_T_camera_(base_T_camera),
      solids_(rendered_solids(world, options)),
      renderer_(true_intrinsics(intrinsics, options.errors)),
      noise_(noise, intrinsics, seed),
      holes_(options.errors, world, seed),
      frame_draws_(seed, Stream::kCameraFrames),
      edge_draws_(seed, Stream::kFatEdges),
      slots_(slot_count(options.errors)) {
  for (Slot& slot : slots_) {
    slot.depth.resize(static_cast<std::size_t>(stated_.width_px) * static_cast<std::size_t>(stated_.height_px));
  }
  for (Spare& spare : spares_) spare.depth.resize(slots_.front().depth.size());
}

SimDepthCamera::~SimDepthCamera() {
  if (rendering_.valid()) rendering_.wait();
}

void SimDepthCamera::tick(std::int64_t tick, const Transform& true_T_base,
                          const std::array<LegShapes, kFootCount>& base_legs) {
  for (Slot* due = oldest(SlotState::kExposed); due != nullptr && tick >= due->arrival_tick;
       due = oldest(SlotState::kExposed)) {
    if (rendering_.valid()) rendering_.get();
    due->state = SlotState::kArrived;
  }
  past_.push_back({true_T_base * base_T_camera_, solids_, base_legs, base_T_camera_, options_.legs_visible});
  if (past_.size() > static_cast<std::size_t>(2 * half_scan_ticks_ + 1)) past_.pop_front();
  if (tick >= exposure_tick(next_frame_) + half_scan_ticks_) expose();
}

std::int64_t SimDepthCamera::arrival_tick(std::int64_t frame) const {
  const CameraErrors& errors = options_.errors;
  const auto index = static_cast<std::uint64_t>(frame);
  std::int64_t late_ticks = ticks_of(errors.latency_s + frame_draws_.uniform(3 * index, 0.0, errors.jitter_s));
  if (frame_draws_.uniform(3 * index + 1) < errors.reorder_share) {
    late_ticks += ticks_of(errors.jitter_s) + kOvertaken_ticks;
  }
  return exposure_tick(frame) + kLatency_ticks + late_ticks;
}

void SimDepthCamera::expose() {
  const std::int64_t frame = next_frame_++, tick = exposure_tick(frame);
  const std::int64_t stamp_ns = VirtualClock::stamp_ns(tick);
  if (any_contains(options_.silent, stamp_ns)) return;
  if (frame_draws_.uniform(3 * static_cast<std::uint64_t>(frame) + 2) < options_.errors.drop_share) return;
  Slot& slot = free_slot();
  slot.state = SlotState::kExposed;
  slot.stamp_ns = stamp_ns + std::llround(options_.errors.stamp_s * kNsPerS);
  slot.arrival_tick = arrival_tick(frame);
  slot.sequence = static_cast<std::uint32_t>(frame);
  std::uint16_t* depth = slot.depth.data();
  if (any_contains(options_.blank, stamp_ns)) {
    std::fill(slot.depth.begin(), slot.depth.end(), std::uint16_t{0});
    return;
  }
  const double time_s = seconds(stamp_ns - VirtualClock::kStart_ns);
  const auto render = [this, first = past_.front(), last = past_.back(), frame, time_s, depth] {
    renderer_.render(first, last);
    renderer_.fatten_edges(options_.errors.edge_fattening_px, edge_draws_);
    noise_.apply(renderer_, static_cast<std::uint64_t>(frame), time_s, depth);
    holes_.apply(renderer_, first, last, static_cast<std::uint64_t>(frame), depth);
  };
  if (rendering_.valid()) rendering_.get();  // pictures share the renderer
  if (options_.threaded) {
    rendering_ = std::async(std::launch::async, render);
  } else {
    render();
  }
}

SimDepthCamera::Slot& SimDepthCamera::free_slot() {
  Slot* slot = oldest(SlotState::kFree);
  if (slot == nullptr) {  // nobody fetches frames: the oldest one that waits is lost, as in a driver
    slot = oldest(SlotState::kArrived);
    ++overwritten_;
  }
  return *slot;
}

SimDepthCamera::Slot* SimDepthCamera::oldest(SlotState state) noexcept {
  const auto before = [](const Slot& a, const Slot& b) {
    return std::tie(a.arrival_tick, a.stamp_ns) < std::tie(b.arrival_tick, b.stamp_ns);
  };
  Slot* found = nullptr;
  for (Slot& slot : slots_) {
    if (slot.state == state && (found == nullptr || before(slot, *found))) found = &slot;
  }
  return found;
}

bool SimDepthCamera::try_acquire(DepthFrameView& frame) noexcept {
  if (oldest(SlotState::kHeld) != nullptr) return false;
  Slot* slot = oldest(SlotState::kArrived);
  if (slot == nullptr) return false;
  slot->state = SlotState::kHeld;
  const CameraIntrinsics& k = intrinsics();
  frame = {slot->stamp_ns, slot->sequence, k.width_px, k.height_px, slot->depth.data()};
  return true;
}

void SimDepthCamera::release() noexcept {
  Slot* slot = oldest(SlotState::kHeld);
  if (slot == nullptr) return;
  slot->state = SlotState::kFree;
  if (!slot->kept) return;
  slot->kept = false;
  const auto spare = std::ranges::find(spares_, false, &Spare::keeps);
  spare->keeps = true;
  spare->depth.swap(slot->depth);
}

bool SimDepthCamera::try_keep() noexcept {
  Slot* slot = oldest(SlotState::kHeld);
  if (slot == nullptr || slot->kept || std::ranges::find(spares_, false, &Spare::keeps) == spares_.end()) return false;
  slot->kept = true;
  return true;
}

void SimDepthCamera::let_go(const std::uint16_t* pixels) noexcept {
  if (Slot* slot = oldest(SlotState::kHeld); slot != nullptr && slot->depth.data() == pixels) slot->kept = false;
  for (Spare& spare : spares_) spare.keeps = spare.keeps && spare.depth.data() != pixels;
}

}  // namespace polygmap::sim
