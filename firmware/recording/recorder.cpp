// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/recorder.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "firmware/config/param_table.hpp"
#include "firmware/recording/stream/recording_header.hpp"

namespace polygmap::recording {
namespace {

constexpr std::size_t kHeaderMemory_bytes = 1024U * 1024U;

// The module's own rows, in their order.
constexpr auto kRows = [] {
  std::array<std::uint8_t, kTasks.size()> rows{};
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<std::uint8_t>(i);
  return rows;
}();

// Where a lane's health counts what its executive raises.
struct EventPlace {
  bool is_fault = false;
  std::size_t index = 0;
};
constexpr auto kEventPlaces = [] {
  std::array<EventPlace, kEventTable<ExecutiveEvent>.size()> places{};
  for (std::size_t i = 0; i < places.size(); ++i) {
    Health probe;
    probe.raise(kEventTable<ExecutiveEvent>[i].code, 0);
    for (std::size_t n = 0; n < kFaultTable.size(); ++n) {
      if (probe.counts<Fault>()[n].count > 0) places[i] = {true, n};
    }
    for (std::size_t n = 0; n < kLimitTable.size(); ++n) {
      if (probe.counts<Limit>()[n].count > 0) places[i] = {false, n};
    }
  }
  return places;
}();

// Numbers one behind the other, in one piece: cheaper than one by one.
template <Number... T>
[[nodiscard]] std::array<std::byte, (sizeof(T) + ...)> bytes_of(T... values) noexcept {
  std::array<std::byte, (sizeof(T) + ...)> bytes;
  std::size_t at = 0;
  ((std::memcpy(bytes.data() + at, &values, sizeof values), at += sizeof values), ...);
  return bytes;
}
template <Number... T>
void put_all(ByteWriter& out, T... values) noexcept {
  const auto bytes = bytes_of(values...);
  out.put_bytes(bytes.data(), bytes.size());
}
// Of any record: its kind and the length of the rest. Of a row, before its calls: row, cycle, units, progress, units
// left, how many calls.
constexpr std::size_t kRecordHead_bytes = sizeof(RecordKind) + sizeof(std::uint32_t);
constexpr std::size_t kRowHead_bytes = kRecordHead_bytes + 1 + 8 + 4 + 1 + 4 + 2;
constexpr auto kLaneOf = [] {
  std::array<std::uint8_t, kTasks.size()> lanes{};
  for (std::size_t row = 0; row < lanes.size(); ++row) lanes[row] = kTasks[row].row.lane;
  return lanes;
}();

// A record of these numbers alone.
template <Number... T>
void put_record(ByteWriter& out, RecordKind kind, T... values) noexcept {
  const auto length = static_cast<std::uint32_t>((sizeof(T) + ... + 0U));
  put_all(out, kind, length, values...);
}

}  // namespace

Recorder::Recorder(const Ports& robot, hal::PictureKeeper* keeper) noexcept
    : robot_(robot),
      keeper_(keeper),
      logs_{LaneLog(control_queue_), LaneLog(perception_queue_)},
      parser_(robot.camera.intrinsics(), kRows) {
  static_assert(kLaneCount == 2);
  static_assert(sizeof(Recorder) <= kMemoryBudget_bytes);
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) open_frame(lane);
}

Recorder::~Recorder() {
  for (const std::uint16_t* const pixels : pictures_.kept) keeper_->let_go(pixels);
}

void Recorder::begin(const std::string& path, const Params& params, std::uint64_t run) {
  const CameraIntrinsics camera = robot_.camera.intrinsics();
  topics_.set_camera(params.robot.mounts.base_T_camera);
  if (!writer_.open(path, channels(), run)) return fail();
  std::vector<std::byte> memory(kHeaderMemory_bytes), message_memory(2 * kHeaderMemory_bytes);
  ByteWriter header(memory);
  put_recording_header(header, params, camera);
  Params copy = params;
  const config::ParamTable table = config::param_table(copy);
  mcap::CdrWriter message(message_memory);
  message.put_text(config::hash_of(table));
  message.put_count(table.params.size());
  for (const config::Param& param : table.params) message.put_text(param.name);
  message.put_count(table.params.size());
  for (const config::Param& param : table.params) message.put_text(config::text_of(param));
  message.put_bytes(header.bytes());
  parameters_.assign(message.bytes().begin(), message.bytes().end());
}

void Recorder::Sink::take(Topic topic, std::int64_t log_ns, std::int64_t publish_ns,
                          std::span<const std::byte> message) noexcept {
  (void)writer.write(static_cast<std::size_t>(topic), log_ns, publish_ns, message);
}

void Recorder::write(Topic topic, std::int64_t log_ns, std::int64_t publish_ns,
                     std::span<const std::byte> message) noexcept {
  if (!writer_.write(static_cast<std::size_t>(topic), log_ns, publish_ns, message)) fail();
}

void Recorder::request_stop() noexcept {
  LaneLog& log = logs_[kControlLane];
  put_record(log.out, RecordKind::kStop);
  pipeline_->control().request_stop();
}

// The executive counts in the lane's health: what has grown there since the last look.
void Recorder::put_events(std::size_t lane) noexcept {
  LaneLog& log = logs_[lane];
  const Health& health = pipeline_->lane_health(lane);
  log.raised = health.raised();
  for (std::size_t i = 0; i < kEventPlaces.size(); ++i) {
    const EventCount& count = kEventPlaces[i].is_fault ? health.counts<Fault>()[kEventPlaces[i].index]
                                                       : health.counts<Limit>()[kEventPlaces[i].index];
    std::uint32_t& told = log.told[i];
    if (count.count == told) continue;
    put_record(log.out, RecordKind::kEvent, static_cast<std::uint8_t>(lane), kEventTable<ExecutiveEvent>[i].code,
               count.last_ns, count.count - told);
    told = count.count;
  }
}

void Recorder::begin_row(std::size_t row, std::int64_t cycle_ns, const WorkBudget& budget) noexcept {
  const std::size_t lane = kLaneOf[row];
  LaneLog& log = logs_[lane];
  if (log.waits && !log.out.full()) open_frame(lane);  // there may be room by now
  log.head.cycle_ns = cycle_ns;
  if (pipeline_->lane_health(lane).raised() != log.raised) put_events(lane);
  log.row_at = log.out.size();
  log.out.skip(kRowHead_bytes);
  log.units = budget.left();
  log.calls = 0;
}

// Flattened: so the place that the next number goes to stays in a register.
[[gnu::flatten]] void Recorder::end_row(std::size_t row, Progress progress, const WorkBudget& budget) noexcept {
  const std::size_t lane = kLaneOf[row];
  LaneLog& log = logs_[lane];
  if (looks_across(row)) put_view(log, lane);
  if (has_outputs(row, progress)) {
    FieldWriter writer(log.out, &log.health);
    walk_outputs(writer, *pipeline_, row, log.head.cycle_ns, progress);
  }
  const auto length = static_cast<std::uint32_t>(log.out.size() - log.row_at - kRecordHead_bytes);
  log.out.put_at(log.row_at, bytes_of(RecordKind::kRow, length, static_cast<std::uint8_t>(row), log.head.cycle_ns,
                                      log.units, progress, budget.left(), log.calls));
}

void Recorder::put_view(LaneLog& log, std::size_t lane) noexcept {
  const LaneView& view = lane == kControlLane ? pipeline_->control().view() : pipeline_->perception().view();
  log.head.saw_ns = view.last_ns();
  FieldWriter writer(log.out, nullptr);
  writer.leaf("", -1, view.other_finished_ns());
  writer.leaf("", -1, static_cast<std::uint8_t>(view.taken().size()));
  for (const TakenFrame& taken : view.taken()) {
    writer.leaf("", -1, taken.frame_ns);
    writer.leaf("", -1, taken.missed);
  }
}

void Recorder::cycle_done(std::size_t lane, const CycleReport& report) noexcept {
  put_events(lane);
  put_record(logs_[lane].out, RecordKind::kCycle, static_cast<std::uint8_t>(lane), report.cycle, report.due_ns,
             static_cast<std::uint8_t>(report.slot), report.ran, report.shed, report.deferred, report.overran,
             report.overrun, report.caught_up, report.skipped_before);
  logs_[lane].last_cycle_ns = report.due_ns;
  if (lane == kControlLane) ++cycles_;
  hand_over(lane, report.due_ns);
  // An executive of one lane has the rows of both.
  constexpr std::size_t kFirstOfPerception = [] {
    std::size_t row = 0;
    while (kTasks[row].row.lane != kPerceptionLane) ++row;
    return row;
  }();
  const std::uint32_t rows = report.ran | report.shed | report.deferred;
  if (lane == kControlLane && rows >> kFirstOfPerception != 0) hand_over(kPerceptionLane, report.due_ns);
}

// Records are written where the queue has them.
void Recorder::open_frame(std::size_t lane) noexcept {
  LaneLog& log = logs_[lane];
  log.head = {};
  log.frame = log.queue.reserve(kFrame_bytes[lane]);
  log.out = ByteWriter(log.frame.empty() ? log.frame : log.frame.subspan(sizeof(FrameHead)));
  if (log.lost > 0 && !log.frame.empty()) {
    put_record(log.out, RecordKind::kLost, static_cast<std::uint8_t>(lane), log.lost);
  }
  log.opened_bytes = log.out.size();
  log.waits = log.frame.empty();
}

void Recorder::hand_over(std::size_t lane, std::int64_t now_ns) noexcept {
  LaneLog& log = logs_[lane];
  if (lane == kPerceptionLane) let_go_written();
  const bool is_lost = log.out.full();
  if (!is_lost && log.out.size() == log.opened_bytes) {
    if (log.frame.empty()) open_frame(lane);
    return;
  }
  if (!is_lost) {
    std::memcpy(log.frame.data(), &log.head, sizeof log.head);
    log.queue.commit(sizeof log.head + log.out.size());
    log.lost = 0;
    return open_frame(lane);
  }
  if (log.head.picture.depth != nullptr) {
    keeper_->let_go(pictures_.kept.back());
    (void)pictures_.kept.try_pop_back();
    --pictures_.acquired;
    ++lost_pictures_;
  }
  ++log.lost;
  ++log.all_lost;
  pipeline_->lane_health(lane).raise(Limit::kRecordingLost, now_ns);
  --log.health;  // so that the next frame has all of it
  open_frame(lane);
}

bool Recorder::load(LaneLog& log) noexcept {
  if (!log.next.empty()) return true;
  const std::span<std::byte> block = log.queue.front();
  if (block.empty()) return false;
  std::memcpy(&log.next_head, block.data(), sizeof log.next_head);
  log.next = block;
  return true;
}

// A lane hands its frame over before the other one can see it (RecordedTasks). So what a frame saw is in the other
// queue when it is looked into after the frame was there.
void Recorder::write_out() noexcept {
  for (std::size_t lane = 0, waited = 0; waited < kLaneCount;) {
    LaneLog &log = logs_[lane], &other = logs_[1 - lane];
    const bool sees_all = load(log) && (!load(other) || other.next_head.cycle_ns > log.next_head.saw_ns);
    if (sees_all) write_frame(log);
    waited = sees_all ? 0 : waited + 1;
    if (!sees_all) lane = 1 - lane;
  }
  if (writer_.error() != 0) fail();
}

void Recorder::write_picture(LaneLog& log) noexcept {
  const DepthFrameView& picture = log.next_head.picture;
  const auto count = static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px);
  const std::uint64_t hash = hash_of_pixels(picture.depth, count);
  std::memcpy(log.next.data() + sizeof(FrameHead) + log.next_head.hash_at, &hash, sizeof hash);
  const std::int64_t log_ns = log.next_head.cycle_ns;
  constexpr auto kCameraInfo = static_cast<std::size_t>(Topic::kCameraInfo),
                 kDepth = static_cast<std::size_t>(Topic::kDepth);
  (void)writer_.write(kCameraInfo, log_ns, picture.stamp_ns, topics_.camera_info(intrinsics(), picture.stamp_ns));
  (void)writer_.write_alone(kDepth, log_ns, picture.stamp_ns, topics_.image_head(picture),
                            std::as_bytes(std::span(picture.depth, count)));
  pictures_written_.fetch_add(1, std::memory_order_release);
}

void Recorder::write_frame(LaneLog& log) noexcept {
  // The head was copied; its last bytes become the message's.
  const std::span<std::byte> records = log.next.subspan(sizeof(FrameHead));
  const std::span<std::byte> message = log.next.subspan(sizeof(FrameHead) - kMessageHead_bytes);
  constexpr std::array<std::uint8_t, mcap::kCdrHead_bytes> kLittleEndian{0, 1, 0, 0};
  const auto count = static_cast<std::uint32_t>(records.size());
  std::memcpy(message.data(), kLittleEndian.data(), kLittleEndian.size());
  std::memcpy(message.data() + kLittleEndian.size(), &count, sizeof count);
  const std::int64_t log_ns = std::max<std::int64_t>(log.next_head.cycle_ns, 0);
  if (!has_parameters_) write(Topic::kParameters, log_ns, log_ns, parameters_);
  has_parameters_ = true;
  if (log.next_head.picture.depth != nullptr) write_picture(log);
  (void)writer_.write(static_cast<std::size_t>(Topic::kReplay), log_ns, log_ns, message);
  ByteReader in(records);
  while (!in.at_end() && parser_.parse(in, record_)) topics_.write(record_, sink_);
  log.next = {};
  log.queue.pop();
}

void Recorder::flush() noexcept {
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) hand_over(lane, logs_[lane].last_cycle_ns);
  write_out();
  let_go_written();
}

std::string Recorder::finish() {
  flush();
  if (!failed()) {
    LaneLog& log = logs_[kControlLane];
    log.head.cycle_ns = log.last_cycle_ns;
    put_record(log.out, RecordKind::kEnd, cycles_, pictures_.acquired);
    flush();
  }
  if (!failed() && !writer_.close()) fail();
  if (failed()) return std::string("Cannot write \"") + writer_.path() + "\": " + std::strerror(writer_.error()) + ".";
  if (lost_frames() == 0 && lost_pictures_ == 0) return {};
  return std::string("The recording \"") + writer_.path() + "\" lacks " + std::to_string(lost_frames()) +
         " frames and " + std::to_string(lost_pictures_) + " pictures: the disk was too slow for its memory.";
}

void Recorder::put_call(LaneLog& log, CallKind kind, bool gave) const noexcept {
  ++log.calls;
  put_all(log.out, kind, gave);
}

[[gnu::flatten]] bool Recorder::try_read(ImuSample& sample) noexcept {
  LaneLog& log = logs_[kControlLane];
  const bool gave = robot_.imu.try_read(sample);
  put_call(log, CallKind::kReadImu, gave);
  FieldWriter writer(log.out, nullptr);
  if (gave) walk(writer, "imu", sample);
  return gave;
}

[[gnu::flatten]] bool Recorder::try_read(JointFeedback& feedback) noexcept {
  LaneLog& log = logs_[kControlLane];
  const bool gave = robot_.joints.try_read(feedback);
  put_call(log, CallKind::kReadJoints, gave);
  FieldWriter writer(log.out, nullptr);
  if (gave) walk(writer, "joints", feedback);
  return gave;
}

bool Recorder::try_read(LioSample& sample) noexcept {
  LaneLog& log = logs_[kControlLane];
  const bool gave = robot_.lio.try_read(sample);
  put_call(log, CallKind::kReadLidar, gave);
  FieldWriter writer(log.out, nullptr);
  if (gave) walk(writer, "lio", sample);
  return gave;
}

bool Recorder::try_read(OperatorRequest& request) noexcept {
  LaneLog& log = logs_[kControlLane];
  const bool gave = robot_.operator_input != nullptr && robot_.operator_input->try_read(request);
  put_call(log, CallKind::kReadOperator, gave);
  FieldWriter writer(log.out, nullptr);
  if (gave) walk(writer, "request", request);
  return gave;
}

[[gnu::flatten]] JointSet Recorder::try_write(const JointCommand& command) noexcept {
  LaneLog& log = logs_[kControlLane];
  const JointSet taken = robot_.joints.try_write(command);
  put_call(log, CallKind::kWriteJoints, taken.is_all());
  FieldWriter writer(log.out, nullptr);
  walk(writer, "taken", taken);
  walk(writer, "command", command);
  return taken;
}

[[gnu::flatten]] hal::JointBusStatus Recorder::status() const noexcept {
  const hal::JointBusStatus status = robot_.joints.status();
  LaneLog& log = logs_[kControlLane];
  put_call(log, CallKind::kJointStatus, true);
  FieldWriter writer(log.out, nullptr);
  walk(writer, "status", status);
  return status;
}

bool Recorder::try_acquire(DepthFrameView& frame) noexcept {
  LaneLog& log = logs_[kPerceptionLane];
  const bool gave = robot_.camera.try_acquire(frame);
  put_call(log, CallKind::kAcquire, gave);
  if (!gave) return false;
  log.out.put(frame.stamp_ns);
  log.out.put(frame.sequence);
  log.out.put(frame.width_px);
  log.out.put(frame.height_px);
  const CameraIntrinsics camera = robot_.camera.intrinsics();
  if (frame.depth == nullptr) {
    log.out.put(Pixels::kNone);
  } else if (frame.width_px != camera.width_px || frame.height_px != camera.height_px) {
    log.out.put(Pixels::kOtherSize);
  } else {
    keep_picture(log, frame);
  }
  return true;
}

void Recorder::keep_picture(LaneLog& log, const DepthFrameView& frame) noexcept {
  let_go_written();
  const bool can_be = keeper_ != nullptr && log.head.picture.depth == nullptr && !pictures_.kept.full();
  if (!can_be || !keeper_->try_keep(frame)) {
    log.out.put(Pixels::kNotRecorded);
    if (keeper_ == nullptr) return;
    ++lost_pictures_;
    return pipeline_->lane_health(kPerceptionLane).raise(Limit::kRecordingLost, frame.stamp_ns);
  }
  log.out.put(Pixels::kStored);
  log.head.picture = frame;
  log.head.hash_at = log.out.size();
  log.out.put(std::uint64_t{0});  // it takes longer than a row has: the other thread's work
  (void)pictures_.kept.try_push_back(frame.depth);
  ++pictures_.acquired;
}

// The driver's buffers go back in the lane that took them.
void Recorder::let_go_written() noexcept {
  const std::uint32_t written = pictures_written_.load(std::memory_order_acquire);
  std::size_t gone = 0;
  for (; gone < pictures_.kept.size() && pictures_.let_go < written; ++gone, ++pictures_.let_go) {
    keeper_->let_go(pictures_.kept[gone]);
  }
  if (gone == 0) return;
  std::copy(pictures_.kept.begin() + gone, pictures_.kept.end(), pictures_.kept.begin());
  (void)pictures_.kept.try_resize(pictures_.kept.size() - gone);
}

void Recorder::release() noexcept {
  put_call(logs_[kPerceptionLane], CallKind::kRelease, true);
  robot_.camera.release();
}

}  // namespace polygmap::recording
