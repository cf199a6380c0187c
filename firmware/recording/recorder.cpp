// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/recorder.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "firmware/config/param_table.hpp"
#include "firmware/recording/recording_header.hpp"

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

// Kind and length, which put_length() fills in.
std::size_t put_record(ByteWriter& out, RecordKind kind) noexcept {
  out.put(kind);
  out.put(std::uint32_t{0});
  return out.size();
}
void put_length(ByteWriter& out, std::size_t begin) noexcept {
  out.put_at(begin - sizeof(std::uint32_t), static_cast<std::uint32_t>(out.size() - begin));
}

}  // namespace

Recorder::Recorder(const Ports& robot, hal::PictureKeeper* keeper) noexcept
    : robot_(robot),
      keeper_(keeper),
      logs_{LaneLog(control_frame_, control_queue_, control_next_),
            LaneLog(perception_frame_, perception_queue_, perception_next_)},
      parser_(robot.camera.intrinsics(), kRows) {
  static_assert(kLaneCount == 2);
}

Recorder::~Recorder() {
  for (const std::uint16_t* const pixels : pictures_.kept) keeper_->let_go(pixels);
}

void Recorder::begin(const std::string& path, const Params& params, std::uint64_t run) {
  const CameraIntrinsics camera = robot_.camera.intrinsics();
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
  put_length(log.out, put_record(log.out, RecordKind::kStop));
  pipeline_->control().request_stop();
}

// The executive counts in the lane's health: what has grown there since the last look.
void Recorder::put_events(std::size_t lane) noexcept {
  LaneLog& log = logs_[lane];
  const Health& health = pipeline_->lane_health(lane);
  for (std::size_t i = 0; i < kEventPlaces.size(); ++i) {
    const EventCount& count = kEventPlaces[i].is_fault ? health.counts<Fault>()[kEventPlaces[i].index]
                                                       : health.counts<Limit>()[kEventPlaces[i].index];
    std::uint32_t& told = log.told[i];
    if (count.count == told) continue;
    const std::size_t begin = put_record(log.out, RecordKind::kEvent);
    log.out.put(static_cast<std::uint8_t>(lane));
    log.out.put(kEventTable<ExecutiveEvent>[i].code);
    log.out.put(count.last_ns);
    log.out.put(count.count - told);
    put_length(log.out, begin);
    told = count.count;
  }
}

void Recorder::begin_row(std::size_t row, std::int64_t cycle_ns, const WorkBudget& budget) noexcept {
  const std::size_t lane = kTasks[row].row.lane;
  LaneLog& log = logs_[lane];
  log.head.cycle_ns = cycle_ns;
  put_events(lane);
  log.length_at = put_record(log.out, RecordKind::kRow);
  log.out.put(static_cast<std::uint8_t>(row));
  log.out.put(cycle_ns);
  log.out.put(budget.left());
  log.count_at = log.out.size();
  log.out.put(std::uint16_t{0});
  log.calls = 0;
}

void Recorder::end_row(std::size_t row, Progress progress, const WorkBudget& budget) noexcept {
  const std::size_t lane = kTasks[row].row.lane;
  LaneLog& log = logs_[lane];
  const LaneView& view = lane == kControlLane ? pipeline_->control().view() : pipeline_->perception().view();
  log.head.saw_ns = view.last_ns();
  log.out.put_at(log.count_at, log.calls);
  log.out.put(view.other_finished_ns());
  log.out.put(static_cast<std::uint8_t>(view.taken().size()));
  for (const TakenFrame& taken : view.taken()) {
    log.out.put(taken.frame_ns);
    log.out.put(taken.missed);
  }
  log.out.put(progress);
  log.out.put(budget.left());
  FieldWriter writer(log.out, &log.health);
  walk_outputs(writer, *pipeline_, row, log.head.cycle_ns, progress);
  put_length(log.out, log.length_at);
}

void Recorder::cycle_done(std::size_t lane, const CycleReport& report) noexcept {
  put_events(lane);
  ByteWriter& out = logs_[lane].out;
  const std::size_t begin = put_record(out, RecordKind::kCycle);
  out.put(static_cast<std::uint8_t>(lane));
  out.put(report.cycle);
  out.put(report.due_ns);
  out.put(static_cast<std::uint8_t>(report.slot));
  for (const std::uint32_t rows : {report.ran, report.shed, report.deferred, report.overran}) out.put(rows);
  out.put(report.overrun);
  out.put(report.caught_up);
  out.put(report.skipped_before);
  put_length(out, begin);
  last_cycle_ns_ = report.due_ns;
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

void Recorder::put_lost(std::size_t lane) noexcept {
  ByteWriter& out = logs_[lane].out;
  const std::size_t begin = put_record(out, RecordKind::kLost);
  out.put(static_cast<std::uint8_t>(lane));
  out.put(logs_[lane].lost);
  put_length(out, begin);
}

void Recorder::hand_over(std::size_t lane, std::int64_t now_ns) noexcept {
  LaneLog& log = logs_[lane];
  if (lane == kPerceptionLane) let_go_written();
  const std::span<const std::byte> head(reinterpret_cast<const std::byte*>(&log.head), sizeof log.head);
  const bool is_empty = log.out.size() == 0;
  const bool is_lost = !is_empty && (log.out.full() || !log.queue.try_push(head, log.out.bytes()));
  log.out.clear();
  if (is_lost) {
    if (log.head.picture.depth != nullptr) {
      keeper_->let_go(pictures_.kept.back());
      (void)pictures_.kept.try_pop_back();
      --pictures_.acquired;
      ++lost_pictures_;
    }
    ++log.lost;
    ++lost_frames_;
    pipeline_->lane_health(lane).raise(Limit::kRecordingLost, now_ns);
    log.health.fill({UINT32_MAX, 0, 0});  // so that the next frame has all of it
    put_lost(lane);
  } else if (!is_empty) {
    log.lost = 0;
  }
  log.head = {};
}

bool Recorder::load(LaneLog& log) noexcept {
  if (!log.next.empty()) return true;
  const std::span<std::byte> block = log.queue.pop(log.next_memory);
  if (block.empty()) return false;
  std::memcpy(&log.next_head, block.data(), sizeof log.next_head);
  log.next = block.subspan(sizeof log.next_head);
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
  std::memcpy(log.next.data() + log.next_head.hash_at, &hash, sizeof hash);
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
  const std::span<std::byte> message =
      log.next_memory.subspan(sizeof(FrameHead) - kMessageHead_bytes, kMessageHead_bytes + log.next.size());
  constexpr std::array<std::uint8_t, mcap::kCdrHead_bytes> kLittleEndian{0, 1, 0, 0};
  const auto count = static_cast<std::uint32_t>(log.next.size());
  std::memcpy(message.data(), kLittleEndian.data(), kLittleEndian.size());
  std::memcpy(message.data() + kLittleEndian.size(), &count, sizeof count);
  const std::int64_t log_ns = std::max<std::int64_t>(log.next_head.cycle_ns, 0);
  if (!has_parameters_) write(Topic::kParameters, log_ns, log_ns, parameters_);
  has_parameters_ = true;
  if (log.next_head.picture.depth != nullptr) write_picture(log);
  (void)writer_.write(static_cast<std::size_t>(Topic::kReplay), log_ns, log_ns, message);
  ByteReader in(log.next);
  while (!in.at_end() && parser_.parse(in, record_)) topics_.write(record_, sink_);
  log.next = {};
}

void Recorder::flush() noexcept {
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) hand_over(lane, last_cycle_ns_);
  write_out();
  let_go_written();
}

std::string Recorder::finish() {
  flush();
  if (!failed()) {
    LaneLog& log = logs_[kControlLane];
    log.head.cycle_ns = last_cycle_ns_;
    const std::size_t begin = put_record(log.out, RecordKind::kEnd);
    log.out.put(cycles_);
    log.out.put(pictures_.acquired);
    put_length(log.out, begin);
    flush();
  }
  if (!failed() && !writer_.close()) fail();
  if (failed()) return std::string("Cannot write \"") + writer_.path() + "\": " + std::strerror(writer_.error()) + ".";
  if (lost_frames_ == 0 && lost_pictures_ == 0) return {};
  return std::string("The recording \"") + writer_.path() + "\" lacks " + std::to_string(lost_frames_) +
         " frames and " + std::to_string(lost_pictures_) + " pictures: the disk was too slow for its memory.";
}

void Recorder::put_call(LaneLog& log, CallKind kind, bool gave) const noexcept {
  ++log.calls;
  log.out.put(kind);
  log.out.put(gave);
}

bool Recorder::try_read(ImuSample& sample) noexcept {
  LaneLog& log = logs_[kControlLane];
  const bool gave = robot_.imu.try_read(sample);
  put_call(log, CallKind::kReadImu, gave);
  FieldWriter writer(log.out, nullptr);
  if (gave) walk(writer, "imu", sample);
  return gave;
}

bool Recorder::try_read(JointFeedback& feedback) noexcept {
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

bool Recorder::try_read(OperatorCommand& command) noexcept {
  LaneLog& log = logs_[kControlLane];
  const bool gave = robot_.operator_input != nullptr && robot_.operator_input->try_read(command);
  put_call(log, CallKind::kReadOperator, gave);
  FieldWriter writer(log.out, nullptr);
  if (gave) walk(writer, "command", command);
  return gave;
}

JointSet Recorder::try_write(const JointCommand& command) noexcept {
  LaneLog& log = logs_[kControlLane];
  const JointSet taken = robot_.joints.try_write(command);
  put_call(log, CallKind::kWriteJoints, taken.is_all());
  FieldWriter writer(log.out, nullptr);
  walk(writer, "taken", taken);
  walk(writer, "command", command);
  return taken;
}

hal::JointBusStatus Recorder::status() const noexcept {
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
