// SPDX-License-Identifier: Apache-2.0
// Writes MCAP from memory of a fixed size: no heap, no C library buffers. On one thread, that may wait for a disk.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "algorithms/core/containers/static_vector.hpp"
#include "firmware/recording/mcap/crc32.hpp"
#include "firmware/recording/mcap/mcap_format.hpp"
#include "firmware/recording/stream/bytes.hpp"

namespace polygmap::mcap {

struct Channel {
  std::string_view topic, schema_name, schema_text;  // ros2msg; messages are CDR
};

using ByteWriter = recording::ByteWriter;

inline constexpr std::size_t kMaxChannels = 24;
struct ChunkEntry {  // where a chunk is; the lengths of its message indexes follow from the counts
  std::uint64_t begin = 0;
  std::uint32_t records_bytes = 0, stored_bytes = 0;  // as they are, and in the file
  std::int64_t first_ns = 0, last_ns = 0;
  std::array<std::uint16_t, kMaxChannels> counts{};
};
struct MessageEntry {
  std::int64_t log_ns = 0;
  std::uint32_t offset = 0;
  std::uint16_t channel = 0;
};

// A chunk is closed when it is full or spans kChunk_ns: so much is lost at most when the program is killed. A file
// whose index is full is finished, and the next one is begun beside it: run.mcap, run-1.mcap, run-2.mcap.
class McapWriter {
 public:
  static constexpr std::size_t kMaxChunks = 4096;  // of a file
  static constexpr std::size_t kChunk_bytes = 448U * 1024U;
  static constexpr std::size_t kMaxChunkMessages = 4096;
  static constexpr std::int64_t kChunk_ns = 400'000'000;
  static constexpr std::size_t kMaxPath = 512;

  // Compresses a chunk's messages, given in two parts; where that does not make them fewer it answers none. What it
  // answers stays until its next call. Off the robot: no codec belongs on its cores.
  struct Compressor {
    std::string_view name;  // as MCAP has it: zstd
    std::span<const std::byte> (*compress)(void* of, std::span<const std::byte> records,
                                           std::span<const std::byte> more) = nullptr;
    void* of = nullptr;
  };

  McapWriter() = default;
  explicit McapWriter(const Compressor& compressor) noexcept : compressor_(compressor) {}
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;
  ~McapWriter();

  // Makes the first file. channels: numbered by their places; they, and the texts in them, outlive this. run: a number
  // that all files of this run have and no other run's.
  [[nodiscard]] bool open(std::string_view path, std::span<const Channel> channels, std::uint64_t run) noexcept;
  // A message of at most half a chunk; a longer one is refused.
  [[nodiscard]] bool write(std::size_t channel, std::int64_t log_ns, std::int64_t publish_ns,
                           std::span<const std::byte> data) noexcept;
  // A message in a chunk of its own, its data in two parts, written from where they lie.
  [[nodiscard]] bool write_alone(std::size_t channel, std::int64_t log_ns, std::int64_t publish_ns,
                                 std::span<const std::byte> head, std::span<const std::byte> body) noexcept;
  // Closes the chunk, so that a reader finds all of it.
  [[nodiscard]] bool flush() noexcept;
  // Index, statistics, end.
  [[nodiscard]] bool close() noexcept;

  // Of the first call that failed; 0: none did.
  [[nodiscard]] int error() const noexcept { return errno_; }
  // The file being written, or that could not be.
  [[nodiscard]] const char* path() const noexcept { return path_.data(); }
  // Of the file before a number is put into its name, for run.mcap: run-2.mcap.
  [[nodiscard]] static bool path_of_part(std::string_view first, unsigned part, std::span<char> path) noexcept;

 private:
  [[nodiscard]] bool begin_file() noexcept;
  [[nodiscard]] bool end_file() noexcept;
  [[nodiscard]] std::size_t schema_of(std::size_t channel) const noexcept;
  void put_schemas_and_channels(ByteWriter& out) const noexcept;
  void put_statistics(ByteWriter& out) const noexcept;
  void put_chunk_index(ByteWriter& out, const ChunkEntry& chunk) const noexcept;
  [[nodiscard]] bool put_summary() noexcept;
  [[nodiscard]] bool put_indexes() noexcept;
  [[nodiscard]] bool end_chunk(std::span<const std::byte> records, std::span<const std::byte> more) noexcept;
  void note_message(std::size_t channel, std::int64_t log_ns, std::size_t offset) noexcept;
  [[nodiscard]] bool put(std::span<const std::byte> bytes) noexcept;
  [[nodiscard]] bool put(const ByteWriter& bytes) noexcept { return put(bytes.bytes()); }
  [[nodiscard]] bool fail(int error) noexcept;

  Compressor compressor_;
  int file_ = -1;
  int errno_ = 0;
  std::array<char, kMaxPath> path_{}, first_path_{};
  unsigned part_ = 0;
  std::uint64_t run_ = 0;
  std::span<const Channel> channels_;
  std::uint64_t place_ = 0;  // in the file
  Crc32 crc_;                // of its data section
  std::array<std::uint32_t, kMaxChannels> sequences_{};
  std::array<std::uint64_t, kMaxChannels> counts_{};  // in this file
  std::uint64_t metadata_place_ = 0;
  std::uint32_t metadata_bytes_ = 0;
  std::array<std::byte, kChunk_bytes> chunk_memory_;
  ByteWriter chunk_{chunk_memory_};
  ChunkEntry open_chunk_;  // of the messages that chunk_ has
  StaticVector<MessageEntry, kMaxChunkMessages> messages_;
  StaticVector<ChunkEntry, kMaxChunks> chunks_;
  std::array<std::byte, 32U * 1024U> scratch_memory_;  // all schemas and channels fit, and an index of messages
};

}  // namespace polygmap::mcap
