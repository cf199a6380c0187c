// SPDX-License-Identifier: Apache-2.0
// What several messages have: stamps, headers, vectors, poses, colours, scenes.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/time.hpp"
#include "firmware/recording/mcap/cdr.hpp"

namespace polygmap::mcap {

inline void put_stamp(CdrWriter& out, std::int64_t t_ns) noexcept {
  out.put(static_cast<std::int32_t>(t_ns / kNsPerS));
  out.put(static_cast<std::uint32_t>(t_ns % kNsPerS));
}
inline void put_header(CdrWriter& out, std::int64_t t_ns, std::string_view frame) noexcept {
  put_stamp(out, t_ns);
  out.put_text(frame);
}
inline void put_vector(CdrWriter& out, const Vec3& v) noexcept {
  for (int i = 0; i < 3; ++i) out.put(v[i]);
}
inline void put_rotation(CdrWriter& out, const Mat3& R) noexcept {
  const Eigen::Quaterniond q(R);
  for (const double x : {q.x(), q.y(), q.z(), q.w()}) out.put(x);
}
inline void put_pose(CdrWriter& out, const Transform& pose) noexcept {
  put_vector(out, pose.p_m);
  put_rotation(out, pose.R);
}
template <std::size_t N>
void put_diagonal(CdrWriter& out, const std::array<double, N>& diagonal) noexcept {
  for (std::size_t i = 0; i < N * N; ++i) out.put(i % (N + 1) == 0 ? diagonal[i / (N + 1)] : 0.0);
}

struct Color {
  double r, g, b, a;
};
inline void put_color(CdrWriter& out, const Color& color) noexcept {
  for (const double x : {color.r, color.g, color.b, color.a}) out.put(x);
}

// A scene (foxglove_msgs/SceneUpdate) replaces what its topic showed before: one deletion of all, then the entities.
inline void begin_scene(CdrWriter& out, std::int64_t stamp_ns, std::size_t entities) noexcept {
  constexpr std::uint8_t kAll = 1;
  out.put_count(1);
  put_stamp(out, stamp_ns);
  out.put(kAll);
  out.put_text("");
  out.put_count(entities);
}
inline void begin_entity(CdrWriter& out, std::int64_t stamp_ns, std::string_view frame, std::string_view id) noexcept {
  put_stamp(out, stamp_ns);
  out.put_text(frame);
  out.put_text(id);
  put_stamp(out, 0);  // no end of its life
  out.put(false);     // it does not move with its frame
}
inline void put_no_primitives(CdrWriter& out, int kinds) noexcept {
  for (int i = 0; i < kinds; ++i) out.put_count(0);
}

}  // namespace polygmap::mcap
