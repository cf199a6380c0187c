// SPDX-License-Identifier: Apache-2.0
// One sigma of an error, measured as it goes from what has no signal in it: differences in which it cancels, or samples
// that should be none.
#pragma once

#include <algorithm>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

class NoiseLevel {
 public:
  struct Params {
    double first = 0.0;
    double first_s = 0.0;
    double memory_s = 1.0;
    double min = 0.0, max = 1e9;
    double most_ratio = 4.0;

    static void visit(auto& p, auto& field) {
      field("first", p.first, 0.0, 100.0, "Sigma until something is measured, in units of the signal.");
      field("first_s", p.first_s, 0.0, 1000.0, "The first sigma counts like so much time of measurement.");
      field("memory_s", p.memory_s, 0.01, 1000.0, "What was measured longer ago is forgotten.");
      field("min", p.min, 0.0, 100.0, "The measured sigma is believed down to this.");
      field("max", p.max, 0.0, 1e9, "The measured sigma is believed up to this.");
      field.ordered("min", "max");
      field("most_ratio", p.most_ratio, 1.0, 100.0,
            "A square that is more than this times the usual one, an impact, counts as this times.");
    }
  };
  void reset(const Params& params) noexcept {
    params_ = params;
    sigma_ = params.first;
    time_s_ = params.first_s;
  }
  // square: of one difference, in units of the noise's variance, per axis. One that is far out (an impact) counts as
  // little more than usual.
  void take(double square, double dt_s) noexcept {
    time_s_ = std::min(time_s_ + dt_s, params_.memory_s);
    const double usual = math::square(sigma_);
    const double seen = std::min(square, params_.most_ratio * usual);
    sigma_ = math::clamp(math::sqrt(usual + std::min(dt_s / time_s_, 1.0) * (seen - usual)), params_.min, params_.max);
  }
  [[nodiscard]] double sigma() const noexcept { return sigma_; }

 private:
  Params params_;
  double sigma_ = 0.0;
  double time_s_ = 0.0;
};

}  // namespace polygmap
