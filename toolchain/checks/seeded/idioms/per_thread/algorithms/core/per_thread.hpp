// SPDX-License-Identifier: Apache-2.0
// expect: 'thread_local'
#pragma once
inline int f() noexcept {
  thread_local int calls = 0;
  return ++calls;
}
