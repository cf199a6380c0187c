// SPDX-License-Identifier: Apache-2.0
// Writes down everything that goes into the module and comes out of it, for replay.hpp and for people.
#pragma once

#include <array>
#include <atomic>
#include <span>
#include <string>
#include <vector>

#include "firmware/recording/block_queue.hpp"
#include "firmware/recording/mcap/mcap_writer.hpp"
#include "firmware/recording/stream/format.hpp"
#include "firmware/recording/stream/outputs.hpp"
#include "firmware/recording/topics/topics.hpp"
#include "firmware/schedule.hpp"
#include "hal/ports/picture_keeper.hpp"

namespace polygmap::recording {

// Stands between the robot's ports and the module, and between the executive and the module's rows. Its memory is part
// of the object. While the module calls, it copies into memory of the lane's own and hands that over when the lane's
// cycle is over, through a queue of a fixed size. write_out() empties the queues into the file, on whatever thread,
// while the lanes run or between their ticks. A frame that finds no room in a queue is lost as a whole: the lane counts
// it (Limit::kRecordingLost), the file says how many are missing, and what follows is recorded again. Pictures are
// written from the driver's own buffers.
class Recorder final : public hal::DepthCamera,
                       public hal::Imu,
                       public hal::JointBus,
                       public hal::LidarOdometry,
                       public hal::OperatorInput {
 public:
  static constexpr std::size_t kMemoryBudget_bytes = 3'000'000;

  // keeper: of the camera's pictures; null: none is recorded.
  explicit Recorder(const Ports& robot, hal::PictureKeeper* keeper = nullptr) noexcept;
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  [[nodiscard]] Ports ports() noexcept { return {*this, *this, *this, *this, this}; }
  // Makes the file, in a directory that exists. params: the module's, from its start on. run: a number of this run's
  // own. Allocates, and is not to be called once the module runs.
  void begin(const std::string& path, const Params& params, std::uint64_t run);
  // The module that ports() were given to, before its first cycle.
  void watch(Pipeline& pipeline) noexcept { pipeline_ = &pipeline; }

  void request_stop() noexcept;  // the operator's, in control's lane
  void begin_row(std::size_t row, std::int64_t cycle_ns, const WorkBudget& budget) noexcept;
  void end_row(std::size_t row, Progress progress, const WorkBudget& budget) noexcept;
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept;

  // On one thread, whether the lanes run or not: writes what was handed over.
  void write_out() noexcept;
  // A message of somebody who knows more than the module does; on the thread of write_out().
  void write(Topic topic, std::int64_t log_ns, std::int64_t publish_ns, std::span<const std::byte> message) noexcept;
  // No lane runs: hands over what belongs to no finished cycle, too, and writes it.
  void flush() noexcept;
  // No lane runs: writes the rest and closes the file. What begin() or a write could not do, or what was lost, is said
  // here: one sentence, empty when all was written.
  [[nodiscard]] std::string finish();
  // The recording has ended before the module. From any thread.
  [[nodiscard]] bool failed() const noexcept { return failed_.load(std::memory_order_acquire); }
  // Frames of lanes, and pictures, that were lost so far. No lane runs.
  [[nodiscard]] std::uint64_t lost_frames() const noexcept {
    return logs_[kControlLane].all_lost + logs_[kPerceptionLane].all_lost;
  }
  [[nodiscard]] std::uint64_t lost_pictures() const noexcept { return lost_pictures_; }

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return robot_.camera.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override;
  void release() noexcept override;
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override;
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override;
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override;
  [[nodiscard]] hal::JointBusStatus status() const noexcept override;
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override;
  [[nodiscard]] bool try_read(OperatorRequest& request) noexcept override;
  void answer(const OperatorAnswer& answer) noexcept override {
    if (robot_.operator_input != nullptr) robot_.operator_input->answer(answer);
  }

 private:
  // Of a frame: control has some 4 kB; perception's largest have 64 surfaces and a map of as many.
  static constexpr std::array<std::size_t, kLaneCount> kFrame_bytes{32U * 1024U, 160U * 1024U};
  // A quarter of a second of control's frames; pictures' results come with every tenth frame.
  static constexpr std::array<std::size_t, kLaneCount> kQueue_bytes{1024U * 1024U, 640U * 1024U};

  // What a lane wrote in one frame. It goes into the file after all of the other lane that it saw: a replay lives the
  // frames one after the other.
  struct FrameHead {
    std::int64_t cycle_ns = kNoFrame_ns;
    std::int64_t saw_ns = kNoFrame_ns;  // up to this frame of the other lane
    DepthFrameView picture;             // acquired in it and kept; depth is null when there is none
    std::size_t hash_at = 0;            // where its hash is to be filled in
  };
  // In front of a frame's records in the message that has them: CDR's head and their count.
  static constexpr std::size_t kMessageHead_bytes = mcap::kCdrHead_bytes + sizeof(std::uint32_t);
  static_assert(sizeof(FrameHead) >= kMessageHead_bytes);

  struct LaneLog {
    explicit LaneLog(std::span<std::byte> queued) noexcept : queue(queued) {}
    BlockQueue queue;
    std::span<std::byte> frame;  // in the queue, or empty: there was no room; a head and records
    ByteWriter out{{}};          // of its records
    bool waits = false;          // for room
    std::size_t opened_bytes = 0;
    FrameHead head;
    std::size_t row_at = 0;  // where the row's head is to be filled in when it is over
    std::int32_t units = 0;
    std::uint16_t calls = 0;
    std::int64_t last_cycle_ns = 0;
    std::uint32_t lost = 0;                                                // frames since the last one that found room
    std::uint64_t all_lost = 0;                                            // frames
    std::uint32_t raised = 0;                                              // by the lane's health when it looked last
    std::array<std::uint32_t, kEventTable<ExecutiveEvent>.size()> told{};  // events written so far
    std::uint32_t health = 0;                                              // Health::raised(), as written last
    // Of the thread that writes: the oldest frame that it has not written, in the queue.
    std::span<std::byte> next;
    FrameHead next_head;
  };
  struct Sink final : MessageSink {
    explicit Sink(mcap::McapWriter& to) noexcept : writer(to) {}
    void take(Topic topic, std::int64_t log_ns, std::int64_t publish_ns,
              std::span<const std::byte> message) noexcept override;
    mcap::McapWriter& writer;
  };

  void put_call(LaneLog& log, CallKind kind, bool gave) const noexcept;
  void put_events(std::size_t lane) noexcept;
  void put_view(LaneLog& log, std::size_t lane) noexcept;
  void open_frame(std::size_t lane) noexcept;
  void hand_over(std::size_t lane, std::int64_t now_ns) noexcept;
  void keep_picture(LaneLog& log, const DepthFrameView& frame) noexcept;
  void let_go_written() noexcept;
  void fail() noexcept { failed_.store(true, std::memory_order_release); }
  // False: there is no frame that could be written now.
  [[nodiscard]] bool load(LaneLog& log) noexcept;
  void write_frame(LaneLog& log) noexcept;
  void write_picture(LaneLog& log) noexcept;

  Ports robot_;
  hal::PictureKeeper* keeper_;
  Pipeline* pipeline_ = nullptr;
  alignas(8) std::array<std::byte, kQueue_bytes[0]> control_queue_;
  alignas(8) std::array<std::byte, kQueue_bytes[1]> perception_queue_;
  mutable std::array<LaneLog, kLaneCount> logs_;                             // a const port call is recorded, too
  struct {                                                                   // of perception's lane
    StaticVector<const std::uint16_t*, hal::PictureKeeper::kMostKept> kept;  // the oldest first
    std::uint32_t acquired = 0, let_go = 0;
  } pictures_;
  std::atomic<std::uint32_t> pictures_written_{0};
  std::uint64_t cycles_ = 0;         // control's
  std::uint64_t lost_pictures_ = 0;  // perception's
  std::atomic<bool> failed_{false};
  // Of the thread that writes.
  mcap::McapWriter writer_;
  std::vector<std::byte> parameters_;  // until the first frame says when they were
  bool has_parameters_ = false;
  Topics topics_;
  Sink sink_{writer_};
  RecordParser parser_;
  Record record_;
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
