// SPDX-License-Identifier: Apache-2.0
// What the sensors make of the true motion. Each is a function of the true state and of counter noise, no more.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "sim_stub/camera/counter_noise.hpp"
#include "sim_stub/sensors/robot_errors.hpp"

namespace polygmap::sim {

// Integrating IMU: the mean over the last tick, by finite differences of the true base poses.
class ImuModel {
 public:
  ImuModel(const ErrorParams& params, const RobotErrors& errors, std::uint64_t seed, const Transform& true_T_base);
  [[nodiscard]] ImuSample sample(const Transform& true_T_base, std::int64_t stamp_ns, double tick_s);

 private:
  ErrorParams params_;
  const RobotErrors& errors_;
  CounterNoise gyro_noise_, accel_noise_;
  std::uint64_t index_ = 0;
  RingBuffer<ImuSample, 32> history_;
  Transform previous_;
  Vec3 previous_velocity_mps_ = Vec3::Zero();
};

class JointModel {
 public:
  JointModel(const ErrorParams& params, std::uint64_t seed)
      : params_(params), angle_noise_(seed, Stream::kEncoders), rate_noise_(seed, Stream::kJointRates) {}
  // q and dq as the drives have them (offset included); forces as delayed by foot_force().
  [[nodiscard]] JointFeedback sample(const JointVector& drive_q_rad, const JointVector& drive_dq_radps,
                                     std::int64_t stamp_ns, double tick_s);

 private:
  ErrorParams params_;
  CounterNoise angle_noise_, rate_noise_;
  std::uint64_t index_ = 0;
  JointVector last_q_rad_ = JointVector::Zero();  // as read
};

// Vertical forces as the feet's sensors report them, late. The foot below its sensor is felt when it moves.
class FootForceModel {
 public:
  FootForceModel(const ErrorParams& params, std::uint64_t seed) : params_(params), noise_(seed, Stream::kFootForces) {}
  [[nodiscard]] std::array<double, kFootCount> sample(const std::array<double, kFootCount>& contact_n,
                                                      const std::array<double, kFootCount>& true_sole_z_m,
                                                      double tick_s);

 private:
  ErrorParams params_;
  CounterNoise noise_;
  std::uint64_t index_ = 0;
  RingBuffer<std::array<double, kFootCount>, 32> history_;
  RingBuffer<std::array<double, kFootCount>, 3> true_sole_z_m_;
};

// What the drives say of their torques: friction and noise on top.
class TorqueModel {
 public:
  TorqueModel(const ErrorParams& params, std::uint64_t seed) : params_(params), noise_(seed, Stream::kTorques) {}
  [[nodiscard]] JointVector sample(const JointVector& drive_tau_nm, const JointVector& dq_radps);

 private:
  ErrorParams params_;
  CounterNoise noise_;
  std::uint64_t index_ = 0;
};

class LioModel {
 public:
  LioModel(const ErrorParams& params, const RobotErrors& errors, std::uint64_t seed)
      : params_(params),
        errors_(errors),
        position_noise_(seed, Stream::kLioPosition),
        rotation_noise_(seed, Stream::kLioRotation),
        walk_noise_(seed, Stream::kLioWalk) {}
  [[nodiscard]] LioSample sample(const Transform& true_T_base, std::int64_t stamp_ns);
  // Whether it says nothing then.
  [[nodiscard]] bool is_out(std::int64_t stamp_ns) const noexcept {
    const double since_s = seconds(stamp_ns) - params_.lio_outage_from_s;
    return since_s >= 0.0 && since_s < params_.lio_outage_s;
  }

 private:
  // What the odometry makes of the truth by drift and jumps alone.
  [[nodiscard]] Transform drifted(const Transform& true_T_base, std::int64_t stamp_ns);

  ErrorParams params_;
  const RobotErrors& errors_;
  CounterNoise position_noise_, rotation_noise_, walk_noise_;
  std::uint64_t index_ = 0;
  std::int64_t last_ns_ = -1;  // negative: there was no sample
  double run_s_ = 0.0;         // since the first
  Vec3 start_m_ = Vec3::Zero(), walk_m_ = Vec3::Zero();
};

}  // namespace polygmap::sim
