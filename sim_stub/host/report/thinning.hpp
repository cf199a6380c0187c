// SPDX-License-Identifier: Apache-2.0
// Which rows of long curves are shown.
#pragma once

#include <cstddef>
#include <vector>

namespace polygmap::sim {

// Rising, at most `most` and two more: where there are more rows, of each stretch of them the least and the greatest of
// every column, so that no spike goes; and the ends. NaN is neither. Columns are of one length.
[[nodiscard]] std::vector<std::size_t> rows_with_extremes(const std::vector<std::vector<double>>& columns,
                                                          std::size_t most);

}  // namespace polygmap::sim
