// SPDX-License-Identifier: Apache-2.0
// A lane's thread: real-time priority, one processor, a stack whose pages are there before it starts.
#pragma once

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstddef>
#include <cstring>

#include "firmware/pipeline.hpp"

namespace polygmap::daemon {

class LaneThread {
 public:
  // Twice kLaneStack_bytes, the least that a thread may have on AArch64 and what the module's memory is reckoned with:
  // that one knows the module's calls only, and here are the drivers', the C library's and the thread's own data, too.
#ifdef POLYGMAP_SANITIZED
  static constexpr std::size_t kStack_bytes = std::size_t{2048} * 1024;  // a sanitizer keeps its own data in it
#else
  static constexpr std::size_t kStack_bytes = 2 * kLaneStack_bytes;
#endif
  static constexpr std::size_t kGuard_bytes = std::size_t{64} * 1024;  // a whole page of every size there is
  struct Placement {
    int processor = -1;  // negative: any
    int priority = 0;    // of SCHED_FIFO; 0: no real-time thread
  };

  // The page faults of the stack are before start(). Below it lies a page that nobody may touch.
  LaneThread() noexcept {
    constexpr int kFlags = MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK | MAP_POPULATE;
    void* const mapped = ::mmap(nullptr, kGuard_bytes + kStack_bytes, PROT_READ | PROT_WRITE, kFlags, -1, 0);
    if (mapped == MAP_FAILED) return;
    mapping_ = mapped;
    (void)::mprotect(mapping_, kGuard_bytes, PROT_NONE);
    std::memset(stack(), kPaint, kStack_bytes);
  }
  ~LaneThread() {
    if (mapping_ != nullptr) ::munmap(mapping_, kGuard_bytes + kStack_bytes);
  }
  LaneThread(const LaneThread&) = delete;
  LaneThread& operator=(const LaneThread&) = delete;

  // 0 or errno. function(argument) is called once, on the new thread.
  [[nodiscard]] int start(const Placement& placement, void* (*function)(void*), void* argument) noexcept {
    if (mapping_ == nullptr) return ENOMEM;
    pthread_attr_t attributes;
    ::pthread_attr_init(&attributes);
    int error = ::pthread_attr_setstack(&attributes, stack(), kStack_bytes);
    if (placement.priority > 0) {
      const sched_param scheduling{.sched_priority = placement.priority};
      if (error == 0) error = ::pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
      if (error == 0) error = ::pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
      if (error == 0) error = ::pthread_attr_setschedparam(&attributes, &scheduling);
    }
    if (placement.processor >= 0) {
      cpu_set_t processors;
      CPU_ZERO(&processors);
      CPU_SET(static_cast<unsigned>(placement.processor), &processors);
      if (error == 0) error = ::pthread_attr_setaffinity_np(&attributes, sizeof processors, &processors);
    }
    if (error == 0) error = ::pthread_create(&thread_, &attributes, function, argument);
    ::pthread_attr_destroy(&attributes);
    started_ = error == 0;
    return error;
  }
  // Without effect when nothing was started.
  void join() noexcept {
    if (started_) ::pthread_join(thread_, nullptr);
    started_ = false;
  }

  // Bytes from the deepest one that was written to the top, thread-local storage included.
  [[nodiscard]] std::size_t used_stack_bytes() const noexcept {
    if (mapping_ == nullptr) return 0;
    const unsigned char* const bytes = stack();
    std::size_t untouched = 0;
    while (untouched < kStack_bytes && bytes[untouched] == kPaint) ++untouched;
    return kStack_bytes - untouched;
  }

 private:
  static constexpr unsigned char kPaint = 0xA5;
  [[nodiscard]] unsigned char* stack() const noexcept { return static_cast<unsigned char*>(mapping_) + kGuard_bytes; }

  void* mapping_ = nullptr;
  pthread_t thread_{};
  bool started_ = false;
};

}  // namespace polygmap::daemon
