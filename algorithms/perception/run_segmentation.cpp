// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/run_segmentation.hpp"

#include <algorithm>
#include <bit>

#include "algorithms/perception/vectors.hpp"

namespace polygmap {
namespace {

using Wide = cv::v_float32;
static_assert(kColumns % Wide::nlanes == 0);

constexpr float kNowhere = -1e3F;   // 1/m: the line of a column without a run, which no row fits
constexpr float kNever = -1e9F;     // its absent rows
constexpr float kNoSpread = 1e-9F;  // added to a sum of squares that may be 0
constexpr float kFitted = 3.0F;     // rows that make a line
constexpr float kBends = 7.0F;      // a run of more rows may bend away
constexpr std::int32_t kBentRows = 3;

}  // namespace

void RunSegmentation::begin(const Params& params, const DepthSigma& noise, const CameraIntrinsics& intrinsics,
                            const ColumnImage& image) noexcept {
  image_ = &image;
  column_count_ = intrinsics.width_px / kColumn_px;
  height_px_ = intrinsics.height_px;
  const double share = math::sqrt(noise.correlated_share + (1.0 - noise.correlated_share) / kColumn_px);
  outlier2_ = static_cast<float>(math::square(params.outlier_sigmas));
  bend2_ = static_cast<float>(math::square(params.bend_sigmas));
  base_ = static_cast<float>(noise.base_m * share);
  per_metre_ = static_cast<float>(noise.per_metre * share);
  quadratic_ = static_cast<float>(noise.quadratic_per_m * share);
  floor2_ = static_cast<float>(math::square(params.floor_m));
  // jump_share w + 4 sigma
  jump_ = {4.0F * quadratic_, static_cast<float>(params.jump_share) + 4.0F * per_metre_, 4.0F * base_};
  max_gap_ = static_cast<float>(params.max_gap_px);
  const std::int32_t outlier_weight = params.max_gap_px / kPending + 1;
  outlier_weight_ = static_cast<float>(outlier_weight);
  fy_ = static_cast<float>(intrinsics.fy_px);
  cy_ = static_cast<float>(intrinsics.cy_px);
  for (std::int32_t g = 0; g < kColumns; ++g) {
    clear(g);
    runs_[static_cast<std::size_t>(g)].clear();
  }
  overflow_ = 0;
}

void RunSegmentation::clear(std::int32_t column) noexcept {
  const auto g = static_cast<std::size_t>(column);
  open_.rows[g] = open_.slope[g] = open_.lever[g] = open_.drift[g] = 0.0F;
  open_.squares[g] = kNoSpread;
  open_.value[g] = kNowhere;
  open_.absent[g] = kNever;
}

void RunSegmentation::add_row(std::int32_t row) noexcept {
  const auto all = [](float x) { return cv::vx_setall_f32(x); };
  const Wide zero = all(0.0F), one = all(1.0F), four = all(4.0F), memory = all(1.0F - kMemory);
  const Wide enough = all(kFitted), long_run = all(kBends), outlier_weight = all(outlier_weight_);
  const Wide base = all(base_), per_metre = all(per_metre_), quadratic = all(quadratic_), floor2 = all(floor2_);
  const Wide jump0 = all(jump_[0]), jump1 = all(jump_[1]), jump2 = all(jump_[2]);
  const Wide outlier2 = all(outlier2_), bend2 = all(bend2_), max_gap = all(max_gap_);
  const Wide fy = all(fy_), to_centre = all(cy_ - static_cast<float>(row));
  // Whole registers: what columns beyond a narrower picture say is never read.
  for (std::int32_t column = 0; column < column_count_; column += Wide::nlanes) {
    const auto g = static_cast<std::size_t>(column);
    const auto load = [g](const Floats& x) { return cv::vx_load(x.data() + g); };
    const auto store = [g](Floats& to, const Wide& x) { cv::v_store(to.data() + g, x); };
    const Wide w = cv::vx_load(image_->inverse_depth.row(row) + g), n = load(open_.rows);
    const Wide slope = load(open_.slope), value = load(open_.value) + slope, lever = load(open_.lever) + one;
    const Wide valid = w > zero, fitted = n >= enough;

    const Wide residual = w - value;
    // Residual across the line in space against sigma_z: dw^2 / (|m|^2 w^2) with m of the line in the column's plane.
    // Both sides are multiplied by w^2, so that sigma is that of the inverse depth.
    const Wide my = slope * fy, m0 = value + slope * to_centre;
    const Wide w2 = w * w, sigma = (base * w + per_metre) * w + quadratic;
    // Predicting one row past n has about (1 + 4 / n) of a row's variance.
    const Wide share = one / (n + one);
    const Wide spread = (my * my + m0 * m0) * (sigma * sigma + floor2 * w2 * w2) * (one + four * share);
    // Two rows make no slope: the third is held against the second.
    const Wide off = residual + cv::v_select(fitted, zero, slope);
    const Wide jump = (jump2 * w + jump1) * w + jump0;
    const Wide fits = off * off * w2 < cv::v_select(fitted, outlier2 * spread, jump * jump * w2);
    const Wide in = valid & fits;

    // Recursive least squares: a row that joins, at distance x from the others' mean, moves the line by its residual.
    const Wide x = lever & in, news = residual & in;
    const Wide lever1 = lever - x * share, squares1 = load(open_.squares) + x * lever1;
    const Wide gain = news * (lever1 / squares1);
    const Wide n1 = n + (one & in);
    const Wide drift0 = load(open_.drift), drift = drift0 + (((news & fitted) - drift0) * memory & in);
    const Wide absent = cv::v_select(in, zero, load(open_.absent) + cv::v_select(valid, outlier_weight, one));
    store(open_.rows, n1);
    store(open_.value, value + news * share + gain * lever1);
    store(open_.slope, slope + gain);
    store(open_.lever, lever1);
    store(open_.squares, squares1);
    store(open_.drift, drift);
    store(open_.absent, absent);

    const Wide strange = cv::v_select(fitted, zero, valid) & ~fits;
    const Wide bent = in & (n1 > long_run) & (drift * drift * w2 > bend2 * spread);
    auto events = static_cast<std::uint32_t>(cv::v_signmask(strange | bent | (absent > max_gap)));
    for (; events != 0; events &= events - 1U) handle(column + std::countr_zero(events), row);
  }
}

// Ends the column's run where it stopped fitting and starts the next one with the rows since.
void RunSegmentation::handle(std::int32_t column, std::int32_t row) noexcept {
  const auto g = static_cast<std::size_t>(column);
  std::int32_t from = row;
  if (open_.absent[g] > max_gap_) {
    from = last_accepted(column, row) + 1;
    close(column, from - 1, row);
  } else if (open_.rows[g] >= kFitted) {
    from = row - kBentRows + 1;
    for (std::int32_t r = from; r <= row; ++r) forget(column, r, row);
    close(column, from - 1, row);
  }
  replay(column, from, row);
}

// Opens a run at the first row with data. Rows this few make no line: each is held against the one before.
void RunSegmentation::replay(std::int32_t column, std::int32_t from, std::int32_t row) noexcept {
  const auto g = static_cast<std::size_t>(column);
  clear(column);
  for (std::int32_t r = from; r <= row; ++r) {
    const float w = image_->inverse_depth(column, r), jump = (jump_[2] * w + jump_[1]) * w + jump_[0];
    const bool open = open_.rows[g] > 0.0F;
    open_.value[g] += open_.slope[g];
    open_.lever[g] += 1.0F;
    const float residual = w - open_.value[g], off = residual + open_.slope[g];
    if (!(w > 0.0F)) {
      open_.absent[g] += 1.0F;
    } else if (open && off * off < jump * jump) {
      const float share = 1.0F / (open_.rows[g] + 1.0F);
      open_.rows[g] += 1.0F;
      open_.squares[g] += open_.lever[g] * (open_.lever[g] - open_.lever[g] * share);
      open_.lever[g] -= open_.lever[g] * share;
      const float gain = residual * (open_.lever[g] / open_.squares[g]);
      open_.value[g] += residual * share + gain * open_.lever[g];
      open_.slope[g] += gain;
      open_.absent[g] = 0.0F;
    } else {
      clear(column);
      open_.rows[g] = 1.0F;
      open_.value[g] = w;
      open_.absent[g] = 0.0F;
      top_[g] = static_cast<std::int16_t>(r);
    }
  }
}

// Takes one accepted row out of the line again.
void RunSegmentation::forget(std::int32_t column, std::int32_t forgotten, std::int32_t row) noexcept {
  const auto g = static_cast<std::size_t>(column);
  const float w = image_->inverse_depth(column, forgotten), back = static_cast<float>(forgotten - row);
  const float n = open_.rows[g] - 1.0F, x = open_.lever[g] + back;
  const float squares = open_.squares[g] - x * x * open_.rows[g] / n;
  if (!(w > 0.0F) || n < kFitted || !(squares > 0.0F)) return;
  const float residual = w - (open_.value[g] + open_.slope[g] * back);
  const float gain = residual * (x * open_.rows[g] / n / squares);
  open_.rows[g] = n;
  open_.squares[g] = squares;
  open_.lever[g] += x / n;
  open_.value[g] -= residual / n + gain * open_.lever[g];
  open_.slope[g] -= gain;
}

std::int32_t RunSegmentation::last_accepted(std::int32_t column, std::int32_t row) const noexcept {
  const auto g = static_cast<std::size_t>(column);
  float absent = open_.absent[g];
  for (; absent > 0.0F && row > top_[g]; --row)
    absent -= image_->inverse_depth(column, row) > 0.0F ? outlier_weight_ : 1.0F;
  return row;
}

void RunSegmentation::close(std::int32_t column, std::int32_t bottom, std::int32_t row) noexcept {
  const auto g = static_cast<std::size_t>(column);
  if (open_.rows[g] < static_cast<float>(kMinRows)) return;
  Run run;
  run.top = top_[g];
  run.bottom = static_cast<std::int16_t>(bottom);
  run.inverse_depth = open_.value[g] - open_.slope[g] * static_cast<float>(row - run.top);
  run.slope = open_.slope[g];
  if (!runs_[g].try_push_back(run)) ++overflow_;
}

void RunSegmentation::finish() noexcept {
  for (std::int32_t g = 0; g < column_count_; ++g) {
    close(g, last_accepted(g, height_px_ - 1), height_px_ - 1);
  }
}

}  // namespace polygmap
