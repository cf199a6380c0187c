// SPDX-License-Identifier: Apache-2.0
// The last half second of states, so that late data meets the pose of its own stamp.
#pragma once

#include "algorithms/core/containers/ring_buffer.hpp"
#include "algorithms/core/messages/state.hpp"

namespace polygmap {

class StateHistory {
 public:
  void clear() noexcept { states_.clear(); }
  // Stamps must increase: an older or equal one is not stored. States closer to each other than kMinPeriod_ns are
  // thinned out, all but the newest, so that the room holds 0.4 s at any rate.
  void push(const StateEstimate& state) noexcept;
  static constexpr std::int64_t kMinPeriod_ns = 3 * kNsPerMs / 2;
  static constexpr std::int64_t kMaxGap_ns = 50 * kNsPerMs;  // what happened in a longer one is unknown
  // The state at a stamp between the oldest and the newest: linear in positions and joints, constant rotation rate
  // between ticks. False, and out untouched, outside and in a gap.
  [[nodiscard]] bool try_at(std::int64_t stamp_ns, StateEstimate& out) const noexcept;

 private:
  RingBuffer<StateEstimate, kStateRingCapacity> states_;
};

}  // namespace polygmap
