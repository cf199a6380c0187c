// SPDX-License-Identifier: Apache-2.0
// expect: signed integer overflow
#include <climits>
int main(int argc, char**) {
  volatile int n = INT_MAX;
  return n + argc > 0;
}
