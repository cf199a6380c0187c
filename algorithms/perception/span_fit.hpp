// SPDX-License-Identifier: Apache-2.0
// One pass over a frame's columns that measures its planes: spans of their segments, boundaries between them, sums of
// the rows within.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/perception/planes/plane_fit.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"
#include "algorithms/perception/segments/scanline_segments.hpp"

namespace polygmap {

class SpanFit {
 public:
  using PlaneIndex = std::array<PlaneId, SpanBoundaries::kMaxPlanes + 1>;
  struct Pass {
    bool trims_and_fills;  // spans lose rows that their plane does not explain, and gain rows that no segment had
    bool by_planes;        // boundaries lie where planes meet, unmeasured
    bool roughly;          // sums are of fewer rows, and the noise is not looked at
  };
  // Sharpens planes that are as rough as the segments they grew from.
  static constexpr Pass kSharpening{.trims_and_fills = false, .by_planes = true, .roughly = true};
  // Measures sharp planes within their final boundaries.
  static constexpr Pass kMeasuring{.trims_and_fills = true, .by_planes = false, .roughly = false};

  // What the next step begins with; a benchmark charges time to it.
  enum class Part : std::uint8_t { kSpans, kGaps, kScores, kPlaces, kSums, kDone };

  // All but the pass is read until done. to_plane: of a segment's plane, which may have been merged. Planes from
  // first_new to last_new have no segments: they may fill any gap. The results are in boundaries.
  void begin(const Pass& pass, const ScanlineSegmentation::Columns& segments, const PlaneIndex& to_plane,
             PlaneId first_new, PlaneId last_new, std::int32_t columns, SpanBoundaries& boundaries) noexcept;
  // Does one piece of work, which boundaries count.
  void step() noexcept;
  [[nodiscard]] Part part() const noexcept { return part_; }
  [[nodiscard]] bool done() const noexcept { return part_ == Part::kDone; }

 private:
  void enter(Part part) noexcept {
    part_ = part;
    column_ = 0;
  }
  void build_column() noexcept;
  void fill_column() noexcept;
  void score_column() noexcept;
  void sum_columns() noexcept;

  Pass pass_ = kSharpening;
  const ScanlineSegmentation::Columns* segments_ = nullptr;
  const PlaneIndex* to_plane_ = nullptr;
  SpanBoundaries* boundaries_ = nullptr;
  PlaneId first_new_ = 1, last_new_ = kNoPlane;
  std::int32_t columns_ = 0;
  Part part_ = Part::kDone;
  std::int32_t column_ = 0;
};

}  // namespace polygmap
