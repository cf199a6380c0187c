// SPDX-License-Identifier: Apache-2.0
// What a test's build of the daemon does before a row: violate a rule. The shipped program has none.
#pragma once

#include <cstddef>
#include <cstdint>

namespace polygmap::daemon {

class RowHook {
 public:
  // In the row's lane.
  virtual void before_row(std::size_t row, std::int64_t cycle_ns) noexcept = 0;

 protected:
  ~RowHook() = default;
};

// Of this program; null: none. system/no_row_hook.cpp has the shipped program's.
[[nodiscard]] RowHook* row_hook();

}  // namespace polygmap::daemon
