// SPDX-License-Identifier: Apache-2.0
// The records of a frame (format.hpp) as values, looked at before anything is believed. Allocates nothing but for its
// complaint.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "firmware/recording/stream/format.hpp"
#include "firmware/recording/stream/outputs.hpp"

namespace polygmap::recording {

struct Picture {
  Pixels pixels = Pixels::kNone;
  std::uint32_t index = 0;  // among those recorded
  std::uint64_t hash = 0;
};

// A port's call and what it gave.
struct PortCall {
  CallKind kind = CallKind::kReadImu;
  bool gave = false;
  ImuSample imu;
  JointFeedback joints;
  LioSample lio;
  OperatorRequest asked;
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
  std::array<PortCall, kMaxCallsPerRow> call_memory;
  std::span<const PortCall> calls;
  std::uint8_t progress = 0;
  std::int32_t units_left = 0;
  ByteReader outputs;  // into the memory that was read from

  RowCall() = default;
  RowCall(const RowCall&) = delete;  // calls refer to it
  RowCall& operator=(const RowCall&) = delete;
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
  std::uint8_t lost_lane = 0;
  std::uint32_t lost_frames = 0;
  std::uint64_t end_cycles = 0;
  std::uint32_t end_pictures = 0;
};

class RecordParser {
 public:
  // rows: the recording's rows, as places in this module's schedule.
  RecordParser(const CameraIntrinsics& camera, std::span<const std::uint8_t> rows) noexcept
      : camera_(camera), rows_(rows) {}

  // The next record of a frame. False: it cannot be, and what() says why.
  [[nodiscard]] bool parse(ByteReader& in, Record& record);
  [[nodiscard]] const char* what() const noexcept { return what_; }

 private:
  bool is(const char* what) noexcept {
    what_ = what;
    return false;
  }
  [[nodiscard]] bool parse_row(ByteReader& in, RowCall& row);
  [[nodiscard]] bool parse_view(ByteReader& in, RowCall& row) noexcept;
  [[nodiscard]] bool parse_call(ByteReader& in, PortCall& call) noexcept;
  [[nodiscard]] bool parse_picture(ByteReader& in, PortCall& call) noexcept;
  [[nodiscard]] bool parse_cycle(ByteReader& in, std::uint8_t& lane, CycleReport& cycle) noexcept;
  [[nodiscard]] bool parse_event(ByteReader& in, ExecutiveEventCount& event) noexcept;
  [[nodiscard]] bool parse_lost(ByteReader& in, Record& record) noexcept;
  [[nodiscard]] bool parse_end(ByteReader& in, Record& record) noexcept;

  CameraIntrinsics camera_;
  std::span<const std::uint8_t> rows_;
  const char* what_ = "";
  std::array<std::int64_t, kLaneCount> last_cycle_ns_{-1, -1};
  std::array<std::size_t, kLaneCount> last_row_{};
  std::uint64_t cycles_ = 0;
  std::uint32_t pictures_ = 0;
};

}  // namespace polygmap::recording
