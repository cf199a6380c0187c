// SPDX-License-Identifier: Apache-2.0
// What presses on each foot, from what there is: joint torques through the legs' dynamics, and force sensors where a
// robot has them. A sensor is quick and finely graded but has a zero of its own; torques have friction and masses that
// are not quite so. Each is weighed by how well it is known, and a sensor's zero is learnt: from the torques while it
// carries, from the air while it swings.
#pragma once

#include "algorithms/estimation/calibration/noise_level.hpp"
#include "algorithms/estimation/contact/ground_force_observer.hpp"
#include "algorithms/estimation/contact/torque_scale.hpp"

namespace polygmap {

class FootForces {
 public:
  struct Params {
    GroundForceObserver::Params observer;
    TorqueScale::Params torque_scale;
    NoiseLevel::Params sensor_noise{10.0, 0.1, 2.0, 1.0, 100.0};
    NoiseLevel::Params observer_noise{20.0, 0.2, 2.0, 6.0, 40.0};
    double zero_sigma_n = 60.0;
    double zero_by_torque_sigma_n = 15.0;
    double zero_in_air_sigma_n = 3.0;
    double zero_s = 0.2;
    double zero_walk_nprs = 1.0;
    double lifted_s = 0.16;
    double most_gap_s = 0.02;
    double light_n = 20.0;
    double light_sigmas = 2.0;

    static void visit(auto& p, auto& field) {
      field("observer", p.observer);
      field("torque_scale", p.torque_scale);
      field("sensor_noise", p.sensor_noise);
      field("observer_noise", p.observer_noise);
      field("zero_sigma_n", p.zero_sigma_n, 0.0, 500.0, "Error of a force sensor's zero at the start.");
      field("zero_by_torque_sigma_n", p.zero_by_torque_sigma_n, 0.5, 500.0,
            "The zero is known no better than this from torques.");
      field("zero_in_air_sigma_n", p.zero_in_air_sigma_n, 0.1, 500.0,
            "The zero is known no better than this from a swing: the foot feels its own motion.");
      field("zero_s", p.zero_s, 0.002, 60.0, "The zero is averaged over so much time at least.");
      field("zero_walk_nprs", p.zero_walk_nprs, 0.0, 50.0, "Random walk of the zero.");
      field("lifted_s", p.lifted_s, 0.0, 1.0,
            "From a foot in the air nothing is learnt earlier: at lift-off it still carries, and one that is stuck is "
            "found to stand after `stuck_swing_s`.");
      field("most_gap_s", p.most_gap_s, 0.001, 1.0,
            "A sample after a longer gap counts no more than after such a one.");
      field("light_n", p.light_n, 0.0, 200.0, "A force below this and below `light_sigmas` is none.");
      field("light_sigmas", p.light_sigmas, 0.0, 10.0, "So many of its sigmas a force may be feigned.");
    }
  };
  void reset(const Params& params) noexcept;
  // frames: of the joints. joints: a force that is not a number is not told, as are all torques when one is none or all
  // are 0, and those of a leg with a mute drive; torques were divided by torque_scale(). base: what the IMU feels, base
  // axes; base_up: the vertical there. stands: which feet do as far as is known.
  void update(const RobotModel& robot, const BodyFrames& frames, const JointFeedback& joints, const ImuSample& base,
              const Vec3& base_up, const std::array<bool, kFootCount>& stands) noexcept;
  // Upwards on each foot, never negative; not a number where nothing tells it.
  [[nodiscard]] const std::array<double, kFootCount>& up_n() const noexcept { return up_n_; }
  // Error of that, one sigma, by what is felt of feet that hang.
  [[nodiscard]] const std::array<double, kFootCount>& sigma_n() const noexcept { return sigma_n_; }
  // Torques of the drives over those that the legs need.
  [[nodiscard]] double torque_scale() const noexcept { return torque_scale_.scale(); }

 private:
  struct Sensor {
    NoiseLevel noise_n;
    double zero_n = 0.0, zero_variance_n2 = 0.0;
    double last_n = 0.0, before_n = 0.0;
    int samples = 0;
  };
  struct InAir {
    bool stood = false;  // since reset; before that nobody knows whether it hangs
    double since_s = 0.0;
  };
  struct Weighed {
    double force_n = 0.0, weight_pn2 = 0.0;  // 1 / variance; 0: not told
  };
  // observed: what torques tell. hangs: the foot does for certain.
  [[nodiscard]] Weighed sense(Sensor& sensor, double read_n, const Weighed& observed, bool hangs, double dt_s) noexcept;
  // Whether the foot does for certain.
  [[nodiscard]] bool hangs(std::size_t foot, bool stands, double dt_s) noexcept;
  void learn_zero(Sensor& sensor, double off_n, double least_sigma_n, double dt_s) noexcept;

  Params params_;
  GroundForceObserver observer_;
  TorqueScale torque_scale_;
  std::array<NoiseLevel, kFootCount> observer_noise_n_;
  std::array<Sensor, kFootCount> sensors_;
  std::array<InAir, kFootCount> in_air_;
  std::array<double, kFootCount> up_n_{}, sigma_n_{};
  std::int64_t stamp_ns_ = -1;
};

}  // namespace polygmap
