// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/record/recording_info.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "firmware/recording/mcap/cdr.hpp"
#include "firmware/recording/mcap/mcap_reader.hpp"
#include "firmware/recording/mcap/mcap_writer.hpp"
#include "firmware/recording/topics/schemas.hpp"
#include "sim_stub/host/record/zstd_chunks.hpp"

namespace polygmap::sim {
namespace {

using mcap::McapReader;

std::string line(const char* format, auto... values) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

// Messages before the file's last chunk are written again; a picture's chunk is its own.
constexpr std::size_t kLargest_bytes = mcap::McapWriter::kChunk_bytes / 4;

struct Packer {
  std::vector<std::byte> all, packed;

  static std::span<const std::byte> compress(void* of, std::span<const std::byte> records,
                                             std::span<const std::byte> more) {
    Packer& self = *static_cast<Packer*>(of);
    self.all.assign(records.begin(), records.end());
    self.all.insert(self.all.end(), more.begin(), more.end());
    self.packed = zstd_compressed(self.all);
    if (self.packed.size() >= self.all.size()) self.packed.clear();
    return self.packed;
  }
};

}  // namespace

RecordingInfo info_of(const std::string& path) {
  RecordingInfo info;
  McapReader reader(zstd_decompress());
  if (!reader.open(path)) {
    info.complaint = reader.complaint();
    return info;
  }
  std::error_code none;
  info.bytes = std::filesystem::file_size(path, none);
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max(), last_ns = 0;
  mcap::MessageRead message;
  McapReader::Found found = reader.next(message);
  for (; found == McapReader::Found::kMessage; found = reader.next(message)) {
    info.topics.resize(reader.channels().size());
    TopicInfo& topic = info.topics[message.channel];
    ++topic.messages;
    topic.bytes += message.data.size();
    first_ns = std::min(first_ns, message.log_ns);
    last_ns = std::max(last_ns, message.log_ns);
    const std::string& name = reader.channels()[message.channel].topic;
    mcap::CdrReader in(message.data);
    if (name == recording::name_of(recording::Topic::kParameters)) info.parameters_hash = in.get_text();
    if (name == recording::name_of(recording::Topic::kVerdict)) {
      const auto json = nlohmann::json::parse(in.get_text(), nullptr, false);
      if (json.is_object()) info.verdict = json.value("verdict", "") + ": " + json.value("reason", "");
    }
  }
  info.topics.resize(reader.channels().size());
  for (std::size_t i = 0; i < info.topics.size(); ++i) {
    info.topics[i].topic = reader.channels()[i].topic;
    info.topics[i].schema = reader.channels()[i].schema;
  }
  info.is_finished = found == McapReader::Found::kEnd;
  info.complaint = found == McapReader::Found::kBad ? reader.complaint() : reader.damage();
  if (first_ns <= last_ns) {
    info.first_s = 1e-9 * static_cast<double>(first_ns);
    info.last_s = 1e-9 * static_cast<double>(last_ns);
  }
  return info;
}

std::string text_of(const RecordingInfo& info) {
  const double length_s = info.last_s - info.first_s;
  std::string text = line("%.3f s from %.3f s on, %.1f MB, %s\n", length_s, info.first_s,
                          1e-6 * static_cast<double>(info.bytes), info.is_finished ? "finished" : "cut off");
  if (!info.parameters_hash.empty()) text += "parameters " + info.parameters_hash + "\n";
  if (!info.verdict.empty()) text += info.verdict + "\n";
  for (const TopicInfo& topic : info.topics) {
    const auto count = static_cast<double>(topic.messages);
    text += line("  %-14s %-38s %8llu messages %7.1f Hz %8.1f kB\n", topic.topic.c_str(), topic.schema.c_str(),
                 static_cast<unsigned long long>(topic.messages), length_s > 0.0 ? count / length_s : 0.0,
                 1e-3 * static_cast<double>(topic.bytes));
  }
  return text;
}

std::string json_of(const RecordingInfo& info) {
  nlohmann::ordered_json json{{"finished", info.is_finished},
                              {"first_s", info.first_s},
                              {"last_s", info.last_s},
                              {"bytes", info.bytes},
                              {"parameters_hash", info.parameters_hash},
                              {"verdict", info.verdict},
                              {"topics", nlohmann::ordered_json::array()}};
  for (const TopicInfo& topic : info.topics) {
    json["topics"].push_back(
        {{"topic", topic.topic}, {"schema", topic.schema}, {"messages", topic.messages}, {"bytes", topic.bytes}});
  }
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string pack_recording(const std::string& path, const std::string& to) {
  McapReader reader(zstd_decompress());
  if (!reader.open(path)) return reader.complaint();
  const std::string beside = to + ".part";
  Packer packer;
  const auto writer =
      std::make_unique<mcap::McapWriter>(mcap::McapWriter::Compressor{"zstd", &Packer::compress, &packer});
  const auto cannot_write = [&] { return "Cannot write \"" + beside + "\": " + std::strerror(writer->error()) + "."; };
  const auto is_ours = [](const mcap::ChannelRead& read) {
    return std::ranges::find(recording::channels(), read.topic, &mcap::Channel::topic) != recording::channels().end();
  };
  const std::uint64_t run = std::strtoull(reader.read_run().c_str(), nullptr, 16);
  if (!writer->open(beside, recording::channels(), run)) return cannot_write();
  mcap::MessageRead message;
  McapReader::Found found = reader.next(message);
  for (; found == McapReader::Found::kMessage; found = reader.next(message)) {
    const mcap::ChannelRead& channel = reader.channels()[message.channel];
    if (!is_ours(channel)) {
      std::filesystem::remove(beside);
      return "\"" + path + "\" has the topic " + channel.topic + ": it is no recording of this module.";
    }
    const auto at = std::ranges::find(recording::channels(), channel.topic, &mcap::Channel::topic);
    const auto topic = static_cast<std::size_t>(at - recording::channels().begin());
    const bool is_large = message.data.size() > kLargest_bytes;
    const bool written = is_large ? writer->write_alone(topic, message.log_ns, message.publish_ns, {}, message.data)
                                  : writer->write(topic, message.log_ns, message.publish_ns, message.data);
    if (!written) return cannot_write();
  }
  const std::string wrong = found == McapReader::Found::kBad ? reader.complaint() : reader.damage();
  if (!wrong.empty() || found == McapReader::Found::kCut) {
    std::filesystem::remove(beside);
    return wrong.empty() ? "\"" + path + "\" is unfinished: it stays as it is." : wrong;
  }
  if (!writer->close()) return cannot_write();
  std::error_code error;
  std::filesystem::rename(beside, to, error);
  return error ? "Cannot write \"" + to + "\": " + error.message() + "." : std::string();
}

}  // namespace polygmap::sim
