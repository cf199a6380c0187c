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

// A unit of work: as much as so many instructions of the robot's processor (AArch64, -O3) do. Every piece of work is
// paid by what it did, counted in rows, columns, corners, pairs, at a price that toolchain/checks/pieces measures: the
// same on every machine, and no piece takes more than 1.5 times what it pays for.
inline constexpr std::int32_t kInstructionsPerUnit = 100;

[[nodiscard]] constexpr std::int32_t units_of(std::int32_t instructions) noexcept {
  return (instructions + kInstructionsPerUnit - 1) / kInstructionsPerUnit;
}

// What a piece of work did, in instructions, until it is paid.
class WorkCount {
 public:
  constexpr void add(std::int32_t instructions) noexcept { instructions_ += instructions; }
  template <typename Count>
  constexpr void add(Count times, std::int32_t instructions) noexcept {
    instructions_ += static_cast<std::int32_t>(times) * instructions;
  }
  constexpr void add(WorkCount& part) noexcept {
    instructions_ += part.instructions_;
    part.instructions_ = 0;
  }
  [[nodiscard]] constexpr std::int32_t instructions() const noexcept { return instructions_; }
  // The units for it, at least one: work never ends for nothing. Begins the count anew.
  [[nodiscard]] constexpr std::int32_t take_units() noexcept {
    const std::int32_t units = units_of(instructions_);
    instructions_ = 0;
    return units > 0 ? units : 1;
  }

 private:
  std::int32_t instructions_ = 0;
};

// Units left in this slot. What a unit takes in time is in the schedule table. A step may overdraw by less than one of
// its own indivisible pieces (stated by the stage).
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
