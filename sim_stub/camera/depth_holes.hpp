// SPDX-License-Identifier: Apache-2.0
// Pixels without depth for what they show: dark and shiny treads, strips along the nosings, sunlight, glass.
#pragma once

#include <cstdint>
#include <vector>

#include "sim_stub/camera/camera_errors.hpp"
#include "sim_stub/camera/counter_noise.hpp"
#include "sim_stub/camera/depth_renderer.hpp"
#include "sim_stub/world/stair_world.hpp"

namespace polygmap::sim {

class DepthHoles {
 public:
  DepthHoles(const CameraErrors& errors, const StairWorld& world, std::uint64_t seed);

  // Takes the depth from such pixels of a picture that was rendered from first to last.
  void apply(const DepthRenderer& picture, const DepthScene& first, const DepthScene& last, std::uint64_t frame,
             std::uint16_t* depth) const;

 private:
  struct Tread {
    Transform step_T_true;
    Step step;
    bool holed;  // dark and shiny
  };
  class Draws;
  // True for a point of the step's frame, no higher than the tread, that is of the tread or of its worn nosing.
  [[nodiscard]] bool is_on(const Step& step, const Vec3& step_p_m) const;
  // True for a point on the tread that gives no depth, seen by the pixel (u, v).
  [[nodiscard]] bool is_lost(const Tread& tread, const Vec3& step_p_m, int u, int v, Draws& draws) const;

  CameraErrors errors_;
  CounterNoise noise_;
  std::vector<Tread> treads_;
  std::vector<OrientedBox> glass_;
  double lowest_m_ = 1e9;  // of the treads' tops
  Vec3 sun_place_m_ = Vec3::Zero(), sun_ray_ = Vec3::UnitZ();
};

}  // namespace polygmap::sim
