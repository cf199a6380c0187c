// SPDX-License-Identifier: Apache-2.0
// Writes down everything that goes into the module and comes out of it, for replay.hpp.
#pragma once

#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "firmware/recording/format.hpp"
#include "firmware/recording/outputs.hpp"
#include "firmware/schedule.hpp"

namespace polygmap::recording {

// Stands between the robot's ports and the module, and between the executive and the module's rows. While the module
// calls it allocates nothing and talks to no file: flush() does that between the ticks. Each lane writes into memory of
// its own; flush() is for a moment in which none runs.
class Recorder final : public hal::DepthCamera, public hal::Imu, public hal::JointBus, public hal::LidarOdometry {
 public:
  explicit Recorder(const Ports& robot);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  [[nodiscard]] Ports ports() noexcept { return {*this, *this, *this, *this}; }
  // Makes both files in a directory that exists. params: the module's, from its start on.
  void begin(const std::string& directory, const Params& params);
  // The module that ports() were given to, before its first cycle.
  void watch(Pipeline& pipeline) noexcept { pipeline_ = &pipeline; }

  void request_stop() noexcept;  // the operator's, in control's lane
  void begin_row(std::size_t row, std::int64_t cycle_ns, const WorkBudget& budget) noexcept;
  void end_row(std::size_t row, Progress progress, const WorkBudget& budget) noexcept;
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept;

  void flush();
  // Closes the files. What begin() or flush() could not do is said here: one sentence, empty when all was written.
  [[nodiscard]] std::string finish();

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return robot_.camera.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override;
  void release() noexcept override;
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override;
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override;
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override;
  [[nodiscard]] hal::JointBusStatus status() const noexcept override;
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override;

 private:
  static constexpr std::size_t kLaneMemory_bytes = 1024U * 1024U;  // three cycles, all their polygons
  static constexpr std::size_t kPicturesPerFlush = 4;
  // What a lane wrote in one frame. It goes into the file after all of the other lane that it saw: a replay lives the
  // frames one after the other.
  struct Frame {
    std::size_t begin = 0;  // in the lane's memory
    std::int64_t cycle_ns = 0;
    std::int64_t saw_ns = kNoFrame_ns;  // up to this frame of the other lane
  };
  static constexpr std::size_t kFramesPerFlush = 16;
  struct LaneLog {
    std::vector<std::byte> memory = std::vector<std::byte>(kLaneMemory_bytes);
    ByteWriter out{memory};
    std::size_t length_at = 0, count_at = 0;  // to be filled in when the row is over
    std::uint16_t calls = 0;
    std::array<Frame, kFramesPerFlush> frames;
    std::size_t frame_count = 0;
    std::array<std::uint32_t, kEventTable<ExecutiveEvent>.size()> told{};  // events written so far
    HealthCounts health{};                                                 // as written last
  };

  void put_call(LaneLog& log, CallKind kind, bool gave) const noexcept;
  void put_events(std::size_t lane) noexcept;
  void begin_frame(LaneLog& log, std::int64_t cycle_ns) noexcept;
  void write_frame(const LaneLog& log, std::size_t frame);
  void write(std::FILE* file, const void* bytes, std::size_t count, const char* name);

  Ports robot_;
  Pipeline* pipeline_ = nullptr;
  mutable std::array<LaneLog, kLaneCount> logs_;  // a const port call is recorded, too
  std::vector<std::uint16_t> pixels_;             // of kPicturesPerFlush pictures
  std::size_t picture_px_ = 0;
  std::size_t pictures_waiting_ = 0;
  std::uint32_t pictures_ = 0;
  std::uint64_t cycles_ = 0;
  std::string directory_;
  std::FILE* file_ = nullptr;
  std::FILE* picture_file_ = nullptr;
  std::string failure_;
  std::array<bool, kLaneCount> no_room_{};
};

// The module's rows on their way to an executive.
template <class Tasks>
class RecordedTasks {
 public:
  // recorder: null where nothing is recorded.
  RecordedTasks(Tasks& tasks, Recorder* recorder) noexcept : tasks_(tasks), recorder_(recorder) {}

  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    if (recorder_ == nullptr) return tasks_.run_row(row, cycle_ns, budget);
    recorder_->begin_row(row, cycle_ns, budget);
    const Progress progress = tasks_.run_row(row, cycle_ns, budget);
    recorder_->end_row(row, progress, budget);
    return progress;
  }
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept {
    if (recorder_ != nullptr) recorder_->cycle_done(lane, report);
    tasks_.cycle_done(lane, report);
  }

 private:
  Tasks& tasks_;
  Recorder* recorder_;
};

}  // namespace polygmap::recording
