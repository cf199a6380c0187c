// SPDX-License-Identifier: Apache-2.0
// The lanes, and everything that crosses between them. Each exchange has one writer and one reader.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <span>

#include "algorithms/core/containers/exchange.hpp"
#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/state.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "firmware/faults.hpp"
#include "scheduler/schedule_table.hpp"

namespace polygmap {

enum Lane : std::uint8_t { kControlLane, kPerceptionLane, kLaneCount };

// What one lane publishes in frame n (a cycle's due time), the other sees from frame n + 1 on, in one lane too: which
// of two threads is quicker changes nothing. A lane that catches up is at most two frames late, the executive skips
// what is older (CyclicExecutive::kMaxCaughtUp); the exchanges have slots for that.
inline constexpr std::int64_t kMaxFramesApart = 2;
// Of a value in every frame: those of the frames in between, the newest one before them, the one held, the one filled.
inline constexpr std::size_t kEveryFrameSlots = kMaxFramesApart + 3;
// Of a value that takes two frames at least, as a question and its answer do.
inline constexpr std::size_t kSecondFrameSlots = kMaxFramesApart / 2 + 3;
// Of a value that takes more than kMaxFramesApart frames.
inline constexpr std::size_t kSeldomSlots = 3;

// How far a lane has come; written by its thread when a cycle is over.
struct alignas(64) LaneProgress {
  std::atomic<std::int64_t> finished_ns{kNoFrame_ns};  // the cycle's due time
};
using LaneProgresses = std::array<LaneProgress, kLaneCount>;

// The frame of a value that a lane holds, and whether it came too late for a newer one.
struct TakenFrame {
  std::int64_t frame_ns = kNoFrame_ns;
  bool missed = false;
};
inline constexpr std::size_t kMaxTaken = 3;  // exchanges that a lane reads

// What a lane sees of the other one in the frame that it runs: settled when the frame begins, so that all its rows see
// the same.
class LaneView {
 public:
  // False when the other lane has not finished the frame before: what it publishes there is then seen a frame later.
  // The first frame has none before it; frames that this lane skipped are told as slips.
  [[nodiscard]] bool begin(std::int64_t frame_ns, std::int64_t other_finished_ns) noexcept {
    const bool in_time = other_finished_ns >= std::min(frame_ns - kCycle_ns, frame_ns_);
    frame_ns_ = frame_ns;
    other_finished_ns_ = other_finished_ns;
    last_ns_ = std::min(frame_ns - kCycle_ns, other_finished_ns);
    taken_.clear();
    return in_time;
  }
  // Takes what the other lane published; in every frame all exchanges that the lane reads, in the same order.
  bool take(auto& exchange) noexcept {
    const bool took = exchange.try_take(last_ns_);
    (void)taken_.try_push_back({exchange.front_frame_ns(), exchange.missed()});
    return took;
  }
  // Values of the frames up to this one are seen.
  [[nodiscard]] std::int64_t last_ns() const noexcept { return last_ns_; }
  // Inputs of the frame, for who replays it: as begin() was told, and what take() found in each exchange.
  [[nodiscard]] std::int64_t other_finished_ns() const noexcept { return other_finished_ns_; }
  [[nodiscard]] std::span<const TakenFrame> taken() const noexcept { return {taken_.begin(), taken_.end()}; }

 private:
  std::int64_t last_ns_ = kNoFrame_ns;
  std::int64_t other_finished_ns_ = kNoFrame_ns;
  std::int64_t frame_ns_ = kNoFrame_ns;
  StaticVector<TakenFrame, kMaxTaken> taken_;
};

// A lane's faults and limits. Its thread counts in `own` and publishes; control reads what was published.
struct LaneHealth {
  Health own;
  Exchange<Health, kEveryFrameSlots> published;

  void publish(std::int64_t frame_ns) noexcept { published.publish(frame_ns, own); }
};
using LaneHealths = std::array<LaneHealth, kLaneCount>;

// Perception asks for the pose at a frame's exposure; control, which owns the past, answers in its next cycle.
struct PoseRequest {
  std::uint32_t number = 0;  // the answer has the same
  std::int64_t stamp_ns = 0;
};
struct PoseAnswer {
  std::uint32_t number = 0;
  bool found = false;
  StateEstimate state;
};

// What the foothold search needs to know of the robot.
struct SearchContext {
  StateEstimate state;
  Foot stance = Foot::kLeft;  // the foot that stays
  bool climbing = false;      // has stepped onto a tread
  bool goes_to = false;       // a place, on the ground that the map shows
};

// The pair of control and perception.
struct ControlPerceptionLink {
  LaneProgresses progress;
  Exchange<PoseRequest, kSecondFrameSlots> pose_request;     // perception -> control
  Exchange<PoseAnswer, kSecondFrameSlots> pose_answer;       // control -> perception
  Exchange<SearchContext, kEveryFrameSlots> search_context;  // control -> perception
  Exchange<FootholdSet, kSecondFrameSlots> footholds;        // perception -> control
};

// What perception made, copied out when it was finished, for whoever watches the module on control's thread. By frames
// like all else that crosses, so that a watcher sees the same in one lane and in two.
struct PerceptionTelemetry {
  Exchange<SurfaceFrame, kSeldomSlots> surfaces;
  Exchange<MapSnapshot, kSeldomSlots> map;
};

}  // namespace polygmap
