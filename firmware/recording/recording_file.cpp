// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/recording_file.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "firmware/config/param_table.hpp"
#include "firmware/recording/stream/recording_header.hpp"

namespace polygmap::recording {
namespace {

using mcap::CdrReader;
using mcap::McapReader;

bool is_host_topic(Topic topic) { return topic >= Topic::kTruth; }

}  // namespace

bool RecordingFile::complain(const std::string& what) {
  if (!complaint_.empty()) return false;
  complaint_ = "\"" + reader_->name() + "\", byte " + std::to_string(reader_->chunk_place()) + ": " + what + ".";
  return false;
}

bool RecordingFile::open(const std::string& path) {
  first_path_ = path;
  reader_ = std::make_unique<McapReader>(decompress_);
  if (reader_->open(path)) return read_beginning();
  complaint_ = reader_->complaint();
  return false;
}

bool RecordingFile::open(const std::string& name, std::FILE* file) {
  reader_ = std::make_unique<McapReader>(decompress_);
  if (reader_->open(name, file)) return read_beginning();
  complaint_ = reader_->complaint();
  return false;
}

bool RecordingFile::read_beginning() {
  while (parser_ == nullptr) {
    const Found found = next_message();
    if (found == Found::kRecord) continue;
    if (complaint_.empty()) {
      complaint_ = "\"" + reader_->name() + "\" is no recording of this module: it has no topic " +
                   std::string(name_of(Topic::kParameters)) + " before it ends.";
    }
    return false;
  }
  return true;
}

// The next part's, where this one is over: of the same run, and beside it.
bool RecordingFile::open_next_part() {
  std::array<char, mcap::McapWriter::kMaxPath> path{};
  if (first_path_.empty() || run_.empty() || !mcap::McapWriter::path_of_part(first_path_, part_ + 1, path))
    return false;
  auto next = std::make_unique<McapReader>(decompress_);
  if (!next->open(path.data()) || next->read_run() != run_) return false;
  ++part_;
  reader_ = std::move(next);
  return true;
}

RecordingFile::Found RecordingFile::next_message() {
  mcap::MessageRead message;
  const McapReader::Found found = reader_->next(message);
  if (damage_.empty()) damage_ = reader_->damage();
  switch (found) {
    case McapReader::Found::kMessage: {
      const std::string& topic = reader_->channels()[message.channel].topic;
      const auto channel = std::ranges::find(channels(), topic, &mcap::Channel::topic);
      if (channel == channels().end()) return Found::kRecord;  // somebody else's
      return take(message, static_cast<Topic>(channel - channels().begin()));
    }
    case McapReader::Found::kBad:
      complaint_ = reader_->complaint();
      return Found::kBad;
    case McapReader::Found::kCut:
      return Found::kCut;
    case McapReader::Found::kEnd:
      break;
  }
  if (has_ended_) return Found::kEnd;
  run_ = reader_->run();
  return open_next_part() ? Found::kRecord : Found::kCut;
}

RecordingFile::Found RecordingFile::take(const mcap::MessageRead& message, Topic topic) {
  if (topic == Topic::kParameters) {
    if (parser_ != nullptr) return Found::kRecord;
    return read_header(message) ? Found::kRecord : Found::kBad;
  }
  if (parser_ == nullptr) {
    (void)complain("a message of " + std::string(name_of(topic)) + " before the parameters");
    return Found::kBad;
  }
  if (is_host_topic(topic)) {
    extras_.push_back({topic, message.log_ns, {message.data.begin(), message.data.end()}});
  } else if (topic == Topic::kDepth) {
    picture_.assign(message.data.begin(), message.data.end());
  } else if (topic == Topic::kCameraInfo) {
    camera_info_.assign(message.data.begin(), message.data.end());
    camera_info_ns_ = message.log_ns;
  } else if (topic != Topic::kReplay) {
    compare(message, topic);
  } else {
    if (!expected_.messages.empty()) {
      const Expected& missing = expected_.messages.front();
      contradict(missing.topic, missing.log_ns, "its message is missing");
      expected_.messages.clear();
    }
    CdrReader in(message.data);
    const std::span<const std::byte> records = in.get_bytes();
    if (in.failed()) {
      (void)complain("a message of /replay that cannot be");
      return Found::kBad;
    }
    frame_memory_.assign(records.begin(), records.end());
    frame_ = ByteReader(frame_memory_);
  }
  return Found::kRecord;
}

void RecordingFile::contradict(Topic topic, std::int64_t log_ns, const std::string& what) {
  if (!contradiction_.empty()) return;
  std::array<char, 32> time{};
  std::snprintf(time.data(), time.size(), "%.3f s", 1e-9 * static_cast<double>(log_ns));
  contradiction_ = "topic " + std::string(name_of(topic)) + " at " + time.data() + ": " + what;
}

void RecordingFile::compare(const mcap::MessageRead& message, Topic topic) {
  if (!contradiction_.empty()) return;  // the first is told
  if (expected_.messages.empty()) return contradict(topic, message.log_ns, "no record has this message");
  const Expected expected = std::move(expected_.messages.front());
  expected_.messages.pop_front();
  if (expected.topic != topic) {
    return contradict(expected.topic, expected.log_ns, "its message is missing");
  }
  if (expected.log_ns != message.log_ns || expected.publish_ns != message.publish_ns) {
    return contradict(topic, expected.log_ns, "its times are not those of the records");
  }
  const auto& recorded = expected.message;
  const auto [here, there] = std::ranges::mismatch(recorded, message.data);
  if (here == recorded.end() && there == message.data.end()) return;
  const auto place = here - recorded.begin();
  std::array<char, 120> text{};
  if (here == recorded.end() || there == message.data.end()) {
    std::snprintf(text.data(), text.size(), "%zu bytes, where the records say %zu", message.data.size(),
                  recorded.size());
  } else {
    std::snprintf(text.data(), text.size(), "byte %td of the message is 0x%02x, where the records say 0x%02x", place,
                  static_cast<unsigned>(*there), static_cast<unsigned>(*here));
  }
  contradict(topic, message.log_ns, text.data());
}

bool RecordingFile::read_picture(const DepthFrameView& frame, const Picture& picture,
                                 std::span<const std::uint16_t>& pixels) {
  const std::vector<std::byte> head = [&] {
    const std::span<const std::byte> bytes = topics_.image_head(frame);
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  }();
  if (!std::ranges::equal(topics_.camera_info(camera_, frame.stamp_ns), camera_info_)) {
    contradict(Topic::kCameraInfo, camera_info_ns_, "it is not the camera of the parameters");
  }
  const auto count = static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px);
  const std::string which = "picture " + std::to_string(picture.index) + " of /depth ";
  if (picture_.size() != head.size() + count * sizeof(std::uint16_t)) return complain(which + "is missing");
  pixels_.resize(count);
  std::memcpy(pixels_.data(), picture_.data() + head.size(), count * sizeof(std::uint16_t));
  if (!std::equal(head.begin(), head.end(), picture_.begin()) ||
      hash_of_pixels(pixels_.data(), count) != picture.hash) {
    return complain(which + "is not the one that was recorded, or its hash in /replay is wrong");
  }
  pixels = pixels_;
  return true;
}

RecordingFile::Found RecordingFile::read(Record& record) {
  while (frame_.at_end()) {
    if (has_ended_) return Found::kEnd;
    const Found found = next_message();
    if (found != Found::kRecord) return found;
  }
  if (!parser_->parse(frame_, record)) {
    (void)complain(parser_->what());
    return Found::kBad;
  }
  topics_.write(record, expected_);
  has_ended_ = record.kind == RecordKind::kEnd;
  return Found::kRecord;
}

bool RecordingFile::read_header(const mcap::MessageRead& message) {
  CdrReader in(message.data);
  const std::string_view hash = in.get_text();
  std::array<std::vector<std::string_view>, 2> lists;  // names, values
  for (auto& list : lists) {
    const std::size_t count = in.get_count(1);
    for (std::size_t i = 0; i < count && !in.failed(); ++i) list.push_back(in.get_text());
  }
  const std::span<const std::byte> header = in.get_bytes();
  if (in.failed()) return complain("parameters that cannot be");
  RecordingHeader read;
  if (const std::string wrong = read_recording_header(header, read); !wrong.empty()) return complain(wrong);
  params_ = read.params;
  camera_ = read.camera;
  topics_.set_camera(params_.robot.mounts.base_T_camera);
  rows_ = read.rows;
  parser_ = std::make_unique<RecordParser>(camera_, rows_);
  // What people read of them is what a replay has, in whatever order.
  const config::ParamTable table = config::param_table(read.params);
  const auto& [names, values] = lists;
  bool is_same = hash == config::hash_of(table) && names.size() == table.params.size() && values.size() == names.size();
  for (std::size_t i = 0; is_same && i < names.size(); ++i) {
    auto param = table.params.begin() + static_cast<std::ptrdiff_t>(i);
    if (param->name != names[i]) param = std::ranges::find(table.params, names[i], &config::Param::name);
    is_same = param != table.params.end() && config::text_of(*param) == values[i];
  }
  if (!is_same) contradict(Topic::kParameters, message.log_ns, "its texts are not those of its header");
  return true;
}

}  // namespace polygmap::recording
