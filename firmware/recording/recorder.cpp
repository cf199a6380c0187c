// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/recorder.hpp"

#include <cerrno>

#include "firmware/config/param_table.hpp"

namespace polygmap::recording {
namespace {

constexpr std::size_t kHeaderMemory_bytes = 1024U * 1024U;

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

Recorder::Recorder(const Ports& robot) : robot_(robot) {
  const CameraIntrinsics camera = robot.camera.intrinsics();
  if (camera.width_px > 0 && camera.height_px > 0) {
    picture_px_ = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  }
  pixels_.resize(kPicturesPerFlush * picture_px_);
}

Recorder::~Recorder() {
  for (std::FILE* file : {file_, picture_file_}) {
    if (file != nullptr) (void)std::fclose(file);
  }
}

void Recorder::begin(const std::string& directory, const Params& params) {
  directory_ = directory;
  const CameraIntrinsics camera = robot_.camera.intrinsics();
  file_ = std::fopen((directory + "/" + kFileName).c_str(), "wb");
  picture_file_ = std::fopen((directory + "/" + kPictureFileName).c_str(), "wb");
  if (file_ == nullptr || picture_file_ == nullptr) {
    failure_ = "Cannot write \"" + directory + "/" + (file_ == nullptr ? kFileName : kPictureFileName) +
               "\": " + std::strerror(errno) + ".";
    return;
  }
  std::vector<std::byte> memory(kHeaderMemory_bytes);
  ByteWriter header(memory);
  put_header(header, params, camera);
  write(file_, header.bytes().data(), header.size(), kFileName);
  header.clear();
  header.put_bytes(kPictureMagic.data(), kPictureMagic.size());
  header.put(kVersion);
  header.put(camera.width_px);
  header.put(camera.height_px);
  write(picture_file_, header.bytes().data(), header.size(), kPictureFileName);
}

void Recorder::write(std::FILE* file, const void* bytes, std::size_t count, const char* name) {
  if (!failure_.empty() || count == 0) return;
  if (std::fwrite(bytes, 1, count, file) != count) {
    failure_ = "Cannot write \"" + directory_ + "/" + name + "\": " + std::strerror(errno) + ".";
  }
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
  std::size_t i = 0;
  for (const auto& line : kEventTable<ExecutiveEvent>) {
    Health probe;
    probe.raise(line.code, 0);
    EventCount count;
    for (const auto& fault : kFaultTable) {
      if (probe.count(fault.code).count > 0) count = health.count(fault.code);
    }
    for (const auto& limit : kLimitTable) {
      if (probe.count(limit.code).count > 0) count = health.count(limit.code);
    }
    std::uint32_t& told = log.told[i++];
    if (count.count == told) continue;
    const std::size_t begin = put_record(log.out, RecordKind::kEvent);
    log.out.put(static_cast<std::uint8_t>(lane));
    log.out.put(line.code);
    log.out.put(count.last_ns);
    log.out.put(count.count - told);
    put_length(log.out, begin);
    told = count.count;
  }
}

void Recorder::begin_row(std::size_t row, std::int64_t cycle_ns, const WorkBudget& budget) noexcept {
  const std::size_t lane = kTasks[row].row.lane;
  LaneLog& log = logs_[lane];
  begin_frame(log, cycle_ns);
  put_events(lane);
  log.length_at = put_record(log.out, RecordKind::kRow);
  log.out.put(static_cast<std::uint8_t>(row));
  log.out.put(cycle_ns);
  log.out.put(budget.left());
  log.out.put(kNoFrame_ns);
  log.count_at = log.out.size();
  log.out.put(std::uint16_t{0});
  log.calls = 0;
}

void Recorder::end_row(std::size_t row, Progress progress, const WorkBudget& budget) noexcept {
  const std::size_t lane = kTasks[row].row.lane;
  LaneLog& log = logs_[lane];
  const LaneView& view = lane == kControlLane ? pipeline_->control().view() : pipeline_->perception().view();
  log.frames[log.frame_count - 1].saw_ns = view.last_ns();
  log.out.put_at(log.count_at - sizeof(std::int64_t), view.other_finished_ns());
  log.out.put_at(log.count_at, log.calls);
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
}

void Recorder::begin_frame(LaneLog& log, std::int64_t cycle_ns) noexcept {
  if (log.frame_count > 0 && log.frames[log.frame_count - 1].cycle_ns == cycle_ns) return;
  if (log.frame_count == kFramesPerFlush) {
    no_room_[static_cast<std::size_t>(&log - logs_.data())] = true;
    log.frames[kFramesPerFlush - 1].cycle_ns = cycle_ns;
    return;
  }
  log.frames[log.frame_count] = {log.frame_count == 0 ? 0 : log.out.size(), cycle_ns, kNoFrame_ns};
  ++log.frame_count;
}

void Recorder::write_frame(const LaneLog& log, std::size_t frame) {
  const std::size_t begin = log.frames[frame].begin;
  const std::size_t end = frame + 1 < log.frame_count ? log.frames[frame + 1].begin : log.out.size();
  write(file_, log.out.bytes().data() + begin, end - begin, kFileName);
}

void Recorder::flush() {
  std::array<std::size_t, kLaneCount> next{};
  const auto frame_of = [&](std::size_t lane) -> const Frame* {
    return next[lane] < logs_[lane].frame_count ? &logs_[lane].frames[next[lane]] : nullptr;
  };
  for (std::size_t lane = 0; frame_of(kControlLane) != nullptr || frame_of(kPerceptionLane) != nullptr;) {
    const Frame *frame = frame_of(lane), *other = frame_of(1 - lane);
    // What the other lane has left it did not see, or it is that one's turn; both cannot wait for each other.
    if (frame != nullptr && (other == nullptr || other->cycle_ns > frame->saw_ns)) {
      write_frame(logs_[lane], next[lane]++);
    } else {
      lane = 1 - lane;
    }
  }
  for (LaneLog& log : logs_) {
    no_room_[0] = no_room_[0] || log.out.full();
    if (log.frame_count == 0) write(file_, log.out.bytes().data(), log.out.size(), kFileName);
    log.out.clear();
    log.frame_count = 0;
  }
  write(picture_file_, pixels_.data(), pictures_waiting_ * picture_px_ * sizeof(std::uint16_t), kPictureFileName);
  pictures_waiting_ = 0;
  if ((no_room_[0] || no_room_[1]) && failure_.empty())
    failure_ = "A tick had more to record than there is memory for.";
}

std::string Recorder::finish() {
  flush();
  ByteWriter& out = logs_[kControlLane].out;
  const std::size_t begin = put_record(out, RecordKind::kEnd);
  out.put(cycles_);
  out.put(pictures_);
  put_length(out, begin);
  flush();
  for (std::FILE** file : {&file_, &picture_file_}) {
    if (*file != nullptr && std::fclose(*file) != 0 && failure_.empty()) {
      failure_ = "Cannot write into \"" + directory_ + "\": " + std::strerror(errno) + ".";
    }
    *file = nullptr;
  }
  return failure_;
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
    log.out.put(hash_of_pixels(frame.depth, picture_px_));
    if (pictures_waiting_ == kPicturesPerFlush) {
      no_room_[kPerceptionLane] = true;
      return true;
    }
    std::memcpy(pixels_.data() + pictures_waiting_ * picture_px_, frame.depth, picture_px_ * sizeof(std::uint16_t));
    ++pictures_waiting_;
    ++pictures_;
  }
  return true;
}

void Recorder::release() noexcept {
  put_call(logs_[kPerceptionLane], CallKind::kRelease, true);
  robot_.camera.release();
}

}  // namespace polygmap::recording
