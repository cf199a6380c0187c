// SPDX-License-Identifier: Apache-2.0
// expect: firmware may not include sim_stub
#include "sim_stub/stair_world.hpp"
