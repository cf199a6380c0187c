// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/leg_history.hpp"

#include <algorithm>

#include "algorithms/core/time.hpp"
#include "algorithms/geometry/so3.hpp"

namespace polygmap {

void LegHistory::push(std::int64_t stamp_ns, const Legs& legs) noexcept {
  if (samples_.empty()) {
    base_v_foot_mps_.fill(Vec3::Zero());
  } else {
    const StampedLegs& last = samples_.newest();
    const double dt_s = seconds(stamp_ns - last.stamp_ns);
    const double share = dt_s / (kSmoothing_s + dt_s);
    for (std::size_t foot = 0; foot < kFootCount; ++foot) {
      const Vec3 v_mps = (legs[foot].base_T_sole.p_m - last.legs[foot].base_T_sole.p_m) / dt_s;
      base_v_foot_mps_[foot] += share * (v_mps - base_v_foot_mps_[foot]);
    }
  }
  samples_.push_overwrite({stamp_ns, legs});
}

LegHistory::Moment LegHistory::before(double delay_s) const noexcept {
  const auto delay_ns = static_cast<std::int64_t>(math::clamp(delay_s, 0.0, kMost_s) * 1e9);
  const std::int64_t stamp_ns = std::max(samples_.newest().stamp_ns - delay_ns, samples_.oldest().stamp_ns);
  std::size_t i = samples_.size() - 1;
  while (i > 0 && samples_[i].stamp_ns > stamp_ns) --i;
  Moment moment{samples_[i].legs, base_v_foot_mps_};
  if (i + 1 == samples_.size()) return moment;
  const StampedLegs &a = samples_[i], &b = samples_[i + 1];
  const double share = seconds(stamp_ns - a.stamp_ns) / seconds(b.stamp_ns - a.stamp_ns);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const Transform &from = a.legs[foot].base_T_sole, &to = b.legs[foot].base_T_sole;
    moment.legs[foot].base_T_sole = {from.R * so3_exp(share * so3_log(from.R.transpose() * to.R)),
                                     from.p_m + share * (to.p_m - from.p_m)};
  }
  return moment;
}

}  // namespace polygmap
