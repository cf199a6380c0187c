// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/record/zstd_chunks.hpp"

#include <zstd.h>

namespace polygmap::sim {

mcap::McapReader::Decompress zstd_decompress() {
  return [](std::string_view compression, std::span<const std::byte> from, std::span<std::byte> to) {
    return compression == "zstd" && ZSTD_decompress(to.data(), to.size(), from.data(), from.size()) == to.size();
  };
}

std::vector<std::byte> zstd_compressed(std::span<const std::byte> bytes) {
  constexpr int kLevel = 3;
  std::vector<std::byte> packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kLevel);
  packed.resize(ZSTD_isError(size) != 0 ? 0 : size);
  return packed;
}

}  // namespace polygmap::sim
