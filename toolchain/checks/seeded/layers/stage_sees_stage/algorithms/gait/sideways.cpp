// SPDX-License-Identifier: Apache-2.0
// expect: algorithms/gait may not include algorithms/foothold
#include "algorithms/foothold/search.hpp"
