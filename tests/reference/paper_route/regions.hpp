// SPDX-License-Identifier: Apache-2.0
// Connected regions of an image, by union-find over its rows.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "algorithms/perception/image/depth_image.hpp"

namespace polygmap {

// Passes: begin, scan_row over all rows, resolve, then label_row over all rows. Labels are 1-based, 0 = none.
class RegionLabelling {
 public:
  static constexpr std::size_t kMaxProvisional = 8192;
  static constexpr std::size_t kMaxRegions = 64;

  struct Region {
    std::uint32_t area_px = 0;
    std::int16_t first_column = 0;  // of the region's first pixel in row order
    std::int16_t first_row = 0;
  };

  void begin() noexcept {
    provisional_count_ = 0;
    region_count_ = 0;
    overflow_ = 0;
  }

  // inside(column, row): the pixel belongs to some region. joined(c0, r0, c1, r1): two 4-neighbours, both inside,
  // belong together.
  template <typename Inside, typename Joined>
  void scan_row(std::int32_t row, std::int32_t width_px, const Inside& inside, const Joined& joined) noexcept {
    std::uint16_t* label = labels_.row(row);
    const std::uint16_t* above = row > 0 ? labels_.row(row - 1) : nullptr;
    for (std::int32_t i = 0; i < width_px; ++i) {
      label[i] = 0;
      if (!inside(i, row)) continue;
      std::uint16_t own = 0;
      if (i > 0 && label[i - 1] != 0 && joined(i - 1, row, i, row)) own = label[i - 1];
      if (above != nullptr && above[i] != 0 && joined(i, row - 1, i, row)) {
        own = own == 0 ? above[i] : unite(own, above[i]);
      }
      if (own == 0) own = fresh(i, row);
      label[i] = own;
      if (own != 0) ++table_[own].area_px;
    }
  }
  // Keeps the kMaxRegions largest regions of at least min_area_px, largest first.
  void resolve(std::uint32_t min_area_px) noexcept;
  void label_row(std::int32_t row, std::int32_t width_px) noexcept {
    std::uint16_t* label = labels_.row(row);
    for (std::int32_t i = 0; i < width_px; ++i) label[i] = final_[label[i]];
  }

  [[nodiscard]] std::size_t region_count() const noexcept { return region_count_; }
  [[nodiscard]] const Region& region(std::size_t label) const noexcept { return regions_[label]; }  // 1-based
  [[nodiscard]] const HalfImage<std::uint16_t>& labels() const noexcept { return labels_; }
  [[nodiscard]] std::uint32_t overflow() const noexcept { return overflow_; }  // pixels and regions that found no room

 private:
  struct Entry {
    std::uint16_t parent = 0;
    std::int16_t first_column = 0;
    std::int16_t first_row = 0;
    std::uint32_t area_px = 0;
  };

  [[nodiscard]] std::uint16_t root(std::uint16_t label) noexcept {
    while (table_[label].parent != label) {
      table_[label].parent = table_[table_[label].parent].parent;  // path halving bounds the climb
      label = table_[label].parent;
    }
    return label;
  }
  [[nodiscard]] std::uint16_t unite(std::uint16_t a, std::uint16_t b) noexcept {
    a = root(a);
    b = root(b);
    if (a == b) return a;
    if (b < a) std::swap(a, b);  // the older label leads: its first pixel is the region's first
    table_[b].parent = a;
    return a;
  }
  [[nodiscard]] std::uint16_t fresh(std::int32_t column, std::int32_t row) noexcept {
    if (provisional_count_ + 1 >= kMaxProvisional) {
      ++overflow_;
      return 0;
    }
    const auto label = static_cast<std::uint16_t>(++provisional_count_);
    table_[label] = {label, static_cast<std::int16_t>(column), static_cast<std::int16_t>(row), 0};
    return label;
  }

  HalfImage<std::uint16_t> labels_{};
  std::array<Entry, kMaxProvisional> table_{};
  std::array<std::uint16_t, kMaxProvisional> final_{};
  std::array<Region, kMaxRegions + 1> regions_{};
  std::size_t provisional_count_ = 0;
  std::size_t region_count_ = 0;
  std::uint32_t overflow_ = 0;
};

}  // namespace polygmap
