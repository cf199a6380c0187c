// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/report/report_run.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/geometry/convex.hpp"
#include "algorithms/geometry/oriented_rectangle.hpp"
#include "firmware/config/operator_request_text.hpp"
#include "sim_stub/host/record/preview_camera.hpp"
#include "sim_stub/host/record/zstd_chunks.hpp"

namespace polygmap::sim {
namespace {

using recording::PortCall;
using recording::Record;
using recording::RecordingFile;
using recording::RecordKind;
using recording::RowCall;
using recording::Topic;

constexpr std::uint64_t kSampleEvery_ticks = 5;  // 100 Hz: linear between two, a foot is off by 0.3 mm at most
constexpr std::uint64_t kCostEvery_ticks = 10;
constexpr double kSearchEvery_s = 0.2;
constexpr std::int64_t kSameEvent_ns = 100'000'000;
constexpr double kInstructionsPerWorkUnit = 100.0;

Vec3 get_vector(mcap::CdrReader& in) {
  Vec3 v = Vec3::Zero();
  for (int i = 0; i < 3; ++i) v[i] = in.get<double>();
  return v;
}
Transform get_pose(mcap::CdrReader& in) {
  Transform pose;
  pose.p_m = get_vector(in);
  Eigen::Quaterniond q;
  for (int i = 0; i < 4; ++i) q.coeffs()[i] = in.get<double>();
  pose.R = q.normalized().toRotationMatrix();
  return pose;
}
void skip_header(mcap::CdrReader& in) {
  (void)in.get<std::int32_t>();
  (void)in.get<std::uint32_t>();
  (void)in.get_text();
}

// World a in world b by one body's poses: heading and place.
Transform aligned(const Transform& a_T_body, const Transform& b_T_body) {
  const Mat3 R = rotation_z(yaw_of(a_T_body.R) - yaw_of(b_T_body.R));
  return {R, a_T_body.p_m - R * b_T_body.p_m};
}

}  // namespace

ReportRun::ReportRun(const std::string& path)
    : path_(path),
      file_(std::make_unique<RecordingFile>(zstd_decompress())),
      sole_true_{ReportTable::of_poses(), ReportTable::of_poses()},
      sole_estimated_{ReportTable::of_poses(), ReportTable::of_poses()},
      sole_desired_{ReportTable::of_poses(), ReportTable::of_poses()},
      sigma_({1e-5, 1e-5, 1e-5, 1e-5, 1e-5}),
      joint_angles_(std::vector<double>(kJointCount, 1e-4)),
      torque_share_(std::vector<double>(kJointCount, 1e-3)),
      contact_({1e-2, 1e-2}),
      lio_({1e-4, 1e-4, 1e-4}),
      cost_(std::vector<double>(kTasks.size(), kInstructionsPerWorkUnit)) {}

std::string ReportRun::read() {
  if (!file_->open(path_)) return file_->complaint();
  const auto record = std::make_unique<Record>();
  RecordingFile::Found found = file_->read(*record);
  while (found == RecordingFile::Found::kRecord) {
    for (const RecordingFile::Extra& extra : file_->take_extras()) take_extra(extra);
    take(*record);
    found = file_->read(*record);
  }
  for (const RecordingFile::Extra& extra : file_->take_extras()) take_extra(extra);
  finish_sample();
  if (found == RecordingFile::Found::kBad) ends_ = file_->complaint();
  if (found == RecordingFile::Found::kCut) ends_ = "The recording was cut off.";
  if (first_ns_ < 0) return ends_.empty() ? "\"" + path_ + "\" has no cycle of the module." : ends_;
  return {};
}

void ReportRun::take(const Record& record) {
  if (record.kind == RecordKind::kRow) take_row(record.row);
  if (record.kind == RecordKind::kLost) {
    events_.push_back({{"t_s", rounded(time_s(now_ns_), 3)},
                       {"kind", "limit"},
                       {"name", "recording_lost"},
                       {"count", record.lost_frames},
                       {"text", "Frames found no room in the recording's memory."}});
  }
  if (record.kind == RecordKind::kCycle && record.cycle_lane == kControlLane) end_cycle(record.cycle);
}

void ReportRun::take_row(const RowCall& row) {
  if (first_ns_ < 0) first_ns_ = row.cycle_ns;
  now_ns_ = row.cycle_ns;
  if (kSchedule[row.row].resumable()) {
    most_cost_[row.row] = std::max(most_cost_[row.row], kInstructionsPerWorkUnit * (row.units - row.units_left));
  }
  for (const PortCall& call : row.calls) take_call(call, row.cycle_ns);
  take_outputs(row);
}

void ReportRun::take_call(const PortCall& call, std::int64_t cycle_ns) {
  using recording::CallKind;
  if (!call.gave) return;
  if (call.kind == CallKind::kReadJoints) joints_ = call.joints;
  if (call.kind == CallKind::kReadOperator) {
    operator_.push_back({rounded(time_s(cycle_ns), 3), text_of(call.asked)});
  }
  if (call.kind == CallKind::kReadLidar) {
    const Transform lio_T_base = call.lio.lio_T_lidar * file_->params().robot.mounts.base_T_lidar.inverse();
    const auto then = std::ranges::lower_bound(past_bases_, call.lio.stamp_ns, {}, &PastBase::stamp_ns);
    if (!page_T_lio_ && then != past_bases_.end()) page_T_lio_ = aligned(then->page_T_base, lio_T_base);
    if (!page_T_lio_) return;
    const Transform pose = *page_T_lio_ * lio_T_base;
    const double at_ms = std::round(1e3 * time_s(call.lio.stamp_ns));
    if (!lio_ms_.empty() && at_ms <= lio_ms_.back()) return;
    lio_ms_.push_back(at_ms);
    lio_.add(std::span(pose.p_m.data(), 3));
  }
  if (call.kind == CallKind::kAcquire && call.picture.pixels == recording::Pixels::kStored) take_picture(call);
}

void ReportRun::take_outputs(const RowCall& row) {
  using Left = recording::RowOutputs::Left;
  switch (outputs_.read(row)) {
    case Left::kState:
      if (!has_truth_) page_T_odom_ = outputs_.state.world_T_odom;
      return;
    case Left::kGait:
      note_change(states_, name_of(outputs_.module_state));
      note_change(phases_, name_of(outputs_.gait.phase));
      return take_steps();
    case Left::kHealth:
      return take_health(outputs_.health);
    case Left::kSurfaces:
      return take_surfaces(outputs_.surfaces);
    case Left::kMap:
      return versions_.add(time_s(now_ns_), outputs_.map, page_T_odom_);
    case Left::kFootholds:
      return take_footholds(outputs_.footholds);
    case Left::kNothing:
      return;
  }
}

void ReportRun::note_change(ReportJson& list, std::string_view name) const {
  if (!list.empty() && list.back()[1] == name) return;
  list.push_back({rounded(time_s(now_ns_), 3), name});
}

void ReportRun::take_health(const recording::HealthCounts& counts) {
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::uint32_t more = counts[i].count - counts_[i].count;
    if (more == 0) continue;
    const bool is_fault = i < kFaultTable.size();
    // What goes on is one event: each of its counts prolongs it.
    if (const std::size_t last = last_event_[i]; last > 0 && counts[i].last_ns - last_raised_ns_[i] <= kSameEvent_ns) {
      ReportJson& event = events_[last - 1];
      event["count"] = event["count"].get<std::uint32_t>() + more;
      last_raised_ns_[i] = counts[i].last_ns;
      continue;
    }
    last_event_[i] = events_.size() + 1;
    last_raised_ns_[i] = counts[i].last_ns;
    const auto add = [&](const auto& line) {
      events_.push_back({{"t_s", rounded(time_s(counts[i].last_ns), 3)},
                         {"kind", is_fault ? "fault" : "limit"},
                         {"number", line.number()},
                         {"name", line.name},
                         {"count", more},
                         {"text", line.text}});
    };
    if (is_fault) {
      add(kFaultTable[i]);
    } else {
      add(kLimitTable[i - kFaultTable.size()]);
    }
  }
  counts_ = counts;
}

void ReportRun::take_steps() {
  const LatchedStep& step = outputs_.gait.step;
  if (step.sequence == 0) return;
  if (steps_.empty() || steps_.back().sequence != step.sequence) {
    steps_.push_back(step);
    step_places_.emplace_back();
    const Transform page_T_target = page_T_odom_ * step.odom_T_target;
    step_places_.back()["target_m"] = rounded(
        std::array{page_T_target.p_m.x(), page_T_target.p_m.y(), page_T_target.p_m.z(), yaw_of(page_T_target.R)});
  }
  const bool has_landed = steps_.back().touch_down_stamp_ns == 0 && step.touch_down_stamp_ns != 0;
  steps_.back() = step;
  if (!has_landed) return;
  const Transform page_T_sole = page_T_odom_ * step.odom_T_executed;
  step_places_.back()["executed_m"] =
      rounded(std::array{page_T_sole.p_m.x(), page_T_sole.p_m.y(), page_T_sole.p_m.z(), yaw_of(page_T_sole.R)});
}

// The lidar tells late of where the base was.
void ReportRun::remember_base(const Transform& page_T_base) {
  constexpr std::size_t kMost = 600;
  past_bases_.push_back({now_ns_, page_T_base});
  if (past_bases_.size() > kMost) past_bases_.pop_front();
}

void ReportRun::end_cycle(const CycleReport& cycle) {
  now_ns_ = cycle.due_ns;
  if (!has_truth_ && outputs_.state.initialised) remember_base(outputs_.state.world_T_base());
  const double at_ms = std::round(1e3 * time_s(now_ns_));
  if (ticks_ % kCostEvery_ticks == kCostEvery_ticks - 1) {
    std::array<double, kTasks.size()> row{};
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = kSchedule[i].resumable() ? most_cost_[i] : std::nan("");
    cost_ms_.push_back(at_ms);
    cost_.add(row);
    most_cost_ = {};
  }
  if (ticks_++ % kSampleEvery_ticks != 0) return;
  finish_sample();
  sample_waits_ = true;
  motion_ms_.push_back(at_ms);
}

// With the truth of its tick, which comes after the module's part of it.
void ReportRun::finish_sample() {
  if (!sample_waits_) return;
  sample_waits_ = false;
  if (!is_aligned_ && has_truth_ && outputs_.state.initialised) {
    page_T_world_ = aligned(true_T_base_, outputs_.state.world_T_base());
    is_aligned_ = true;
  }
  // Before it has initialised the module knows no pose.
  const auto add = [this](ReportTable& table, const Transform& pose) {
    outputs_.state.initialised ? table.add(pose) : table.add_missing();
  };
  if (has_truth_) {
    base_true_.add(true_T_base_);
  } else {
    base_true_.add_missing();
  }
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    has_truth_ ? sole_true_[foot].add(true_T_sole_[foot]) : sole_true_[foot].add_missing();
    add(sole_estimated_[foot], page_T_odom_ * outputs_.state.odom_T_sole[foot]);
    add(sole_desired_[foot], page_T_odom_ * outputs_.gait.odom_T_sole_desired[foot]);
  }
  add(base_fused_, page_T_world_ * outputs_.state.world_T_base());
  add(base_odometry_, page_T_world_ * outputs_.state.odom_T_base);
  sigma_.add(std::array{outputs_.state.position_sigma_m.x(), outputs_.state.position_sigma_m.y(),
                        outputs_.state.position_sigma_m.z(), outputs_.state.yaw_sigma_rad,
                        outputs_.state.tilt_sigma_rad});
  joint_angles_.add(std::span(joints_.q_rad.data(), kJointCount));
  std::array<double, kJointCount> share{};
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const double tau_nm = joints_.tau_nm[static_cast<Eigen::Index>(n)];
    share[n] = std::abs(tau_nm) / file_->params().robot.drives.limits[n].torque_nm;
  }
  torque_share_.add(share);
  contact_.add(outputs_.state.contact_probability);
}

void ReportRun::take_extra(const RecordingFile::Extra& extra) {
  if (extra.topic == Topic::kTruth) take_truth(extra.message);
  if (extra.topic == Topic::kTruthFeet) take_true_feet(extra.message);
  if (extra.topic == Topic::kStairs) take_stairs(extra.message);
  if (extra.topic == Topic::kPreview) take_preview(extra.message);
  if (extra.topic != Topic::kVerdict) return;
  mcap::CdrReader in(extra.message);
  summary_ = ReportJson::parse(in.get_text(), nullptr, false);
  if (!summary_.is_object()) summary_ = ReportJson::object();
}

void ReportRun::take_truth(std::span<const std::byte> message) {
  mcap::CdrReader in(message);
  skip_header(in);
  (void)in.get_text();
  true_T_base_ = get_pose(in);
  has_truth_ = !in.failed();
  if (has_truth_) remember_base(true_T_base_);
}

// The last of a tick's truth.
void ReportRun::take_true_feet(std::span<const std::byte> message) {
  mcap::CdrReader in(message);
  skip_header(in);
  if (in.get_count(7 * sizeof(double)) != kFootCount) return;
  for (Transform& sole : true_T_sole_) sole = get_pose(in);
  page_T_odom_ = true_T_base_ * outputs_.state.odom_T_base.inverse();
  finish_sample();
}

void ReportRun::take_stairs(std::span<const std::byte> message) {
  mcap::CdrReader in(message);
  const auto skip_stamp = [&in] {
    (void)in.get<std::int32_t>();
    (void)in.get<std::uint32_t>();
  };
  for (std::size_t i = in.get_count(1); i > 0; --i) {
    skip_stamp();
    (void)in.get<std::uint8_t>();
    (void)in.get_text();
  }
  for (std::size_t i = in.get_count(1); i > 0 && !in.failed(); --i) {
    skip_stamp();
    (void)in.get_text();
    const std::string id(in.get_text());
    skip_stamp();
    (void)in.get<bool>();
    for (int kind = 0; kind < 2; ++kind) (void)in.get<std::uint32_t>();
    if (in.get<std::uint32_t>() != 1) return;  // one cube each
    const Transform pose = get_pose(in);
    const Vec3 half_m = 0.5 * get_vector(in);
    for (int part = 0; part < 4; ++part) (void)in.get<double>();  // its colour
    for (int kind = 0; kind < 6; ++kind) (void)in.get<std::uint32_t>();
    ReportJson box{{"pose", pose_json(pose)}, {"half_m", rounded(half_m)}};
    if (id.starts_with("step ")) box["step"] = std::stoi(id.substr(5));
    if (!in.failed()) boxes_.push_back(std::move(box));
  }
}

void ReportRun::take_preview(std::span<const std::byte> message) {
  mcap::CdrReader in(message);
  const auto seconds = in.get<std::int32_t>();
  const auto nanoseconds = in.get<std::uint32_t>();
  (void)in.get_text();
  (void)in.get_text();
  const std::span<const std::byte> png = in.get_bytes();
  if (in.failed()) return;
  add_picture(seconds * kNsPerS + nanoseconds, {reinterpret_cast<const unsigned char*>(png.data()), png.size()});
}

// A simulation's recording has small ones anyway, a robot's the pictures themselves: either will do.
void ReportRun::take_picture(const PortCall& call) {
  std::span<const std::uint16_t> pixels;
  if (call.frame.stamp_ns < next_picture_ns_ || !file_->read_picture(call.frame, call.picture, pixels)) return;
  Preview preview;
  DepthFrameView frame = call.frame;
  frame.depth = pixels.data();
  fill(preview, frame, file_->camera().depth_unit_m);
  add_picture(frame.stamp_ns, png_of(preview));
}

// At most one in a while, whichever topic has it.
void ReportRun::add_picture(std::int64_t stamp_ns, std::span<const unsigned char> png) {
  if (stamp_ns < next_picture_ns_) return;
  next_picture_ns_ = stamp_ns + Preview::kPeriod_ns;
  pictures_.push_back(
      {{"t_s", rounded(time_s(stamp_ns), 3)}, {"png", base64_of(png)}, {"surfaces", ReportJson::array()}});
}

// A frame is finished some cycles after its picture was acquired.
void ReportRun::take_surfaces(const SurfaceFrame& frame) {
  const ReportJson t_s = rounded(time_s(frame.stamp_ns), 3);
  const auto picture = std::ranges::find_if(pictures_, [&](const ReportJson& p) { return p["t_s"] == t_s; });
  if (picture == pictures_.end()) return;
  (*picture)["invalid_fraction"] = rounded(frame.invalid_fraction);
  for (const SurfacePatch& surface : frame.surfaces) {
    ReportJson seen{{"kind", kind_text(surface.kind)},
                    {"vertices", corners_json(surface.polygon, Transform{})},
                    {"invalid_fraction", rounded(surface.invalid_fraction, 3)}};
    if (surface.nosing.valid) {
      const Vec3 &a = surface.nosing.a_m, &b = surface.nosing.b_m;
      seen["nosing"] = rounded(std::array{a.x(), a.y(), a.z(), b.x(), b.y(), b.z()});
    }
    (*picture)["surfaces"].push_back(std::move(seen));
  }
}

ReportJson ReportRun::foothold_json(const Foothold& f, const Transform& page_T_odom) const {
  return {{"position_m", rounded(Vec3(page_T_odom * f.position_m))},
          {"yaw_rad", rounded(f.yaw_rad + yaw_of(page_T_odom.R))},
          {"clearance_m", rounded(f.clearance_m)},
          {"toe_clearance_m", rounded(f.toe_clearance_m)},
          {"nosing_distance_m", rounded(f.nosing_distance_m)},
          {"side_room_m", rounded(f.side_room_m)},
          {"polygon_id", f.polygon_id},
          {"last_seen_s", rounded(time_s(f.last_seen_ns), 3)}};
}

// Where the sole's origin may be with all of the sole on the foothold's polygon, at the foothold's heading.
ReportJson ReportRun::safe_json(const Foothold& foothold) const {
  const MapPolygon* const polygon = versions_.find(foothold.polygon_id);
  if (polygon == nullptr) return nullptr;
  ConvexPolygon outline, safe;
  for (const Vec3& corner : polygon->surface.polygon) {
    const Vec2 in_plan = corner.head<2>();
    (void)outline.try_push_back(in_plan);
    (void)safe.try_push_back(in_plan);
  }
  const SoleRectangle& sole = file_->params().robot.sole.contact;
  const Vec2 ahead = unit_at(foothold.yaw_rad), left = left_of(ahead);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    HalfPlane inside = edge_half_plane(outline, i);
    double reach_m = 0.0;
    for (const double x : {sole.toe_x_m, sole.heel_x_m}) {
      for (const double y : {sole.half_width_m, -sole.half_width_m}) {
        reach_m = std::max(reach_m, -inside.inward.dot(Vec2(x * ahead + y * left)));
      }
    }
    inside.offset_m += reach_m;
    safe = clip(safe, inside);
  }
  ReportJson corners = ReportJson::array();
  const double height_m = foothold.position_m.z();
  for (const Vec2& corner : safe) {
    const Vec3 there = page_T_odom_ * Vec3(corner.x(), corner.y(), height_m);
    for (int i = 0; i < 3; ++i) corners.push_back(rounded(there[i]));
  }
  return {{"polygon_id", foothold.polygon_id}, {"vertices", corners}};
}

void ReportRun::take_footholds(const FootholdSet& set) {
  const double t_s = time_s(now_ns_);
  if (t_s < next_search_s_ && set.obstruction == last_stop_) return;
  next_search_s_ = t_s + kSearchEvery_s;
  last_stop_ = set.obstruction;
  ReportJson search{{"t_s", rounded(t_s, 3)},
                    {"map_stamp_s", rounded(time_s(set.map_stamp_ns), 3)},
                    {"stop", name_of(set.obstruction)}};
  if (set.obstruction != StopReason::kNone) search["stop_text"] = text_of(set.obstruction);
  if (set.measured_rise_m > 0.0) {
    search["measured_rise_m"] = rounded(set.measured_rise_m);
    search["measured_tread_m"] = rounded(set.measured_tread_m);
  }
  search["safe"] = ReportJson::array();
  const auto add = [&](const char* name, const std::array<Foothold, kFootCount>& feet) {
    ReportJson both = ReportJson::array();
    for (const Foothold& foot : feet) both.push_back(foothold_json(foot, page_T_odom_));
    search[name] = std::move(both);
    if (ReportJson safe = safe_json(feet[0]); !safe.is_null()) search["safe"].push_back(std::move(safe));
  };
  if (set.has_p_star) add("p_star", set.p_star_feet);
  if (set.has_p_star_star) add("p_star_star", set.p_star_star_feet);
  searches_.push_back(std::move(search));
}

}  // namespace polygmap::sim
