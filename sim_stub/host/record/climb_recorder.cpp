// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/record/climb_recorder.hpp"

#include <lodepng.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include "algorithms/core/time.hpp"
#include "algorithms/estimation/contact/leg_measurement.hpp"
#include "firmware/config/file_error.hpp"
#include "sim_stub/host/output_file.hpp"
#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

constexpr std::int64_t kPicturePeriod_ns = 2 * kNsPerS;

void add_number(std::string& text, double value) {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%s%.9g", text.empty() || text.back() == '\n' ? "" : ",", value);
  text += buffer.data();
}
void add_numbers(std::string& text, const Vec3& values) {
  for (const double value : values) add_number(text, value);
}
void add_rotation(std::string& text, const Mat3& R) {
  const Eigen::Quaterniond q(R);
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) add_number(text, value);
}
void add_pose(std::string& text, const Transform& pose) {
  add_numbers(text, pose.p_m);
  add_rotation(text, pose.R);
}

}  // namespace

ClimbRecorder::ClimbRecorder(hal::DepthCamera& camera, hal::Imu& imu, hal::JointBus& joints, hal::LidarOdometry& lidar)
    : camera_(camera), imu_(imu), joints_(joints), lidar_(lidar) {
  const CameraIntrinsics size = camera.intrinsics();
  picture_.depth.resize(static_cast<std::size_t>(size.width_px) * static_cast<std::size_t>(size.height_px));
}

bool ClimbRecorder::try_acquire(DepthFrameView& frame) noexcept {
  if (!camera_.try_acquire(frame)) return false;
  const auto pixels = static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px);
  if (frame.stamp_ns >= next_picture_ns_ && frame.depth != nullptr && pixels <= picture_.depth.size()) {
    next_picture_ns_ = frame.stamp_ns + kPicturePeriod_ns;
    picture_.width_px = frame.width_px;
    picture_.height_px = frame.height_px;
    std::copy_n(frame.depth, pixels, picture_.depth.begin());
    has_new_picture_ = true;
  }
  return true;
}

bool ClimbRecorder::try_read(ImuSample& sample) noexcept {
  if (!imu_.try_read(sample)) return false;
  last_imu_ = sample;
  return true;
}

bool ClimbRecorder::try_read(JointFeedback& feedback) noexcept {
  if (!joints_.try_read(feedback)) return false;
  last_joints_ = feedback;
  return true;
}

bool ClimbRecorder::try_read(LioSample& sample) noexcept {
  if (!lidar_.try_read(sample)) return false;
  last_lio_ = sample;
  has_new_lio_ = true;
  return true;
}

void ClimbRecorder::observe(const Truth& truth, const StateEstimate& state) {
  if (has_new_picture_) pictures_.push_back(picture_);
  has_new_picture_ = false;
  if (has_new_lio_) {
    lio_rows_.push_back(
        {last_lio_.stamp_ns, truth.stamp_ns, last_lio_.lio_T_lidar * nominal_robot().mounts.base_T_lidar.inverse()});
  }
  has_new_lio_ = false;
  if (last_joints_.stamp_ns == 0 || (!rows_.empty() && last_imu_.stamp_ns <= rows_.back().stamp_ns)) return;
  LogRow row;
  row.stamp_ns = last_imu_.stamp_ns;
  row.gyro_radps = last_imu_.gyro_radps;
  row.accel_mps2 = last_imu_.accel_mps2;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    // Before the module has an opinion it waits for a robot that stands.
    row.contact[index_of(foot)] = state.initialised ? state.contact_probability[index_of(foot)] : 1.0;
    const LegMeasurement leg = measure_leg(leg_frames(nominal_robot().legs, foot, leg_joints(last_joints_.q_rad, foot)),
                                           leg_joints(last_joints_.dq_radps, foot));
    row.base_p_foot_m[index_of(foot)] = leg.base_T_sole.p_m;
    row.base_R_foot[index_of(foot)] = leg.base_T_sole.R;
    row.base_w_foot_radps[index_of(foot)] = leg.base_w_sole_radps;
  }
  row.truth.true_T_base = truth.true_T_base;
  rows_.push_back(row);
  if (rows_.size() < 3) return;
  // The velocity of the row before the newest, by central difference: without its delay.
  const LogRow& before = rows_[rows_.size() - 3];
  rows_[rows_.size() - 2].truth.true_v_base_mps =
      (row.truth.true_T_base.p_m - before.truth.true_T_base.p_m) / seconds(row.stamp_ns - before.stamp_ns);
}

void ClimbRecorder::write(const std::string& folder) const {
  std::string log =
      "t_s,gyro_x_radps,gyro_y_radps,gyro_z_radps,accel_x_mps2,accel_y_mps2,accel_z_mps2,left_contact,right_contact,"
      "left_foot_x_m,left_foot_y_m,left_foot_z_m,right_foot_x_m,right_foot_y_m,right_foot_z_m,"
      "truth_px_m,truth_py_m,truth_pz_m,truth_qw,truth_qx,truth_qy,truth_qz,truth_vx_mps,truth_vy_mps,truth_vz_mps,"
      "left_foot_qw,left_foot_qx,left_foot_qy,left_foot_qz,left_foot_wx_radps,left_foot_wy_radps,left_foot_wz_radps,"
      "right_foot_qw,right_foot_qx,right_foot_qy,right_foot_qz,right_foot_wx_radps,right_foot_wy_radps,"
      "right_foot_wz_radps\n";
  for (const LogRow& row : rows_) {
    add_number(log, seconds(row.stamp_ns));
    add_numbers(log, row.gyro_radps);
    add_numbers(log, row.accel_mps2);
    for (const double contact : row.contact) add_number(log, std::clamp(contact, 0.0, 1.0));
    for (const Vec3& foot_m : row.base_p_foot_m) add_numbers(log, foot_m);
    add_pose(log, row.truth.true_T_base);
    add_numbers(log, row.truth.true_v_base_mps);
    for (std::size_t f = 0; f < kFootCount; ++f) {
      add_rotation(log, row.base_R_foot[f]);
      add_numbers(log, row.base_w_foot_radps[f]);
    }
    log += '\n';
  }
  write_output(folder + "/log.csv", log);

  std::string lio = "stamp_s,arrival_s,px_m,py_m,pz_m,qw,qx,qy,qz\n";
  for (const LioRow& row : lio_rows_) {
    add_number(lio, seconds(row.stamp_ns));
    add_number(lio, seconds(row.arrival_ns));
    add_pose(lio, row.pose);
    lio += '\n';
  }
  write_output(folder + "/lio.csv", lio);

  for (std::size_t i = 0; i < pictures_.size(); ++i) {
    const Picture& picture = pictures_[i];
    std::vector<unsigned char> big_endian, png;
    for (const std::uint16_t depth : picture.depth) {
      big_endian.push_back(static_cast<unsigned char>(depth >> 8U));
      big_endian.push_back(static_cast<unsigned char>(depth & 0xFFU));
    }
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "/depth_%02zu.png", i + 1);
    const unsigned error = lodepng::encode(png, big_endian, static_cast<unsigned>(picture.width_px),
                                           static_cast<unsigned>(picture.height_px), LCT_GREY, 16);
    if (error != 0)
      throw config::FileError("Cannot encode \"" + folder + name.data() + "\": " + lodepng_error_text(error) + ".");
    write_output(folder + name.data(), std::string_view(reinterpret_cast<const char*>(png.data()), png.size()));
  }
}

}  // namespace polygmap::sim
