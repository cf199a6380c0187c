// SPDX-License-Identifier: Apache-2.0
// A width of zero.
// expect: a raster without cells is a mistake
#include "algorithms/core/containers/raster.hpp"

#ifdef POSITIVE_CONTROL
polygmap::Raster<int, 1, 4> r;
#else
polygmap::Raster<int, 0, 4> r;
#endif
