// SPDX-License-Identifier: Apache-2.0
// One stage, run against the records in instructions/: a store and a branch a thousand times, whatever the compiler.
#include <cstdio>

static volatile int sink;

[[gnu::noinline]] void stage_loop() {
  for (int i = 0; i < 1000; ++i) sink = i;
}

int main() {
  stage_loop();
  std::puts("build seeded narrow\nruns 1");
}
