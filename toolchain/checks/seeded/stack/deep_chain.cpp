// SPDX-License-Identifier: Apache-2.0
// expect: a chain of calls of [0-9]{5} bytes
void touch(char* p) noexcept;
template <int kDepth>
__attribute__((noinline)) void careless(char* p) noexcept {
  char frame[6000];
  touch(frame);
  if constexpr (kDepth > 0) careless<kDepth - 1>(frame);
  touch(p);
}
template void careless<6>(char* p) noexcept;
