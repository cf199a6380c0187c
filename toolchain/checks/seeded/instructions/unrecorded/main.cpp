// SPDX-License-Identifier: Apache-2.0
// expect: error: loop is not recorded
// A stage without a record would never fail.
#include <cstdio>

static volatile int sink;

[[gnu::noinline]] void stage_loop() {
  for (int i = 0; i < 1000; ++i) sink = i;
}

int main() {
  stage_loop();
  std::puts("build seeded\nruns 1");
}
