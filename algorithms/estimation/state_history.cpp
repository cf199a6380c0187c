// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/state_history.hpp"

#include "algorithms/geometry/so3.hpp"

namespace polygmap {
namespace {

Transform between(const Transform& a, const Transform& b, double share) noexcept {
  return {a.R * so3_exp(share * so3_log(a.R.transpose() * b.R)), a.p_m + share * (b.p_m - a.p_m)};
}

}  // namespace

void StateHistory::push(const StateEstimate& state) noexcept {
  if (!states_.empty() && state.stamp_ns <= states_.newest().stamp_ns) return;
  const std::size_t count = states_.size();
  if (count >= 2 && states_.newest().stamp_ns - states_[count - 2].stamp_ns < kMinPeriod_ns) {
    states_.replace_newest(state);
  } else {
    states_.push_overwrite(state);
  }
}

bool StateHistory::try_at(std::int64_t stamp_ns, StateEstimate& out) const noexcept {
  if (states_.empty() || stamp_ns < states_.oldest().stamp_ns || stamp_ns > states_.newest().stamp_ns) return false;
  std::size_t low = 0, high = states_.size() - 1;  // stamp in [low, high]
  while (high - low > 1) {
    const std::size_t middle = low + (high - low) / 2;
    (states_[middle].stamp_ns <= stamp_ns ? low : high) = middle;
  }
  const StateEstimate& a = states_[low];
  const StateEstimate& b = states_[high];
  if (stamp_ns == a.stamp_ns || stamp_ns == b.stamp_ns) {
    out = stamp_ns == a.stamp_ns ? a : b;
    return true;
  }
  if (b.stamp_ns - a.stamp_ns > kMaxGap_ns) return false;
  const double share = static_cast<double>(stamp_ns - a.stamp_ns) / static_cast<double>(b.stamp_ns - a.stamp_ns);
  out = share < 0.5 ? a : b;  // what is not interpolated: probabilities, ages, sigmas
  out.stamp_ns = stamp_ns;
  out.odom_T_base = between(a.odom_T_base, b.odom_T_base, share);
  out.world_T_odom = between(a.world_T_odom, b.world_T_odom, share);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    out.odom_T_sole[foot] = between(a.odom_T_sole[foot], b.odom_T_sole[foot], share);
  }
  out.odom_v_base_mps = a.odom_v_base_mps + share * (b.odom_v_base_mps - a.odom_v_base_mps);
  out.base_w_base_radps = a.base_w_base_radps + share * (b.base_w_base_radps - a.base_w_base_radps);
  out.q_rad = a.q_rad + share * (b.q_rad - a.q_rad);
  return true;
}

}  // namespace polygmap
