// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/report/thinning.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace polygmap::sim {

std::vector<std::size_t> rows_with_extremes(const std::vector<std::vector<double>>& columns, std::size_t most) {
  const std::size_t rows = columns.front().size();
  std::vector<std::size_t> kept;
  if (rows <= most) {
    kept.resize(rows);
    std::iota(kept.begin(), kept.end(), std::size_t{0});
    return kept;
  }
  kept = {0, rows - 1};
  const std::size_t stretches = std::max<std::size_t>(1, most / (2 * columns.size()));
  for (std::size_t s = 0; s < stretches; ++s) {
    const std::size_t from = s * rows / stretches, to = (s + 1) * rows / stretches;
    for (const std::vector<double>& column : columns) {
      std::size_t low = to, high = to;
      for (std::size_t i = from; i < to; ++i) {
        if (std::isnan(column[i])) continue;
        if (low == to || column[i] < column[low]) low = i;
        if (high == to || column[i] > column[high]) high = i;
      }
      if (low == to) continue;
      kept.push_back(low);
      kept.push_back(high);
    }
  }
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  return kept;
}

}  // namespace polygmap::sim
