// SPDX-License-Identifier: Apache-2.0
// How the module lets go of a robot that stands, for another controller to take it over.
//
// It balances until the robot has been at rest for a while. Then the drives are sent one law that holds the robot where
// it is without anybody's help: the mean of its joints' angles, the mean of the torques that it stood by, and as much
// stiffness as they take. After some cycles of that nothing is sent any more: two masters on a bus contradict each
// other, so the other controller speaks from then on, and not before.
#pragma once

#include <algorithm>
#include <cstdint>

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/messages/state.hpp"
#include "algorithms/robot/drive_torque.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

class HandOver {
 public:
  struct Params {
    std::int32_t rest_ticks = 250;
    double rest_mps = 0.03;
    double rest_radps = 0.1;
    std::int32_t hold_ticks = 25;

    static void visit(auto& p, auto& field) {
      field(
          "rest_ticks", p.rest_ticks, 50, 5000,
          "Handing over, it balances until the robot has been at rest for so long; the hold is the mean of that time.");
      field("rest_mps", p.rest_mps, 0.001, 1.0, "At rest the base is no faster.");
      field("rest_radps", p.rest_radps, 0.001, 1.0, "Nor does it turn faster.");
      field("hold_ticks", p.hold_ticks, 1, 500, "The hold is sent for so long; then nothing is.");
    }
  };

  void begin() noexcept { *this = {}; }
  [[nodiscard]] static bool is_at_rest(const Params& params, const StateEstimate& state) noexcept {
    return state.odom_v_base_mps.squaredNorm() <= params.rest_mps * params.rest_mps &&
           state.base_w_base_radps.squaredNorm() <= params.rest_radps * params.rest_radps;
  }
  // command: of the balance, for this tick; the hold, when it is time for that and as long as the robot rests in it.
  // joints: in its angles and torques.
  void tick(const Params& params, const DriveModel& drives, bool at_rest, const JointFeedback& joints,
            JointCommand& command) noexcept {
    if (!at_rest) return begin();
    if (rested_ticks_ < params.rest_ticks) {
      ++rested_ticks_;
      return add(joints, command);
    }
    ++held_ticks_;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const auto i = static_cast<Eigen::Index>(n);
      command.joints[n] = {mean_q_rad_[i], 0.0, mean_torque_nm_[i], drives.kp_blind_of(n), drives.kd_of(n)};
    }
  }
  // As many commands with the hold as it takes have been made.
  [[nodiscard]] bool is_over(const Params& params) const noexcept { return held_ticks_ >= params.hold_ticks; }

 private:
  void add(const JointFeedback& joints, const JointCommand& command) noexcept {
    const double share = 1.0 / rested_ticks_;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const auto i = static_cast<Eigen::Index>(n);
      const double torque_nm = torque_asked_nm(command.joints[n], joints.q_rad[i], joints.dq_radps[i]);
      mean_q_rad_[i] += share * (joints.q_rad[i] - mean_q_rad_[i]);
      mean_torque_nm_[i] += share * (torque_nm - mean_torque_nm_[i]);
    }
  }

  std::int32_t rested_ticks_ = 0, held_ticks_ = 0;
  JointVector mean_q_rad_ = JointVector::Zero(), mean_torque_nm_ = JointVector::Zero();
};

}  // namespace polygmap
