// SPDX-License-Identifier: Apache-2.0
// Counts the process's calls of the heap. A program that is linked with heap_count.cpp has malloc and its relatives
// interposed, those of every thread and library in it.
#pragma once

#include <cstdint>

namespace polygmap::daemon {

// What the service uses: a test's program has an interposer of its own.
struct HeapCount {
  void (*start)() noexcept = []() noexcept {};
  void (*stop)() noexcept = []() noexcept {};
  // Calls between start() and stop(), the frees among them.
  std::uint64_t (*calls)() noexcept = []() noexcept { return std::uint64_t{0}; };
};

// Of the interposer.
[[nodiscard]] HeapCount counted_heap() noexcept;

}  // namespace polygmap::daemon
