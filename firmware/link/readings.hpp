// SPDX-License-Identifier: Apache-2.0
// From the module's values to the structs of the C interface. All but their size is written; false: there is nothing of
// that kind, and nothing is written.
#pragma once

#include "firmware/link/abi.hpp"
#include "firmware/link/instance.hpp"

namespace polygmap::link {

[[nodiscard]] bool read_command(const Instance& instance, polygmap_command& to) noexcept;
[[nodiscard]] bool read_pose(const Instance& instance, polygmap_pose& to) noexcept;
[[nodiscard]] bool read_status(const Instance& instance, polygmap_status& to) noexcept;
[[nodiscard]] bool read_faults(const Instance& instance, polygmap_faults& to) noexcept;
[[nodiscard]] bool read_plan(const Instance& instance, polygmap_plan& to) noexcept;

// Parts of several. to: three numbers.
inline void copy(const Vec3& from, double* to) noexcept {
  for (int i = 0; i < 3; ++i) to[i] = from[i];
}
[[nodiscard]] inline polygmap_transform transform_of(const Transform& from) noexcept {
  const Eigen::Quaterniond q(from.R);
  polygmap_transform to{{}, {q.w(), q.x(), q.y(), q.z()}};
  copy(from.p_m, to.p_m);
  return to;
}

}  // namespace polygmap::link
