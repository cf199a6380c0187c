// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/recorder.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "firmware/config/param_table.hpp"

namespace polygmap::recording {
namespace {

constexpr std::size_t kHeaderMemory_bytes = 1024U * 1024U;

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

void put_name(ByteWriter& out, std::string_view name) {
  out.put(static_cast<std::uint16_t>(name.size()));
  out.put_bytes(name.data(), name.size());
}

void put_numbers(ByteWriter& out, ValueKind kind, const auto* first, std::size_t count) {
  out.put(kind);
  out.put(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) out.put(first[i]);
}

struct PutValue {
  ByteWriter& out;
  void operator()(const bool* value) const { put_numbers(out, ValueKind::kBool, value, 1); }
  void operator()(const std::int32_t* value) const { put_numbers(out, ValueKind::kI32, value, 1); }
  void operator()(const std::uint32_t* value) const { put_numbers(out, ValueKind::kU32, value, 1); }
  void operator()(const std::int64_t* value) const { put_numbers(out, ValueKind::kI64, value, 1); }
  void operator()(const double* value) const { put_numbers(out, ValueKind::kF64, value, 1); }
  void operator()(std::span<double> values) const { put_numbers(out, ValueKind::kF64, values.data(), values.size()); }
  void operator()(config::EnumValue choice) const { put_numbers(out, ValueKind::kChoice, choice.value, 1); }
  void operator()(config::RotationValue rotation) const {
    put_numbers(out, ValueKind::kF64, rotation.value->data(), 9);
  }
};

void put_header(ByteWriter& out, const Params& params, const CameraIntrinsics& camera) {
  out.put_bytes(kMagic.data(), kMagic.size());
  out.put(kVersion);
  out.put(hash_of_fields());
  Params copy = params;
  const config::ParamTable table = config::param_table(copy);
  out.put(static_cast<std::uint32_t>(table.params.size()));
  for (const config::Param& param : table.params) {
    put_name(out, param.name);
    std::visit(PutValue{out}, param.value);
  }
  out.put(static_cast<std::uint32_t>(kTasks.size()));
  for (const Task& task : kTasks) {
    put_name(out, task.row.task);
    out.put(task.row.lane);
    out.put(task.row.slots);
    out.put(task.row.budget_us);
    out.put(task.row.unit_cost_ns);
    out.put(task.row.shed_order);
  }
  FieldWriter writer(out, nullptr);
  walk(writer, "camera", camera);
  walk(writer, "gain_limits", params.robot.drives.gain_limits);
}

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

Recorder::Recorder(const Ports& robot, const Capacity& capacity)
    : robot_(robot), capacity_(capacity), logs_{LaneLog(capacity.queue_bytes), LaneLog(capacity.queue_bytes)} {
  static_assert(kLaneCount == 2);
  const CameraIntrinsics camera = robot.camera.intrinsics();
  if (camera.width_px > 0 && camera.height_px > 0) {
    picture_px_ = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  }
  pixels_.resize(capacity_.pictures * picture_px_);
}

Recorder::~Recorder() {
  if (copy_.kept) capacity_.keeper->let_go();
  for (std::FILE* file : {file_, picture_file_}) {
    if (file != nullptr) (void)std::fclose(file);
  }
}

void Recorder::begin(const std::string& directory, const Params& params) {
  directory_ = directory;
  const CameraIntrinsics camera = robot_.camera.intrinsics();
  file_ = std::fopen((directory + "/" + kFileName).c_str(), "wb");
  if (file_ != nullptr) picture_file_ = std::fopen((directory + "/" + kPictureFileName).c_str(), "wb");
  if (picture_file_ == nullptr) {
    errno_.store(errno);
    unmade_file_ = file_ == nullptr ? kFileName : kPictureFileName;
    return fail(Failure::kBegin);
  }
  std::vector<std::byte> memory(kHeaderMemory_bytes);
  ByteWriter header(memory);
  put_header(header, params, camera);
  write(file_, header.bytes().data(), header.size());
  header.clear();
  header.put_bytes(kPictureMagic.data(), kPictureMagic.size());
  header.put(kVersion);
  header.put(camera.width_px);
  header.put(camera.height_px);
  write(picture_file_, header.bytes().data(), header.size());
}

void Recorder::fail(Failure failure) noexcept {
  Failure none = Failure::kNone;  // the first one is told
  (void)failure_.compare_exchange_strong(none, failure, std::memory_order_acq_rel);
}

void Recorder::write(std::FILE* file, const void* bytes, std::size_t count) noexcept {
  const Failure before = failure_.load(std::memory_order_acquire);
  if (before == Failure::kBegin || before == Failure::kWrite || count == 0) return;
  if (std::fwrite(bytes, 1, count, file) == count) return;
  errno_.store(errno);
  fail(Failure::kWrite);
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
  walk_outputs(writer, *pipeline_, row, progress);
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
  if (lane == kControlLane) ++cycles_;
  hand_over(logs_[lane]);
  // An executive of one lane has the rows of both.
  constexpr std::size_t kFirstOfPerception = [] {
    std::size_t row = 0;
    while (kTasks[row].row.lane != kPerceptionLane) ++row;
    return row;
  }();
  const std::uint32_t rows = report.ran | report.shed | report.deferred;
  if (lane == kControlLane && rows >> kFirstOfPerception != 0) hand_over(logs_[kPerceptionLane]);
}

void Recorder::hand_over(LaneLog& log) noexcept {
  if (log.out.full()) fail(Failure::kFrameTooLarge);
  const std::span<const std::byte> head(reinterpret_cast<const std::byte*>(&log.head), sizeof log.head);
  if (log.out.size() > 0 && !failed() && !log.queue.try_push(head, log.out.bytes())) fail(Failure::kQueueFull);
  log.out.clear();
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
void Recorder::write_out() {
  for (std::size_t lane = 0, waited = 0; waited < kLaneCount;) {
    LaneLog &log = logs_[lane], &other = logs_[1 - lane];
    const bool sees_all =
        load(log) && (!load(other) || other.next_head.cycle_ns > log.next_head.saw_ns) && write_frame(log);
    waited = sees_all ? 0 : waited + 1;
    if (!sees_all) lane = 1 - lane;
  }
}

bool Recorder::write_frame(LaneLog& log) {
  const std::uint32_t written = pictures_written_.load(std::memory_order_relaxed);
  if (pictures_copied_.load(std::memory_order_acquire) - written < log.next_head.pictures) return false;
  for (std::uint32_t i = 0; i < log.next_head.pictures; ++i) {
    const std::uint16_t* pixels = pixels_.data() + ((written + i) % capacity_.pictures) * picture_px_;
    const std::uint64_t hash = hash_of_pixels(pixels, picture_px_);
    std::memcpy(log.next.data() + log.next_head.hash_at[i], &hash, sizeof hash);
    write(picture_file_, pixels, picture_px_ * sizeof(std::uint16_t));
    pictures_written_.store(written + i + 1, std::memory_order_release);
  }
  write(file_, log.next.data(), log.next.size());
  log.next = {};
  return true;
}

void Recorder::flush() {
  for (LaneLog& log : logs_) hand_over(log);
  copy_pixels(picture_px_);
  write_out();
}

std::string Recorder::finish() {
  flush();
  if (!failed()) {
    ByteWriter& out = logs_[kControlLane].out;
    const std::size_t begin = put_record(out, RecordKind::kEnd);
    out.put(cycles_);
    out.put(pictures_);
    put_length(out, begin);
    flush();
  }
  for (std::FILE** file : {&file_, &picture_file_}) {
    if (*file != nullptr && std::fclose(*file) != 0) {
      errno_.store(errno);
      fail(Failure::kWrite);
    }
    *file = nullptr;
  }
  return sentence();
}

std::string Recorder::sentence() const {
  switch (failure_.load(std::memory_order_acquire)) {
    case Failure::kNone:
      break;
    case Failure::kBegin:
      return "Cannot write \"" + directory_ + "/" + unmade_file_ + "\": " + std::strerror(errno_.load()) + ".";
    case Failure::kWrite:
      return "Cannot write into \"" + directory_ + "\": " + std::strerror(errno_.load()) + ".";
    case Failure::kFrameTooLarge:
      return "The recording in \"" + directory_ + "\" ends early: a cycle had more to record than there is memory for.";
    case Failure::kQueueFull:
      return "The recording in \"" + directory_ + "\" ends early: its queue was full.";
    case Failure::kPicturesFull:
      return "The recording in \"" + directory_ + "\" ends early: its queue of pictures was full.";
  }
  return {};
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
    log.out.put(Pixels::kStored);
    put_picture(log, frame);
  }
  return true;
}

// The hash takes longer than a row has: it is the other thread's work, as is the file's.
void Recorder::put_picture(LaneLog& log, const DepthFrameView& frame) noexcept {
  copy_pixels(picture_px_);  // the rest of the one before, if a lane was so late
  const std::size_t waiting = pictures_ - pictures_written_.load(std::memory_order_acquire);
  if (waiting == capacity_.pictures || log.head.pictures == kPicturesPerFrame) fail(Failure::kPicturesFull);
  log.head.hash_at[log.head.pictures % kPicturesPerFrame] = static_cast<std::uint32_t>(log.out.size());
  log.out.put(std::uint64_t{0});
  if (failed()) return;
  ++log.head.pictures;
  ++pictures_;
  DepthFrameView kept = frame;
  const bool is_kept = capacity_.keeper != nullptr && capacity_.keeper->try_keep(kept);
  copy_ = {is_kept ? kept.depth : frame.depth, 0, is_kept};
  if (!copy_.kept) copy_pixels(picture_px_);
}

void Recorder::copy_piece() noexcept { copy_pixels(kPiece_px); }

void Recorder::copy_pixels(std::size_t most_px) noexcept {
  if (copy_.from == nullptr) return;
  const std::size_t count = std::min(most_px, picture_px_ - copy_.done_px);
  std::uint16_t* to = pixels_.data() + ((pictures_ - 1) % capacity_.pictures) * picture_px_ + copy_.done_px;
  std::memcpy(to, copy_.from + copy_.done_px, count * sizeof *to);
  copy_.done_px += count;
  if (copy_.done_px < picture_px_) return;
  if (copy_.kept) capacity_.keeper->let_go();
  copy_ = {};
  pictures_copied_.store(pictures_, std::memory_order_release);
}

void Recorder::release() noexcept {
  put_call(logs_[kPerceptionLane], CallKind::kRelease, true);
  robot_.camera.release();
}

}  // namespace polygmap::recording
