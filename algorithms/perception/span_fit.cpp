// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/span_fit.hpp"

namespace polygmap {

void SpanFit::begin(const Pass& pass, const ScanlineSegmentation::Columns& segments, const PlaneIndex& to_plane,
                    PlaneId first_new, PlaneId last_new, std::int32_t columns, SpanBoundaries& boundaries) noexcept {
  pass_ = pass;
  segments_ = &segments;
  to_plane_ = &to_plane;
  boundaries_ = &boundaries;
  first_new_ = first_new;
  last_new_ = last_new;
  columns_ = columns;
  enter(Part::kSpans);
}

void SpanFit::step() noexcept {
  constexpr int kColumnsAtOnce = 2;
  switch (part_) {
    case Part::kSpans:
      for (int i = 0; i < kColumnsAtOnce && part_ == Part::kSpans; ++i) build_column();
      return;
    case Part::kGaps:
      for (int i = 0; i < kColumnsAtOnce && part_ == Part::kGaps; ++i) fill_column();
      return;
    case Part::kScores:
      for (int i = 0; i < kColumnsAtOnce && part_ == Part::kScores; ++i) score_column();
      return;
    case Part::kPlaces:
      if (!boundaries_->place_some()) return;
      boundaries_->begin_refit();
      return enter(Part::kSums);
    case Part::kSums:
      return sum_columns();
    case Part::kDone:
      return;
  }
}

void SpanFit::build_column() noexcept {
  boundaries_->build_spans(column_, (*segments_)[static_cast<std::size_t>(column_)], *to_plane_);
  if (pass_.trims_and_fills) boundaries_->trim_ends(column_);
  if (++column_ == columns_) enter(pass_.trims_and_fills ? Part::kGaps : Part::kScores);
}

// From left to right, each column after the one to its left and with the new planes; then back, after the one to its
// right.
void SpanFit::fill_column() noexcept {
  if (column_ < columns_) {
    boundaries_->fill_gaps(column_, column_ - 1, first_new_, last_new_);
  } else {
    const std::int32_t g = 2 * columns_ - 1 - column_;
    boundaries_->fill_gaps(g, g + 1, 1, 0);
  }
  if (++column_ == 2 * columns_) enter(Part::kScores);
}

void SpanFit::score_column() noexcept {
  if (column_ == 0) boundaries_->begin_scores();
  boundaries_->score(column_, pass_.by_planes);
  if (++column_ < columns_) return;
  boundaries_->begin_placing();
  enter(Part::kPlaces);
}

void SpanFit::sum_columns() noexcept {
  if (!boundaries_->refit_some(column_, pass_.roughly)) return;
  column_ += SpanBoundaries::kRefitColumns;
  if (column_ >= columns_) enter(Part::kDone);
}

}  // namespace polygmap
