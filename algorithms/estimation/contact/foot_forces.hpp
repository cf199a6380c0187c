// SPDX-License-Identifier: Apache-2.0
// What presses on each foot, from what there is: joint torques through the legs' dynamics, and force sensors where a
// robot has them. A sensor is quick and finely graded but has a zero of its own; torques have friction and masses that
// are not quite so. Each is weighed by how well it is known, and a sensor's zero is learnt: from the torques while it
// carries, from the air while it swings.
#pragma once

#include "algorithms/estimation/calibration/noise_level.hpp"
#include "algorithms/estimation/contact/ground_force_observer.hpp"

namespace polygmap {

class FootForces {
 public:
  struct Params {
    GroundForceObserver::Params observer;
    NoiseLevel::Params sensor_noise{10.0, 0.1, 2.0, 1.0, 100.0};
    double observer_sigma_n = 10.0;
    double zero_sigma_n = 60.0;
    double zero_by_torque_sigma_n = 15.0;
    double zero_in_air_sigma_n = 3.0;
    double zero_s = 0.2;
    double zero_walk_nprs = 1.0;

    static void visit(auto& p, auto& field) {
      field("observer", p.observer);
      field("sensor_noise", p.sensor_noise);
      field("observer_sigma_n", p.observer_sigma_n, 0.5, 200.0, "Error of a force that torques tell.");
      field("zero_sigma_n", p.zero_sigma_n, 0.0, 500.0, "Error of a force sensor's zero at the start.");
      field("zero_by_torque_sigma_n", p.zero_by_torque_sigma_n, 0.5, 500.0,
            "The zero is known no better than this from torques.");
      field("zero_in_air_sigma_n", p.zero_in_air_sigma_n, 0.1, 500.0,
            "The zero is known no better than this from a swing: the foot feels its own motion.");
      field("zero_s", p.zero_s, 0.002, 60.0, "The zero is averaged over so much time at least.");
      field("zero_walk_nprs", p.zero_walk_nprs, 0.0, 50.0, "Random walk of the zero.");
    }
  };
  struct Pressed {
    double up_n = 0.0;     // never negative; not a number when nothing tells it
    double sigma_n = 0.0;  // of up_n
  };
  void reset(const Params& params) noexcept;
  // joints: torques not a number are not told, as are foot forces. base: what the IMU feels, base axes; base_up: the
  // vertical there. in_air: feet that hang for certain.
  [[nodiscard]] const std::array<Pressed, kFootCount>& update(const RobotModel& robot, const JointFeedback& joints,
                                                            const ImuSample& base, const Vec3& base_up,
                                                            const std::array<bool, kFootCount>& in_air) noexcept;

 private:
  struct Sensor {
    NoiseLevel noise_n;
    double zero_n = 0.0, zero_variance_n2 = 0.0;
    double last_n = 0.0, before_n = 0.0;
    int samples = 0;
  };
  void learn_zero(Sensor& sensor, double off_n, double least_sigma_n, double dt_s) noexcept;

  Params params_;
  GroundForceObserver observer_;
  std::array<Sensor, kFootCount> sensors_;
  std::array<Pressed, kFootCount> feet_{};
  std::int64_t stamp_ns_ = -1;
};

}  // namespace polygmap
