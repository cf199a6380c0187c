// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/com_plan.hpp"

#include <algorithm>

#include "algorithms/core/time.hpp"

namespace polygmap {
namespace {

constexpr std::int32_t kRest_ticks = 1'000'000;  // beyond every plan

// The zero-moment point leaves its straight way by the offset: up, then full, gone at the end.
double offset_share(const ComPlan::Params& params, double u) noexcept {
  if (u >= 1.0) return 0.0;
  return std::min({u / params.offset_up, 1.0, (1.0 - u) / (1.0 - params.offset_down)});
}

// Where the zero-moment point is without the offset.
Vec2 straight_m(const Vec2& start_m, const ZmpKnots& knots, std::int32_t tick) noexcept {
  ZmpKnot before{0, start_m};
  for (const ZmpKnot& knot : knots) {
    if (tick <= knot.tick) {
      const double share = static_cast<double>(tick - before.tick) / std::max(knot.tick - before.tick, 1);
      return before.zmp_m + share * (knot.zmp_m - before.zmp_m);
    }
    before = knot;
  }
  return before.zmp_m;
}

}  // namespace

// The knots of plan and offset together, in their order.
ComPlan::Knots ComPlan::with_offset_knots(const Params& params, const Vec2& start_m, const ZmpKnots& knots,
                                          double offset_ticks) noexcept {
  const std::array<std::int32_t, 3> extra{static_cast<std::int32_t>(params.offset_up * offset_ticks),
                                          static_cast<std::int32_t>(params.offset_down * offset_ticks),
                                          static_cast<std::int32_t>(offset_ticks)};
  Knots all;
  (void)all.try_push_back({0, start_m});
  std::size_t next_extra = 0;
  for (const ZmpKnot& knot : knots) {
    for (; next_extra < extra.size() && extra[next_extra] <= knot.tick; ++next_extra) {
      const std::int32_t tick = extra[next_extra];
      if (tick < knot.tick) (void)all.try_push_back({tick, straight_m(start_m, knots, tick)});
    }
    if (knot.tick > all.back().tick) (void)all.try_push_back(knot);
  }
  return all;
}

// The divergent component xi = x + v/w must meet every segment so that the last one rests: backwards. The offset's part
// of xi(0) per metre of offset goes along.
ComPlan::Knots ComPlan::offset_knots(const Params& params, const HorizontalMotion& from, const ZmpKnots& knots,
                                     Vec2& offset_m) noexcept {
  const double w = params.omega_radps, offset_ticks = std::min(params.zmp_offset_ticks, knots.back().tick);
  Knots all = with_offset_knots(params, zmp_under(params, from), knots, offset_ticks);
  std::array<double, kSegments> share{};
  for (std::size_t i = 0; i < all.size(); ++i) share[i] = offset_share(params, all[i].tick / offset_ticks);
  Vec2 xi_m = all.back().zmp_m;
  double offset_xi = 0.0;
  for (std::size_t i = all.size() - 1; i-- > 0;) {
    const double T = (all[i + 1].tick - all[i].tick) * kTick_s, decay = math::exp(-w * T);
    const Vec2 slope = (all[i + 1].zmp_m - all[i].zmp_m) / T;
    xi_m = all[i].zmp_m + slope / w + decay * (xi_m - all[i + 1].zmp_m - slope / w);
    const double rate = (share[i + 1] - share[i]) / T;
    offset_xi = share[i] + rate / w + decay * (offset_xi - share[i + 1] - rate / w);
  }
  offset_m = (from.position_m + from.velocity_mps / w - xi_m) / std::max(offset_xi, 0.05);
  for (std::size_t i = 0; i < all.size(); ++i) all[i].zmp_m += share[i] * offset_m;
  return all;
}

double ComPlan::zmp_offset_m(const Params& params, const HorizontalMotion& from, const ZmpKnots& knots) noexcept {
  Vec2 offset_m;
  (void)offset_knots(params, from, knots, offset_m);
  return offset_m.norm();
}

void ComPlan::plan(const Params& params, const HorizontalMotion& from, const ZmpKnots& knots) noexcept {
  const double w = omega_radps_ = params.omega_radps;
  Vec2 offset_m;
  const Knots all = offset_knots(params, from, knots, offset_m);
  count_ = all.size();

  // Backwards again for the growing part, forwards for the dying one.
  Segment& rest = segments_[count_ - 1];
  rest = {all.back().tick, kRest_ticks, all.back().zmp_m, Vec2::Zero(), Vec2::Zero(), Vec2::Zero()};
  Vec2 xi_m = rest.zmp_m;
  for (std::size_t i = count_ - 1; i-- > 0;) {
    Segment& s = segments_[i];
    s.begin = all[i].tick;
    s.ticks = all[i + 1].tick - all[i].tick;
    const double T = s.ticks * kTick_s;
    s.zmp_m = all[i].zmp_m;
    s.slope_mps = (all[i + 1].zmp_m - s.zmp_m) / T;
    s.a_m = 0.5 * (xi_m - all[i + 1].zmp_m - s.slope_mps / w);
    xi_m = s.zmp_m + s.slope_mps / w + 2.0 * math::exp(-w * T) * s.a_m;
  }
  Vec2 position_m = from.position_m;
  for (std::size_t i = 0; i < count_; ++i) {
    Segment& s = segments_[i];
    const double decay = math::exp(-w * s.ticks * kTick_s);
    s.b_m = position_m - s.zmp_m - decay * s.a_m;
    position_m = s.zmp_m + s.ticks * kTick_s * s.slope_mps + s.a_m + decay * s.b_m;
  }
}

const ComPlan::Segment& ComPlan::segment(std::int32_t tick) const noexcept {
  std::size_t i = 0;
  while (i + 1 < count_ && tick >= segments_[i + 1].begin) ++i;
  return segments_[i];
}

HorizontalMotion ComPlan::at(std::int32_t tick) const noexcept {
  const Segment& s = segment(std::max(tick, 0));
  const double w = omega_radps_;
  const std::int32_t ticks = std::max(tick, 0) - s.begin;
  const double t = ticks * kTick_s;
  const Vec2 growing_m = math::exp(w * (ticks - s.ticks) * kTick_s) * s.a_m, dying_m = math::exp(-w * t) * s.b_m;
  return {s.zmp_m + t * s.slope_mps + growing_m + dying_m, s.slope_mps + w * (growing_m - dying_m),
          w * w * (growing_m + dying_m)};
}

Vec2 ComPlan::zmp_m(std::int32_t tick) const noexcept {
  const Segment& s = segment(std::max(tick, 0));
  return s.zmp_m + (std::max(tick, 0) - s.begin) * kTick_s * s.slope_mps;
}

}  // namespace polygmap
