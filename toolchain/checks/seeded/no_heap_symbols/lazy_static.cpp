// SPDX-License-Identifier: Apache-2.0
// expect: '__cxa_guard_acquire'.*first use
int measure() noexcept;
int careless() noexcept {
  static const int value = measure();
  return value;
}
int measure() noexcept { return 1; }
