// SPDX-License-Identifier: Apache-2.0
// What the drivers share: an owned file descriptor, who may touch a device, counters.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "hal/linux/system/system_calls.hpp"

namespace polygmap::hal {

// Closes what it owns.
class Descriptor {
 public:
  Descriptor() noexcept = default;
  Descriptor(const SystemCalls& calls, int fd) noexcept : calls_(&calls), fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  Descriptor(Descriptor&& other) noexcept : calls_(other.calls_), fd_(other.fd_) { other.fd_ = -1; }
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this != &other) {
      close();
      calls_ = other.calls_;
      fd_ = other.fd_;
      other.fd_ = -1;
    }
    return *this;
  }
  [[nodiscard]] int get() const noexcept { return fd_; }
  [[nodiscard]] bool valid() const noexcept { return fd_ >= 0; }
  // Whatever close() answers, Linux has closed it: EINTR must not be answered by closing another thread's descriptor.
  void close() noexcept {
    if (fd_ >= 0) static_cast<void>(calls_->close(fd_));
    fd_ = -1;
  }

 private:
  const SystemCalls* calls_ = nullptr;
  int fd_ = -1;
};

// Who may touch a device. A lane uses it while it is open and hands it over, lost, when the device is gone; whoever
// maintains the drivers, outside the lanes, then opens it anew and hands it back. So no lane waits for the kernel to
// set up a device, and nobody needs a lock.
class DeviceOwner {
 public:
  [[nodiscard]] bool is_open() const noexcept { return state_.load(std::memory_order_acquire) == State::kOpen; }
  [[nodiscard]] bool is_lost() const noexcept { return state_.load(std::memory_order_acquire) == State::kLost; }
  void set_open() noexcept { state_.store(State::kOpen, std::memory_order_release); }
  void set_lost() noexcept { state_.store(State::kLost, std::memory_order_release); }
  void set_closed() noexcept { state_.store(State::kClosed, std::memory_order_release); }

 private:
  enum class State : std::uint8_t { kClosed, kOpen, kLost };
  std::atomic<State> state_{State::kClosed};
};

// What a driver's maintain() did, readable by anybody.
struct ReopenCounters {
  std::atomic<std::uint32_t> reopened{0};
  std::atomic<std::uint32_t> failed{0};
};

// Saturates.
constexpr void count_up(std::uint32_t& counter, std::size_t by = 1) noexcept {
  const std::uint64_t sum = std::uint64_t{counter} + by;
  counter = sum < UINT32_MAX ? static_cast<std::uint32_t>(sum) : UINT32_MAX;
}

}  // namespace polygmap::hal
