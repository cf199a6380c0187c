// SPDX-License-Identifier: Apache-2.0
// The base filter's rows over a stair climb.
#pragma once

#include <random>

#include "tests/reference/base_filter/base_filter.hpp"
#include "tests/support/measured_legs.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/synthetic_walk.hpp"

namespace polygmap::test {

// A stair climb with noisy sensors, feet that lift and land, treads whose height is known or not, and noise that
// differs from contact to contact and from tick to tick: each tick's rows and acceleration.
class WalkRows {
 public:
  static constexpr double kTick_s = seconds(SyntheticWalk::kTick_ns);

  explicit WalkRows(const WalkSpec& spec) : walk_(spec) {
    contacts_.reset({});
    axes.reset({}, nominal_robot().sole);
    heights_.fill({0.0, 0.003});
  }

  void next() {
    const WalkTruth truth = walk_.truth(t_ns_);
    const JointFeedback joints = walk_.joints(t_ns_);
    contacts_.update(joints.foot_force_n, truth.stance, t_ns_);
    const auto legs = measured_legs(LegGeometry{}, joints.q_rad, joints.dq_radps);
    const auto make = [&](const std::array<FootContact, kFootCount>& feet) {
      return axes.make_rows(truth.true_T_base.R, Vec3::Zero(), legs, feet, touch_downs(truth), heights_, kTick_s);
    };
    if (t_ns_ == 0) axes.initialise(truth.true_T_base.p_m, Vec3::Zero(), make({}));
    rows = make(contacts_.feet());
    for (ContactRow& row : rows) {
      row.position_m2 *= scale_(random_);
      row.velocity_m2ps2 *= scale_(random_);
      row.process_m2 *= scale_(random_);
    }
    accel_mps2 = truth.true_T_base.R * walk_.imu(t_ns_).accel_mps2 - Vec3{0, 0, kGravity_mps2};
    t_ns_ += SyntheticWalk::kTick_ns;
  }

  BaseFilter axes;
  ContactRows rows;
  Vec3 accel_mps2 = Vec3::Zero();

 private:
  // A foot that lands is anchored and, every other time, on a tread of known height.
  std::array<TouchDown, kFootCount> touch_downs(const WalkTruth& truth) {
    std::array<TouchDown, kFootCount> now;
    for (std::size_t foot = 0; foot < kFootCount; ++foot) {
      if (!contacts_.feet()[foot].landed) continue;
      now[foot] = {true, truth.true_T_sole[foot]};
      heights_[foot] = ++landings_ % 2 == 0 ? KnownHeight{truth.true_T_sole[foot].p_m.z(), 0.004} : KnownHeight{};
    }
    return now;
  }

  SyntheticWalk walk_;
  ContactEstimator contacts_;
  std::array<KnownHeight, kFootCount> heights_;
  int landings_ = 0;
  std::mt19937 random_{5};
  std::uniform_real_distribution<double> scale_{0.25, 4.0};
  std::int64_t t_ns_ = 0;
};

}  // namespace polygmap::test
