// SPDX-License-Identifier: Apache-2.0
// Marks of pieces of work for toolchain/checks/pieces: a system call that no kernel has, which its plugin sees.
#pragma once

#include <unistd.h>

#include <cstdint>

namespace polygmap::bench {

inline constexpr long kPieceMarker = 77777;
inline void piece_begins() { static_cast<void>(syscall(kPieceMarker, 0L, 0L, 0L)); }
inline void piece_ends(std::int64_t label, std::int64_t units) {
  static_cast<void>(syscall(kPieceMarker, 1L, label, units));
}

}  // namespace polygmap::bench
