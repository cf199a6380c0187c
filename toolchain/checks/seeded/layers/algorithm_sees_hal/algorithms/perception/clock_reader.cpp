// SPDX-License-Identifier: Apache-2.0
// expect: algorithms/perception may not include hal/ports
#include "hal/ports/clock.hpp"
