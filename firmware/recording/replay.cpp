// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/replay.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <tuple>

#include "firmware/recording/recording_file.hpp"

namespace polygmap::recording {
namespace {

// The ports of a module that lives its row once more: each call gets the answer that was recorded.
class ReplayedPorts final : public hal::DepthCamera,
                            public hal::Imu,
                            public hal::JointBus,
                            public hal::LidarOdometry,
                            public hal::OperatorInput {
 public:
  explicit ReplayedPorts(RecordingFile& file) : file_(file) {}

  void begin_row(const RowCall& row) {
    row_ = &row;
    next_ = 0;
    difference_.clear();
  }
  // Empty, or the row's first call that was not the recorded one.
  [[nodiscard]] const std::string& end_row() {
    if (next_ < row_->calls.size()) differ("nothing more", row_->calls[next_].kind);
    return difference_;
  }
  [[nodiscard]] bool unreadable() const noexcept { return unreadable_; }

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return file_.camera(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    const PortCall* call = next(CallKind::kAcquire);
    if (call == nullptr || !call->gave) return false;
    std::span<const std::uint16_t> pixels;  // of another size: refused anyway
    if (call->picture.pixels == Pixels::kStored) {
      unreadable_ = unreadable_ || !file_.read_picture(call->frame, call->picture, pixels);
    }
    frame = call->frame;
    frame.depth = pixels.data();
    return true;
  }
  void release() noexcept override { (void)next(CallKind::kRelease); }
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override {
    const PortCall* call = next(CallKind::kReadImu);
    if (call == nullptr || !call->gave) return false;
    sample = call->imu;
    return true;
  }
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    const PortCall* call = next(CallKind::kReadJoints);
    if (call == nullptr || !call->gave) return false;
    feedback = call->joints;
    return true;
  }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    const PortCall* call = next(CallKind::kWriteJoints);
    if (call == nullptr) return JointSet::all();
    if (difference_.empty()) difference_ = difference_of(call->command, command);
    return call->taken;
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override {
    const PortCall* call = next(CallKind::kJointStatus);
    return call == nullptr ? hal::JointBusStatus{} : call->status;
  }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    const PortCall* call = next(CallKind::kReadLidar);
    if (call == nullptr || !call->gave) return false;
    sample = call->lio;
    return true;
  }
  [[nodiscard]] bool try_read(OperatorRequest& request) noexcept override {
    const PortCall* call = next(CallKind::kReadOperator);
    if (call == nullptr || !call->gave) return false;
    request = call->asked;
    return true;
  }
  void answer(const OperatorAnswer&) noexcept override {}  // who asked is gone

 private:
  // The next recorded call when it is of this kind; else the module does something else than it did.
  [[nodiscard]] const PortCall* next(CallKind kind) const noexcept {
    if (next_ < row_->calls.size() && row_->calls[next_].kind == kind) return &row_->calls[next_++];
    differ(std::string(name_of(kind)), next_ < row_->calls.size() ? row_->calls[next_].kind : CallKind{});
    return nullptr;
  }
  void differ(const std::string& computed, CallKind recorded) const {
    if (!difference_.empty()) return;
    difference_ = "call " + std::to_string(next_) + " of a port: recorded " + std::string(name_of(recorded)) +
                  ", computed " + computed;
  }
  [[nodiscard]] static std::string difference_of(const JointCommand& recorded, const JointCommand& computed) {
    std::array<std::byte, sizeof(JointCommand)> memory;
    ByteWriter bytes(memory);
    write_fields(bytes, [&recorded](FieldWriter& writer) { walk(writer, "", recorded); });
    ByteReader in(bytes.bytes());
    FieldComparer comparer(in, nullptr);
    walk(comparer, "joints.try_write", computed);
    return comparer.difference();
  }

  RecordingFile& file_;
  const RowCall* row_ = nullptr;
  mutable std::size_t next_ = 0;  // a const port call is one, too
  bool unreadable_ = false;
  mutable std::string difference_;
};

// The values of an exchange, as long as its reader may be found to have taken them.
template <typename Exchange>
class Values {
 public:
  explicit Values(Exchange& exchange) : exchange_(exchange) {}

  void keep_newest() {
    const std::int64_t frame_ns = exchange_.published_ns();
    if (const auto* value = exchange_.find(frame_ns); value != nullptr) kept_.try_emplace(frame_ns, *value);
  }
  void keep(std::int64_t frame_ns, const auto& value) { kept_.try_emplace(frame_ns, value); }
  // False: nobody published what the reader took.
  [[nodiscard]] bool replay(const TakenFrame& taken) {
    if (taken.frame_ns == exchange_.front_frame_ns()) {
      exchange_.replay_take(taken.frame_ns, nullptr, taken.missed);
      return true;
    }
    kept_.erase(kept_.begin(), kept_.lower_bound(taken.frame_ns));
    if (kept_.empty() || kept_.begin()->first != taken.frame_ns) return false;
    exchange_.replay_take(taken.frame_ns, &kept_.begin()->second, taken.missed);
    return true;
  }

 private:
  using Value = std::remove_cvref_t<decltype(std::declval<Exchange&>().front())>;
  Exchange& exchange_;
  std::map<std::int64_t, Value> kept_;
};

// What each lane takes from the other one, in the order of its look_across().
class Crossings {
 public:
  explicit Crossings(Pipeline& module)
      : of_control_(Values(module.link().pose_request), Values(module.link().footholds),
                    Values(module.published_health(kPerceptionLane))),
        of_perception_(Values(module.link().pose_answer), Values(module.link().search_context)) {}

  void keep_newest(std::size_t writer) {
    const auto keep = [](auto&... values) { (values.keep_newest(), ...); };
    writer == kControlLane ? std::apply(keep, of_perception_) : std::apply(keep, of_control_);
  }
  // The same of a perception that is not run, by what its rows left in the recording.
  void keep(std::int64_t frame_ns, const PoseRequest& request) { std::get<0>(of_control_).keep(frame_ns, request); }
  void keep(std::int64_t frame_ns, const FootholdSet& footholds) { std::get<1>(of_control_).keep(frame_ns, footholds); }
  void keep(std::int64_t frame_ns, const Health& health) { std::get<2>(of_control_).keep(frame_ns, health); }
  [[nodiscard]] bool replay(std::size_t reader, std::span<const TakenFrame> taken) {
    const auto replay = [taken](auto&... values) {
      std::size_t i = 0;
      return taken.size() == sizeof...(values) && (values.replay(taken[i++]) && ...);
    };
    return reader == kControlLane ? std::apply(replay, of_control_) : std::apply(replay, of_perception_);
  }

 private:
  std::tuple<Values<decltype(ControlPerceptionLink::pose_request)>, Values<decltype(ControlPerceptionLink::footholds)>,
             Values<decltype(LaneHealth::published)>>
      of_control_;
  std::tuple<Values<decltype(ControlPerceptionLink::pose_answer)>,
             Values<decltype(ControlPerceptionLink::search_context)>>
      of_perception_;
};

// Perception's part in a recording without pictures: its rows are not run, and what they left is handed to control.
class BelievedPerception {
 public:
  // Every row of perception's, since counts are told when they change. crossings: null while the rows are run. False:
  // the outputs cannot be.
  [[nodiscard]] bool live(const RowCall& row, Crossings* crossings) {
    ByteReader in = row.outputs;
    FieldReader reader(in);
    const std::string_view task = kTasks[row.row].row.task;
    if (task == "intake") {
      if (in.get<bool>()) {
        for (EventCount& count : counts_) walk(reader, "", count);
      }
      if (crossings == nullptr) return !in.failed();
      Health health;
      health.assign(counts_);
      crossings->keep(row.cycle_ns, health);
      PoseRequest request;
      walk(reader, "pose_request", request);
      if (request.number != 0) crossings->keep(row.cycle_ns, request);
    } else if (crossings != nullptr && task == "footholds" &&
               row.progress == static_cast<std::uint8_t>(Progress::kDone)) {
      FootholdSet footholds;
      walk(reader, "footholds", footholds);
      crossings->keep(row.cycle_ns, footholds);
    }
    return !in.failed();
  }

 private:
  HealthCounts counts_{};
};

class Replay {
 public:
  explicit Replay(RecordingFile& file)
      : file_(file),
        ports_(file),
        module_(std::make_unique<Pipeline>(Ports{ports_, ports_, ports_, ports_, &ports_}, file.params())) {}

  [[nodiscard]] ReplayResult run() {
    const auto record = std::make_unique<Record>();
    RecordingFile::Found found = file_.read(*record);
    while (found == RecordingFile::Found::kRecord && result_.ends.empty()) {
      if (!live(*record)) {
        found = RecordingFile::Found::kBad;
        break;
      }
      found = file_.read(*record);
    }
    result_.differ = differing_ns_.size();
    if (result_.difference.empty()) result_.difference = file_.contradiction();
    result_.complaint = file_.complaint().empty() || !result_.ends.empty() ? file_.damage() : file_.complaint();
    if (found == RecordingFile::Found::kCut && result_.ends.empty()) result_.ends = "it was cut off";
    if (found == RecordingFile::Found::kBad || !result_.complaint.empty()) {
      result_.verdict = ReplayVerdict::kUnreadable;
    } else if (!result_.difference.empty()) {
      result_.verdict = ReplayVerdict::kDiffers;
    } else {
      result_.verdict = result_.ends.empty() ? ReplayVerdict::kSame : ReplayVerdict::kUnfinished;
    }
    return std::move(result_);
  }

 private:
  // False when the file cannot be read on.
  [[nodiscard]] bool live(const Record& record) {
    switch (record.kind) {
      case RecordKind::kRow:
        return run_row(record.row);
      case RecordKind::kEvent:
        module_->lane_health(record.event.lane).raise(record.event.event, record.event.at_ns, record.event.times);
        break;
      case RecordKind::kStop:
        module_->control().request_stop();
        break;
      case RecordKind::kCycle:
        module_->cycle_done(record.cycle_lane, record.cycle);
        result_.ticks += record.cycle_lane == kControlLane ? 1U : 0U;
        break;
      case RecordKind::kLost:
        result_.ends = std::to_string(record.lost_frames) + " frames of " +
                       (record.lost_lane == kControlLane ? "control" : "perception") + " found no room in it";
        break;
      case RecordKind::kEnd:
        break;
    }
    return true;
  }

  [[nodiscard]] bool run_row(const RowCall& row) {
    const std::size_t lane = kTasks[row.row].row.lane;
    if (first_ns_ < 0) first_ns_ = row.cycle_ns;
    if (lane == kPerceptionLane && !result_.without_perception) {
      result_.without_perception = std::ranges::any_of(row.calls, [](const PortCall& call) {
        return call.kind == CallKind::kAcquire && call.gave && call.picture.pixels == Pixels::kNotRecorded;
      });
    }
    if (lane == kPerceptionLane && !believed_.live(row, result_.without_perception ? &crossings_ : nullptr)) {
      return file_.complain("a row whose outputs cannot be");
    }
    if (lane == kPerceptionLane && result_.without_perception) return true;
    if (looks_across(row.row)) module_->lane_finished(1 - lane, row.other_finished_ns);
    if (looks_across(row.row) && !crossings_.replay(lane, row.taken)) {
      (void)file_.complain("a frame that saw what the other lane had not published");
      return reaches_loss_of(1 - lane);
    }
    ports_.begin_row(row);
    WorkBudget budget(row.units);
    const Progress progress = module_->run_row(row.row, row.cycle_ns, budget);
    crossings_.keep_newest(lane);
    if (ports_.unreadable()) return false;
    std::string difference = ports_.end_row();

    ByteReader outputs = row.outputs;
    FieldComparer comparer(outputs, &last_health_[lane]);
    comparer.compare("progress", -1, row.progress, static_cast<std::uint8_t>(progress));
    comparer.compare("units_left", -1, row.units_left, budget.left());
    compare_view(comparer, row, lane == kControlLane ? module_->control().view() : module_->perception().view());
    // What a row leaves depends on how it ended: the recorded outputs are those of the recorded end.
    const bool ended_alike = row.progress == static_cast<std::uint8_t>(progress);
    if (ended_alike) walk_outputs(comparer, *module_, row.row, row.cycle_ns, progress);
    if (outputs.failed() || (ended_alike && !comparer.stopped() && !outputs.at_end())) {
      return file_.complain("a row whose outputs cannot be");
    }
    if (difference.empty()) difference = comparer.difference();
    if (!difference.empty()) note_difference(row, difference);
    return true;
  }

  // What the lane saw of the other one: of the frame's first row it was an input.
  static void compare_view(FieldComparer& comparer, const RowCall& row, const LaneView& view) {
    comparer.compare("other_finished_ns", -1, row.other_finished_ns, view.other_finished_ns());
    comparer.compare("taken", -1, row.taken.size(), view.taken().size());
    for (std::size_t i = 0; i < std::min(row.taken.size(), view.taken().size()); ++i) {
      const int index = static_cast<int>(i);
      comparer.compare("taken.frame_ns", index, row.taken[i].frame_ns, view.taken()[i].frame_ns);
      comparer.compare("taken.missed", index, row.taken[i].missed, view.taken()[i].missed);
    }
  }

  // A frame that saw one that was lost is written before the other lane's next one, which says so.
  [[nodiscard]] bool reaches_loss_of(std::size_t lane) {
    const auto record = std::make_unique<Record>();
    while (result_.ends.empty() && file_.read(*record) == RecordingFile::Found::kRecord) {
      if (record->kind == RecordKind::kLost && record->lost_lane == lane) (void)live(*record);
    }
    return !result_.ends.empty();
  }

  void note_difference(const RowCall& row, const std::string& difference) {
    differing_ns_.insert(row.cycle_ns);
    if (!result_.difference.empty()) return;
    result_.difference = "tick " + std::to_string((row.cycle_ns - first_ns_) / kCycle_ns) + ", " +
                         std::string(kTasks[row.row].row.task) + ", " + difference;
  }

  RecordingFile& file_;
  ReplayedPorts ports_;
  std::unique_ptr<Pipeline> module_;
  Crossings crossings_{*module_};
  BelievedPerception believed_;
  std::array<HealthCounts, kLaneCount> last_health_{};
  std::set<std::int64_t> differing_ns_;
  std::int64_t first_ns_ = -1;
  ReplayResult result_;
};

}  // namespace

ReplayResult replay(const std::string& path, mcap::McapReader::Decompress decompress) {
  RecordingFile file(std::move(decompress));
  if (file.open(path)) return Replay(file).run();
  ReplayResult result;
  result.complaint = file.complaint();
  return result;
}

std::string text_of(const ReplayResult& result) {
  std::string text;
  if (!result.difference.empty()) text += "first difference: " + result.difference + "\n";
  if (result.verdict == ReplayVerdict::kUnreadable) return text + result.complaint + "\n";
  if (result.without_perception) {
    text += "There are no pictures in it: what perception had found was believed, and all else replayed.\n";
  }
  if (!result.ends.empty()) text += "The recording is unfinished: " + result.ends + ".\n";
  return text + "replay: " + std::to_string(result.ticks) + " ticks, " + std::to_string(result.differ) + " differ\n";
}

}  // namespace polygmap::recording
