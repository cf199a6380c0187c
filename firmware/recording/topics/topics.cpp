// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/topics/topics.hpp"

#include <bit>
#include <cstdio>

#include "algorithms/core/math/transcendental.hpp"
#include "firmware/recording/mcap/cdr_parts.hpp"

namespace polygmap::recording {
namespace {

using namespace mcap;  // what messages are put together from

// Colours as the report and the layouts have them, too.
constexpr Color kTread{0.0, 0.62, 0.45, 0.55}, kRiser{0.0, 0.45, 0.70, 0.45}, kOther{0.6, 0.6, 0.6, 0.35};
constexpr Color kNosing{0.94, 0.89, 0.26, 1.0}, kOutline{0.1, 0.1, 0.1, 0.9};
constexpr Color kNext{0.84, 0.10, 0.11, 0.9}, kAfterNext{0.50, 0.25, 0.60, 0.9};

void put_joint_names(CdrWriter& out) noexcept {
  out.put_count(kJointCount);
  for (const std::string_view name : kJointNames) out.put_text(name);
}
template <class OfJoint>
void put_joints(CdrWriter& out, OfJoint&& of_joint) noexcept {
  out.put_count(kJointCount);
  for (std::size_t n = 0; n < kJointCount; ++n) out.put(of_joint(n));
}

void put_pair(CdrWriter& out, std::string_view key, double value) noexcept {
  std::array<char, 32> text{};
  const int length = std::snprintf(text.data(), text.size(), "%.6g", value);
  out.put_text(key);
  out.put_text({text.data(), static_cast<std::size_t>(length)});
}
void put_outline(CdrWriter& out, std::span<const Vec3> points, bool closed, double thickness_m,
                 const Color& color) noexcept {
  constexpr std::uint8_t kStrip = 0, kLoop = 1;
  out.put(closed ? kLoop : kStrip);
  put_pose(out, Transform{});
  out.put(thickness_m);
  out.put(false);  // metres, not pixels
  out.put_count(points.size());
  for (const Vec3& point : points) put_vector(out, point);
  put_color(out, color);
  out.put_count(0);
  out.put_count(0);
}
// A convex polygon as triangles that share its first corner.
void put_fan(CdrWriter& out, std::span<const Vec3> points, const Color& color) noexcept {
  put_pose(out, Transform{});
  out.put_count(points.size());
  for (const Vec3& point : points) put_vector(out, point);
  put_color(out, color);
  out.put_count(0);
  const std::size_t triangles = points.size() < 3 ? 0 : points.size() - 2;
  out.put_count(3 * triangles);
  for (std::size_t i = 0; i < triangles; ++i) {
    out.put(std::uint32_t{0});
    out.put(static_cast<std::uint32_t>(i + 1));
    out.put(static_cast<std::uint32_t>(i + 2));
  }
}
const Color& color_of(SurfaceKind kind) noexcept {
  return kind == SurfaceKind::kTread ? kTread : kind == SurfaceKind::kRiser ? kRiser : kOther;
}
std::string_view name_of(SurfaceKind kind) noexcept {
  return kind == SurfaceKind::kTread ? "tread" : kind == SurfaceKind::kRiser ? "riser" : "other";
}
void put_surface(CdrWriter& out, const SurfacePatch& surface, std::int64_t stamp_ns, std::string_view frame,
                 std::string_view id) noexcept {
  begin_entity(out, stamp_ns, frame, id);
  out.put_count(4);
  out.put_text("kind");
  out.put_text(name_of(surface.kind));
  put_pair(out, "offset_sigma_m", surface.offset_sigma_m);
  put_pair(out, "rmse_m", surface.rmse_m);
  put_pair(out, "invalid_fraction", surface.invalid_fraction);
  put_no_primitives(out, 4);  // arrows, cubes, spheres, cylinders
  constexpr double kThin_m = 0.003, kThick_m = 0.008;
  const std::span<const Vec3> corners(surface.polygon.begin(), surface.polygon.end());
  out.put_count(surface.nosing.valid ? 2 : 1);
  put_outline(out, corners, true, kThin_m, kOutline);
  const std::array<Vec3, 2> nosing{surface.nosing.a_m, surface.nosing.b_m};
  if (surface.nosing.valid) put_outline(out, nosing, false, kThick_m, kNosing);
  out.put_count(1);
  put_fan(out, corners, color_of(surface.kind));
  put_no_primitives(out, 2);  // texts, models
}

class IdText {
 public:
  IdText(const char* prefix, std::size_t number) noexcept {
    length_ = std::snprintf(text_.data(), text_.size(), "%s%zu", prefix, number);
  }
  [[nodiscard]] std::string_view view() const noexcept { return {text_.data(), static_cast<std::size_t>(length_)}; }

 private:
  std::array<char, 32> text_{};
  int length_ = 0;
};

}  // namespace

void Topics::send(Topic topic, std::int64_t publish_ns, MessageSink& sink) noexcept {
  if (out_.full()) {
    ++too_long_;
    return;
  }
  sink.take(topic, log_ns_, publish_ns, out_.bytes());
}

void Topics::write(const Record& record, MessageSink& sink) noexcept {
  if (record.kind == RecordKind::kRow) write_row(record.row, sink);
  if (record.kind != RecordKind::kCycle) return;
  log_ns_ = record.cycle.due_ns;
  write_frame(record.cycle_lane, record.cycle);
  send(Topic::kFrame, record.cycle.due_ns, sink);
}

void Topics::write_row(const RowCall& row, MessageSink& sink) noexcept {
  log_ns_ = row.cycle_ns;
  units_spent_[row.row] = row.units - row.units_left;
  for (const PortCall& call : row.calls) write_call(call, sink);
  write_outputs(row, sink);
}

void Topics::write_call(const PortCall& call, MessageSink& sink) noexcept {
  if (call.kind == CallKind::kWriteJoints) {
    write_command(call.command);
    send(Topic::kCommands, call.command.stamp_ns, sink);
    write_gains(call.command);
    return send(Topic::kGains, call.command.stamp_ns, sink);
  }
  if (!call.gave) return;
  switch (call.kind) {
    case CallKind::kReadImu:
      write_imu(call.imu);
      return send(Topic::kImu, call.imu.stamp_ns, sink);
    case CallKind::kReadJoints:
      write_joints(call.joints);
      send(Topic::kJoints, call.joints.stamp_ns, sink);
      for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
        write_foot(call.joints, foot);
        send(Topic::kFeet, call.joints.stamp_ns, sink);
      }
      return;
    case CallKind::kReadLidar:
      write_lio(call.lio);
      return send(Topic::kLio, call.lio.stamp_ns, sink);
    default:
      return;
  }
}

void Topics::write_outputs(const RowCall& row, MessageSink& sink) noexcept {
  using Left = RowOutputs::Left;
  constexpr std::uint32_t kEvery = 5;  // of the transforms: 100 Hz
  switch (outputs_.read(row)) {
    case Left::kState:
      write_odometry();
      send(Topic::kOdometry, outputs_.state.stamp_ns, sink);
      if (transform_skip_++ % kEvery != 0) return;
      write_transforms();
      return send(Topic::kTransforms, outputs_.state.stamp_ns, sink);
    case Left::kGait:
      write_gait();
      return send(Topic::kGait, outputs_.gait.stamp_ns, sink);
    case Left::kHealth:
      write_faults(outputs_.health, row.cycle_ns);
      return send(Topic::kFaults, row.cycle_ns, sink);
    case Left::kSurfaces:
      write_surfaces();
      return send(Topic::kSurfaces, outputs_.surfaces.stamp_ns, sink);
    case Left::kMap:
      write_map();
      return send(Topic::kMap, outputs_.map.stamp_ns, sink);
    case Left::kFootholds:
      write_footholds(row.cycle_ns);
      return send(Topic::kFootholds, outputs_.footholds.map_stamp_ns, sink);
    case Left::kNothing:
      return;
  }
}

void Topics::write_imu(const ImuSample& imu) noexcept {
  out_.begin();
  put_header(out_, imu.stamp_ns, "base");
  for (const double x : {0.0, 0.0, 0.0, 1.0}) out_.put(x);
  for (int i = 0; i < 9; ++i) out_.put(i == 0 ? -1.0 : 0.0);  // -1: no orientation is measured
  put_vector(out_, imu.gyro_radps);
  put_diagonal<3>(out_, {});
  put_vector(out_, imu.accel_mps2);
  put_diagonal<3>(out_, {});
}

void Topics::write_joints(const JointFeedback& joints) noexcept {
  out_.begin();
  put_header(out_, joints.stamp_ns, "");
  put_joint_names(out_);
  for (const JointVector* values : {&joints.q_rad, &joints.dq_radps, &joints.tau_nm}) {
    put_joints(out_, [values](std::size_t n) { return (*values)[static_cast<Eigen::Index>(n)]; });
  }
}

void Topics::write_foot(const JointFeedback& joints, Foot foot) noexcept {
  out_.begin();
  put_header(out_, joints.stamp_ns, foot == Foot::kLeft ? "left_sole" : "right_sole");
  for (const double x : {0.0, 0.0, joints.foot_force_n[index_of(foot)], 0.0, 0.0, 0.0}) out_.put(x);
}

void Topics::write_lio(const LioSample& lio) noexcept {
  out_.begin();
  put_header(out_, lio.stamp_ns, "lio");
  out_.put_text("lidar");
  put_pose(out_, lio.lio_T_lidar);
  const Vec3 p = lio.position_sigma_m.cwiseAbs2(), r = lio.rotation_sigma_rad.cwiseAbs2();
  put_diagonal<6>(out_, {p[0], p[1], p[2], r[0], r[1], r[2]});
  for (int i = 0; i < 6; ++i) out_.put(0.0);
  for (int i = 0; i < 36; ++i) out_.put(i == 0 ? -1.0 : 0.0);  // no twist is measured
}

void Topics::write_command(const JointCommand& command) noexcept {
  out_.begin();
  put_header(out_, command.stamp_ns, "");
  put_joint_names(out_);
  for (double JointSetpoint::*const field :
       {&JointSetpoint::q_rad, &JointSetpoint::dq_radps, &JointSetpoint::tau_ff_nm}) {
    put_joints(out_, [&command, field](std::size_t n) { return command.joints[n].*field; });
  }
}

void Topics::write_gains(const JointCommand& command) noexcept {
  out_.begin();
  put_header(out_, command.stamp_ns, "");
  put_joint_names(out_);
  for (double JointSetpoint::*const field : {&JointSetpoint::kp_nmprad, &JointSetpoint::kd_nmsprad}) {
    put_joints(out_, [&command, field](std::size_t n) { return command.joints[n].*field; });
  }
}

void Topics::write_odometry() noexcept {
  const Transform pose = outputs_.state.world_T_base();
  out_.begin();
  put_header(out_, outputs_.state.stamp_ns, "world");
  out_.put_text("base");
  put_pose(out_, pose);
  const auto& covariance = outputs_.quality.covariance;  // position, velocity, rotation; odometry's axes
  constexpr std::array<int, 6> kPose{0, 1, 2, 6, 7, 8};
  for (const int row : kPose) {
    for (const int column : kPose) out_.put(covariance(row, column));
  }
  const Mat3& odom_R_base = outputs_.state.odom_T_base.R;
  put_vector(out_, Vec3(odom_R_base.transpose() * outputs_.state.odom_v_base_mps));
  put_vector(out_, outputs_.state.base_w_base_radps);
  const Mat3 velocity = odom_R_base.transpose() * covariance.block<3, 3>(3, 3) * odom_R_base;
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) out_.put(row < 3 && column < 3 ? velocity(row, column) : 0.0);
  }
}

void Topics::write_transforms() noexcept {
  out_.begin();
  out_.put_count(3);
  put_header(out_, outputs_.state.stamp_ns, "world");
  out_.put_text("odom");
  put_pose(out_, outputs_.state.world_T_odom);
  put_header(out_, outputs_.state.stamp_ns, "odom");
  out_.put_text("base");
  put_pose(out_, outputs_.state.odom_T_base);
  put_header(out_, outputs_.state.stamp_ns, "base");
  out_.put_text("camera");
  put_pose(out_, base_T_camera_);
}

void Topics::write_gait() noexcept {
  out_.begin();
  put_header(out_, outputs_.gait.stamp_ns, "odom");
  out_.put_text(polygmap::name_of(outputs_.gait.phase));
  out_.put_text(polygmap::name_of(outputs_.module_state));
  out_.put_text(polygmap::name_of(outputs_.gait.stop_reason));
  out_.put(outputs_.gait.stop_measured_m);
  out_.put(outputs_.gait.treads_climbed);
  out_.put(outputs_.gait.step.sequence);
  for (const bool stands : outputs_.gait.stands) out_.put(stands);
  for (const double probability : outputs_.state.contact_probability) out_.put(probability);
  for (const Transform& sole : outputs_.gait.odom_T_sole_desired) put_pose(out_, sole);
  for (const Transform& sole : outputs_.state.odom_T_sole) put_pose(out_, sole);
  put_vector(out_, Vec3(outputs_.gait.odom_p_com_desired_m[0], outputs_.gait.odom_p_com_desired_m[1], 0.0));
}

void Topics::write_faults(const HealthCounts& counts, std::int64_t now_ns) noexcept {
  const auto put_raised = [&](auto&& put) {
    out_.put_count(static_cast<std::size_t>(
        std::ranges::count_if(counts, [](const EventCount& count) { return count.count > 0; })));
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (counts[i].count > 0) put(i);
    }
  };
  out_.begin();
  put_header(out_, now_ns, "");
  put_raised([&](std::size_t i) {
    out_.put_text(i < kFaultTable.size() ? kFaultTable[i].name : kLimitTable[i - kFaultTable.size()].name);
  });
  put_raised([&](std::size_t i) { out_.put(counts[i].count); });
  put_raised([&](std::size_t i) { out_.put(counts[i].first_ns); });
  put_raised([&](std::size_t i) { out_.put(counts[i].last_ns); });
}

void Topics::write_frame(std::uint8_t lane, const CycleReport& cycle) noexcept {
  const std::uint32_t rows = cycle.ran | cycle.shed | cycle.deferred;
  const auto put_rows = [&](auto&& put) {
    out_.put_count(static_cast<std::size_t>(std::popcount(rows)));
    for (std::size_t row = 0; row < kTasks.size(); ++row) {
      if ((rows >> row & 1U) != 0) put(row);
    }
  };
  out_.begin();
  put_header(out_, cycle.due_ns, "");
  out_.put(lane);
  out_.put(cycle.cycle);
  put_rows([&](std::size_t row) { out_.put_text(kTasks[row].row.task); });
  for (const std::uint32_t mask : {cycle.ran, cycle.shed, cycle.deferred, cycle.overran}) {
    put_rows([&](std::size_t row) { out_.put((mask >> row & 1U) != 0); });
  }
  put_rows([&](std::size_t row) { out_.put((cycle.ran >> row & 1U) != 0 ? units_spent_[row] : 0); });
  out_.put(cycle.overrun);
  out_.put(cycle.caught_up);
  out_.put(cycle.skipped_before);
}

void Topics::write_surfaces() noexcept {
  out_.begin();
  begin_scene(out_, outputs_.surfaces.stamp_ns, outputs_.surfaces.surfaces.size());
  for (std::size_t i = 0; i < outputs_.surfaces.surfaces.size(); ++i) {
    put_surface(out_, outputs_.surfaces.surfaces[i], outputs_.surfaces.stamp_ns, "camera",
                IdText("surface ", i).view());
  }
}

void Topics::write_map() noexcept {
  out_.begin();
  begin_scene(out_, outputs_.map.stamp_ns, outputs_.map.polygons.size());
  for (const MapPolygon& polygon : outputs_.map.polygons) {
    put_surface(out_, polygon.surface, outputs_.map.stamp_ns, "odom", IdText("polygon ", polygon.id).view());
  }
}

void Topics::write_footholds(std::int64_t now_ns) noexcept {
  const auto put_feet = [&](const std::array<Foothold, kFootCount>& feet, const char* id, const Color& color) {
    begin_entity(out_, now_ns, "odom", id);
    out_.put_count(2 * kFootCount);
    for (const Foothold& foothold : feet) {
      put_pair(out_, "clearance_m", foothold.clearance_m);
      put_pair(out_, "toe_clearance_m", foothold.toe_clearance_m);
    }
    put_no_primitives(out_, 1);
    out_.put_count(kFootCount);
    for (const Foothold& foothold : feet) {
      const auto half = math::sin_cos(0.5 * foothold.yaw_rad);
      put_vector(out_, foothold.position_m);
      for (const double x : {0.0, 0.0, half.sin, half.cos}) out_.put(x);
      for (const double x : {0.26, 0.096, 0.004}) out_.put(x);
      put_color(out_, color);
    }
    put_no_primitives(out_, 6);
  };
  out_.begin();
  begin_scene(out_, now_ns,
              static_cast<std::size_t>(outputs_.footholds.has_p_star) + (outputs_.footholds.has_p_star_star ? 1U : 0U));
  if (outputs_.footholds.has_p_star) put_feet(outputs_.footholds.p_star_feet, "p*", kNext);
  if (outputs_.footholds.has_p_star_star) put_feet(outputs_.footholds.p_star_star_feet, "p**", kAfterNext);
}

std::span<const std::byte> Topics::image_head(const DepthFrameView& frame) noexcept {
  const auto width = static_cast<std::uint32_t>(frame.width_px), height = static_cast<std::uint32_t>(frame.height_px);
  out_.begin();
  put_header(out_, frame.stamp_ns, "camera");
  out_.put(height);
  out_.put(width);
  out_.put_text("16UC1");
  out_.put(std::uint8_t{0});
  out_.put(2 * width);
  out_.put_count(std::size_t{2} * width * height);
  return out_.bytes();
}

std::span<const std::byte> Topics::camera_info(const CameraIntrinsics& camera, std::int64_t stamp_ns) noexcept {
  out_.begin();
  put_header(out_, stamp_ns, "camera");
  out_.put(static_cast<std::uint32_t>(camera.height_px));
  out_.put(static_cast<std::uint32_t>(camera.width_px));
  out_.put_text("plumb_bob");
  out_.put_count(0);  // no distortion
  for (const double x : {camera.fx_px, 0.0, camera.cx_px, 0.0, camera.fy_px, camera.cy_px, 0.0, 0.0, 1.0}) out_.put(x);
  put_diagonal<3>(out_, {1.0, 1.0, 1.0});
  for (const double x :
       {camera.fx_px, 0.0, camera.cx_px, 0.0, 0.0, camera.fy_px, camera.cy_px, 0.0, 0.0, 0.0, 1.0, 0.0}) {
    out_.put(x);
  }
  for (int i = 0; i < 6; ++i) out_.put(std::uint32_t{0});  // no binning, no region
  out_.put(false);
  return out_.bytes();
}

}  // namespace polygmap::recording
