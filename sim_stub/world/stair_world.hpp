// SPDX-License-Identifier: Apache-2.0
// The true staircase of the simulation, or the world of a file (world_file.hpp). True world frame: z up, level floor at
// z = 0; of a staircase x up the stairs, y left, the first riser at x = 0, the middle at y = 0.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/robot/body_shapes.hpp"

namespace polygmap::sim {

// A box that stands on, beside or over the staircase, axis-aligned.
struct Obstacle {
  Vec3 centre_m = Vec3::Zero();
  Vec3 size_m = Vec3::Constant(0.3);
};

// Upright square posts along the edges of the staircase, one row on each side.
struct Balusters {
  double spacing_m = 0.0;  // between the middles of two posts; 0: no posts
  double inset_m = 0.02;   // from the edge of the tread to the post; negative: the posts stand beside the staircase
  double size_m = 0.04;    // side of a post
  double height_m = 0.9;   // above the tread
  bool left = true;
  bool right = true;
};

struct StairParams {
  int steps = 10;  // step N is the landing
  double rise_m = 0.13;
  double tread_m = 0.28;
  double width_m = 1.2;
  double nosing_m = 0.0;    // overhang of every tread's front edge over its riser
  double landing_m = 1.0;   // length of step N
  double jitter_m = 0.005;  // each step's rise and tread differ by up to this much
  Balusters balusters{};
  std::vector<Obstacle> obstacles{};
};

// How stairs that were built, and walked on for years, differ from their drawing.
struct StairErrors {
  double tread_slope_rad = 0.0;
  double tread_fall_rad = 0.0;
  double tread_cant_rad = 0.0;
  double tread_yaw_rad = 0.0;
  double rise_error_m = 0.0;
  double worn_nosing_m = 0.0;

  static void visit(auto& p, auto& field) {
    field("tread_slope_rad", p.tread_slope_rad, 0.0, 0.1, "Half range of each tread's slope along the stairs.");
    field("tread_fall_rad", p.tread_fall_rad, -0.1, 0.1, "By which every tread falls towards its nosing.");
    field("tread_cant_rad", p.tread_cant_rad, 0.0, 0.1, "Half range of each tread's slope across the stairs.");
    field("tread_yaw_rad", p.tread_yaw_rad, 0.0, 0.2, "Half range of each tread's turn about the vertical.");
    field("rise_error_m", p.rise_error_m, 0.0, 0.05, "Half range of each rise's error, beside --jitter.");
    field("worn_nosing_m", p.worn_nosing_m, 0.0, 0.02, "Radius to which every nosing is worn.");
  }
};

// A tread with a nosing is a slab of this thickness that overhangs its riser.
inline constexpr double kTreadSlab_m = 0.03;

inline constexpr int kFloorStep = -1;     // the floor among step indices
inline constexpr int kObstacleStep = -2;  // what is no step: posts, boxes

// A box along its own axes, with all that is nearer to it than round_m.
struct SolidBox {
  Vec3 min_m;
  Vec3 max_m;
  int step;
  Transform true_T_solid{};
  double round_m = 0.0;
  bool is_glass = false;  // it gives no depth, and nor does what is behind it

  [[nodiscard]] Vec3 half_m() const noexcept { return 0.5 * (max_m - min_m); }
  // About its middle, without what is round.
  [[nodiscard]] OrientedBox box() const noexcept {
    return {{true_T_solid.R, true_T_solid * Vec3(0.5 * (min_m + max_m))}, half_m()};
  }
};

// Step k (1-based in speech, index k - 1): a tread from its nosing to the next riser. Its numbers are along its own
// axes: those of the true world, turned about the middle of its nosing; of a world file's solid the solid's, about the
// middle of its top.
struct Step {
  double riser_x_m = 0.0;   // plane of the riser beneath the tread
  double nosing_x_m = 0.0;  // front edge of the tread: riser_x_m - nosing
  double back_x_m = 0.0;    // the next riser's plane; the landing's far end for step N
  double height_m = 0.0;
  double worn_m = 0.0;      // radius of the nosing
  double beneath_m = 0.0;   // how far it reaches beneath the next step, which is turned otherwise
  Transform true_T_step{};  // a level, square step has the true world's axes
  double half_width_m = 0.6;
  // Of a world file's solid: its name, whether it may be stood on, and which tops are one with it (kFloorStep: the
  // floor is).
  std::string name{};
  bool is_walkable = true;
  int group = 0;

  // Where the tread is flat from.
  [[nodiscard]] double edge_x_m() const noexcept { return nosing_x_m + worn_m; }
  // Where it carries a sole from, which gives by as much: a worn nosing has fallen by a millimetre there.
  [[nodiscard]] double carries_from_x_m() const noexcept {
    const double fallen_m = std::min(0.001, worn_m);
    return edge_x_m() - std::sqrt(worn_m * worn_m - (worn_m - fallen_m) * (worn_m - fallen_m));
  }
  [[nodiscard]] bool turned() const noexcept { return true_T_step.R != Mat3::Identity(); }
  // Of the tread's plane, at a place in the true world.
  [[nodiscard]] double top_m(double x_m, double y_m) const noexcept;
};

// Where somebody is to stand.
struct WorldPlace {
  double x_m = 0.0, y_m = 0.0;
  std::optional<double> yaw_rad;
  int step = kFloorStep;
};

struct StairWorld {
  // What can be stood on beside the floor: a staircase's from the lowest up, a world file's in its order.
  std::vector<Step> steps;
  double half_width_m = 0.6;
  std::vector<Obstacle> obstacles;  // posts among them; seen and collided with, never stood on
  // Of a world file alone: all that is seen and collided with, a step for each; and where the robot is to go.
  bool is_staircase = true;
  std::vector<SolidBox> solids;
  std::optional<WorldPlace> goal;

  // Whether who stands on the one stands on the other.
  [[nodiscard]] bool are_one(int a, int b) const noexcept {
    const auto group = [this](int step) {
      return step < 0 || is_staircase ? step : steps[static_cast<std::size_t>(step)].group;
    };
    return group(a) == group(b);
  }
  [[nodiscard]] Vec3 point_m(const WorldPlace& place) const noexcept {
    const bool is_floor = place.step < 0;
    return {place.x_m, place.y_m,
            is_floor ? 0.0 : steps[static_cast<std::size_t>(place.step)].top_m(place.x_m, place.y_m)};
  }
  // Of a staircase: height of the highest step at (x, y): 0 beside, before and behind the staircase. Index of its step
  // in *step
  // (-1: floor).
  [[nodiscard]] double height_m(double x_m, double y_m, int* step = nullptr) const noexcept;
};

// The staircase of one seed: what differs from step to step is drawn from the seed, nothing else.
[[nodiscard]] StairWorld make_stairs(const StairParams& params, std::uint64_t seed, const StairErrors& errors = {});

}  // namespace polygmap::sim
