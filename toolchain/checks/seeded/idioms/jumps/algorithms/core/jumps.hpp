// SPDX-License-Identifier: Apache-2.0
// expect: 'goto'
#pragma once
inline int f(int a) noexcept {
  if (a > 0) goto end;
  a = -a;
end:
  return a;
}
