// SPDX-License-Identifier: Apache-2.0
// What a climb's sensors said, tick by tick, and what the module commanded: written on the host, played in the guest.
// Field by field, little-endian: the layout of Eigen's types differs between the two machines.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::vm {

static_assert(std::endian::native == std::endian::little);

inline constexpr std::uint64_t kInputsMagic = 0x31'54'55'50'4E'49'4D'50;  // "PMINPUT1"
inline constexpr std::size_t kMaxImuPerTick = 4;

struct TickInputs {
  std::int64_t now_ns = 0;
  std::uint32_t imu_count = 0;
  std::array<ImuSample, kMaxImuPerTick> imu;
  std::uint32_t has_joints = 0;
  JointFeedback joints;
  std::uint32_t has_lio = 0;
  LioSample lio;
  std::uint32_t has_picture = 0;  // arrives now; its pixels are the next of the pictures' file
  std::int64_t picture_stamp_ns = 0;
  std::uint32_t picture_sequence = 0;
  std::uint32_t has_command = 0;  // what the module made of all this
  JointCommand command;
};

// Applies visit to every field of a record: one list for writing and reading.
template <typename Visit, typename Record>
void visit_vector(Visit& visit, Record& vector) {
  for (auto* x = vector.data(); x != vector.data() + vector.size(); ++x) visit(*x);
}
template <typename Visit>
void visit_fields(Visit& visit, CameraIntrinsics& k) {
  visit(k.width_px), visit(k.height_px), visit(k.fx_px), visit(k.fy_px), visit(k.cx_px), visit(k.cy_px);
  visit(k.depth_unit_m);
}
template <typename Visit>
void visit_fields(Visit& visit, TickInputs& t) {
  visit(t.now_ns), visit(t.imu_count);
  for (std::size_t i = 0; i < t.imu_count && i < kMaxImuPerTick; ++i) {
    visit(t.imu[i].stamp_ns);
    visit_vector(visit, t.imu[i].gyro_radps);
    visit_vector(visit, t.imu[i].accel_mps2);
  }
  visit(t.has_joints);
  if (t.has_joints != 0) {
    visit(t.joints.stamp_ns);
    visit_vector(visit, t.joints.q_rad);
    visit_vector(visit, t.joints.dq_radps);
    visit_vector(visit, t.joints.tau_nm);
    visit_vector(visit, t.joints.foot_force_n);
    visit_vector(visit, t.joints.silent_cycles);
  }
  visit(t.has_lio);
  if (t.has_lio != 0) {
    visit(t.lio.stamp_ns);
    visit_vector(visit, t.lio.lio_T_lidar.R);
    visit_vector(visit, t.lio.lio_T_lidar.p_m);
    visit_vector(visit, t.lio.position_sigma_m);
    visit_vector(visit, t.lio.rotation_sigma_rad);
  }
  visit(t.has_picture);
  if (t.has_picture != 0) visit(t.picture_stamp_ns), visit(t.picture_sequence);
  visit(t.has_command);
  if (t.has_command != 0) {
    visit(t.command.stamp_ns);
    for (JointSetpoint& j : t.command.joints) {
      visit(j.q_rad), visit(j.dq_radps), visit(j.tau_ff_nm), visit(j.kp_nmprad), visit(j.kd_nmsprad);
    }
  }
}

class Writer {
 public:
  template <typename T>
  void operator()(const T& value) {
    const auto* bytes = reinterpret_cast<const char*>(&value);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof value);
  }
  [[nodiscard]] const std::vector<char>& bytes() const { return bytes_; }

 private:
  std::vector<char> bytes_;
};

class Reader {
 public:
  explicit Reader(std::span<const char> bytes) noexcept : bytes_(bytes) {}
  template <typename T>
  void operator()(T& value) noexcept {
    if (bytes_.size() < sizeof value) {
      bytes_ = {};
      good_ = false;
      return;
    }
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
  }
  [[nodiscard]] bool at_end() const noexcept { return bytes_.empty(); }
  [[nodiscard]] bool good() const noexcept { return good_; }  // false: the file ended inside a field

 private:
  std::span<const char> bytes_;
  bool good_ = true;
};

}  // namespace polygmap::vm
