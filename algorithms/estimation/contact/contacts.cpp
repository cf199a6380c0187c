// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/contacts.hpp"

#include <algorithm>
#include <cmath>

namespace polygmap {

void ContactEstimator::reset(const Params& params) noexcept {
  *this = ContactEstimator{};
  params_ = params;
}

void ContactEstimator::update(const std::array<double, kFootCount>& force_n,
                              const std::array<bool, kFootCount>& planned_stance, std::int64_t stamp_ns) noexcept {
  const double rise = stamp_ns_ < 0 ? 0.0 : seconds(stamp_ns - stamp_ns_) / params_.settle_s;
  const double total_n = force_n[0] + force_n[1];
  for (std::size_t i = 0; i < kFootCount; ++i) {
    if (!planned_stance[i] && was_planned_[i]) {
      unloaded_[i] = false;
      swing_since_ns_[i] = stamp_ns;
    }
    was_planned_[i] = planned_stance[i];
    if (force_n[i] <= params_.force_air_n) unloaded_[i] = true;
    const bool stuck = seconds(stamp_ns - swing_since_ns_[i]) > params_.stuck_swing_s;
    bool may_stand = planned_stance[i];
    double evidence = 1.0;
    if (!std::isnan(force_n[i])) {
      may_stand = may_stand || unloaded_[i] || stuck;
      evidence =
          math::clamp((force_n[i] - params_.force_air_n) / (params_.force_standing_n - params_.force_air_n), 0.0, 1.0);
    }
    FootContact& foot = feet_[i];
    const double before = foot.probability;
    foot.probability = may_stand ? std::min(evidence, before + rise) : 0.0;
    foot.landed = !foot.stands && foot.probability >= 1.0;
    foot.stands = foot.landed || (foot.stands && foot.probability > 0.0);
    foot.load_share = total_n > params_.force_air_n ? force_n[i] / total_n : 0.5;
  }
  stamp_ns_ = stamp_ns;
}

void ContactEstimator::update_stated(const std::array<double, kFootCount>& probability,
                                     std::int64_t stamp_ns) noexcept {
  const double dt_s = stamp_ns_ < 0 ? 0.0 : seconds(stamp_ns - stamp_ns_);
  const double kept = params_.flicker_s / (params_.flicker_s + dt_s);
  for (std::size_t i = 0; i < kFootCount; ++i) {
    FootContact& foot = feet_[i];
    foot.probability = std::max(probability[i], kept * foot.probability);
    foot.landed = !foot.stands && foot.probability >= params_.stated_standing;
    foot.stands = foot.landed || (foot.stands && foot.probability >= params_.stated_air);
  }
  const double total = feet_[0].probability + feet_[1].probability;
  for (FootContact& foot : feet_) foot.load_share = total > 0.0 ? foot.probability / total : 0.5;
  stamp_ns_ = stamp_ns;
}

}  // namespace polygmap
