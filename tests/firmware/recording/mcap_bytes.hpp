// SPDX-License-Identifier: Apache-2.0
// An MCAP file in memory, walked by what its specification says and by none of the product's code: for tests that look
// where things are, and that change them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "firmware/recording/mcap/crc32.hpp"

namespace polygmap::mcap_bytes {

using Bytes = std::vector<std::byte>;

template <class T>
T number_at(std::span<const std::byte> bytes, std::size_t at) {
  T value{};
  if (at + sizeof value <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}
inline std::string text_at(std::span<const std::byte> bytes, std::size_t at) {
  const auto length = number_at<std::uint32_t>(bytes, at);
  if (at + 4 + length > bytes.size()) return {};
  return {reinterpret_cast<const char*>(bytes.data() + at + 4), length};
}

enum : std::uint8_t {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kDataEnd = 0x0F,
};
struct RecordPlace {
  std::uint8_t opcode = 0;
  std::size_t begin = 0;    // of its opcode
  std::size_t content = 0;  // behind its length
  std::size_t size = 0;     // of the content
};
// Of the top level from there on, as far as they are whole.
inline std::vector<RecordPlace> records_of(std::span<const std::byte> file, std::size_t from = 8) {
  std::vector<RecordPlace> records;
  for (std::size_t at = from; at + 9 <= file.size();) {
    const auto length = number_at<std::uint64_t>(file, at + 1);
    if (length > file.size() - at - 9) break;
    records.push_back({static_cast<std::uint8_t>(file[at]), at, at + 9, static_cast<std::size_t>(length)});
    at += 9 + static_cast<std::size_t>(length);
  }
  return records;
}

struct MessagePlace {
  std::string topic;
  std::int64_t log_ns = 0;
  std::size_t chunk = 0;  // its record's content
  std::size_t begin = 0;  // of the message's record
  std::size_t data = 0, size = 0;
};
inline constexpr std::size_t kChunkCrc = 24, kChunkRecords = 40;  // in a chunk's content, not compressed

inline std::vector<MessagePlace> messages_of(std::span<const std::byte> file) {
  std::map<std::uint16_t, std::string> topics;
  std::vector<MessagePlace> messages;
  for (const RecordPlace& record : records_of(file)) {
    if (record.opcode == kChannel)
      topics[number_at<std::uint16_t>(file, record.content)] = text_at(file, record.content + 4);
    if (record.opcode != kChunk) continue;
    const std::span<const std::byte> chunk = file.first(record.content + record.size);
    for (const RecordPlace& inner : records_of(chunk, record.content + kChunkRecords)) {
      if (inner.opcode != kMessage) continue;
      messages.push_back({topics[number_at<std::uint16_t>(file, inner.content)],
                          number_at<std::int64_t>(file, inner.content + 6), record.content, inner.begin,
                          inner.content + 22, inner.size - 22});
    }
  }
  return messages;
}

inline void flip_bit(Bytes& file, std::size_t byte, std::uint64_t bit) { file[byte] ^= std::byte{1} << (bit % 8); }
// So that the chunk looks whole.
inline void repair_crc(Bytes& file, std::size_t chunk) {
  const auto size = number_at<std::uint64_t>(file, chunk + 32);
  const std::uint32_t crc = mcap::Crc32::of(std::span<const std::byte>(file).subspan(chunk + kChunkRecords, size));
  std::memcpy(file.data() + chunk + kChunkCrc, &crc, sizeof crc);
}

}  // namespace polygmap::mcap_bytes
