// SPDX-License-Identifier: Apache-2.0
// Whether a swinging foot touches, from a force that friction and masses may feign: the log odds of touching against
// hanging, summed over the samples (Page's cumulative sum; Page, "Continuous inspection schemes", Biometrika 1954). A
// hard touch-down counts at once, one a little above the even one after some samples, a softer one never, and a toe
// that scrapes along a riser for a moment does not.
#pragma once

#include <algorithm>
#include <cmath>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

class TouchEvidence {
 public:
  struct Params {
    double even_sigmas = 3.0;
    double least_even_n = 13.0;
    double most_even_n = 45.0;
    double odds_pn = 0.2;
    double most_odds = 2.0;
    double expected_odds = 2.0;
    double early_odds = 10.0;

    static void visit(auto& p, auto& field) {
      field("even_sigmas", p.even_sigmas, 0.1, 10.0,
            "A foot that is felt to press so many of the force's sigmas touches as likely as it hangs.");
      field("least_even_n", p.least_even_n, 1.0, 200.0, "It touches less likely below this: the leg moves.");
      field("most_even_n", p.most_even_n, 1.0, 500.0, "It touches more likely above this: it carries its own leg.");
      field.ordered("least_even_n", "most_even_n");
      field("odds_pn", p.odds_pn, 0.001, 10.0, "Log odds of touching, for each newton above that and sample.");
      field("most_odds", p.most_odds, 0.1, 100.0, "One sample's log odds count no more, either way.");
      field("expected_odds", p.expected_odds, 0.1, 100.0, "Log odds that make a touch where the ground is expected.");
      field("early_odds", p.early_odds, 0.1, 1000.0, "And where it is not expected yet: a toe may scrape there.");
      field.ordered("expected_odds", "early_odds");
    }
  };
  // One sample and its sigma, which may be 0 or no number: not known. A force that is not a number is none, as of a
  // foot that hangs.
  void take(const Params& params, double force_n, double sigma_n) noexcept {
    const double even_n = sigma_n > 0.0
                              ? math::clamp(params.even_sigmas * sigma_n, params.least_even_n, params.most_even_n)
                              : params.most_even_n;
    const double sample = std::isfinite(force_n) ? params.odds_pn * (force_n - even_n) : -params.most_odds;
    odds_ = math::clamp(odds_ + math::clamp(sample, -params.most_odds, params.most_odds), 0.0, params.early_odds);
    presses_ = sample > 0.0;
  }
  // early: above where the ground is expected. What scraped there and is free again does not touch below.
  [[nodiscard]] bool touches(const Params& params, bool early) const noexcept {
    return presses_ && odds_ >= (early ? params.early_odds : params.expected_odds);
  }
  // Whatever the last sample was.
  [[nodiscard]] bool likely(const Params& params) const noexcept { return odds_ >= params.expected_odds; }
  [[nodiscard]] bool hangs() const noexcept { return !(odds_ > 0.0); }

 private:
  double odds_ = 0.0;
  bool presses_ = false;  // by the last sample
};

}  // namespace polygmap
