// SPDX-License-Identifier: Apache-2.0
// One recorded run as the report's page wants it (page/DATA.md): read from its file, record by record.
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware/recording/recording_file.hpp"
#include "sim_stub/host/report/map_versions.hpp"
#include "sim_stub/host/report/report_blocks.hpp"

namespace polygmap::sim {

class ReportRun {
 public:
  explicit ReportRun(const std::string& path);

  // Empty, or why the file is no recording. An unfinished one is read as far as it goes.
  [[nodiscard]] std::string read();
  [[nodiscard]] ReportJson json() const;
  // Empty, or one sentence: it is cut off, or some of its bytes are not those that were written.
  [[nodiscard]] const std::string& unsound() const noexcept {
    return file_->damage().empty() ? ends_ : file_->damage();
  }

 private:
  void take(const recording::Record& record);
  void take_row(const recording::RowCall& row);
  void take_call(const recording::PortCall& call, std::int64_t cycle_ns);
  void take_outputs(const recording::RowCall& row);
  void take_extra(const recording::RecordingFile::Extra& extra);
  void take_truth(std::span<const std::byte> message);
  void take_true_feet(std::span<const std::byte> message);
  void take_stairs(std::span<const std::byte> message);
  void take_preview(std::span<const std::byte> message);
  void take_picture(const recording::PortCall& call);
  void add_picture(std::int64_t stamp_ns, std::span<const unsigned char> png);
  void take_surfaces(const SurfaceFrame& frame);
  void take_footholds(const FootholdSet& footholds);
  void take_health(const recording::HealthCounts& counts);
  void take_steps();
  void end_cycle(const CycleReport& cycle);
  void note_change(ReportJson& list, std::string_view name) const;
  void remember_base(const Transform& page_T_base);
  void finish_sample();
  [[nodiscard]] ReportJson steps_json() const;
  [[nodiscard]] ReportJson stairs_json() const;
  [[nodiscard]] ReportJson pictures_json() const;
  [[nodiscard]] double time_s(std::int64_t at_ns) const noexcept {
    return 1e-9 * static_cast<double>(at_ns - first_ns_);
  }
  [[nodiscard]] ReportJson foothold_json(const Foothold& foothold, const Transform& page_T_odom) const;
  [[nodiscard]] ReportJson safe_json(const Foothold& foothold) const;

  std::string path_;
  std::unique_ptr<recording::RecordingFile> file_;
  std::string ends_;  // of an unfinished file: how
  std::int64_t first_ns_ = -1, now_ns_ = 0;
  std::uint64_t ticks_ = 0;

  // As of the newest rows.
  recording::RowOutputs outputs_;
  JointFeedback joints_;
  recording::HealthCounts counts_{};
  std::array<std::size_t, std::tuple_size_v<recording::HealthCounts>> last_event_{};  // 1 + place in events_; 0: none
  std::array<std::int64_t, std::tuple_size_v<recording::HealthCounts>> last_raised_ns_{};
  Transform true_T_base_;
  std::array<Transform, kFootCount> true_T_sole_;
  bool has_truth_ = false;
  struct PastBase {
    std::int64_t stamp_ns;
    Transform page_T_base;
  };
  std::deque<PastBase> past_bases_;
  std::optional<Transform> page_T_lio_;  // of the lidar's world, once, by its first pose
  Transform page_T_world_;               // of the module's world on the true one, once, when it has initialised
  // Of odometry by the moment: drift moves no foothold against its stairs, and so it must not on the page.
  Transform page_T_odom_;
  bool is_aligned_ = false;

  // A sample that waits for its truth.
  bool sample_waits_ = false;
  std::vector<double> motion_ms_;
  ReportTable base_true_ = ReportTable::of_poses(), base_fused_ = ReportTable::of_poses(),
              base_odometry_ = ReportTable::of_poses();
  std::array<ReportTable, kFootCount> sole_true_, sole_estimated_, sole_desired_;
  ReportTable sigma_, joint_angles_, torque_share_, contact_;
  std::vector<double> lio_ms_, cost_ms_;
  ReportTable lio_, cost_;
  std::array<double, kTasks.size()> most_cost_{};
  MapVersions versions_;
  ReportJson states_ = ReportJson::array(), phases_ = ReportJson::array(), events_ = ReportJson::array(),
             operator_ = ReportJson::array(), pictures_ = ReportJson::array(), searches_ = ReportJson::array(),
             boxes_ = ReportJson::array(), summary_ = ReportJson::object();  // empty: nobody judged the run
  std::vector<LatchedStep> steps_;
  std::vector<ReportJson> step_places_;
  double next_search_s_ = 0.0;
  std::int64_t next_picture_ns_ = 0;
  StopReason last_stop_ = StopReason::kNone;
};

}  // namespace polygmap::sim
