// SPDX-License-Identifier: Apache-2.0
// A log's IMU and lidar odometry as drivers: what was recorded comes when its time has come.
#pragma once

#include <vector>

#include "hal/ports/imu.hpp"
#include "hal/ports/lidar_odometry.hpp"
#include "sim_stub/host/estimate/estimate_log.hpp"

namespace polygmap::sim {

class LogImu final : public hal::Imu {
 public:
  // rows: outlive the port.
  explicit LogImu(const std::vector<LogRow>& rows) : rows_(rows) {}
  void advance(std::int64_t now_ns) noexcept { now_ns_ = now_ns; }
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override {
    if (next_ == rows_.size() || rows_[next_].stamp_ns > now_ns_) return false;
    const LogRow& row = rows_[next_++];
    sample = {row.stamp_ns, row.gyro_radps, row.accel_mps2};
    return true;
  }

 private:
  const std::vector<LogRow>& rows_;
  std::size_t next_ = 0;
  std::int64_t now_ns_ = 0;
};

class LogLidarOdometry final : public hal::LidarOdometry {
 public:
  // rows: outlive the port.
  explicit LogLidarOdometry(const std::vector<LioRow>& rows) : rows_(rows) {}
  void advance(std::int64_t now_ns) noexcept { now_ns_ = now_ns; }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    if (unread() == 0 || rows_[next_].arrival_ns > now_ns_) return false;
    const LioRow& row = rows_[next_++];
    sample = {};
    sample.stamp_ns = row.stamp_ns;
    sample.lio_T_lidar = row.pose;
    return true;
  }
  [[nodiscard]] std::size_t unread() const noexcept { return rows_.size() - next_; }

 private:
  const std::vector<LioRow>& rows_;
  std::size_t next_ = 0;
  std::int64_t now_ns_ = 0;
};

}  // namespace polygmap::sim
