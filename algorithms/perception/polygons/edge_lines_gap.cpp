// SPDX-License-Identifier: Apache-2.0
// Edges on rows without depth: how far those reach, and where among them the edge lies.
#include <algorithm>

#include "algorithms/perception/polygons/edge_lines.hpp"

namespace polygmap {
namespace {

// The guess ends a label, which goes on to where the planes meet or stops where the depths do: either is next to the
// gap.
constexpr std::int32_t kBesideGuess_px = 4;

}  // namespace

EdgeLineFinder::GapFound EdgeLineFinder::find_gap(const Group& group, std::int32_t at, Gap& gap) noexcept {
  const auto column = static_cast<std::int32_t>(group.column_sum / group.columns) / kColumn_px;
  const auto centre = static_cast<std::int32_t>(std::floor(guess_.at(middle_px(column)) + 0.5));
  const std::int32_t first = kMaxWindow_px - params_.window_px, last = kMaxWindow_px + params_.window_px;
  const auto gain = [&group](std::int32_t i) { return static_cast<double>(group.gain[static_cast<std::size_t>(i)]); };
  // Rows off both planes say nothing, too, but they have data: an overhang's face is no gap.
  const auto empty = [&](std::int32_t i) {
    const std::int32_t r = surface_above_ ? centre + i - kMaxWindow_px : centre - i + kMaxWindow_px;
    return gain(i) == 0.0 && r >= 0 && r < intrinsics_.height_px && !(image_->inverse_depth(column, r) > 0.0F);
  };
  // Where the planes meet, rows hardly tell one from the other, and the least sum may be a few rows aside of the gap.
  // It is one with it when no more lies between than a single pixel can say.
  const double most = math::square(params_.truncate_sigmas);
  std::int32_t begin = last + 1, end = first - 1;
  double sum = 0.0;
  for (std::int32_t i = at + 1; i <= last && sum < most; ++i) {
    work_.add(14);
    sum += gain(i);
    if (sum < most && empty(i)) begin = std::min(begin, i), end = i;
  }
  sum = 0.0;
  for (std::int32_t i = at; i >= first && sum < most; --i) {
    work_.add(14);
    if (empty(i)) begin = i, end = std::max(end, i);
    sum -= gain(i);
  }
  if (begin > end) return GapFound::kNone;
  if (begin == first || end == last) return GapFound::kOutside;
  gap = {begin - 0.5 - kMaxWindow_px, end + 0.5 - kMaxWindow_px};
  return GapFound::kInside;
}

bool EdgeLineFinder::try_gap_of_column(std::int32_t column, Gap& gap) const noexcept {
  // A gap of more rows leaves too few to either side in the widest window.
  const std::int32_t most_px = kOffsets - 2 * (params_.min_side_px + 2) + 1;
  const auto guess = static_cast<std::int32_t>(std::floor(guess_.at(middle_px(column)) + 0.5));
  if (guess < most_px + kBesideGuess_px || guess + most_px + kBesideGuess_px >= intrinsics_.height_px) {
    return false;
  }
  const auto empty = [&](std::int32_t r) { return !(image_->inverse_depth(column, r) > 0.0F); };
  std::int32_t first = guess;
  for (std::int32_t i = 1; i <= kBesideGuess_px && !empty(first); ++i) {
    first = empty(guess - i) ? guess - i : guess + i;
  }
  if (!empty(first)) return false;
  std::int32_t last = first;
  while (last - first < most_px && empty(first - 1)) --first;
  while (last - first < most_px && empty(last + 1)) ++last;
  gap = {first - 0.5, last + 0.5};
  return last - first < most_px;
}

bool EdgeLineFinder::begins_at_gap() noexcept {
  if (gap_tried_ || !(surface_above_ || drops_)) return false;
  gap_tried_ = true;
  work_.add(600);
  std::array<double, kMaxGroups> shifts{};
  std::size_t count = 0;
  // As few rows of the surface as tell it, and all others for the gap and what is beyond it: an overhang's face, and
  // the riser under that.
  const double window_px = kMaxWindow_px - (params_.min_side_px + 2);
  const std::int32_t columns = guess_.last_column - guess_.first_column + 1;
  const std::int32_t stride = (columns + kMaxGroups - 1) / kMaxGroups;
  for (std::int32_t g = guess_.first_column; g <= guess_.last_column; g += stride) {
    work_.add(450);
    Gap gap;
    if (!try_gap_of_column(g, gap)) continue;
    shifts[count++] = (surface_above_ ? gap.from + window_px : gap.to - window_px) - guess_.at(middle_px(g));
  }
  if (2 * static_cast<std::int32_t>(count) * stride < columns || count < 3) return false;
  const auto middle = shifts.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(shifts.begin(), middle, shifts.begin() + static_cast<std::ptrdiff_t>(count));
  guess_.row += *middle;
  params_.window_px = kMaxWindow_px;
  restart();
  return true;
}

// A nosing stands out from the riser or is flush with it: behind where the planes meet there is no edge. For a back
// line, both planes are seen up to the corner between them, or something hides it.
void EdgeLineFinder::widen_by_gap(Fit& fit, double from) const noexcept {
  const double half_m = fit.half_gap_m, kept = 0.5 * (1.0 - from);
  fit.a += 0.5 * (1.0 + from) * half_m;
  fit.sigma_m = math::sqrt(math::square(fit.sigma_m) + math::square(kept * half_m) / 3.0);
}

bool EdgeLineFinder::settle_gap(Fit& fit, double apart_m, double limit_m) const noexcept {
  const double half_m = fit.half_gap_m, at = apart_m / half_m;  // -1: where the gap begins, 1: where it ends
  const double off = limit_m / std::abs(half_m);
  if (surface_above_ ? std::abs(at - 1.0) < off : std::abs(at) < 1.0 + off) {
    // What is beyond begins where the planes meet: it was seen to, and the gap was the surface's.
    if (surface_above_) {
      fit.a += half_m;
    } else {
      widen_by_gap(fit, -1.0);
    }
    return true;
  }
  // A lip hides where what is below begins: rows without depth before that are the surface's, a strip along its edge,
  // or the lower one's own.
  widen_by_gap(fit, drops_ ? 0.0 : surface_above_ && std::abs(at) < 1.0 ? at : -1.0);
  return false;
}

}  // namespace polygmap
