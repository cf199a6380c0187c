// SPDX-License-Identifier: Apache-2.0
// expect: data race
#include <thread>
int shared_count = 0;
int main() {
  std::thread other([] {
    for (int i = 0; i < 1000; ++i) ++shared_count;
  });
  for (int i = 0; i < 1000; ++i) ++shared_count;
  other.join();
  return shared_count == 0;
}
