// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/regions.hpp"

namespace polygmap {

void RegionLabelling::resolve(std::uint32_t min_area_px) noexcept {
  for (std::size_t k = 1; k <= provisional_count_; ++k) {
    const std::uint16_t r = root(static_cast<std::uint16_t>(k));
    table_[k].parent = r;
    if (r != k) table_[r].area_px += table_[k].area_px;
    final_[k] = 0;
  }
  final_[0] = 0;
  // Insertion into a short list sorted by area: equal areas keep row order.
  std::array<std::uint16_t, kMaxRegions + 1> roots{};
  for (std::size_t k = 1; k <= provisional_count_; ++k) {
    if (table_[k].parent != k || table_[k].area_px < min_area_px) continue;
    if (region_count_ == kMaxRegions) {
      ++overflow_;
      if (table_[k].area_px <= regions_[kMaxRegions].area_px) continue;
      --region_count_;
    }
    std::size_t place = ++region_count_;
    for (; place > 1 && regions_[place - 1].area_px < table_[k].area_px; --place) {
      regions_[place] = regions_[place - 1];
      roots[place] = roots[place - 1];
    }
    regions_[place] = {table_[k].area_px, table_[k].first_column, table_[k].first_row};
    roots[place] = static_cast<std::uint16_t>(k);
  }
  for (std::size_t k = 1; k <= region_count_; ++k) final_[roots[k]] = static_cast<std::uint16_t>(k);
  for (std::size_t k = 1; k <= provisional_count_; ++k) final_[k] = final_[table_[k].parent];
}

}  // namespace polygmap
