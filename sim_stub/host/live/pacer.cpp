// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/live/pacer.hpp"

#include <algorithm>
#include <thread>

namespace polygmap::sim {
namespace {

constexpr auto kPatience = std::chrono::milliseconds(100);                           // so much is made up for
constexpr std::chrono::steady_clock::duration kNap = std::chrono::milliseconds(20);  // so soon a signal is heard of

}  // namespace

Pacer::Clock::duration Pacer::rest(std::int64_t now_ns) const {
  const double due_ns = static_cast<double>(now_ns - begun_ns_) / speed_;
  return begun_ + std::chrono::nanoseconds(static_cast<std::int64_t>(due_ns)) - Clock::now();
}

void Pacer::wait_for(std::int64_t now_ns) {
  if (speed_ <= 0.0) return;
  if (!has_begun_ || rest(now_ns) < -kPatience) {
    has_begun_ = true;
    begun_ = Clock::now();
    begun_ns_ = now_ns;
  }
  for (Clock::duration left = rest(now_ns); left > Clock::duration::zero(); left = rest(now_ns)) {
    if (interrupt_ != nullptr && *interrupt_ != 0) return;
    std::this_thread::sleep_for(std::min(left, kNap));
  }
}

}  // namespace polygmap::sim
