// SPDX-License-Identifier: Apache-2.0
// Chunks of MCAP files compressed by zstd, as `polygmap pack` leaves them. Host only: no codec is in the module.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "firmware/recording/mcap/mcap_reader.hpp"

namespace polygmap::sim {

[[nodiscard]] mcap::McapReader::Decompress zstd_decompress();
// Empty when it cannot be.
[[nodiscard]] std::vector<std::byte> zstd_compressed(std::span<const std::byte> bytes);

}  // namespace polygmap::sim
