// SPDX-License-Identifier: Apache-2.0
#include "firmware/perception_lane.hpp"

#include "algorithms/robot/body_shapes.hpp"

namespace polygmap {
namespace {

constexpr std::int64_t kCameraTimeout_ns = 200 * kNsPerMs;  // six frames
constexpr std::int64_t kPoseTimeout_ns = 20 * kNsPerMs;     // control answers within three cycles

// In instructions, by what they copy and go through.
constexpr std::int32_t kLearnMount = 2500, kLearnPerSurface = 60;
constexpr std::int32_t kJudgePicture = PictureMonitor::kInstructions;
constexpr std::int32_t kBeginMap = 16'000, kMapPerSurface = 60, kWayPerSurface = 400;
constexpr std::int32_t kBeginSearch = 16'000, kSearchPerPolygon = 20;
constexpr double kStands = 0.9;  // probability of a contact

}  // namespace

PerceptionLane::PerceptionLane(hal::DepthCamera& camera, ControlPerceptionLink& link, LaneHealth& health,
                               const Params& params) noexcept
    : camera_port_(camera),
      link_(link),
      health_(health),
      params_(params),
      intrinsics_(camera.intrinsics()),
      extractor_(params.surfaces),
      pictures_(params.pictures),
      mount_(params.mount, params.robot.mounts.base_T_camera),
      learning_{{}, {}, 0, WayScale{params.way}},
      map_(params.map),
      search_(params.footholds, params.robot.sole) {}

Progress PerceptionLane::intake(std::int64_t now_ns) noexcept {
  look_across(now_ns);
  health_.publish(now_ns);
  if (last_frame_ns_ < 0) last_frame_ns_ = now_ns;
  if (stage_ == FrameStage::kWaiting) {
    if (!camera_port_.try_acquire(frame_)) {
      if (now_ns - last_frame_ns_ > kCameraTimeout_ns) {
        health_.own.raise(Fault::kDepthMissing, now_ns);
        last_frame_ns_ = now_ns;
      }
      return Progress::kIdle;
    }
    last_frame_ns_ = now_ns;
    // The map was shed since the last picture: another one would be looked at for nothing, in time that is short.
    if (pending_.mapping) {
      camera_port_.release();
      health_.own.raise(Limit::kFrameLost, now_ns);
      return Progress::kIdle;
    }
    link_.pose_request.back() = {++request_, frame_.stamp_ns};
    link_.pose_request.publish(now_ns);
    stage_ = FrameStage::kPoseAsked;
    return Progress::kBusy;
  }
  if (stage_ != FrameStage::kPoseAsked) return Progress::kIdle;
  // A late answer to a request that was given up is not this frame's.
  if (link_.pose_answer.front().number == request_) {
    begin_extraction(now_ns);
    return Progress::kDone;
  }
  if (now_ns - last_frame_ns_ <= kPoseTimeout_ns) return Progress::kIdle;
  health_.own.raise(Fault::kPoseMissing, now_ns);
  stage_ = FrameStage::kWaiting;
  camera_port_.release();
  return Progress::kDone;
}

// As ControlLane::look_across().
void PerceptionLane::look_across(std::int64_t now_ns) noexcept {
  const std::int64_t finished_ns = link_.progress[kControlLane].finished_ns.load(std::memory_order_acquire);
  if (!view_.begin(now_ns, finished_ns)) health_.own.raise(Fault::kLaneBehind, now_ns);
  (void)view_.take(link_.pose_answer);
  (void)view_.take(link_.search_context);  // the newest, or the last one again
  health_.own.follow(Limit::kHandOverLost, now_ns, link_.pose_answer.lost() + link_.search_context.lost());
}

void PerceptionLane::begin_extraction(std::int64_t now_ns) noexcept {
  const PoseAnswer& answer = link_.pose_answer.front();
  stage_ = FrameStage::kWaiting;
  if (!answer.found) {
    health_.own.raise(Limit::kDepthUnplaced, now_ns);
  } else {
    exposure_state_ = answer.state;
    const Transform camera_T_base = mount_.base_T_camera().inverse();
    SurfaceExtractor::View view;
    view.intrinsics = intrinsics_;
    view.camera_up = (camera_T_base.R * exposure_state_.odom_T_base.R.transpose()) * Vec3::UnitZ();
    // Yaw of the mount stays as vague as the data sheet.
    view.body_margin = body_margin(params_.body, params_.robot.legs, params_.mount.prior.tilt_sigma_rad);
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      if (!params_.self_filter) break;
      body_[index_of(foot)] =
          transformed(camera_T_base, base_leg_shapes(params_.robot, foot, leg_joints(exposure_state_.q_rad, foot)));
    }
    view.body = body_;
    if (extractor_.try_begin(frame_, view)) {
      stage_ = FrameStage::kExtracting;
      return;
    }
    health_.own.raise(Fault::kDepthRejected, now_ns);
  }
  camera_port_.release();
}

Progress PerceptionLane::surfaces(std::int64_t now_ns, WorkBudget& budget) noexcept {
  if (stage_ == FrameStage::kExtracting) {
    if (extractor_.step(budget) != Progress::kDone) return Progress::kBusy;
    stage_ = FrameStage::kLearning;
    if (params_.estimate_mount) begin_learning();
  }
  if (stage_ != FrameStage::kLearning) return Progress::kIdle;
  if (params_.estimate_mount && !learn_some(budget)) return Progress::kBusy;
  const auto count = static_cast<std::int32_t>(extractor_.result().surfaces.size());
  finish_picture(now_ns);
  budget.spend(units_of(kJudgePicture + kBeginMap + count * (kMapPerSurface + kWayPerSurface)));
  return Progress::kDone;
}

void PerceptionLane::finish_picture(std::int64_t now_ns) noexcept {
  judge_picture(now_ns);
  camera_port_.release();
  health_.own.follow(Limit::kSegmentsFull, now_ns, extractor_.counters().segment_overflow);
  health_.own.follow(Limit::kPlanesFull, now_ns, extractor_.counters().plane_overflow);
  if (watcher_ != nullptr) watcher_->surfaces.publish(now_ns, extractor_.result());
  begin_map(now_ns);
  stage_ = FrameStage::kWaiting;
}

void PerceptionLane::judge_picture(std::int64_t now_ns) noexcept {
  const StateEstimate& state = exposure_state_;
  const Transform odom_T_way{rotation_z(yaw_of(state.odom_T_base.R)),
                             0.5 * (state.odom_T_sole[0].p_m + state.odom_T_sole[1].p_m)};
  const Transform odom_T_camera = state.odom_T_base * mount_.base_T_camera();
  pictures_.take(frame_, intrinsics_, depth_range(), odom_T_camera.inverse() * odom_T_way,
                 extractor_.noise().sigma_m(1.0) / params_.surfaces.noise.sigma_m(1.0));
  if (pictures_.is_bad()) health_.own.raise(Limit::kPictureBad, now_ns);
}

RawRange PerceptionLane::depth_range() const noexcept {
  RawRange range;
  range.set(params_.surfaces.limits, intrinsics_.depth_unit_m);
  return range;
}

void PerceptionLane::begin_learning() noexcept {
  const StateEstimate& state = exposure_state_;
  const Transform base_T_odom = state.odom_T_base.inverse();
  learning_.stance = {};
  learning_.stance.base_up = base_T_odom.R.col(2);
  learning_.stance.speed_mps = math::sqrt(state.odom_v_base_mps.squaredNorm());
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    learning_.stance.base_T_sole[foot] = base_T_odom * state.odom_T_sole[foot];
    learning_.stance.stands[foot] = state.contact_probability[foot] > kStands;
  }
  learning_.foot = 0;
  begin_toe();
}

void PerceptionLane::begin_toe() noexcept {
  if (learning_.foot == kFootCount) return;
  learning_.toe.begin(params_.mount.toe, frame_, intrinsics_, depth_range(), params_.robot.sole,
                      mount_.base_T_camera().inverse() * learning_.stance.base_T_sole[learning_.foot]);
}

bool PerceptionLane::learn_some(WorkBudget& budget) noexcept {
  while (!budget.exhausted()) {
    if (learning_.foot == kFootCount) {
      mount_.update(extractor_.result(), learning_.stance);
      budget.spend(
          units_of(kLearnMount + kLearnPerSurface * static_cast<std::int32_t>(extractor_.result().surfaces.size())));
      return true;
    }
    if (!learning_.stance.stands[learning_.foot] || learning_.toe.step()) {
      if (learning_.stance.stands[learning_.foot]) learning_.stance.toes[learning_.foot] = learning_.toe.sighting();
      ++learning_.foot;
      begin_toe();
    }
    budget.spend(learning_.toe.work().take_units());
  }
  return false;
}

void PerceptionLane::begin_map(std::int64_t now_ns) noexcept {
  PolygonMap::View view;
  view.odom_T_camera = exposure_state_.odom_T_base * mount_.base_T_camera();
  view.position_sigma_m = exposure_state_.odom_sigma_m;
  view.tilt_sigma_rad = exposure_state_.tilt_sigma_rad;
  if (params_.estimate_mount) view.mount_sigma_rad = mount_.tilt_sigma_rad();  // else the data sheet is believed
  view.intrinsics = intrinsics_;
  view.body = body_;
  view.body_margin = body_margin(params_.body, params_.robot.legs, params_.mount.prior.tilt_sigma_rad);
  view.columns = &extractor_.segmenter().image().columns;  // no next picture before the map is done, see intake()
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    view.odom_T_sole[foot] = exposure_state_.odom_T_sole[foot];
    view.stands[foot] = exposure_state_.contact_probability[foot] > kStands;
  }
  view.sole = params_.robot.sole.contact;
  view.tell_ground = link_.search_context.front().goes_to;
  map_.begin(extractor_.result(), view);
  // On the stairs alone: before them the mount is still being found, and treads seem to move with it.
  if (params_.estimate_mount && link_.search_context.front().climbing)
    learning_.way.update(extractor_.result(), view.odom_T_camera, exposure_state_.odom_T_base.p_m);
  pending_.mapping = true;
  const PolygonMap::Counters& counters = map_.counters();
  const std::uint32_t lost = counters.abandoned_frames + counters.stale_frames + counters.rejected_frames;
  health_.own.follow(Limit::kFrameLost, now_ns, lost);
}

Progress PerceptionLane::map(std::int64_t now_ns, WorkBudget& budget) noexcept {
  if (!pending_.mapping) return Progress::kIdle;
  const Progress progress = map_.step(budget);
  if (progress != Progress::kBusy) {
    pending_.mapping = false;
    pending_.search_due = true;
    health_.own.follow(Limit::kMapFull, now_ns, map_.counters().evicted + map_.counters().refused);
    if (watcher_ != nullptr) watcher_->map.publish(now_ns, map_.snapshot());
  }
  return progress;
}

void PerceptionLane::begin_search() noexcept {
  const SearchContext& context = link_.search_context.front();
  FootholdSearch::Query query;
  query.odom_T_base = context.state.odom_T_base;
  for (const Foot foot : {Foot::kLeft, Foot::kRight})
    query.odom_T_sole[index_of(foot)] = context.state.odom_T_sole[index_of(foot)];
  query.stance = context.stance;
  query.climbing = context.climbing;
  query.descends = context.goes_to;
  query.feet_ahead_m = mount_.feet_ahead_m();
  query.way_excess = learning_.way.excess();
  search_.begin(map_.snapshot(), query);
  pending_.search_due = false;
  pending_.searching = true;
}

Progress PerceptionLane::footholds(std::int64_t now_ns, WorkBudget& budget) noexcept {
  if (!pending_.searching && pending_.search_due) {
    begin_search();
    budget.spend(
        units_of(kBeginSearch + kSearchPerPolygon * static_cast<std::int32_t>(map_.snapshot().polygons.size())));
  }
  if (!pending_.searching) return Progress::kIdle;
  const Progress progress = search_.step(budget);
  if (progress == Progress::kDone) {
    FootholdSet& told = link_.footholds.back();
    told = search_.result();
    const bool climbing = link_.search_context.front().climbing;
    told.obstruction = pictures_.explain(told.obstruction, climbing);
    told.unsteady = pictures_.explain(StopReason::kUnsteady, climbing);
    link_.footholds.publish(now_ns);
  }
  if (progress != Progress::kBusy) pending_.searching = false;
  return progress;
}

}  // namespace polygmap
