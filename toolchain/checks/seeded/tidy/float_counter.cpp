// SPDX-License-Identifier: Apache-2.0
// expect: cert-flp30-c
double careless() noexcept {
  double sum = 0.0;
  for (float x = 0.0F; x < 1.0F; x += 0.1F) sum += static_cast<double>(x);
  return sum;
}
