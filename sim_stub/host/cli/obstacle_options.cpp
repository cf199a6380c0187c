// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/obstacle_options.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>

#include "sim_stub/host/cli/command_words.hpp"

namespace polygmap::sim {
namespace {

constexpr double kFarthest_m = 100.0, kSmallest_m = 0.005;

// Six numbers: middle and size. False, and out untouched, when the text is anything else.
bool read_obstacle(const std::string& text, Obstacle& out) {
  std::array<double, 6> v{};
  int end = 0;
  const int read =
      std::sscanf(text.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf%n", &v[0], &v[1], &v[2], &v[3], &v[4], &v[5], &end);
  if (read != 6 || end != static_cast<int>(text.size())) return false;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!(std::abs(v[i]) <= kFarthest_m) || (i >= 3 && v[i] < kSmallest_m)) return false;
  }
  out = {Vec3{v[0], v[1], v[2]}, Vec3{v[3], v[4], v[5]}};
  return true;
}

}  // namespace

void declare_obstacles(CLI::App& climb, StairParams& stairs) {
  keep_within(*climb.add_option("--balusters", stairs.balusters.spacing_m,
                                "Posts along both edges of the stairs, this far apart, m"),
              0.05, 2.0, "m");
  keep_within(*climb
                   .add_option("--baluster-inset", stairs.balusters.inset_m,
                               "From the edge of the stairs to a post, m; negative: the posts stand beside the stairs")
                   ->capture_default_str(),
              -1.0, 1.0, "m");
  keep_within(*climb.add_option("--baluster-size", stairs.balusters.size_m, "Side of a post, m")->capture_default_str(),
              0.01, 0.3, "m");
  keep_among(*climb.add_option_function<std::string>(
                 "--baluster-side",
                 [&stairs](const std::string& side) {
                   stairs.balusters.left = side != "right";
                   stairs.balusters.right = side != "left";
                 },
                 "Where the posts stand"),
             {"both", "left", "right"});
  climb
      .add_option_function<std::vector<std::string>>(
          "--obstacle",
          [&stairs](const std::vector<std::string>& boxes) {
            for (const std::string& box : boxes) {
              if (Obstacle read; read_obstacle(box, read)) stairs.obstacles.push_back(read);
            }
          },
          "A box, X,Y,Z,LENGTH,WIDTH,HEIGHT: middle and size, m; x up the stairs from the first riser, y left; each "
          "from -" +
              number(kFarthest_m) + " to " + number(kFarthest_m) + ", sizes from " + number(kSmallest_m))
      ->type_name("X,Y,Z,L,W,H")
      ->check([](const std::string& box) -> std::string {
        Obstacle read;
        if (read_obstacle(box, read)) return {};
        return "must be six numbers, X,Y,Z,LENGTH,WIDTH,HEIGHT in m, each from -" + number(kFarthest_m) + " to " +
               number(kFarthest_m) + " and sizes from " + number(kSmallest_m) + ", not \"" + box + "\"";
      });
}

}  // namespace polygmap::sim
