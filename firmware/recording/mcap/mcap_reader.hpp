// SPDX-License-Identifier: Apache-2.0
// Reads MCAP from its beginning to its end, whether or not it has an index, and believes nothing unlooked at.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "firmware/recording/mcap/mcap_format.hpp"
#include "firmware/recording/stream/bytes.hpp"

namespace polygmap::mcap {

struct ChannelRead {
  std::string topic, schema, schema_text, encoding;
};
struct MessageRead {
  std::size_t channel = 0;  // of McapReader::channels()
  std::uint32_t sequence = 0;
  std::int64_t log_ns = 0, publish_ns = 0;
  std::span<const std::byte> data;  // until the next call
  std::uint64_t place = 0;          // of the chunk that has it, bytes from the file's beginning
};

class McapReader {
 public:
  enum class Found : std::uint8_t {
    kMessage,
    kEnd,  // of a finished file
    kCut,  // the file ends before its end: what came is good
    kBad,  // complaint() says where and why
  };
  // Makes `to` what was compressed; false when it cannot. The compression's name is the file's.
  using Decompress =
      std::function<bool(std::string_view compression, std::span<const std::byte> from, std::span<std::byte> to)>;
  // A chunk, compressed or not, is no larger: readers stay within 100 MB.
  static constexpr std::uint64_t kMaxChunk_bytes = 32U * 1024U * 1024U;
  static constexpr std::uint64_t kMaxSmallRecord_bytes = 1024U * 1024U;
  static constexpr std::size_t kMaxChannelsRead = 1024;

  explicit McapReader(Decompress decompress = {}) : decompress_(std::move(decompress)) {}
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;
  ~McapReader();

  // False, and complaint(), when the file is none.
  [[nodiscard]] bool open(const std::string& path);
  // Of a file that is open, and becomes this one's. name: what it is called in sentences.
  [[nodiscard]] bool open(const std::string& name, std::FILE* file);
  [[nodiscard]] Found next(MessageRead& message);
  [[nodiscard]] const std::vector<ChannelRead>& channels() const noexcept { return channels_; }
  // Of the metadata record "polygmap", as far as it was read: empty when there is none.
  [[nodiscard]] const std::string& run() const noexcept { return run_; }
  // The same before the first message.
  [[nodiscard]] const std::string& read_run();
  // A chunk's bytes were not those that were written: the CRC of the last one read says so. Its messages are read all
  // the same, so that whoever knows them may find the one.
  [[nodiscard]] bool is_damaged() const noexcept { return !damage_.empty(); }
  // One sentence about the first damaged chunk.
  [[nodiscard]] const std::string& damage() const noexcept { return damage_; }
  [[nodiscard]] const std::string& complaint() const noexcept { return complaint_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // Of the chunk that has the message read last.
  [[nodiscard]] std::uint64_t chunk_place() const noexcept { return chunk_place_; }

 private:
  using ByteReader = recording::ByteReader;
  enum class Loaded : std::uint8_t { kYes, kCut, kBad };

  Found complain_at(std::uint64_t place, const std::string& what);
  // A record of the top level: its content is in record_; one that nobody needs is passed over.
  [[nodiscard]] Loaded load_record(Opcode& opcode, std::uint64_t& begin);
  [[nodiscard]] Loaded load(std::vector<std::byte>& into, std::uint64_t count);
  [[nodiscard]] bool read_channel(ByteReader in);
  [[nodiscard]] bool read_schema(ByteReader in);
  void read_metadata(ByteReader in);
  [[nodiscard]] Found read_record();
  [[nodiscard]] Found read_chunk(std::uint64_t begin);
  [[nodiscard]] Found next_in_chunk(MessageRead& message);

  Decompress decompress_;
  std::string name_, complaint_, damage_, run_;
  std::FILE* file_ = nullptr;
  std::uint64_t place_ = 0;  // of the next byte
  std::vector<std::byte> record_, chunk_memory_;
  std::span<const std::byte> chunk_;  // what is left of its messages
  std::uint64_t chunk_place_ = 0;
  struct Schema {
    std::uint16_t id = 0;
    std::string name, text;
  };
  std::vector<Schema> schemas_;
  std::vector<ChannelRead> channels_;
  std::vector<std::uint16_t> channel_ids_;
};

}  // namespace polygmap::mcap
