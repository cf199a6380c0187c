// SPDX-License-Identifier: Apache-2.0
// A stair climb as a function of time, and what noisy sensors say of it: estimation's test bench, without the
// simulation.
#pragma once

#include <random>
#include <vector>

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap::test {

struct WalkSpec {
  std::uint32_t seed = 1;
  int steps = 4;  // stairs climbed, both feet onto each
  double rise_m = 0.13;
  double tread_m = 0.28;
  double stand_s = 2.0;  // before and after
  double yaw_per_step_rad = 0.0;
  std::int64_t slip_ns = -1;  // from here on the standing left foot slips ahead, 0.3 m/s for 0.2 s; -1: never
  // Sensor errors, one sigma; scale 0 makes everything perfect.
  double noise_scale = 1.0;
  double encoder_noise_rad = 2e-4, encoder_offset_rad = 2e-3, encoder_rate_noise_radps = 0.02;
  double gyro_noise_radps = 2e-3, gyro_bias_radps = 2e-3;
  double accel_noise_mps2 = 0.05, accel_bias_mps2 = 0.05;
  double imu_mount_rad = 0.0035;
  double leg_length_error = 0.005;
  double lio_position_m = 0.01, lio_rotation_rad = 0.0035;
  std::int64_t contact_delay_ns = 6 * kNsPerMs;
  std::int64_t lio_delay_ns = 100 * kNsPerMs;
};

struct WalkTruth {
  Transform true_T_base;
  std::array<Transform, kFootCount> true_T_sole;
  std::array<bool, kFootCount> stance{true, true};
  std::array<double, kFootCount> load_share{0.5, 0.5};
};

class SyntheticWalk {
 public:
  static constexpr std::int64_t kTick_ns = 2 * kNsPerMs;
  explicit SyntheticWalk(const WalkSpec& spec);

  [[nodiscard]] std::int64_t end_ns() const { return end_ns_; }
  [[nodiscard]] WalkTruth truth(std::int64_t t_ns) const;
  // One call per tick, in order: the noise is a sequence.
  [[nodiscard]] ImuSample imu(std::int64_t t_ns);
  [[nodiscard]] JointFeedback joints(std::int64_t t_ns);
  [[nodiscard]] LioSample lio(std::int64_t stamp_ns);
  [[nodiscard]] const Vec3& gyro_bias_radps() const { return gyro_bias_radps_; }
  [[nodiscard]] const Transform& lio_T_true() const { return lio_T_true_; }

 private:
  struct Phase {
    std::int64_t start_ns, end_ns;
    int swing;  // foot index, -1: double support
    Vec3 base_from_m, base_to_m;
    double yaw_from_rad, yaw_to_rad;
    std::array<Transform, kFootCount> sole_from, sole_to;
    double left_share_from, left_share_to;
  };
  void build();
  [[nodiscard]] Vec3 slipped_m(std::int64_t t_ns) const;
  [[nodiscard]] JointVector true_joints(std::int64_t t_ns) const;
  [[nodiscard]] double draw(double sigma) { return spec_.noise_scale * sigma * normal_(random_); }
  [[nodiscard]] Vec3 draw3(double sigma) {
    const double x = draw(sigma), y = draw(sigma), z = draw(sigma);
    return {x, y, z};
  }

  WalkSpec spec_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::vector<Phase> phases_;
  std::int64_t end_ns_ = 0;
  std::array<LegGeometry, kFootCount> true_geometry_;
  JointVector encoder_offset_rad_;
  Vec3 gyro_bias_radps_, accel_bias_mps2_;
  Mat3 imu_R_base_;
  Transform lio_T_true_;
};

}  // namespace polygmap::test
