// SPDX-License-Identifier: Apache-2.0
// Every stage's parameters and the robot's mounts, in one place.
#pragma once

#include "algorithms/estimation/estimator.hpp"
#include "algorithms/foothold/foothold_search.hpp"
#include "algorithms/gait/gait.hpp"
#include "algorithms/perception/extrinsics/camera_extrinsics.hpp"
#include "algorithms/perception/map/polygon_map.hpp"
#include "algorithms/perception/surface_extractor.hpp"
#include "algorithms/robot/model.hpp"

namespace polygmap {

struct Params {
  Estimator::Params estimator;
  SurfaceExtractor::Params surfaces;
  CameraExtrinsicsEstimator::Params mount;
  PolygonMap::Params map;
  FootholdSearch::Params footholds;
  Gait::Params gait;
  LegGeometry legs;
  Transform base_T_camera = polygmap::base_T_camera();  // as the data sheet says
  bool estimate_mount = true;
  bool self_filter = true;              // false only to show what the camera then takes for ground
  BodyUncertainty body;                 // of the robot's own shapes
  double tread_height_sigma_m = 0.004;  // of a mapped tread under a foot that has just landed on it
};

}  // namespace polygmap
