// SPDX-License-Identifier: Apache-2.0
// The fields of everything that a recording has, each named once: by this list they are written, read and compared.
// Never a struct as it lies in memory, whose padding and byte order are the compiler's and the processor's.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <type_traits>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/operator_command.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/messages/state.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/estimation/quality/estimate_quality.hpp"
#include "algorithms/robot/robot_model.hpp"
#include "firmware/lane_link.hpp"
#include "firmware/recording/stream/bytes.hpp"
#include "hal/ports/joint_bus.hpp"
#include "scheduler/event_counters.hpp"

namespace polygmap::recording {

template <class T, class Message>
concept Of = std::is_same_v<std::remove_const_t<T>, Message>;

// A visitor f has
//   leaf(name, index, value)      a number; index: its place in an array, -1 outside one
//   enter(name, index), leave()   around the fields of a struct and the elements of an array
//   count(n)                      before the n elements of a vector: how many of them to visit; or, of who fills it,
//   resize(vector)                which gives it its elements
//   leaves(numbers)               optional, in the stead of leaf() for numbers that lie side by side
//   whole(message)                optional, in the stead of enter(), its fields and leave()
//   names_only()                  in the stead of count(): it wants no values, and a vector's element once
template <class F, class T>
void walk(F& f, std::string_view name, T& value, int index = -1);

void each_field(auto& f, Of<Transform> auto& m) {
  constexpr std::size_t kNumbers = 9 + 3;
  static_assert(sizeof m == kNumbers * sizeof(double), "numbers that lie side by side");
  if constexpr (requires { f.leaves(std::span(m.R.data(), std::size_t{})); }) {
    f.leaves(std::span(m.R.data(), kNumbers));
  } else {
    walk(f, "R", m.R);
    walk(f, "p_m", m.p_m);
  }
}
void each_field(auto& f, Of<ImuSample> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  walk(f, "gyro_radps", m.gyro_radps);
  walk(f, "accel_mps2", m.accel_mps2);
}
void each_field(auto& f, Of<JointSet> auto& m) {
  std::uint16_t bits = m.bits();
  f.leaf("bits", -1, bits);
  if constexpr (!std::is_const_v<std::remove_reference_t<decltype(m)>>) m = JointSet::of_bits(bits);
}
void each_field(auto& f, Of<JointFeedback> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  walk(f, "q_rad", m.q_rad);
  walk(f, "dq_radps", m.dq_radps);
  walk(f, "tau_nm", m.tau_nm);
  walk(f, "silent_cycles", m.silent_cycles);
  walk(f, "foot_force_n", m.foot_force_n);
}
void each_field(auto& f, Of<hal::JointBusStatus> auto& m) {
  walk(f, "drive_errors", m.drive_errors);
  walk(f, "drive_code", m.drive_code);
  walk(f, "drive_degc", m.drive_degc);
  walk(f, "bus_off", m.bus_off);
  walk(f, "senses_feet", m.senses_feet);
  walk(f, "feet_silent", m.feet_silent);
  walk(f, "bus_offs", m.bus_offs);
  walk(f, "refused", m.refused);
  walk(f, "unknown_ids", m.unknown_ids);
  walk(f, "bad_frames", m.bad_frames);
  walk(f, "drive_error_replies", m.drive_error_replies);
  walk(f, "clamped", m.clamped);
  walk(f, "not_finite", m.not_finite);
  walk(f, "lost", m.lost);
  walk(f, "failed_calls", m.failed_calls);
  walk(f, "stale", m.stale);
}
void each_field(auto& f, Of<GainLimits> auto& m) {
  walk(f, "kp_nmprad", m.kp_nmprad);
  walk(f, "kd_nmsprad", m.kd_nmsprad);
}
void each_field(auto& f, Of<JointSetpoint> auto& m) {
  walk(f, "q_rad", m.q_rad);
  walk(f, "dq_radps", m.dq_radps);
  walk(f, "tau_ff_nm", m.tau_ff_nm);
  walk(f, "kp_nmprad", m.kp_nmprad);
  walk(f, "kd_nmsprad", m.kd_nmsprad);
}
void each_field(auto& f, Of<JointCommand> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  static_assert(sizeof m.joints == 5 * sizeof(double) * kJointCount, "numbers that lie side by side");
  if constexpr (requires { f.leaves(std::span(&m.joints[0].q_rad, std::size_t{})); }) {
    f.leaves(std::span(&m.joints[0].q_rad, 5 * kJointCount));
  } else {
    walk(f, "joints", m.joints);
  }
}
void each_field(auto& f, Of<Destination> auto& m) {
  walk(f, "ahead_m", m.ahead_m);
  walk(f, "left_m", m.left_m);
  walk(f, "turn_rad", m.turn_rad);
  walk(f, "has_turn", m.has_turn);
  walk(f, "up_m", m.up_m);
  walk(f, "has_height", m.has_height);
}
void each_field(auto& f, Of<OperatorRequest> auto& m) {
  walk(f, "command", m.command);
  walk(f, "destination", m.destination);
}
void each_field(auto& f, Of<LioSample> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  walk(f, "lio_T_lidar", m.lio_T_lidar);
  walk(f, "position_sigma_m", m.position_sigma_m);
  walk(f, "rotation_sigma_rad", m.rotation_sigma_rad);
}
void each_field(auto& f, Of<CameraIntrinsics> auto& m) {
  walk(f, "width_px", m.width_px);
  walk(f, "height_px", m.height_px);
  walk(f, "fx_px", m.fx_px);
  walk(f, "fy_px", m.fy_px);
  walk(f, "cx_px", m.cx_px);
  walk(f, "cy_px", m.cy_px);
  walk(f, "depth_unit_m", m.depth_unit_m);
}

void each_field(auto& f, Of<StateEstimate> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  walk(f, "oldest_input_ns", m.oldest_input_ns);
  walk(f, "heard_ns", m.heard_ns);
  walk(f, "odom_T_base", m.odom_T_base);
  walk(f, "world_T_odom", m.world_T_odom);
  walk(f, "odom_v_base_mps", m.odom_v_base_mps);
  walk(f, "base_w_base_radps", m.base_w_base_radps);
  walk(f, "q_rad", m.q_rad);
  walk(f, "odom_T_sole", m.odom_T_sole);
  walk(f, "contact_probability", m.contact_probability);
  walk(f, "foot_force_sigma_n", m.foot_force_sigma_n);
  walk(f, "position_sigma_m", m.position_sigma_m);
  walk(f, "odom_turned_rad", m.odom_turned_rad);
  walk(f, "odom_sigma_m", m.odom_sigma_m);
  walk(f, "velocity_sigma_mps", m.velocity_sigma_mps);
  walk(f, "yaw_sigma_rad", m.yaw_sigma_rad);
  walk(f, "tilt_sigma_rad", m.tilt_sigma_rad);
  walk(f, "lio_age_ns", m.lio_age_ns);
  walk(f, "initialised", m.initialised);
}
void each_field(auto& f, Of<InnovationStatistics> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  walk(f, "count", m.count);
  walk(f, "last", m.last);
  walk(f, "recent", m.recent);
  walk(f, "mean", m.mean);
}
void each_field(auto& f, Of<EstimateQuality> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  walk(f, "covariance", m.covariance);
  walk(f, "innovations", m.innovations);
  walk(f, "outliers", m.outliers);
}

void each_field(auto& f, Of<EdgeLine> auto& m) {
  walk(f, "a_m", m.a_m);
  walk(f, "b_m", m.b_m);
  walk(f, "sigma_m", m.sigma_m);
  walk(f, "valid", m.valid);
}
void each_field(auto& f, Of<SurfacePatch> auto& m) {
  walk(f, "kind", m.kind);
  walk(f, "normal", m.normal);
  walk(f, "d_m", m.d_m);
  walk(f, "offset_sigma_m", m.offset_sigma_m);
  walk(f, "tilt_sigma_rad", m.tilt_sigma_rad);
  walk(f, "centroid_m", m.centroid_m);
  walk(f, "area_m2", m.area_m2);
  walk(f, "rmse_m", m.rmse_m);
  walk(f, "invalid_fraction", m.invalid_fraction);
  walk(f, "polygon", m.polygon);
  for (std::size_t i = 0; i < m.polygon.size(); ++i) walk(f, "edges", m.edges[i], static_cast<int>(i));
  walk(f, "covariance", m.covariance);
  walk(f, "plane", m.plane);
  walk(f, "nosing", m.nosing);
  walk(f, "back", m.back);
  walk(f, "back_drops", m.back_drops);
}
void each_field(auto& f, Of<ThingSighting> auto& m) {
  walk(f, "near_m", m.near_m);
  walk(f, "far_m", m.far_m);
  walk(f, "height_m", m.height_m);
}
void each_field(auto& f, Of<SurfaceFrame> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  walk(f, "sequence", m.sequence);
  walk(f, "surfaces", m.surfaces);
  walk(f, "things", m.things);
  walk(f, "invalid_fraction", m.invalid_fraction);
  walk(f, "dropped", m.dropped);
}
void each_field(auto& f, Of<MapPolygon> auto& m) {
  walk(f, "surface", m.surface);
  walk(f, "id", m.id);
  walk(f, "sightings", m.sightings);
  walk(f, "last_seen_ns", m.last_seen_ns);
}
void each_field(auto& f, Of<OccupiedCell> auto& m) {
  walk(f, "x_m", m.x_m);
  walk(f, "y_m", m.y_m);
  walk(f, "ground_m", m.ground_m);
  walk(f, "height_m", m.height_m);
}
void each_field(auto& f, Of<MapSnapshot> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  walk(f, "drift_m", m.drift_m);
  walk(f, "polygons", m.polygons);
  walk(f, "occupied", m.occupied);
}

void each_field(auto& f, Of<Foothold> auto& m) {
  walk(f, "position_m", m.position_m);
  walk(f, "yaw_rad", m.yaw_rad);
  walk(f, "up", m.up);
  walk(f, "clearance_m", m.clearance_m);
  walk(f, "toe_clearance_m", m.toe_clearance_m);
  walk(f, "polygon_id", m.polygon_id);
  walk(f, "last_seen_ns", m.last_seen_ns);
  walk(f, "nosing_distance_m", m.nosing_distance_m);
  walk(f, "side_room_m", m.side_room_m);
}
void each_field(auto& f, Of<TreadView> auto& m) {
  walk(f, "nosing_a_m", m.nosing_a_m);
  walk(f, "nosing_b_m", m.nosing_b_m);
}
void each_field(auto& f, Of<GroundView> auto& m) {
  walk(f, "corner_m", m.corner_m);
  walk(f, "height_m", m.height_m);
  walk(f, "level", m.level);
  walk(f, "tall", m.tall);
  walk(f, "ramps", m.ramps);
  walk(f, "steepest", m.steepest);
}
void each_field(auto& f, Of<FootholdSet> auto& m) {
  walk(f, "map_stamp_ns", m.map_stamp_ns);
  walk(f, "p_star", m.p_star);
  walk(f, "has_p_star", m.has_p_star);
  walk(f, "has_p_star_star", m.has_p_star_star);
  walk(f, "p_star_feet", m.p_star_feet);
  walk(f, "p_star_star_feet", m.p_star_star_feet);
  walk(f, "tread", m.tread);
  walk(f, "lip_beyond", m.lip_beyond);
  walk(f, "has_lip_beyond", m.has_lip_beyond);
  walk(f, "obstruction", m.obstruction);
  walk(f, "unsteady", m.unsteady);
  walk(f, "measured_rise_m", m.measured_rise_m);
  walk(f, "measured_tread_m", m.measured_tread_m);
  walk(f, "ground", m.ground);
}
void each_field(auto& f, Of<PoseRequest> auto& m) {
  walk(f, "number", m.number);
  walk(f, "stamp_ns", m.stamp_ns);
}
void each_field(auto& f, Of<LatchedStep> auto& m) {
  walk(f, "sequence", m.sequence);
  walk(f, "foot", m.foot);
  walk(f, "onto_tread", m.onto_tread);
  walk(f, "height_mapped", m.height_mapped);
  walk(f, "latch_stamp_ns", m.latch_stamp_ns);
  walk(f, "map_stamp_ns", m.map_stamp_ns);
  walk(f, "target", m.target);
  walk(f, "odom_T_target", m.odom_T_target);
  walk(f, "touch_down_stamp_ns", m.touch_down_stamp_ns);
  walk(f, "odom_T_executed", m.odom_T_executed);
}
void each_field(auto& f, Of<GaitStatus> auto& m) {
  walk(f, "stamp_ns", m.stamp_ns);
  walk(f, "phase", m.phase);
  walk(f, "stop_reason", m.stop_reason);
  walk(f, "stop_measured_m", m.stop_measured_m);
  walk(f, "step", m.step);
  walk(f, "treads_climbed", m.treads_climbed);
  walk(f, "stands", m.stands);
  walk(f, "on_toe", m.on_toe);
  walk(f, "odom_T_sole_desired", m.odom_T_sole_desired);
  walk(f, "odom_p_com_desired_m", m.odom_p_com_desired_m);
  walk(f, "ik_limited_ticks", m.ik_limited_ticks);
  walk(f, "early_contacts", m.early_contacts);
  walk(f, "late_contacts", m.late_contacts);
  walk(f, "aborted_swings", m.aborted_swings);
}
void each_field(auto& f, Of<EventCount> auto& m) {
  walk(f, "count", m.count);
  walk(f, "first_ns", m.first_ns);
  walk(f, "last_ns", m.last_ns);
}

// What the camera's mount was found to be.
struct MountFound {
  double roll_rad = 0.0, pitch_rad = 0.0, x_m = 0.0, height_m = 0.0, tilt_sigma_rad = 0.0;
};
void each_field(auto& f, Of<MountFound> auto& m) {
  walk(f, "roll_rad", m.roll_rad);
  walk(f, "pitch_rad", m.pitch_rad);
  walk(f, "x_m", m.x_m);
  walk(f, "height_m", m.height_m);
  walk(f, "tilt_sigma_rad", m.tilt_sigma_rad);
}

namespace detail {
template <class T>
inline constexpr bool kIsMatrix = false;
template <class Scalar, int Rows, int Columns, int Options, int MaxRows, int MaxColumns>
inline constexpr bool kIsMatrix<Eigen::Matrix<Scalar, Rows, Columns, Options, MaxRows, MaxColumns>> = true;
template <class T>
inline constexpr bool kHasNumbers = false;  // and nothing else, side by side
template <class Scalar, int Rows, int Columns, int Options, int MaxRows, int MaxColumns>
inline constexpr bool kHasNumbers<Eigen::Matrix<Scalar, Rows, Columns, Options, MaxRows, MaxColumns>> = true;
template <Number T, std::size_t N>
inline constexpr bool kHasNumbers<std::array<T, N>> = true;
template <class T>
inline constexpr bool kIsVector = false;
template <class T, std::size_t Capacity>
inline constexpr bool kIsVector<StaticVector<T, Capacity>> = true;
template <class T>
inline constexpr bool kIsArray = false;
template <class T, std::size_t N>
inline constexpr bool kIsArray<std::array<T, N>> = true;
}  // namespace detail

template <class F, class T>
void walk(F& f, std::string_view name, T& value, int index) {
  using Value = std::remove_const_t<T>;
  if constexpr (Number<Value>) {
    f.leaf(name, index, value);
  } else if constexpr (requires { f.whole(value); }) {
    f.whole(value);
  } else {
    f.enter(name, index);
    if constexpr (detail::kHasNumbers<Value> && requires { f.leaves(std::span(value.data(), std::size_t{})); }) {
      f.leaves(std::span(value.data(), static_cast<std::size_t>(value.size())));
    } else if constexpr (detail::kIsMatrix<Value>) {  // column by column
      for (int i = 0; i < static_cast<int>(value.size()); ++i) f.leaf("", i, value.data()[i]);
    } else if constexpr (detail::kIsArray<Value>) {
      for (std::size_t i = 0; i < value.size(); ++i) walk(f, "", value[i], static_cast<int>(i));
    } else if constexpr (detail::kIsVector<Value>) {
      if constexpr (requires { f.names_only(); }) {
        static const typename Value::value_type kNone;
        walk(f, "", kNone, 0);
      } else {
        std::size_t count = 0;
        if constexpr (requires { f.resize(value); }) {
          f.resize(value);
          count = value.size();
        } else {
          count = f.count(value.size());
        }
        for (std::size_t i = 0; i < count; ++i) walk(f, "", value[i], static_cast<int>(i));
      }
    } else {
      each_field(f, value);
    }
    f.leave();
  }
}

}  // namespace polygmap::recording
