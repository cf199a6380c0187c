// SPDX-License-Identifier: Apache-2.0
// What every gait test asks of a climb, and how some disturb one.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "tests/support/ideal_climb.hpp"

namespace polygmap::test {

inline void expect_sound_commands(const IdealClimb& climb) {
  const ClimbRecord& r = climb.record();
  EXPECT_LE(*std::max_element(r.speed_share.begin(), r.speed_share.end()), 1.0 + 1e-9);
  EXPECT_GE(r.joint_margin_rad, 0.0);
  EXPECT_GE(r.knee_min_rad, 0.05);
}

inline constexpr std::uint32_t kOnTheFirstTread = 1;
// Calls disturb(ns since both feet stood on the first tread, footholds).
inline void disturb_after_the_first_tread(IdealClimb& climb,
                                          const std::function<void(std::int64_t since_ns, FootholdSet& set)>& disturb) {
  climb.tamper = [&climb, disturb](StateEstimate& state, FootholdSet& set, JointFeedback&) {
    if (climb.status().treads_climbed < kOnTheFirstTread) return;
    disturb(state.stamp_ns - climb.status().step.touch_down_stamp_ns, set);
  };
}

}  // namespace polygmap::test
