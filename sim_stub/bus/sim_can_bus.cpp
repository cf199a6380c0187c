// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/bus/sim_can_bus.hpp"

#include <algorithm>
#include <limits>

#include "algorithms/core/time.hpp"
#include "hal/codec/can_bits.hpp"

namespace polygmap::sim {

std::size_t SimCanBus::read(std::span<hal::CanFrame> frames) noexcept {
  std::size_t count = 0;
  while (count < frames.size() && to_host_.try_pop(frames[count])) ++count;
  return count;
}

std::size_t SimCanBus::write(std::span<const hal::CanFrame> frames) noexcept {
  std::size_t taken = 0;
  while (taken < frames.size() && !status_.bus_off && to_bus_.size() < places_ && to_bus_.try_push(frames[taken])) {
    ++taken;
  }
  status_.refused += static_cast<std::uint32_t>(frames.size() - taken);
  return taken;
}

void SimCanBus::set_bus_off(bool off) noexcept {
  status_.bus_off = off;
  if (!off) return;
  to_bus_.clear();
  in_flight_.reset();
  nodes_.clear();
}

void SimCanBus::begin_next(std::int64_t now_ns) {
  const auto ready = [now_ns](const Waiting& node) { return node.ready_ns <= now_ns; };
  auto next = nodes_.end();
  for (auto node = nodes_.begin(); node != nodes_.end(); ++node) {
    if (ready(*node) && (next == nodes_.end() || node->frame.id < next->frame.id)) next = node;
  }
  InFlight chosen;
  // Of two equal identifiers the host's goes first: a node answers it.
  chosen.by_host = !to_bus_.empty() && (next == nodes_.end() || to_bus_.oldest().id <= next->frame.id);
  if (!chosen.by_host && next == nodes_.end()) return;
  if (chosen.by_host) {
    (void)to_bus_.try_pop(chosen.frame);
  } else {
    chosen.frame = next->frame;
    nodes_.erase(next);
  }
  const auto bits = static_cast<std::int64_t>(hal::frame_bits(chosen.frame));
  chosen.done_ns = now_ns + bits * kNsPerS / bitrate_bps_;
  in_flight_ = chosen;
}

void SimCanBus::finish(const Received& received, const Logged& logged) {
  InFlight done = *in_flight_;
  in_flight_.reset();
  done.frame.stamp_ns = done.done_ns;
  if (logged) logged(done.frame);
  if (done.by_host) {
    ++status_.sent;
    if (received) received(done.frame, done.done_ns);
  } else if (to_host_.try_push(done.frame)) {
    ++status_.received;
  } else {
    ++status_.lost;
  }
}

void SimCanBus::run(std::int64_t from_ns, std::int64_t to_ns, const Received& received, const Logged& logged) {
  if (status_.bus_off) {
    nodes_.clear();
    return;
  }
  std::int64_t now_ns = from_ns;
  while (true) {
    if (!in_flight_) begin_next(now_ns);
    if (in_flight_) {
      if (in_flight_->done_ns > to_ns) return;
      now_ns = in_flight_->done_ns;
      finish(received, logged);
      continue;
    }
    std::int64_t next_ns = std::numeric_limits<std::int64_t>::max();
    for (const Waiting& node : nodes_) next_ns = std::min(next_ns, node.ready_ns);
    if (next_ns >= to_ns) return;
    now_ns = std::max(now_ns, next_ns);
  }
}

}  // namespace polygmap::sim
