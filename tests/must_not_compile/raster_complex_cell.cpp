// SPDX-License-Identifier: Apache-2.0
// Cells are filled and copied as memory.
// expect: cells are plain values
#include "algorithms/core/containers/raster.hpp"

struct Cell {
#ifndef POSITIVE_CONTROL
  Cell(const Cell&) {}
  Cell() {}
#endif
};
polygmap::Raster<Cell, 2, 2> r;
