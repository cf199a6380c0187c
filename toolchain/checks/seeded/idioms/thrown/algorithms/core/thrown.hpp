// SPDX-License-Identifier: Apache-2.0
// expect: 'throw'
#pragma once
inline void f(bool bad) {
  if (bad) throw 1;
}
