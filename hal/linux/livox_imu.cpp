// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/livox_imu.hpp"

namespace polygmap::hal {

DeviceError LivoxImu::open(const Config& config) noexcept {
  check_crc_ = config.check_crc;
  base_R_imu_ = config.base_R_imu;
  clock_ = SampleClock(config.time);
  started_ = false;
  last_stamp_ns_ = INT64_MIN;
  waiting_.clear();
  cut_short_ = false;
  return socket_.open(config.udp, calls_);
}

bool LivoxImu::try_read(ImuSample& sample) noexcept {
  // Read until it is false, as a cycle does, it reads the socket once where that has more than one may take.
  if (waiting_.empty() && !cut_short_) {
    cut_short_ = socket_.drain([this](const Datagram& datagram) noexcept { take(datagram); });
  }
  if (waiting_.try_pop(sample)) return true;
  cut_short_ = false;
  return false;
}

bool LivoxImu::decoded(const Datagram& datagram, codec::LivoxImuPacket& packet) noexcept {
  switch (codec::decode(datagram.bytes, check_crc_, packet)) {
    case codec::LivoxDecode::kGood:
      return true;
    case codec::LivoxDecode::kShort:
      count_up(counters_.too_short);
      break;
    case codec::LivoxDecode::kLong:
      count_up(counters_.too_long);
      break;
    case codec::LivoxDecode::kForeign:
      count_up(counters_.foreign);
      break;
    case codec::LivoxDecode::kCorrupted:
      count_up(counters_.corrupted);
      break;
    case codec::LivoxDecode::kInvalid:
      count_up(counters_.invalid);
      break;
  }
  return false;
}

// Numbers wrap around, and the lidar may begin them again at 0. What comes behind its successor is not missing twice.
void LivoxImu::count_missing(std::uint16_t udp_count) noexcept {
  const auto ahead = static_cast<std::uint16_t>(udp_count - udp_count_);
  const auto behind = static_cast<std::uint16_t>(udp_count_ - udp_count);
  if (started_ && udp_count != 0 && behind <= kFarthest) return;
  if (started_ && ahead > 1 && ahead <= kFarthest) count_up(counters_.missing, ahead - 1U);
  udp_count_ = udp_count;
}

void LivoxImu::take(const Datagram& datagram) noexcept {
  codec::LivoxImuPacket packet;
  if (!decoded(datagram, packet)) return;
  count_missing(packet.udp_count);
  if (started_ && packet.time != time_) {
    count_up(counters_.clock_changed);
    clock_.restart();
  }
  started_ = true;
  time_ = packet.time;
  ImuSample sample;
  if (!clock_.timely(packet.stamp_ns, datagram.arrival_ns, sample.stamp_ns, counters_.time)) return;
  if (sample.stamp_ns <= last_stamp_ns_) {
    count_up(sample.stamp_ns == last_stamp_ns_ ? counters_.repeated : counters_.out_of_order);
    return;
  }
  last_stamp_ns_ = sample.stamp_ns;
  const auto in_base = [this](const std::array<float, 3>& x) noexcept -> Vec3 {
    return base_R_imu_ * Vec3(double{x[0]}, double{x[1]}, double{x[2]});
  };
  sample.gyro_radps = in_base(packet.gyro_radps);
  sample.accel_mps2 = in_base(packet.accel_mps2);
  count_up(counters_.good);
  if (waiting_.full()) count_up(counters_.overwritten);
  waiting_.push_overwrite(sample);
}

}  // namespace polygmap::hal
