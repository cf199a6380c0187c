// SPDX-License-Identifier: Apache-2.0
// A view as a table, as a line and as JSON.
#pragma once

#include <string>
#include <vector>

#include "firmware/live/live_view.hpp"

namespace polygmap {

// Lines of ASCII without their ends, none longer than width columns. What matters most stands first.
[[nodiscard]] std::vector<std::string> table_of(const LiveView& view, std::size_t width);
// One line without its end.
[[nodiscard]] std::string line_of(const LiveView& view);
// One line without its end; docs/reference/live-json.md has the keys. What is not known is null.
[[nodiscard]] std::string json_of(const LiveView& view);

}  // namespace polygmap
