// SPDX-License-Identifier: Apache-2.0
// expect: a piece 1 takes .* instructions and pays for 1,000
#include "tests/benchmarks/piece_marker.hpp"

int main() {
  using namespace polygmap::bench;
  piece_begins();
  piece_ends(0, 0);
  volatile int sum = 0;
  piece_begins();
  for (int i = 0; i < 1000; ++i) sum = sum + i;
  piece_ends(1, 10);
  return 0;
}
