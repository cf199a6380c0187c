// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/system/heap_count.hpp"

#include <atomic>

#include "firmware/daemon/system/heap_interposer.hpp"

namespace polygmap::daemon {
namespace {

constinit std::atomic<bool> counting{false};
constinit std::atomic<std::uint64_t> calls{0};

}  // namespace

HeapCount counted_heap() noexcept {
  return {.start = []() noexcept { counting.store(true); },
          .stop = []() noexcept { counting.store(false); },
          .calls = []() noexcept { return calls.load(); }};
}

}  // namespace polygmap::daemon

namespace polygmap::heap {

void on_heap_call(const char*) noexcept {
  if (daemon::counting.load(std::memory_order_relaxed)) daemon::calls.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace polygmap::heap
