// SPDX-License-Identifier: Apache-2.0
// Counts the calls of one function of a fake and says which of them shall fail.
#pragma once

#include <cstdint>

namespace polygmap::fakes {

class CallScript {
 public:
  // Calls number first .. first + count - 1 from now on fail; 0 is the next call.
  void fail(std::uint64_t first, std::uint64_t count) noexcept {
    fail_from_ = calls_ + first;
    fail_to_ = fail_from_ + count;
  }
  void fail_next(std::uint64_t count = 1) noexcept { fail(0, count); }

  // Called by the fake, once per call.
  [[nodiscard]] bool next_fails() noexcept {
    const std::uint64_t call = calls_++;
    return call >= fail_from_ && call < fail_to_;
  }
  [[nodiscard]] std::uint64_t calls() const noexcept { return calls_; }

 private:
  std::uint64_t calls_ = 0;
  std::uint64_t fail_from_ = 0;
  std::uint64_t fail_to_ = 0;
};

}  // namespace polygmap::fakes
