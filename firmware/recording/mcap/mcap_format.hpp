// SPDX-License-Identifier: Apache-2.0
// The container of recordings: MCAP (https://mcap.dev/spec), chunked, indexed, not compressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace polygmap::mcap {

inline constexpr std::string_view kMagic = "\x89MCAP0\r\n";
enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};
// In front of each record: its opcode and the length of the rest.
inline constexpr std::size_t kRecordHead_bytes = 1 + 8;
// Of a message, before its data: channel, sequence, log time, publish time.
inline constexpr std::size_t kMessageHead_bytes = 2 + 4 + 8 + 8;

// What a message may be at most, for readers, too: a picture of the largest camera fits.
inline constexpr std::size_t kMaxMessage_bytes = 8U * 1024U * 1024U;

}  // namespace polygmap::mcap
