// SPDX-License-Identifier: Apache-2.0
// A recording as it is read: record by record, and nothing of it believed before it was looked at.
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "firmware/params.hpp"
#include "firmware/recording/format.hpp"
#include "firmware/recording/outputs.hpp"

namespace polygmap::recording {

struct Picture {
  Pixels pixels = Pixels::kNone;
  std::uint32_t index = 0;  // among those stored
  std::uint64_t hash = 0;
  std::uint64_t place = 0;  // of the record that has it, bytes
};

// A port's call and what it gave, in recording.bin.
struct PortCall {
  CallKind kind = CallKind::kReadImu;
  bool gave = false;
  ImuSample imu;
  JointFeedback joints;
  LioSample lio;
  OperatorCommand asked{};
  JointCommand command;
  JointSet taken;
  hal::JointBusStatus status;
  DepthFrameView frame;  // without its pixels
  Picture picture;
};

struct RowCall {
  std::size_t row = 0;  // of this module's schedule
  std::int64_t cycle_ns = 0;
  std::int32_t units = 0;
  std::int64_t other_finished_ns = 0;
  StaticVector<TakenFrame, kMaxTaken> taken;
  std::vector<PortCall> calls;
  std::uint8_t progress = 0;
  std::int32_t units_left = 0;
  ByteReader outputs;  // into the file's memory, until the next record is read
};

struct ExecutiveEventCount {
  std::uint8_t lane = 0;
  ExecutiveEvent event = ExecutiveEvent::kCycleOverrun;
  std::int64_t at_ns = 0;
  std::uint32_t times = 0;
};

struct Record {
  RecordKind kind = RecordKind::kEnd;
  RowCall row;
  ExecutiveEventCount event;
  std::uint8_t cycle_lane = 0;
  CycleReport cycle;
};

class RecordingFile {
 public:
  RecordingFile() = default;
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;
  ~RecordingFile();

  // Each false when the file is none, or not of this module: complaint() says where and why.
  [[nodiscard]] bool open(const std::string& directory);
  // Of files that are open, and become this one's; name: what they are called in sentences, as their directory.
  [[nodiscard]] bool open(const std::string& name, std::FILE* recording, std::FILE* pictures);
  [[nodiscard]] bool read(Record& record);
  [[nodiscard]] bool read_picture(const Picture& picture, std::span<std::uint16_t> pixels);
  // One sentence with file and byte. For whoever finds something else wrong with the record read last.
  bool complain(const std::string& what);
  [[nodiscard]] const std::string& complaint() const noexcept { return complaint_; }

  [[nodiscard]] const Params& params() const noexcept { return params_; }
  [[nodiscard]] const CameraIntrinsics& camera() const noexcept { return camera_; }

 private:
  bool complain_at(const char* name, std::uint64_t place, const std::string& what);
  [[nodiscard]] bool load(std::size_t count, const char* what);
  template <Number T>
  [[nodiscard]] bool take(T& value, const char* what);
  [[nodiscard]] bool take_name(std::string& name);
  [[nodiscard]] bool read_beginning();
  [[nodiscard]] bool read_header();
  [[nodiscard]] bool read_params();
  [[nodiscard]] bool read_schedule();
  [[nodiscard]] bool read_camera();
  [[nodiscard]] bool read_gain_limits();
  [[nodiscard]] bool open_pictures();
  [[nodiscard]] bool parse_row(RowCall& row);
  [[nodiscard]] bool parse_view(RowCall& row);
  [[nodiscard]] bool parse_call(PortCall& call);
  [[nodiscard]] bool parse_cycle(std::uint8_t& lane, CycleReport& cycle);
  [[nodiscard]] bool parse_event(ExecutiveEventCount& event);
  [[nodiscard]] bool parse_end();

  std::string directory_, complaint_;
  std::FILE* file_ = nullptr;
  std::FILE* picture_file_ = nullptr;
  std::uint64_t place_ = 0;         // of the next byte
  std::uint64_t record_place_ = 0;  // of the record read last
  std::vector<std::byte> memory_;
  ByteReader in_;
  Params params_;
  CameraIntrinsics camera_;
  std::vector<std::uint8_t> rows_;  // the file's -> this module's
  std::array<std::int64_t, kLaneCount> last_cycle_ns_{-1, -1};
  std::array<std::size_t, kLaneCount> last_row_{};
  std::uint64_t cycles_ = 0;
  std::uint32_t pictures_ = 0;
};

}  // namespace polygmap::recording
