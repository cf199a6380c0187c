// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/image/noise_tracker.hpp"

#include <algorithm>

#include "algorithms/core/math/math.hpp"

namespace polygmap {
namespace {

constexpr float kCostsPerUnit = 4.0F;  // bins of a histogram, kCostBins

}  // namespace

void NoiseSamples::add(float inverse_depth, float cost) noexcept {
  // Where the next range begins: half octaves from 0.7 m on.
  constexpr std::array<float, kDepths - 1> kNextFrom{1.0F / 0.7F, 1.0F,        1.0F / 1.4F, 1.0F / 2.0F,
                                                     1.0F / 2.8F, 1.0F / 4.0F, 1.0F / 5.6F};
  std::size_t i = 0;
  while (i < kNextFrom.size() && inverse_depth < kNextFrom[i]) ++i;
  ++depths_[i].rows[static_cast<std::size_t>(std::min(cost * kCostsPerUnit, static_cast<float>(kCostBins)))];
  depths_[i].sum_z_m += static_cast<double>(1.0F / inverse_depth);
}

// The median forgives half of the rows being something else; a squared normal variable's is 0.455.
StaticVector<NoiseSamples::Seen, NoiseSamples::kDepths> NoiseSamples::seen(std::int32_t min_rows) const noexcept {
  constexpr double kMedian = 0.455;
  StaticVector<Seen, kDepths> out;
  for (const AtDepth& depth : depths_) {
    std::int32_t all = 0;
    for (const std::int32_t n : depth.rows) all += n;
    if (all < min_rows) continue;
    std::int32_t below = 0;
    std::size_t bin = 0;
    while (2 * (below + depth.rows[bin]) < all) below += depth.rows[bin++];
    const double within = (0.5 * all - below) / depth.rows[bin];
    const double median = (static_cast<double>(bin) + within) / static_cast<double>(kCostsPerUnit);
    static_cast<void>(out.try_push_back({depth.sum_z_m / all, math::sqrt(median / kMedian), static_cast<double>(all)}));
  }
  return out;
}

DepthNoiseModel NoiseTracker::of(const DepthNoiseModel& profile) const noexcept {
  DepthNoiseModel believed = profile.scaled(scale_);
  believed.quadratic_per_m += quadratic_per_m_;
  return believed;
}

void NoiseTracker::follow(const Params& params, const DepthNoiseModel& profile, const NoiseSamples& samples) noexcept {
  constexpr double kLeastSpread = 1e-3;  // of depths, below which they do not tell the two apart
  const DepthNoiseModel believed = of(profile);
  // Relative errors: 1 = scale p + quadratic q in every range.
  double pp = 0.0, pq = 0.0, qq = 0.0, p1 = 0.0, q1 = 0.0;
  for (const NoiseSamples::Seen& at : samples.seen(params.min_rows)) {
    const double sigma_m = std::max(at.scale * believed.sigma_m(at.z_m), 1e-6);
    const double p = profile.sigma_m(at.z_m) / sigma_m, q = at.z_m * at.z_m / sigma_m;
    pp += at.rows * p * p, pq += at.rows * p * q, qq += at.rows * q * q, p1 += at.rows * p, q1 += at.rows * q;
  }
  if (!(pp > 0.0) || !(qq > 0.0)) return;
  const double determinant = pp * qq - pq * pq;
  double quadratic = quadratic_per_m_;
  if (determinant > kLeastSpread * pp * qq) quadratic = (pp * q1 - pq * p1) / determinant;
  quadratic = math::clamp(quadratic, 0.0, params.max_quadratic_per_m);
  const double scale = math::clamp((p1 - pq * quadratic) / pp, params.min_scale, params.max_scale);
  // Where the scale's lower bound says more than was seen, the rest is less.
  quadratic = math::clamp((q1 - pq * scale) / qq, 0.0, quadratic);
  scale_ += params.gain * (scale - scale_);
  quadratic_per_m_ += params.gain * (quadratic - quadratic_per_m_);
}

}  // namespace polygmap
