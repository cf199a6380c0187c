// SPDX-License-Identifier: Apache-2.0
// What compiled this and for which vectors: instructions are counted of a build.
#pragma once

#include <string>

namespace polygmap::bench {

[[nodiscard]] inline std::string build_name() {
#if defined(__clang__)
  const std::string compiler;  // says its name itself
#else
  const std::string compiler = "g++ ";
#endif
#if defined(__AVX2__)
  return compiler + __VERSION__ + " avx2";
#else
  return compiler + __VERSION__ + " sse2";
#endif
}

}  // namespace polygmap::bench
