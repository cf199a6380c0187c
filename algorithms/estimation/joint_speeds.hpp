// SPDX-License-Identifier: Apache-2.0
// Joint speeds as smooth as the balance needs them. A drive that differences its encoder tells a coarse step as a spike
// of one cycle: how noisy each joint's speed is, is measured as it goes, and it is averaged over as much time as that
// takes. Speeds that are smooth enough pass unchanged.
#pragma once

#include <algorithm>
#include <array>

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/estimation/calibration/noise_level.hpp"

namespace polygmap {

class JointSpeeds {
 public:
  struct Params {
    NoiseLevel::Params noise{0.02, 0.2, 0.5, 0.0, 10.0, 100.0};
    double smooth_radps = 0.1;

    static void visit(auto& p, auto& field) {
      field("noise", p.noise);
      field("smooth_radps", p.smooth_radps, 0.001, 10.0,
            "A joint's speed with more noise, one sigma, is averaged down to this.");
    }
  };
  void reset(const Params& params) noexcept {
    *this = JointSpeeds{};
    params_ = params;
    for (NoiseLevel& noise : noise_radps_) noise.reset(params.noise);
  }
  // Once per sample, dt_s after the one before.
  [[nodiscard]] const JointVector& smoothed(const JointVector& dq_radps, double dt_s) noexcept {
    for (Eigen::Index j = 0; j < dq_radps.size(); ++j) {
      NoiseLevel& noise_radps = noise_radps_[static_cast<std::size_t>(j)];
      // A speed that changes steadily is no noise.
      if (samples_ >= 2) noise_radps.take(math::square(dq_radps[j] - 2.0 * last_[j] + before_[j]) / 6.0, dt_s);
      const double smooth = math::square(std::min(params_.smooth_radps / std::max(noise_radps.sigma(), 1e-6), 1.0));
      const double gain = samples_ == 0 ? 1.0 : 2.0 * smooth / (1.0 + smooth);  // leaves sigma sqrt(gain / (2 - gain))
      smoothed_[j] = gain < 1.0 ? smoothed_[j] + gain * (dq_radps[j] - smoothed_[j]) : dq_radps[j];
    }
    before_ = last_;
    last_ = dq_radps;
    samples_ = std::min(samples_ + 1, 2);
    return smoothed_;
  }

 private:
  Params params_;
  std::array<NoiseLevel, kJointCount> noise_radps_;
  JointVector smoothed_ = JointVector::Zero(), last_ = JointVector::Zero(), before_ = JointVector::Zero();
  int samples_ = 0;
};

}  // namespace polygmap
