// SPDX-License-Identifier: Apache-2.0
// Resumable work: a stage that is longer than a slot takes a budget of work units and says whether it is done.
#pragma once

#include <cstdint>
#include <limits>

namespace polygmap {

enum class [[nodiscard]] Progress : std::uint8_t{
    kIdle,  // nothing to do
    kBusy,  // call again with a new budget
    kDone,  // a result is ready
};

// Units left in this slot. A unit is a number of pixels or cells that the stage states; its cost in time is in the
// schedule table. A step may overdraw by less than one of its own indivisible pieces (also stated by the stage).
class WorkBudget {
 public:
  explicit constexpr WorkBudget(std::int32_t units) noexcept : units_(units) {}
  [[nodiscard]] constexpr bool exhausted() const noexcept { return units_ <= 0; }
  [[nodiscard]] constexpr std::int32_t left() const noexcept { return units_; }
  // A negative amount spends nothing: work never earns units. Saturates.
  constexpr void spend(std::int32_t units) noexcept {
    if (units > 0) units_ = units_ < units - kMost ? -kMost : units_ - units;
  }

 private:
  static constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
  std::int32_t units_;
};

}  // namespace polygmap
