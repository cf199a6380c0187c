// SPDX-License-Identifier: Apache-2.0
// expect: error: gone is recorded, but was not run
// A stage that nobody runs any more is no improvement.
#include <cstdio>

static volatile int sink;

[[gnu::noinline]] void stage_loop() {
  for (int i = 0; i < 1000; ++i) sink = i;
}

int main() {
  stage_loop();
  std::puts("build seeded\nruns 1");
}
