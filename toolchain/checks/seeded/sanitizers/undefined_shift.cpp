// SPDX-License-Identifier: Apache-2.0
// expect: shift exponent
int main(int argc, char**) {
  volatile int n = 40;
  return argc << n;
}
