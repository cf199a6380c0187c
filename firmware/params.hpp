// SPDX-License-Identifier: Apache-2.0
// The robot and every stage's parameters, in one place.
#pragma once

#include "algorithms/estimation/estimator.hpp"
#include "algorithms/foothold/foothold_search.hpp"
#include "algorithms/gait/gait.hpp"
#include "algorithms/perception/extrinsics/camera_extrinsics.hpp"
#include "algorithms/perception/map/polygon_map.hpp"
#include "algorithms/perception/surface_extractor.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

struct Params {
  RobotModel robot;
  Estimator::Params estimator;
  SurfaceExtractor::Params surfaces;
  CameraExtrinsicsEstimator::Params mount;
  PolygonMap::Params map;
  FootholdSearch::Params footholds;
  Gait::Params gait;
  bool estimate_mount = true;
  bool self_filter = true;              // false only to show what the camera then takes for ground
  BodyUncertainty body;                 // of the robot's own shapes
  double tread_height_sigma_m = 0.004;  // of a mapped tread under a foot that has just landed on it
};

}  // namespace polygmap
