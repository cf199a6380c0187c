// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/segmenter.hpp"

#include <algorithm>

namespace polygmap {

void Segmenter::begin(const ScanlineSegmentation::Params& params, const DepthNoiseModel& noise, const RawImage& raw,
                      const std::array<LegShapes, kFootCount>& body, const BodyMargin& margin) noexcept {
  raw_ = &raw;
  body_ = &body;
  margin_ = margin;
  shape_ = 0;
  row_ = 0;
  measured_px_ = outside_body_px_ = 0;
  image_.rays.set(raw.intrinsics);
  image_.column_rays.set(raw.intrinsics);
  image_.any_body = false;
  self_filter_.clear();
  segmentation_.begin(params, noise, raw.intrinsics, image_.columns);
  part_ = Part::kMask;
}

Progress Segmenter::step(WorkBudget& budget) noexcept {
  while (part_ != Part::kDone && !budget.exhausted()) budget.spend(do_piece());
  return part_ == Part::kDone ? Progress::kDone : Progress::kBusy;
}

std::int32_t Segmenter::do_piece() noexcept {
  if (part_ == Part::kMask) {
    if (self_filter_.add_some(image_.rays, *body_, margin_, shape_) && ++shape_ == SelfFilter::kShapes) {
      part_ = Part::kRows;
    }
    return self_filter_.work().take_units();
  }
  constexpr std::int32_t kRowsAtOnce = 4;
  const std::int32_t height_px = image_.column_rays.height_px, end = std::min(row_ + kRowsAtOnce, height_px);
  for (; row_ < end; ++row_) reduce_row();
  if (row_ == height_px) {
    segmentation_.finish();
    part_ = Part::kDone;
  }
  return segmentation_.work().take_units();
}

void Segmenter::reduce_row() noexcept {
  std::uint8_t* flags = image_.flags.row(row_ / 2);
  if (row_ % 2 == 0) {
    const bool marked = self_filter_.try_mark_row(row_ / 2, image_.rays.width_px, flags);
    image_.body_rows[static_cast<std::size_t>(row_ / 2)] = marked;
    image_.any_body = image_.any_body || marked;
  }
  const bool body = image_.body_rows[static_cast<std::size_t>(row_ / 2)];
  WorkCount& work = segmentation_.work();
  work.add(190 + image_.column_rays.columns * (body ? 24 : 13));  // every other row is looked at for the body
  constexpr std::int32_t kLater = 2;                              // rows ahead that are fetched from memory
  const std::int32_t columns = image_.column_rays.columns, last = image_.column_rays.height_px - 1;
  const ReducedRow reduced = reduce_to_columns(raw_->range, raw_->row(row_), body ? flags : nullptr, columns,
                                               image_.columns.inverse_depth.row(row_), image_.columns.valid.row(row_),
                                               raw_->row(std::min(row_ + kLater, last)));
  measured_px_ += reduced.measured_px;
  outside_body_px_ += kColumn_px * (columns - reduced.body_columns);
  constexpr std::int32_t kBlock = ScanlineSegmentation::kBlock;
  if (row_ % kBlock == kBlock - 1 || row_ == last) {
    static_assert(kBlock % ColumnImage::kTransposeRows == 0);
    work.add(kColumns, 20);
    image_.columns.transpose(row_ - row_ % kBlock, row_);
    segmentation_.add_rows(row_ - row_ % kBlock, row_);
  }
}

double Segmenter::invalid_fraction() const noexcept {
  return outside_body_px_ > 0 ? 1.0 - static_cast<double>(measured_px_) / outside_body_px_ : 1.0;
}

}  // namespace polygmap
