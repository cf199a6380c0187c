// SPDX-License-Identifier: Apache-2.0
// expect: algorithms/gait/footsteps may not include algorithms/gait/trajectories
#include "algorithms/gait/trajectories/swing.hpp"
