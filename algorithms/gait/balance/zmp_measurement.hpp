// SPDX-License-Identifier: Apache-2.0
// Where the ground presses, by what feet and ankle drives feel: the zero-moment point as it is, not as it was asked
// for.
#pragma once

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

struct ZmpMeasurementParams {
  double min_weight_share = 0.7, max_weight_share = 1.4;
  double pressed_n = 30.0;

  static void visit(auto& p, auto& field) {
    field("min_weight_share", p.min_weight_share, 0.0, 1.0,
          "Feet that carry less of the weight have no zero-moment point: a sensor is wrong, or the robot is not on "
          "them.");
    field("max_weight_share", p.max_weight_share, 1.0, 10.0,
          "Feet that carry more than this share of the weight have no zero-moment point: a sensor is wrong.");
    field("pressed_n", p.pressed_n, 1.0, 200.0, "A foot that is pressed less does not say where the ground presses.");
  }
};

// odom_slope: of the ground's force, horizontal over vertical. False, and nothing changes, when forces or torques are
// not told (not a number, or ankles at exactly 0) or the feet together do not carry about the robot's weight.
[[nodiscard]] bool try_measure_zmp(const ZmpMeasurementParams& params, const RobotModel& robot,
                                   const JointFeedback& felt, const std::array<Transform, kFootCount>& odom_T_sole,
                                   const Vec2& odom_slope, Vec2& odom_p_zmp_m) noexcept;

}  // namespace polygmap
