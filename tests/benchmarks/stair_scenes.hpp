// SPDX-License-Identifier: Apache-2.0
// What benchmarks run on: depth frames of the robot on its way up simulated stairs, always the same ones.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/foothold/foothold_search.hpp"
#include "algorithms/perception/map/polygon_map.hpp"
#include "algorithms/perception/surface_extractor.hpp"

namespace polygmap::bench {

struct StairScene {
  std::vector<std::uint16_t> depth;  // of the robot's camera
  SurfaceExtractor::View view;
  PolygonMap::View map_view;
  FootholdSearch::Query query;  // but for the time
};

// Six places on six staircases, white and correlated noise in turn, both feet down or one leg in the picture.
[[nodiscard]] std::vector<StairScene> stair_scenes();

}  // namespace polygmap::bench
