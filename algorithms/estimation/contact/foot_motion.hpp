// SPDX-License-Identifier: Apache-2.0
// Does a foot that is said to stand really rest? Its speed over the ground, as the IMU's prediction of the base and the
// leg's position have it, against what their noise explains.
//
// A foot that touches a little early, lifts a little before its flag falls, or slips, moves. A gate on the innovation
// would see that only after the velocity was dragged along, and throw away good rows at every touch-down; here a foot
// that moves is let go by as much as it moves, a continuous function, and one that has come to rest is held again.
#pragma once

#include <array>

#include "algorithms/core/messages/samples.hpp"
#include "algorithms/estimation/calibration/noise_level.hpp"

namespace polygmap {

class FootMotion {
 public:
  struct Params {
    double speed_sigma_mps = 0.04;
    double min_window_s = 0.010;
    double max_window_s = 0.060;
    NoiseLevel::Params noise{1e-3, 0.0, 2.0, 3e-4, 0.02};
    double rest_sigma_mps = 0.05;
    double rest_sigmas = 3.0;
    double gain = 4.0;

    static void visit(auto& p, auto& field) {
      field("speed_sigma_mps", p.speed_sigma_mps, 0.001, 1.0,
            "The measured speed of a foot is averaged until it is as good as this.");
      field("min_window_s", p.min_window_s, 0.002, 0.1, "The speed is averaged over no less.");
      field("max_window_s", p.max_window_s, 0.002, 0.5, "The speed is averaged over no more.");
      field.ordered("min_window_s", "max_window_s");
      field("noise", p.noise);
      field("rest_sigma_mps", p.rest_sigma_mps, 0.001, 1.0,
            "A foot that rests moves like this all the same: it rolls and creeps.");
      field("rest_sigmas", p.rest_sigmas, 0.0, 10.0, "A speed below this many of its sigmas is rest.");
      field("gain", p.gain, 0.0, 100.0,
            "The random walk that a speed stands for is this times its square times the window.");
    }
  };
  void reset(const Params& params) noexcept;

  // odom_step_m: by how much the foot moved over the ground in this step of dt_s, the base as predicted by the IMU from
  // the last corrected state. speed_sigma_mps: of the base's velocity, one sigma. A foot in the air says nothing of
  // noise.
  void update(std::size_t foot, const Vec3& odom_step_m, double speed_sigma_mps, bool stands, double dt_s) noexcept;

  // The foot is known to rest from now on, whatever it did before.
  void rest(std::size_t foot) noexcept { feet_[foot] = {}; }

  // Random walk of the contact that its motion stands for, m^2/s, 0 at rest.
  [[nodiscard]] double walk_m2ps(std::size_t foot) const noexcept { return feet_[foot].walk_m2ps; }
  // White noise of one foot position, per axis, measured from its jitter.
  [[nodiscard]] double position_sigma_m() const noexcept { return noise_m_.sigma(); }

 private:
  struct Track {
    Vec3 odom_v_mps = Vec3::Zero();
    Vec3 last_step_m = Vec3::Zero();
    double walk_m2ps = 0.0;
    bool has_step = false;
  };

  Params params_;
  std::array<Track, kFootCount> feet_{};
  NoiseLevel noise_m_;
};

}  // namespace polygmap
