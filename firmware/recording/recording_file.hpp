// SPDX-License-Identifier: Apache-2.0
// A recording as it is read: record by record, and nothing of it believed before it was looked at.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "firmware/params.hpp"
#include "firmware/recording/mcap/mcap_reader.hpp"
#include "firmware/recording/stream/format.hpp"
#include "firmware/recording/stream/record.hpp"
#include "firmware/recording/topics/topics.hpp"

namespace polygmap::recording {

class RecordingFile {
 public:
  enum class Found : std::uint8_t {
    kRecord,
    kEnd,  // all of it
    kCut,  // unfinished: what came is good
    kBad,  // complaint() says where and why
  };
  explicit RecordingFile(mcap::McapReader::Decompress decompress = {}) : decompress_(std::move(decompress)) {}
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;

  // Each false when the file is none, or not of this module: complaint() says where and why.
  [[nodiscard]] bool open(const std::string& path);
  // Of a file that is open, and becomes this one's. name: what it is called in sentences.
  [[nodiscard]] bool open(const std::string& name, std::FILE* file);
  // The next record. Where a file of several is over, the next one is read on.
  [[nodiscard]] Found read(Record& record);
  // The picture that the record read last acquired, its size the camera's; false, and complaint(), when it is not the
  // recorded one.
  [[nodiscard]] bool read_picture(const DepthFrameView& frame, const Picture& picture,
                                  std::span<const std::uint16_t>& pixels);
  // One sentence with file and byte, the first one. For whoever finds something else wrong with the record read last.
  bool complain(const std::string& what);
  [[nodiscard]] const std::string& complaint() const noexcept { return complaint_; }
  // The first message of a topic that is not what the records say: empty when all are.
  [[nodiscard]] const std::string& contradiction() const noexcept { return contradiction_; }
  // A chunk's bytes are not those that were written: one sentence about the first one. Its messages are read all the
  // same, so that contradiction() or a replay may say which it is.
  [[nodiscard]] const std::string& damage() const noexcept { return damage_; }
  // A message that is none of the module's: of the truth, the verdict. Since the last record.
  struct Extra {
    Topic topic;
    std::int64_t log_ns = 0;
    std::vector<std::byte> message;
  };
  [[nodiscard]] std::vector<Extra> take_extras() { return std::exchange(extras_, {}); }

  [[nodiscard]] const Params& params() const noexcept { return params_; }
  [[nodiscard]] const CameraIntrinsics& camera() const noexcept { return camera_; }

 private:
  struct Expected {
    Topic topic;
    std::int64_t log_ns = 0, publish_ns = 0;
    std::vector<std::byte> message;
  };
  struct Collector final : MessageSink {
    std::deque<Expected> messages;
    void take(Topic topic, std::int64_t log_ns, std::int64_t publish_ns,
              std::span<const std::byte> message) noexcept override {
      messages.push_back({topic, log_ns, publish_ns, {message.begin(), message.end()}});
    }
  };

  [[nodiscard]] bool read_beginning();
  [[nodiscard]] Found next_message();
  [[nodiscard]] bool open_next_part();
  [[nodiscard]] Found take(const mcap::MessageRead& message, Topic topic);
  void compare(const mcap::MessageRead& message, Topic topic);
  void contradict(Topic topic, std::int64_t log_ns, const std::string& what);
  [[nodiscard]] bool read_header(const mcap::MessageRead& message);

  mcap::McapReader::Decompress decompress_;
  std::unique_ptr<mcap::McapReader> reader_;
  std::string first_path_, run_, complaint_, contradiction_, damage_;
  unsigned part_ = 0;
  bool has_ended_ = false;
  Params params_;
  CameraIntrinsics camera_;
  std::vector<std::uint8_t> rows_;  // the file's -> this module's
  std::unique_ptr<RecordParser> parser_;
  std::vector<std::byte> frame_memory_;
  ByteReader frame_;
  Topics topics_;
  Collector expected_;
  std::vector<std::byte> picture_, camera_info_;  // the newest messages of /depth and /camera_info
  std::int64_t camera_info_ns_ = 0;
  std::vector<std::uint16_t> pixels_;
  std::vector<Extra> extras_;
};

}  // namespace polygmap::recording
