// SPDX-License-Identifier: Apache-2.0
// expect: algorithms/core may not include algorithms/robot
#include "algorithms/robot/model.hpp"
