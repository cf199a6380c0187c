// SPDX-License-Identifier: Apache-2.0
// expect: a parameter is listed under the name of its field
#pragma once
struct Params {
  double gain = 1.0;
  static void visit(auto& p, auto& field) { field("again", p.gain, 0.0, 2.0, "Gain."); }
};
