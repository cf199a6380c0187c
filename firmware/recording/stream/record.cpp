// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/stream/record.hpp"

namespace polygmap::recording {
namespace {

bool time_possible(std::int64_t t_ns) noexcept { return t_ns >= 0 && t_ns <= kLatest_ns; }

}  // namespace

bool RecordParser::parse(ByteReader& in, Record& record) {
  record.kind = in.get<RecordKind>();
  const auto length = in.get<std::uint32_t>();
  ByteReader rest(in.get_bytes(length));
  if (in.failed()) return is("a record that is too long");
  bool good = false;
  switch (record.kind) {
    case RecordKind::kRow:
      return parse_row(rest, record.row);
    case RecordKind::kEvent:
      good = parse_event(rest, record.event);
      break;
    case RecordKind::kStop:
      good = true;
      break;
    case RecordKind::kCycle:
      good = parse_cycle(rest, record.cycle_lane, record.cycle);
      break;
    case RecordKind::kLost:
      good = parse_lost(rest, record);
      break;
    case RecordKind::kEnd:
      if (!parse_end(rest, record)) return false;
      good = true;
      break;
    default:
      return is("no record begins so");
  }
  return (good && !rest.failed() && rest.at_end()) || is("a record that cannot be");
}

bool RecordParser::parse_end(ByteReader& in, Record& record) noexcept {
  record.end_cycles = in.get<std::uint64_t>();
  record.end_pictures = in.get<std::uint32_t>();
  return (record.end_cycles == cycles_ && record.end_pictures == pictures_) || is("cycles or pictures are missing");
}

bool RecordParser::parse_lost(ByteReader& in, Record& record) noexcept {
  record.lost_lane = in.get<std::uint8_t>();
  record.lost_frames = in.get<std::uint32_t>();
  return record.lost_lane < kLaneCount;
}

bool RecordParser::parse_event(ByteReader& in, ExecutiveEventCount& event) noexcept {
  event.lane = in.get<std::uint8_t>();
  event.event = in.get<ExecutiveEvent>();
  event.at_ns = in.get<std::int64_t>();
  event.times = in.get<std::uint32_t>();
  return event.lane < kLaneCount && time_possible(event.at_ns) &&
         index_of_event(event.event) < kEventTable<ExecutiveEvent>.size();
}

bool RecordParser::parse_cycle(ByteReader& in, std::uint8_t& lane, CycleReport& cycle) noexcept {
  lane = in.get<std::uint8_t>();
  cycle.cycle = in.get<std::uint64_t>();
  cycle.due_ns = in.get<std::int64_t>();
  cycle.slot = in.get<std::uint8_t>();
  for (std::uint32_t* const mask : {&cycle.ran, &cycle.shed, &cycle.deferred, &cycle.overran}) {
    const auto recorded = in.get<std::uint32_t>();
    *mask = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) *mask |= ((recorded >> i) & 1U) << rows_[i];
  }
  cycle.overrun = in.get<bool>();
  cycle.caught_up = in.get<bool>();
  cycle.skipped_before = in.get<std::uint64_t>();
  cycles_ += lane == kControlLane ? 1U : 0U;
  return lane < kLaneCount && time_possible(cycle.due_ns);
}

bool RecordParser::parse_view(ByteReader& in, RowCall& row) noexcept {
  const auto can_be = [](std::int64_t frame_ns) { return frame_ns == kNoFrame_ns || time_possible(frame_ns); };
  row.other_finished_ns = in.get<std::int64_t>();
  const auto taken = in.get<std::uint8_t>();
  if (!can_be(row.other_finished_ns) || taken > kMaxTaken) return false;
  row.taken.clear();
  for (std::size_t i = 0; i < taken; ++i) {
    const auto frame_ns = in.get<std::int64_t>();
    (void)row.taken.try_push_back({frame_ns, in.get<bool>()});
    if (!can_be(frame_ns)) return false;
  }
  return true;
}

bool RecordParser::parse_row(ByteReader& in, RowCall& row) {
  const auto index = in.get<std::uint8_t>();
  if (index >= rows_.size()) return is("a row that the schedule does not have");
  row.row = rows_[index];
  row.cycle_ns = in.get<std::int64_t>();
  row.units = in.get<std::int32_t>();
  row.progress = in.get<std::uint8_t>();
  row.units_left = in.get<std::int32_t>();
  const auto calls = in.get<std::uint16_t>();
  const std::size_t lane = kTasks[row.row].row.lane;
  const bool in_order =
      row.cycle_ns > last_cycle_ns_[lane] || (row.cycle_ns == last_cycle_ns_[lane] && row.row > last_row_[lane]);
  if (!time_possible(row.cycle_ns) || !in_order) return is("a row out of its order");
  last_cycle_ns_[lane] = row.cycle_ns;
  last_row_[lane] = row.row;
  if (calls > kMaxCallsPerRow) return is("too many calls of ports in a row");
  for (std::size_t i = 0; i < calls; ++i) {
    if (!parse_call(in, row.call_memory[i])) return is("a call of a port that cannot be");
  }
  row.calls = std::span(row.call_memory).first(calls);
  if (looks_across(row.row) && !parse_view(in, row)) return is("frames of the other lane that cannot be");
  if (in.failed()) return is("a row that is too short");
  row.outputs = in;
  return true;
}

bool RecordParser::parse_picture(ByteReader& in, PortCall& call) noexcept {
  call.frame = {};
  call.frame.stamp_ns = in.get<std::int64_t>();
  call.frame.sequence = in.get<std::uint32_t>();
  call.frame.width_px = in.get<std::int32_t>();
  call.frame.height_px = in.get<std::int32_t>();
  const auto pixels = in.get<std::uint8_t>();
  if (pixels > static_cast<std::uint8_t>(Pixels::kNotRecorded)) return false;
  call.picture = {static_cast<Pixels>(pixels), pictures_, 0};
  const bool of_camera = call.frame.width_px == camera_.width_px && call.frame.height_px == camera_.height_px;
  if (call.picture.pixels == Pixels::kOtherSize && of_camera) return false;
  if (call.picture.pixels != Pixels::kStored) return true;
  call.picture.hash = in.get<std::uint64_t>();
  ++pictures_;
  return of_camera;
}

bool RecordParser::parse_call(ByteReader& in, PortCall& call) noexcept {
  call.kind = in.get<CallKind>();
  call.gave = in.get<bool>();
  FieldReader reader(in);
  switch (call.kind) {
    case CallKind::kReadImu:
      if (call.gave) walk(reader, "imu", call.imu);
      break;
    case CallKind::kReadJoints:
      if (call.gave) walk(reader, "joints", call.joints);
      break;
    case CallKind::kReadLidar:
      if (call.gave) walk(reader, "lio", call.lio);
      break;
    case CallKind::kReadOperator:
      if (call.gave) walk(reader, "request", call.asked);
      break;
    case CallKind::kWriteJoints:
      walk(reader, "taken", call.taken);
      if (call.gave != call.taken.is_all()) return false;
      walk(reader, "command", call.command);
      break;
    case CallKind::kAcquire:
      if (call.gave && !parse_picture(in, call)) return false;
      break;
    case CallKind::kJointStatus:
      walk(reader, "status", call.status);
      break;
    case CallKind::kRelease:
      break;
    default:
      return false;
  }
  return !in.failed();
}

}  // namespace polygmap::recording
