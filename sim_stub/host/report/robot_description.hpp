// SPDX-License-Identifier: Apache-2.0
// A robot's legs as a tree of joints with shapes on them, for the report's page (page/DATA.md).
#pragma once

#include "algorithms/robot/robot_model.hpp"
#include "sim_stub/host/report/report_blocks.hpp"

namespace polygmap::sim {

[[nodiscard]] ReportJson robot_json(const RobotModel& robot);

}  // namespace polygmap::sim
