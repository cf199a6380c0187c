// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/mcap/mcap_writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>

namespace polygmap::mcap {
namespace {

void put_text(ByteWriter& out, std::string_view text) noexcept {
  out.put(static_cast<std::uint32_t>(text.size()));
  out.put_bytes(text.data(), text.size());
}
// Opcode and length, which end_record() fills in. Where the content begins.
std::size_t begin_record(ByteWriter& out, Opcode opcode) noexcept {
  out.put(opcode);
  out.put(std::uint64_t{0});
  return out.size();
}
void end_record(ByteWriter& out, std::size_t begin) noexcept {
  out.put_at(begin - sizeof(std::uint64_t), static_cast<std::uint64_t>(out.size() - begin));
}
// The same of a record whose content is written elsewhere.
void put_record_head(ByteWriter& out, Opcode opcode, std::uint64_t length) noexcept {
  out.put(opcode);
  out.put(length);
}
void put_message_head(ByteWriter& out, std::uint16_t channel, std::uint32_t sequence, std::int64_t log_ns,
                      std::int64_t publish_ns, std::size_t data_bytes) noexcept {
  put_record_head(out, Opcode::kMessage, kMessageHead_bytes + data_bytes);
  out.put(channel);
  out.put(sequence);
  out.put(log_ns);
  out.put(publish_ns);
}

constexpr std::string_view kMetadataName = "polygmap";
constexpr std::size_t kIndexEntry_bytes = 8 + 8;
// Channel, length of the entries.
constexpr std::uint64_t index_bytes(std::size_t count) noexcept {
  return count == 0 ? 0 : kRecordHead_bytes + 2 + 4 + kIndexEntry_bytes * count;
}
// Of a chunk's record, before the messages: times, size, CRC, compression's length, length of the messages.
constexpr std::size_t kChunkHead_bytes = 8 + 8 + 8 + 4 + 4 + 8;

}  // namespace

McapWriter::~McapWriter() {
  if (file_ >= 0) (void)::close(file_);
}

bool McapWriter::path_of_part(std::string_view first, unsigned part, std::span<char> path) noexcept {
  constexpr std::string_view kEnding = ".mcap";
  const std::string_view stem = first.ends_with(kEnding) ? first.substr(0, first.size() - kEnding.size()) : first;
  const std::string_view ending = first.substr(stem.size());
  const int stem_length = static_cast<int>(stem.size()), ending_length = static_cast<int>(ending.size());
  const int length = part == 0
                         ? std::snprintf(path.data(), path.size(), "%.*s", static_cast<int>(first.size()), first.data())
                         : std::snprintf(path.data(), path.size(), "%.*s-%u%.*s", stem_length, stem.data(), part,
                                         ending_length, ending.data());
  return length >= 0 && static_cast<std::size_t>(length) < path.size();
}

bool McapWriter::fail(int error) noexcept {
  if (errno_ == 0) errno_ = error;
  return false;
}

bool McapWriter::put(std::span<const std::byte> bytes) noexcept {
  if (file_ < 0 || errno_ != 0) return false;
  crc_.add(bytes);
  place_ += bytes.size();
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return fail(written < 0 ? errno : ENOSPC);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

bool McapWriter::open(std::string_view path, std::span<const Channel> channels, std::uint64_t run) noexcept {
  if (channels.size() > kMaxChannels || !path_of_part(path, 0, first_path_)) return fail(ENAMETOOLONG);
  channels_ = channels;
  run_ = run;
  return begin_file();
}

bool McapWriter::begin_file() noexcept {
  if (!path_of_part(first_path_.data(), part_, path_)) return fail(ENAMETOOLONG);
  constexpr mode_t kMode = 0644;
  file_ = ::open(path_.data(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
  if (file_ < 0) return fail(errno);
  place_ = 0;
  crc_ = {};
  counts_ = {};
  chunks_.clear();
  ByteWriter out(scratch_memory_);
  out.put_bytes(kMagic.data(), kMagic.size());
  const std::size_t header = begin_record(out, Opcode::kHeader);
  put_text(out, "ros2");
  put_text(out, "polygmap-rt");
  end_record(out, header);
  metadata_place_ = out.size();
  const std::size_t metadata = begin_record(out, Opcode::kMetadata);
  put_text(out, kMetadataName);
  std::array<char, 24> run{}, part{};
  std::snprintf(run.data(), run.size(), "%016llx", static_cast<unsigned long long>(run_));
  std::snprintf(part.data(), part.size(), "%u", part_);
  out.put(static_cast<std::uint32_t>(4 * 4 + 3 + 4 + std::strlen(run.data()) + std::strlen(part.data())));
  put_text(out, "run");
  put_text(out, run.data());
  put_text(out, "part");
  put_text(out, part.data());
  end_record(out, metadata);
  metadata_bytes_ = static_cast<std::uint32_t>(out.size() - metadata_place_);
  put_schemas_and_channels(out);
  return !out.full() ? put(out) : fail(ENOMEM);
}

// Schema n + 1 belongs to channel n, and is written once for all that share it.
void McapWriter::put_schemas_and_channels(ByteWriter& out) const noexcept {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (schema_of(i) != i) continue;
    const std::size_t schema = begin_record(out, Opcode::kSchema);
    out.put(static_cast<std::uint16_t>(i + 1));
    put_text(out, channels_[i].schema_name);
    put_text(out, "ros2msg");
    put_text(out, channels_[i].schema_text);
    end_record(out, schema);
  }
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const std::size_t channel = begin_record(out, Opcode::kChannel);
    out.put(static_cast<std::uint16_t>(i));
    out.put(static_cast<std::uint16_t>(schema_of(i) + 1));
    put_text(out, channels_[i].topic);
    put_text(out, "cdr");
    out.put(std::uint32_t{0});  // no metadata
    end_record(out, channel);
  }
}

void McapWriter::note_message(std::size_t channel, std::int64_t log_ns, std::size_t offset) noexcept {
  if (messages_.empty()) open_chunk_ = {.first_ns = log_ns, .last_ns = log_ns};
  open_chunk_.first_ns = std::min(open_chunk_.first_ns, log_ns);
  open_chunk_.last_ns = std::max(open_chunk_.last_ns, log_ns);
  ++open_chunk_.counts[channel];
  (void)messages_.try_push_back({log_ns, static_cast<std::uint32_t>(offset), static_cast<std::uint16_t>(channel)});
}

bool McapWriter::write(std::size_t channel, std::int64_t log_ns, std::int64_t publish_ns,
                       std::span<const std::byte> data) noexcept {
  if (data.size() > kChunk_bytes / 2) return false;
  const bool fits = kRecordHead_bytes + kMessageHead_bytes + data.size() <= kChunk_bytes - chunk_.size();
  const bool is_long = !messages_.empty() && log_ns - open_chunk_.first_ns >= kChunk_ns;
  if ((!fits || is_long || messages_.full()) && !flush()) return false;
  note_message(channel, log_ns, chunk_.size());
  put_message_head(chunk_, static_cast<std::uint16_t>(channel), sequences_[channel]++, log_ns, publish_ns, data.size());
  chunk_.put_bytes(data.data(), data.size());
  return true;
}

bool McapWriter::write_alone(std::size_t channel, std::int64_t log_ns, std::int64_t publish_ns,
                             std::span<const std::byte> head, std::span<const std::byte> body) noexcept {
  if (head.size() > kChunk_bytes / 2 || body.size() > kMaxMessage_bytes || !flush()) return false;
  note_message(channel, log_ns, 0);
  put_message_head(chunk_, static_cast<std::uint16_t>(channel), sequences_[channel]++, log_ns, publish_ns,
                   head.size() + body.size());
  chunk_.put_bytes(head.data(), head.size());
  return end_chunk(chunk_.bytes(), body);
}

bool McapWriter::flush() noexcept { return messages_.empty() ? errno_ == 0 : end_chunk(chunk_.bytes(), {}); }

bool McapWriter::end_chunk(std::span<const std::byte> records, std::span<const std::byte> more) noexcept {
  const std::uint64_t length = records.size() + more.size();
  Crc32 crc;
  crc.add(records);
  crc.add(more);
  std::span<const std::byte> packed;
  if (compressor_.compress != nullptr) packed = compressor_.compress(compressor_.of, records, more);
  const std::string_view compression = packed.empty() ? std::string_view() : compressor_.name;
  const std::uint64_t stored = packed.empty() ? length : packed.size();
  ByteWriter out(scratch_memory_);
  open_chunk_.begin = place_;
  open_chunk_.records_bytes = static_cast<std::uint32_t>(length);
  open_chunk_.stored_bytes = static_cast<std::uint32_t>(stored);
  put_record_head(out, Opcode::kChunk, kChunkHead_bytes + compression.size() + stored);
  out.put(open_chunk_.first_ns);
  out.put(open_chunk_.last_ns);
  out.put(length);
  out.put(crc.value());
  put_text(out, compression);
  out.put(stored);
  const bool good = put(out) && (packed.empty() ? put(records) && put(more) : put(packed)) && put_indexes();
  for (std::size_t i = 0; i < channels_.size(); ++i) counts_[i] += open_chunk_.counts[i];
  (void)chunks_.try_push_back(open_chunk_);
  messages_.clear();
  chunk_.clear();
  if (!good || !chunks_.full()) return good;
  ++part_;
  return end_file() && begin_file();
}

bool McapWriter::put_indexes() noexcept {
  for (std::size_t channel = 0; channel < channels_.size(); ++channel) {
    const std::size_t count = open_chunk_.counts[channel];
    if (count == 0) continue;
    ByteWriter out(scratch_memory_);
    put_record_head(out, Opcode::kMessageIndex, 2 + 4 + kIndexEntry_bytes * count);
    out.put(static_cast<std::uint16_t>(channel));
    out.put(static_cast<std::uint32_t>(kIndexEntry_bytes * count));
    for (const MessageEntry& message : messages_) {
      if (message.channel != channel) continue;
      if (scratch_memory_.size() - out.size() < kIndexEntry_bytes) {
        if (!put(out)) return false;
        out.clear();
      }
      out.put(message.log_ns);
      out.put(std::uint64_t{message.offset});
    }
    if (!put(out)) return false;
  }
  return true;
}

std::size_t McapWriter::schema_of(std::size_t channel) const noexcept {
  const auto same = std::ranges::find(channels_, channels_[channel].schema_name, &Channel::schema_name);
  return static_cast<std::size_t>(same - channels_.begin());
}

void McapWriter::put_statistics(ByteWriter& out) const noexcept {
  std::int64_t first_ns = 0, last_ns = 0;
  for (const ChunkEntry& chunk : chunks_) {
    const bool is_first = &chunk == chunks_.begin();
    first_ns = is_first ? chunk.first_ns : std::min(first_ns, chunk.first_ns);
    last_ns = is_first ? chunk.last_ns : std::max(last_ns, chunk.last_ns);
  }
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    messages += counts_[i];
    if (schema_of(i) == i) ++schemas;
  }
  const std::size_t begin = begin_record(out, Opcode::kStatistics);
  out.put(messages);
  out.put(schemas);
  out.put(static_cast<std::uint32_t>(channels_.size()));
  out.put(std::uint32_t{0});  // attachments
  out.put(std::uint32_t{1});  // metadata
  out.put(static_cast<std::uint32_t>(chunks_.size()));
  out.put(first_ns);
  out.put(last_ns);
  out.put(static_cast<std::uint32_t>(channels_.size() * (2 + 8)));
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    out.put(static_cast<std::uint16_t>(i));
    out.put(counts_[i]);
  }
  end_record(out, begin);
}

void McapWriter::put_chunk_index(ByteWriter& out, const ChunkEntry& chunk) const noexcept {
  const bool is_packed = chunk.stored_bytes != chunk.records_bytes;
  const std::string_view compression = is_packed ? compressor_.name : std::string_view();
  const std::uint64_t length = kRecordHead_bytes + kChunkHead_bytes + compression.size() + chunk.stored_bytes;
  const std::size_t begin = begin_record(out, Opcode::kChunkIndex);
  out.put(chunk.first_ns);
  out.put(chunk.last_ns);
  out.put(chunk.begin);
  out.put(length);
  const std::size_t map_at = out.size();
  out.put(std::uint32_t{0});
  std::uint64_t index = chunk.begin + length;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (chunk.counts[i] == 0) continue;
    out.put(static_cast<std::uint16_t>(i));
    out.put(index);
    index += index_bytes(chunk.counts[i]);
  }
  out.put_at(map_at, static_cast<std::uint32_t>(out.size() - map_at - sizeof(std::uint32_t)));
  out.put(index - chunk.begin - length);
  put_text(out, compression);
  out.put(std::uint64_t{chunk.stored_bytes});
  out.put(std::uint64_t{chunk.records_bytes});
  end_record(out, begin);
}

bool McapWriter::put_summary() noexcept {
  crc_ = {};  // of the summary, from here on
  ByteWriter out(scratch_memory_);
  const std::uint64_t summary = place_;
  put_schemas_and_channels(out);
  if (!put(out)) return false;
  const std::uint64_t statistics = place_;
  out.clear();
  put_statistics(out);
  if (!put(out)) return false;
  const std::uint64_t metadata = place_;
  out.clear();
  const std::size_t begin = begin_record(out, Opcode::kMetadataIndex);
  out.put(metadata_place_);
  out.put(std::uint64_t{metadata_bytes_});
  put_text(out, kMetadataName);
  end_record(out, begin);
  if (!put(out)) return false;
  const std::uint64_t chunks = place_;
  for (const ChunkEntry& chunk : chunks_) {
    out.clear();
    put_chunk_index(out, chunk);
    if (!put(out)) return false;
  }
  const std::uint64_t offsets = place_;
  out.clear();
  const auto put_offset = [&out](Opcode group, std::uint64_t from, std::uint64_t to) {
    put_record_head(out, Opcode::kSummaryOffset, 1 + 8 + 8);
    out.put(group);
    out.put(from);
    out.put(to - from);
  };
  put_offset(Opcode::kStatistics, statistics, metadata);
  put_offset(Opcode::kMetadataIndex, metadata, chunks);
  if (!chunks_.empty()) put_offset(Opcode::kChunkIndex, chunks, offsets);
  put_record_head(out, Opcode::kFooter, 8 + 8 + 4);
  out.put(summary);
  out.put(offsets);
  return put(out);
}

bool McapWriter::end_file() noexcept {
  ByteWriter out(scratch_memory_);
  put_record_head(out, Opcode::kDataEnd, 4);
  out.put(crc_.value());
  bool good = put(out) && put_summary();
  out.clear();
  out.put(crc_.value());
  out.put_bytes(kMagic.data(), kMagic.size());
  good = good && put(out);
  const int closed = ::close(file_);
  file_ = -1;
  return good && (closed == 0 || fail(errno));
}

bool McapWriter::close() noexcept {
  if (file_ < 0) return false;
  const bool good = flush() && end_file();
  if (file_ >= 0) (void)::close(file_);
  file_ = -1;
  return good;
}

}  // namespace polygmap::mcap
