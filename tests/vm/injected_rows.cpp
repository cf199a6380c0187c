// SPDX-License-Identifier: Apache-2.0
// The row hook of polygmapd_inject, the daemon with a seeded violation: what /job/injection says, "allocate@S" or
// "overrun=ROW@S", S seconds after the first cycle. It says at the end if that never came.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>

#include "firmware/daemon/service/row_hook.hpp"
#include "firmware/schedule.hpp"

namespace polygmap::daemon {
namespace {

std::int64_t monotonic_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerS + now.tv_nsec;
}

class Violation final : public RowHook {
 public:
  Violation() = default;
  Violation(const Violation&) = delete;
  Violation& operator=(const Violation&) = delete;
  ~Violation() {
    if (row_ >= kTasks.size() || done_) return;
    std::printf("the fault was never injected: the climb had ended at %.2f s\n",
                1e-9 * static_cast<double>(last_ns_ - std::max<std::int64_t>(first_ns_, 0)));
  }
  // False: it is none.
  [[nodiscard]] bool parse(const std::string& text) {
    const std::size_t at = text.find('@');
    if (at == std::string::npos) return false;
    const std::string what = text.substr(0, at);
    allocates_ = what == "allocate";
    row_ = allocates_ ? 0 : row_named(kSchedule, what.starts_with("overrun=") ? what.substr(8) : "");
    at_ns_ = static_cast<std::int64_t>(std::atof(text.c_str() + at + 1) * 1e9);
    return row_ < kTasks.size();
  }
  void before_row(std::size_t row, std::int64_t cycle_ns) noexcept override {
    if (row != row_ || done_) return;
    if (first_ns_ < 0) first_ns_ = cycle_ns;
    last_ns_ = cycle_ns;
    if (cycle_ns - first_ns_ < at_ns_) return;
    done_ = true;
    if (allocates_) {
      void* volatile block = std::malloc(1);  // volatile: or the compiler leaves both calls out
      std::free(block);
      return;
    }
    constexpr std::int64_t kTooLong_ns = 3 * kNsPerMs;
    const std::int64_t begin_ns = monotonic_ns();
    while (monotonic_ns() - begin_ns < kTooLong_ns) {
    }
  }

 private:
  bool allocates_ = false, done_ = false;
  std::size_t row_ = kTasks.size();
  std::int64_t at_ns_ = 0, first_ns_ = -1, last_ns_ = 0;
};

}  // namespace

RowHook* row_hook() {
  static Violation violation;
  std::ifstream file("/job/injection");
  std::string text;
  if (file >> text && violation.parse(text)) return &violation;
  std::fprintf(stderr, "polygmapd_inject: /job/injection says nothing that can be injected: \"%s\"\n", text.c_str());
  std::exit(2);
}

}  // namespace polygmap::daemon
