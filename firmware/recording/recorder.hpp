// SPDX-License-Identifier: Apache-2.0
// Writes down everything that goes into the module and comes out of it, for replay.hpp.
#pragma once

#include <array>
#include <atomic>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "firmware/recording/block_queue.hpp"
#include "firmware/recording/format.hpp"
#include "firmware/recording/outputs.hpp"
#include "firmware/schedule.hpp"

namespace polygmap::recording {

// A picture that the module holds, kept for a second holder after the module has released it (V4l2Camera).
class PictureKeeper {
 public:
  // The picture that was acquired last, its pixels valid until let_go(); false: it cannot be kept.
  [[nodiscard]] virtual bool try_keep(DepthFrameView& frame) noexcept = 0;
  virtual void let_go() noexcept = 0;

 protected:
  ~PictureKeeper() = default;
};

// Stands between the robot's ports and the module, and between the executive and the module's rows. While the module
// calls it allocates nothing and talks to no file: each lane writes into memory of its own and hands it over when its
// cycle is over, through a queue of a fixed size. write_out() empties the queues into the files, on whatever thread,
// while the lanes run or between their ticks. What finds no room in a queue ends the recording there, and says so.
class Recorder final : public hal::DepthCamera,
                       public hal::Imu,
                       public hal::JointBus,
                       public hal::LidarOdometry,
                       public hal::OperatorInput {
 public:
  struct Capacity {
    std::size_t queue_bytes = 4U * 1024U * 1024U;  // of each lane
    std::size_t pictures = 4;
    PictureKeeper* keeper = nullptr;  // null: a picture is copied when it is acquired, in one piece
  };
  explicit Recorder(const Ports& robot) : Recorder(robot, Capacity{}) {}
  Recorder(const Ports& robot, const Capacity& capacity);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  [[nodiscard]] Ports ports() noexcept { return {*this, *this, *this, *this, this}; }
  // Makes both files in a directory that exists. params: the module's, from its start on.
  void begin(const std::string& directory, const Params& params);
  // The module that ports() were given to, before its first cycle.
  void watch(Pipeline& pipeline) noexcept { pipeline_ = &pipeline; }

  void request_stop() noexcept;  // the operator's, in control's lane
  void begin_row(std::size_t row, std::int64_t cycle_ns, const WorkBudget& budget) noexcept;
  void end_row(std::size_t row, Progress progress, const WorkBudget& budget) noexcept;
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept;
  // In perception's lane after a tick: copies a piece of the picture that is kept.
  void copy_piece() noexcept;

  // On one thread, whether the lanes run or not: writes what was handed over.
  void write_out();
  // No lane runs: hands over what belongs to no finished cycle, too, and writes it.
  void flush();
  // No lane runs: writes the rest and closes the files. What begin() or a write could not do, or what was lost, is said
  // here: one sentence, empty when all was written.
  [[nodiscard]] std::string finish();
  // The recording has ended before the module. From any thread.
  [[nodiscard]] bool failed() const noexcept { return failure_.load(std::memory_order_acquire) != Failure::kNone; }

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return robot_.camera.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override;
  void release() noexcept override;
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override;
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override;
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override;
  [[nodiscard]] hal::JointBusStatus status() const noexcept override;
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override;
  [[nodiscard]] bool try_read(OperatorCommand& command) noexcept override;
  void answer(const OperatorAnswer& answer) noexcept override {
    if (robot_.operator_input != nullptr) robot_.operator_input->answer(answer);
  }

 private:
  static constexpr std::size_t kFrameMemory_bytes = 1024U * 1024U;  // of a lane in one frame, with all its polygons
  static constexpr std::size_t kPicturesPerFrame = 4;
  static constexpr std::size_t kPiece_px = 32U * 1024U;  // a tenth of a picture
  enum class Failure : std::uint8_t { kNone, kBegin, kFrameTooLarge, kQueueFull, kPicturesFull, kWrite };

  // What a lane wrote in one frame. It goes into the file after all of the other lane that it saw: a replay lives the
  // frames one after the other.
  struct FrameHead {
    std::int64_t cycle_ns = kNoFrame_ns;
    std::int64_t saw_ns = kNoFrame_ns;  // up to this frame of the other lane
    std::uint32_t pictures = 0;         // acquired in it; their hashes are filled in when they are written
    std::array<std::uint32_t, kPicturesPerFrame> hash_at{};
  };
  struct LaneLog {
    explicit LaneLog(std::size_t queue_bytes) : queue(queue_bytes) {}
    std::vector<std::byte> memory = std::vector<std::byte>(kFrameMemory_bytes);
    ByteWriter out{memory};
    FrameHead head;
    std::size_t length_at = 0, count_at = 0;  // to be filled in when the row is over
    std::uint16_t calls = 0;
    std::array<std::uint32_t, kEventTable<ExecutiveEvent>.size()> told{};  // events written so far
    HealthCounts health{};                                                 // as written last
    BlockQueue queue;
    // Of the thread that writes: the oldest frame that it has not written.
    std::vector<std::byte> next_memory = std::vector<std::byte>(sizeof(FrameHead) + kFrameMemory_bytes);
    std::span<std::byte> next;
    FrameHead next_head;
  };

  void put_call(LaneLog& log, CallKind kind, bool gave) const noexcept;
  void put_events(std::size_t lane) noexcept;
  void hand_over(LaneLog& log) noexcept;
  void put_picture(LaneLog& log, const DepthFrameView& frame) noexcept;
  void copy_pixels(std::size_t most_px) noexcept;
  void fail(Failure failure) noexcept;
  // False: there is no frame that could be written now.
  [[nodiscard]] bool load(LaneLog& log) noexcept;
  [[nodiscard]] bool write_frame(LaneLog& log);
  void write(std::FILE* file, const void* bytes, std::size_t count) noexcept;
  [[nodiscard]] std::string sentence() const;

  Ports robot_;
  Capacity capacity_;
  Pipeline* pipeline_ = nullptr;
  mutable std::array<LaneLog, kLaneCount> logs_;  // a const port call is recorded, too
  std::vector<std::uint16_t> pixels_;             // of all pictures that the capacity has
  std::size_t picture_px_ = 0;
  struct {
    const std::uint16_t* from = nullptr;  // null: nothing is being copied
    std::size_t done_px = 0;
    bool kept = false;
  } copy_;
  std::uint32_t pictures_ = 0;  // acquired
  std::atomic<std::uint32_t> pictures_copied_{0};
  std::atomic<std::uint32_t> pictures_written_{0};
  std::uint64_t cycles_ = 0;
  std::string directory_;
  std::FILE* file_ = nullptr;
  std::FILE* picture_file_ = nullptr;
  std::atomic<Failure> failure_{Failure::kNone};
  const char* unmade_file_ = "";
  std::atomic<int> errno_{0};  // of begin() or of a write
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
