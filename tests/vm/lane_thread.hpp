// SPDX-License-Identifier: Apache-2.0
// A thread as a lane of the robot has it: pinned, SCHED_FIFO, its stack locked, touched and painted beforehand.
#pragma once

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <functional>

namespace polygmap::vm {

class LaneThread {
 public:
  // At least PTHREAD_STACK_MIN, which is 128 KiB on AArch64.
  static constexpr std::size_t kStack_bytes = std::size_t{256} * 1024;

  // The page faults of the stack are before start().
  LaneThread() {
    constexpr int kFlags = MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK | MAP_POPULATE;
    stack_ = mmap(nullptr, kStack_bytes, PROT_READ | PROT_WRITE, kFlags, -1, 0);
    if (stack_ != MAP_FAILED) std::memset(stack_, kPaint, kStack_bytes);
  }
  LaneThread(const LaneThread&) = delete;
  LaneThread& operator=(const LaneThread&) = delete;

  // 0 or errno. The function is called once, on the new thread.
  [[nodiscard]] int start(int priority, int processor, std::function<void()> function) {
    if (stack_ == MAP_FAILED) return ENOMEM;
    function_ = std::move(function);
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    cpu_set_t processors;
    CPU_ZERO(&processors);
    CPU_SET(static_cast<unsigned>(processor), &processors);
    const sched_param scheduling{.sched_priority = priority};
    int error = pthread_attr_setstack(&attributes, stack_, kStack_bytes);
    if (error == 0) error = pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    if (error == 0) error = pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
    if (error == 0) error = pthread_attr_setschedparam(&attributes, &scheduling);
    if (error == 0) error = pthread_attr_setaffinity_np(&attributes, sizeof processors, &processors);
    if (error == 0) error = pthread_create(&thread_, &attributes, &LaneThread::enter, this);
    pthread_attr_destroy(&attributes);
    return error;
  }
  void join() { pthread_join(thread_, nullptr); }

  // Bytes from the deepest one that was written to the top, thread-local storage included.
  [[nodiscard]] std::size_t used_stack_bytes() const noexcept {
    const auto* bytes = static_cast<const unsigned char*>(stack_);
    std::size_t untouched = 0;
    while (untouched < kStack_bytes && bytes[untouched] == kPaint) ++untouched;
    return kStack_bytes - untouched;
  }

 private:
  static constexpr unsigned char kPaint = 0xA5;
  static void* enter(void* self) {
    static_cast<LaneThread*>(self)->function_();
    return nullptr;
  }
  std::function<void()> function_;
  void* stack_ = nullptr;
  pthread_t thread_{};
};

}  // namespace polygmap::vm
