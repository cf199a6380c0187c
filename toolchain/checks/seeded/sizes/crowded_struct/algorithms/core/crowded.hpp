// SPDX-License-Identifier: Apache-2.0
// expect: Search::Params: has 21 data members
#pragma once
class Search {
 public:
  struct Params {
    struct Limits {
      double least = 0.0, most = 1.0;
    };
    double a = 0.0, b = 0.0, c = 0.0, d = 0.0, e = 0.0, f = 0.0, g = 0.0, h = 0.0, i = 0.0, j = 0.0;
    double k = 0.0, l = 0.0, m = 0.0, n = 0.0, o = 0.0, p = 0.0, q = 0.0, r = 0.0, s = 0.0, t = 0.0;
    Limits limits;  // the last one too many

    static void visit(auto& x, auto& field) { field("a", x.a, 0.0, 1.0, "A."); }
  };

 private:
  Params params_;
};
