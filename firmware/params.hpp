// SPDX-License-Identifier: Apache-2.0
// The robot and every stage's parameters, in one place.
#pragma once

#include "algorithms/estimation/calibration/stance_check.hpp"
#include "algorithms/estimation/estimator.hpp"
#include "algorithms/foothold/foothold_search.hpp"
#include "algorithms/gait/gait.hpp"
#include "algorithms/perception/extrinsics/camera_extrinsics.hpp"
#include "algorithms/perception/extrinsics/way_scale.hpp"
#include "algorithms/perception/image/picture_monitor.hpp"
#include "algorithms/perception/map/polygon_map.hpp"
#include "algorithms/perception/surface_extractor.hpp"
#include "algorithms/robot/robot_model.hpp"
#include "firmware/hand_over.hpp"
#include "firmware/overload_guard.hpp"
#include "firmware/supervisor.hpp"
#include "scheduler/schedule_table.hpp"

namespace polygmap {

struct Params {
  RobotModel robot;
  Estimator::Params estimator;
  SurfaceExtractor::Params surfaces;
  PictureMonitor::Params pictures;
  CameraExtrinsicsEstimator::Params mount;
  PolygonMap::Params map;
  WayScale::Params way;
  FootholdSearch::Params footholds;
  Gait::Params gait;
  bool estimate_mount = true;
  bool self_filter = true;
  BodyUncertainty body;
  OverloadGuard::Params overload;
  Supervisor::Params supervisor;
  HandOver::Params hand_over;
  StanceCheck::Params stance;
  double tread_height_sigma_m = 0.004;
  std::int64_t imu_interval_ns = kCycle_ns;

  // Of the parameters' table, firmware/config/param_table.hpp.
  static void visit(auto& p, auto& field) {
    field("robot", p.robot);
    field("estimator", p.estimator);
    field("surfaces", p.surfaces);
    field("pictures", p.pictures);
    field("mount", p.mount);
    field("map", p.map);
    field("way", p.way);
    field("footholds", p.footholds);
    field("gait", p.gait);
    field("estimate_mount", p.estimate_mount, "The mount is estimated, starting from the data sheet.");
    field("self_filter", p.self_filter,
          "The robot's own legs are masked; false only shows what is taken for ground then.");
    field("body", p.body);
    field("overload", p.overload);
    field("supervisor", p.supervisor);
    field("hand_over", p.hand_over);
    field("stance", p.stance);
    field("tread_height_sigma_m", p.tread_height_sigma_m, 1e-5, 0.1,
          "Height of a mapped tread under a foot that has just landed on it.");
    // A cycle reads four samples, and nothing is steered by one of 20 ms ago (gait.steer_age_ns): half of that for
    // either.
    field("imu_interval_ns", p.imu_interval_ns, 1'000'000, 10'000'000,
          "From one sample of the IMU to the next; when one is missing is judged by it.");
  }
};

}  // namespace polygmap
