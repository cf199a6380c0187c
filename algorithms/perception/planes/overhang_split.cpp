// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/overhang_split.hpp"

#include <algorithm>

namespace polygmap {
namespace {

constexpr double kLeastMiddle_m = 0.05;  // a plane nearer than that is seen from its end

}  // namespace

void OverhangSplit::begin(const Params& params, const Vec3& up, const PlaneSet& planes) noexcept {
  params_ = params;
  up_ = up;
  count_ = 0;
  overflow_ = 0;
  profile_of_.fill(0);
  work_.add(250 + planes.count * 45);
  const double least = math::sin(params.least_lean_rad), most = math::sin(params.most_lean_rad);
  for (std::size_t p = 1; p <= planes.count; ++p) {
    if (!planes[p].alive) continue;
    const Vec3 normal = planes[p].plane.normal();
    const double lean = std::abs(normal.dot(up));
    if (lean < least || lean > most) continue;
    if (count_ == kMaxLeaning) {
      ++overflow_;
      continue;
    }
    Profile& profile = profiles_[count_++];
    profile_of_[p] = static_cast<std::uint8_t>(count_);
    profile = Profile{};
    profile.back = (up * up.dot(normal) - normal).normalized();
    profile.middle_m = profile.back.dot(planes[p].centre_m);
    profile.lowest_m = up.dot(planes[p].centre_m) - 0.5 * kBins * kBin_m;
    profile.drop = profile.middle_m > kLeastMiddle_m ? -up.dot(planes[p].centre_m) / profile.middle_m : 0.0;
  }
}

void OverhangSplit::add_column(const FrameImage& picture, std::int32_t column, const SpanBoundaries::Column& spans,
                               const PlaneMerging::PlaneIndex& to_plane) noexcept {
  constexpr std::int32_t kStride = 2;  // rows next to each other say nearly the same
  const auto farthest_m = static_cast<float>(params_.farthest_m);
  const float* inverse_depths = picture.columns.by_column.row(column);
  work_.add(30);
  work_.add(spans.size(), 7);
  const Vec3 middle{static_cast<double>(picture.column_rays.x[static_cast<std::size_t>(column)]), 0.0, 1.0};
  for (const ColumnSpan& span : spans) {
    const std::size_t number = profile_of_[to_plane[span.plane]];
    if (number == 0) continue;
    Profile& profile = profiles_[number - 1];
    work_.add(50 + 27 * ((span.bottom - span.top) / kStride + 1));
    const auto back_at = static_cast<float>(profile.back.dot(middle)), back_by = static_cast<float>(profile.back.y());
    const auto up_at = static_cast<float>(up_.dot(middle)), up_by = static_cast<float>(up_.y());
    const auto middle_m = static_cast<float>(profile.middle_m), lowest_m = static_cast<float>(profile.lowest_m);
    for (std::int32_t r = span.top; r <= span.bottom; r += kStride) {
      const float w = inverse_depths[r];
      if (!(w > 0.0F)) continue;
      const float y = picture.column_rays.y[static_cast<std::size_t>(r)];
      const float bin = ((up_at + up_by * y) / w - lowest_m) * static_cast<float>(1.0 / kBin_m);
      if (!(bin >= 0.0F && bin < static_cast<float>(kBins))) {
        profile.beyond += 1.0;
        continue;
      }
      const float distance_m = (back_at + back_by * y) / w - middle_m;
      if (!(std::abs(distance_m) < farthest_m)) continue;
      Bin& sums = profile.bins[static_cast<std::size_t>(bin)];
      sums.rows += 1.0F;
      sums.distance_m += distance_m;
    }
  }
}

// Bins are compared by their means: what pixels differ by within one is noise to either.
double OverhangSplit::left_by_slope_m2(const Profile& profile) noexcept {
  double n = 0.0, h = 0.0, hh = 0.0, u = 0.0, hu = 0.0, uu = 0.0;
  for (std::int32_t k = 0; k < kBins; ++k) {
    const Bin& bin = profile.bins[static_cast<std::size_t>(k)];
    if (bin.rows == 0.0F) continue;
    const auto rows = static_cast<double>(bin.rows), sum = static_cast<double>(bin.distance_m);
    n += rows, h += rows * k, hh += rows * k * k, u += sum, hu += sum * k, uu += sum * sum / rows;
  }
  const double spread = hh - h * h / std::max(n, 1.0), shared = hu - h * u / std::max(n, 1.0);
  return uu - u * u / std::max(n, 1.0) - (spread > 1e-9 ? shared * shared / spread : 0.0);
}

OverhangSplit::Step OverhangSplit::best_step(const Profile& profile) const noexcept {
  double rows = 0.0, sum = 0.0, squares = 0.0;
  for (const Bin& bin : profile.bins) {
    if (bin.rows == 0.0F) continue;
    const auto distance_m = static_cast<double>(bin.distance_m), here = static_cast<double>(bin.rows);
    rows += here, sum += distance_m, squares += distance_m * distance_m / here;
  }
  Step best;
  double below = 0.0, below_sum = 0.0;
  for (std::int32_t k = 0; k < kBins; ++k) {
    const Bin& bin = profile.bins[static_cast<std::size_t>(k)];
    below += static_cast<double>(bin.rows), below_sum += static_cast<double>(bin.distance_m);
    const double above = rows - below, above_sum = sum - below_sum;
    if (below < params_.least_rows || above < params_.least_rows) continue;
    const double left_m2 = squares - below_sum * below_sum / below - above_sum * above_sum / above;
    if (left_m2 < best.left_m2) best = {k + 1, below_sum / below, above_sum / above, below, above, left_m2};
  }
  return best;
}

// Where a surface ends its pixels are mixed with what lies behind: such heights are few rows, lie between the two
// distances, and look like a slope.
void OverhangSplit::drop_sparse(Profile& profile) const noexcept {
  float fullest = 0.0F;
  for (const Bin& bin : profile.bins) fullest = std::max(fullest, bin.rows);
  for (Bin& bin : profile.bins) {
    if (bin.rows < static_cast<float>(params_.sparse) * fullest) bin = Bin{};
  }
}

// Where the nearer of two upright surfaces ends, the line of sight passes heights of the farther one that nobody sees.
// What shows such a height is a mixture of both surfaces: it lies on that line, and speaks neither for a step nor for a
// slope. As many heights as the step hides, those with the fewest rows about it, are left out of both.
void OverhangSplit::drop_hidden(const Step& step, Profile& profile) noexcept {
  const double hidden = (step.lower_m - step.upper_m) * profile.drop / kBin_m;
  if (!(hidden > 0.0)) return;
  const auto count = static_cast<std::int32_t>(std::min(hidden + 1.0, kBins - 1.0));  // that begin or end in a bin
  const auto rows_at = [&profile](std::int32_t k) { return profile.bins[static_cast<std::size_t>(k)].rows; };
  const std::int32_t from = std::max(step.first_upper - count, 0), until = std::min(step.first_upper, kBins - count);
  float rows = 0.0F;
  for (std::int32_t k = from; k < from + count; ++k) rows += rows_at(k);
  float fewest = rows;
  std::int32_t first = from;
  for (std::int32_t k = from + 1; k <= until; ++k) {
    rows += rows_at(k + count - 1) - rows_at(k - 1);
    if (rows >= fewest) continue;
    fewest = rows;
    first = k;
  }
  std::fill_n(profile.bins.begin() + first, count, Bin{});
}

bool OverhangSplit::try_split(std::size_t plane, Halves& halves) noexcept {
  if (profile_of_[plane] == 0) return false;
  Profile& profile = profiles_[profile_of_[plane] - 1U];
  work_.add(kBins, 110);
  drop_sparse(profile);
  Step step = best_step(profile);
  if (step.first_upper == 0) return false;
  drop_hidden(step, profile);
  step = best_step(profile);
  const double rows = step.lower_rows + step.upper_rows;
  if (step.first_upper == 0 || profile.beyond > params_.most_beyond * rows) return false;
  if (std::abs(step.upper_m - step.lower_m) < params_.least_step_m) return false;
  if (!(step.left_m2 < params_.most_left * left_by_slope_m2(profile))) return false;
  const double lower_m = profile.middle_m + step.lower_m, upper_m = profile.middle_m + step.upper_m;
  if (!(std::min(lower_m, upper_m) > 0.0)) return false;
  const bool upper_is_larger = step.upper_rows > step.lower_rows;
  halves.larger.m = profile.back / (upper_is_larger ? upper_m : lower_m);
  halves.smaller.m = profile.back / (upper_is_larger ? lower_m : upper_m);
  constexpr double kPixels = 2.0 * kColumn_px;  // every second row of a column
  halves.smaller_px = kPixels * std::min(step.lower_rows, step.upper_rows);
  return true;
}

}  // namespace polygmap
