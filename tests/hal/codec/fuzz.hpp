// SPDX-License-Identifier: Apache-2.0
// Bytes that a decoder may meet: random ones, and good packets with a few bytes changed, cut or added.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <span>
#include <vector>

namespace polygmap::test {

// Calls decode(std::span<const std::uint8_t>) with `runs` inputs, each in memory of exactly its size, so that
// AddressSanitizer sees one byte too far.
template <typename Decode>
void fuzz(std::span<const std::uint8_t> good, int runs, unsigned seed, Decode&& decode) {
  std::mt19937_64 random(seed);
  std::vector<std::uint8_t> bytes;
  for (int run = 0; run < runs; ++run) {
    if (run % 4 == 0) {
      bytes.resize(random() % (2 * good.size()));
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    } else {
      bytes.assign(good.begin(), good.end());
      for (std::uint64_t changes = random() % 4; changes > 0; --changes) {
        bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
      }
      if (run % 4 == 2) bytes.resize(random() % (2 * good.size()), static_cast<std::uint8_t>(random()));
    }
    const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), exact.get());
    decode(std::span<const std::uint8_t>(exact.get(), bytes.size()));
  }
}

}  // namespace polygmap::test
