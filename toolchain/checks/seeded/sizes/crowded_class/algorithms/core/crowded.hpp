// SPDX-License-Identifier: Apache-2.0
// expect: Everything::Inner: has 21 data members
#pragma once
#include <array>
class Everything {
 public:
  Everything() noexcept : a_{1.0}, b_(2.0) {}
  [[nodiscard]] double sum() const noexcept { return a_ + b_; }

 private:
  class Inner {
    static constexpr int kNone = 0;
    struct Pair {
      int left = 0, right = 0;
    };
    int a_ = 0, b_ = 1, c_{2}, d_ = 0, e_ = 0, f_ = 0, g_ = 0, h_ = 0, i_ = 0, j_ = 0;
    std::array<std::array<int, 3>, 2> k_{}, l_{{{1, 2, 3}, {4, 5, 6}}};
    int m_ = 0, n_ = 0, o_ = 0, p_ = 0, q_ = 0, r_ = 0, s_ = 0;
    Pair t_{1, 2};
    bool v_ = false;
  };
  double a_, b_;
  Inner inner_;
};
