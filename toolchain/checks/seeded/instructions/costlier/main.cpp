// SPDX-License-Identifier: Apache-2.0
// expect: error: loop [\d,]+, \+\d+\.\d% of its record 1,000
// A stage that has become dearer than its record: a store and a branch a thousand times, whatever the compiler.
#include <cstdio>

static volatile int sink;

[[gnu::noinline]] void stage_loop() {
  for (int i = 0; i < 1000; ++i) sink = i;
}

int main() {
  stage_loop();
  std::puts("build seeded\nruns 1");
}
