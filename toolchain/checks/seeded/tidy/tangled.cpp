// SPDX-License-Identifier: Apache-2.0
// expect: readability-function-cognitive-complexity
int careless(int a, int b, int c) noexcept {
  int n = 0;
  for (int i = 0; i < a; ++i) {
    for (int j = 0; j < b; ++j) {
      if (i != j) {
        for (int k = 0; k < c; ++k) {
          if (i + j > k) {
            if (k > 2 && i > 1) {
              n += i;
            } else if (j > 3 || k > i) {
              n += j;
            } else {
              n -= k;
            }
            if (n > 100) {
              if (n % 2 == 0 || n % 3 == 0) n -= 7;
              if (n % 5 == 0) n += 11;
              for (int m = 0; m < n; ++m) {
                if (m % 7 == 3 && n > k) n -= m;
                while (n > 1000) n /= 2;
              }
            }
          }
        }
      }
    }
  }
  return n;
}
