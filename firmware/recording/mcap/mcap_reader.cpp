// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/mcap/mcap_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "firmware/recording/mcap/crc32.hpp"

namespace polygmap::mcap {
namespace {

std::string_view get_text(recording::ByteReader& in) { return in.get_text(in.get<std::uint32_t>()); }

// A name of a foreign file as it may stand in a sentence.
std::string printable(std::string_view name) {
  std::string text(name.substr(0, 60));
  for (char& c : text) c = c >= ' ' && c <= '~' ? c : '?';
  return text;
}

bool is_needed(Opcode opcode) {
  return opcode == Opcode::kSchema || opcode == Opcode::kChannel || opcode == Opcode::kChunk ||
         opcode == Opcode::kMessage || opcode == Opcode::kMetadata || opcode == Opcode::kFooter;
}

}  // namespace

McapReader::~McapReader() {
  if (file_ != nullptr) (void)std::fclose(file_);
}

McapReader::Found McapReader::complain_at(std::uint64_t place, const std::string& what) {
  complaint_ = "\"" + name_ + "\", byte " + std::to_string(place) + ": " + what + ".";
  return Found::kBad;
}

bool McapReader::open(const std::string& path) {
  std::error_code none;
  const auto status = std::filesystem::status(path, none);
  const auto is_none = [&](const std::string& why) {
    complaint_ = "\"" + path + "\" is no recording: " + why + ".";
    return false;
  };
  if (!std::filesystem::exists(status)) return is_none("there is no such file");
  if (std::filesystem::is_directory(status)) return is_none("it is a directory, and a recording is a file (run.mcap)");
  if (!std::filesystem::is_regular_file(status)) return is_none("it is no plain file");
  std::FILE* const file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) {
    complaint_ = "\"" + path + "\" cannot be read: " + std::strerror(errno) + ".";
    return false;
  }
  return open(path, file);
}

bool McapReader::open(const std::string& name, std::FILE* file) {
  name_ = name;
  file_ = file;
  const Loaded magic = load(record_, kMagic.size());
  const bool is_mcap = magic == Loaded::kYes && std::memcmp(record_.data(), kMagic.data(), kMagic.size()) == 0;
  if (is_mcap) return true;
  if (magic == Loaded::kBad) return false;
  complaint_ = "\"" + name_ + "\" is no recording: " +
               (magic == Loaded::kCut && place_ == 0 ? "it is empty." : "it does not begin as an MCAP file does.");
  return false;
}

McapReader::Loaded McapReader::load(std::vector<std::byte>& into, std::uint64_t count) {
  into.resize(count);
  const std::size_t got = count == 0 ? 0 : std::fread(into.data(), 1, count, file_);
  place_ += got;
  if (got == count) return Loaded::kYes;
  if (std::ferror(file_) == 0) return Loaded::kCut;
  complaint_ = "\"" + name_ + "\" cannot be read: " + std::strerror(errno) + ".";
  return Loaded::kBad;
}

McapReader::Loaded McapReader::load_record(Opcode& opcode, std::uint64_t& begin) {
  begin = place_;
  if (const Loaded head = load(record_, kRecordHead_bytes); head != Loaded::kYes) return head;
  ByteReader in(record_);
  opcode = in.get<Opcode>();
  const auto length = in.get<std::uint64_t>();
  if (opcode == Opcode{}) {
    (void)complain_at(begin, "no record begins so");
    return Loaded::kBad;
  }
  if (is_needed(opcode)) {
    const std::uint64_t most =
        opcode == Opcode::kChunk || opcode == Opcode::kMessage ? kMaxChunk_bytes : kMaxSmallRecord_bytes;
    if (length <= most) return load(record_, length);
    (void)complain_at(begin, "a record of " + std::to_string(length) + " bytes");
    return Loaded::kBad;
  }
  // In pieces: a length that the file does not have is found at its end, not in memory.
  constexpr std::uint64_t kPiece_bytes = 64U * 1024U;
  for (std::uint64_t left = length; left > 0;) {
    const std::uint64_t piece = std::min(left, kPiece_bytes);
    if (const Loaded passed = load(record_, piece); passed != Loaded::kYes) return passed;
    left -= piece;
  }
  return Loaded::kYes;
}

bool McapReader::read_schema(ByteReader in) {
  const auto id = in.get<std::uint16_t>();
  const std::string_view name = get_text(in);
  (void)get_text(in);  // its language
  const std::string_view text = get_text(in);
  if (in.failed() || schemas_.size() >= kMaxChannelsRead) return false;
  if (std::ranges::find(schemas_, id, &Schema::id) == schemas_.end())
    schemas_.push_back({id, std::string(name), std::string(text)});
  return true;
}

bool McapReader::read_channel(ByteReader in) {
  const auto id = in.get<std::uint16_t>();
  const auto schema = in.get<std::uint16_t>();
  const std::string_view topic = get_text(in), encoding = get_text(in);
  if (in.failed() || channels_.size() >= kMaxChannelsRead) return false;
  if (std::ranges::find(channel_ids_, id) != channel_ids_.end()) return true;  // the summary repeats it
  const auto named = std::ranges::find(schemas_, schema, &Schema::id);
  channel_ids_.push_back(id);
  const Schema none, &of = named == schemas_.end() ? none : *named;
  channels_.push_back({std::string(topic), of.name, of.text, std::string(encoding)});
  return true;
}

void McapReader::read_metadata(ByteReader in) {
  if (get_text(in) != "polygmap") return;
  const auto length = in.get<std::uint32_t>();
  const std::size_t end = in.place() + length;
  while (!in.failed() && in.place() < end) {
    const std::string_view key = get_text(in), value = get_text(in);
    if (!in.failed() && key == "run") run_ = printable(value);
  }
}

McapReader::Found McapReader::read_chunk(std::uint64_t begin) {
  ByteReader in(record_);
  (void)in.get<std::int64_t>();
  (void)in.get<std::int64_t>();
  const auto plain_bytes = in.get<std::uint64_t>();
  const auto crc = in.get<std::uint32_t>();
  const std::string compression(get_text(in));
  const auto length = in.get<std::uint64_t>();
  const std::size_t from = in.place();
  if (in.failed() || length != record_.size() - from) return complain_at(begin, "a chunk whose length cannot be");
  const std::span<const std::byte> packed = std::span<const std::byte>(record_).subspan(from);
  if (plain_bytes > kMaxChunk_bytes) {
    return complain_at(begin, "a chunk of " + std::to_string(plain_bytes) + " bytes");
  }
  if (compression.empty()) {
    if (plain_bytes != length) return complain_at(begin, "a chunk whose length cannot be");
    chunk_memory_.assign(packed.begin(), packed.end());
  } else {
    if (!decompress_) {
      return complain_at(begin,
                         "a chunk compressed by \"" + printable(compression) + "\", which this program does not read");
    }
    chunk_memory_.resize(plain_bytes);
    if (!decompress_(compression, packed, chunk_memory_)) {
      return complain_at(begin, "a chunk that does not unpack by \"" + printable(compression) + "\"");
    }
  }
  if (crc != 0 && Crc32::of(chunk_memory_) != crc && damage_.empty()) {
    damage_ = "\"" + name_ + "\", byte " + std::to_string(begin) +
              ": the bytes of this chunk are not those that were written (CRC).";
  }
  chunk_ = chunk_memory_;
  chunk_place_ = begin;
  return Found::kMessage;
}

McapReader::Found McapReader::next_in_chunk(MessageRead& message) {
  ByteReader in(chunk_);
  const auto opcode = in.get<Opcode>();
  const auto length = in.get<std::uint64_t>();
  if (in.failed() || length > chunk_.size() - in.place())
    return complain_at(chunk_place_, "a record in this chunk is too long");
  ByteReader content(chunk_.subspan(in.place(), length));
  const std::span<const std::byte> all = chunk_.subspan(in.place(), length);
  chunk_ = chunk_.subspan(in.place() + length);
  if (opcode == Opcode::kSchema || opcode == Opcode::kChannel) {
    const bool good = opcode == Opcode::kSchema ? read_schema(content) : read_channel(content);
    return good ? Found::kEnd : complain_at(chunk_place_, "a channel in this chunk cannot be");
  }
  if (opcode != Opcode::kMessage) return Found::kEnd;
  const auto id = content.get<std::uint16_t>();
  message.sequence = content.get<std::uint32_t>();
  message.log_ns = content.get<std::int64_t>();
  message.publish_ns = content.get<std::int64_t>();
  const auto channel = std::ranges::find(channel_ids_, id);
  if (content.failed() || channel == channel_ids_.end()) {
    return complain_at(chunk_place_, "a message in this chunk is of no channel");
  }
  message.channel = static_cast<std::size_t>(channel - channel_ids_.begin());
  message.data = all.subspan(kMessageHead_bytes);
  message.place = chunk_place_;
  return Found::kMessage;
}

// The next record of the top level. kMessage: the file goes on.
McapReader::Found McapReader::read_record() {
  Opcode opcode{};
  std::uint64_t begin = 0;
  const Loaded loaded = load_record(opcode, begin);
  if (loaded != Loaded::kYes) return loaded == Loaded::kCut ? Found::kCut : Found::kBad;
  switch (opcode) {
    case Opcode::kSchema:
      return read_schema(ByteReader(record_)) ? Found::kMessage : complain_at(begin, "a schema that cannot be");
    case Opcode::kChannel:
      return read_channel(ByteReader(record_)) ? Found::kMessage : complain_at(begin, "a channel that cannot be");
    case Opcode::kMetadata:
      read_metadata(ByteReader(record_));
      return Found::kMessage;
    case Opcode::kChunk:
      return read_chunk(begin);
    case Opcode::kMessage: {  // outside a chunk: as in one
      chunk_memory_.resize(kRecordHead_bytes);
      recording::ByteWriter head(chunk_memory_);
      head.put(opcode);
      head.put(static_cast<std::uint64_t>(record_.size()));
      chunk_memory_.insert(chunk_memory_.end(), record_.begin(), record_.end());
      chunk_ = chunk_memory_;
      chunk_place_ = begin;
      return Found::kMessage;
    }
    case Opcode::kFooter:
      return Found::kEnd;
    default:
      return Found::kMessage;
  }
}

McapReader::Found McapReader::next(MessageRead& message) {
  while (true) {
    while (!chunk_.empty()) {
      const Found found = next_in_chunk(message);
      if (found != Found::kEnd) return found;
    }
    if (const Found found = read_record(); found != Found::kMessage) return found;
  }
}

const std::string& McapReader::read_run() {
  while (run_.empty() && chunk_.empty() && read_record() == Found::kMessage) {
  }
  return run_;
}

}  // namespace polygmap::mcap
