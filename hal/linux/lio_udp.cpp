// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/lio_udp.hpp"

#include "algorithms/core/math/math.hpp"

namespace polygmap::hal {
namespace {

[[nodiscard]] Vec3 vector_of(const std::array<double, 3>& x) noexcept { return {x[0], x[1], x[2]}; }

[[nodiscard]] Mat3 rotation_of(const std::array<double, 4>& wxyz) noexcept {
  const double norm2 = wxyz[0] * wxyz[0] + wxyz[1] * wxyz[1] + wxyz[2] * wxyz[2] + wxyz[3] * wxyz[3];
  const double scale = 1.0 / math::sqrt(norm2);
  const double w = wxyz[0] * scale, x = wxyz[1] * scale, y = wxyz[2] * scale, z = wxyz[3] * scale;
  Mat3 R;
  R.col(0) << 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y);
  R.col(1) << 2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x);
  R.col(2) << 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y);
  return R;
}

}  // namespace

DeviceError LioUdp::open(const Config& config) noexcept {
  clock_ = SampleClock(config.time);
  watch_ = SequenceWatch(config.sequence);
  stamped_here_ = config.time.base == TimeBase::kMonotonic;
  last_stamp_ns_ = INT64_MIN;
  waiting_.clear();
  cut_short_ = false;
  return socket_.open(config.udp, calls_);
}

bool LioUdp::try_read(LioSample& sample) noexcept {
  // Read until it is false, as a cycle does, it reads the socket once where that has more than one may take.
  if (waiting_.empty() && !cut_short_) {
    cut_short_ = socket_.drain([this](const Datagram& datagram) noexcept { take(datagram); });
  }
  if (waiting_.try_pop(sample)) return true;
  cut_short_ = false;
  return false;
}

bool LioUdp::decoded(const Datagram& datagram, codec::LioPacket& packet) noexcept {
  switch (codec::decode(datagram.bytes, packet)) {
    case codec::LioDecode::kGood:
      return true;
    case codec::LioDecode::kShort:
      count_up(counters_.too_short);
      break;
    case codec::LioDecode::kForeign:
      count_up(counters_.foreign);
      break;
    case codec::LioDecode::kWrongVersion:
      count_up(counters_.wrong_version);
      break;
    case codec::LioDecode::kLong:
      count_up(counters_.too_long);
      break;
    case codec::LioDecode::kCorrupted:
      count_up(counters_.corrupted);
      break;
    case codec::LioDecode::kInvalid:
      count_up(counters_.invalid);
      break;
  }
  return false;
}

void LioUdp::take(const Datagram& datagram) noexcept {
  codec::LioPacket packet;
  if (!decoded(datagram, packet)) return;
  LioSample sample;
  const auto is_timely = [&]() noexcept {
    return clock_.timely(packet.stamp_ns, datagram.arrival_ns, sample.stamp_ns, counters_.time);
  };
  // Old packets, sent again, must not pass for a sender that started anew; packets out of sequence must not move the
  // estimate of the sender's clock.
  if (stamped_here_ && !is_timely()) return;
  const std::uint32_t restarts = counters_.sequence.restarts;
  if (!watch_.takes(packet.sequence, counters_.sequence)) return;
  if (counters_.sequence.restarts != restarts) clock_.restart();  // the sender's clock began anew, too
  if (!stamped_here_ && !is_timely()) return;
  if (sample.stamp_ns <= last_stamp_ns_) {
    count_up(counters_.sequence.out_of_order);
    return;
  }
  last_stamp_ns_ = sample.stamp_ns;
  sample.lio_T_lidar = {rotation_of(packet.rotation_wxyz), vector_of(packet.position_m)};
  sample.position_sigma_m = vector_of(packet.position_sigma_m);
  sample.rotation_sigma_rad = vector_of(packet.rotation_sigma_rad);
  count_up(counters_.good);
  if (waiting_.full()) count_up(counters_.overwritten);
  waiting_.push_overwrite(sample);
}

}  // namespace polygmap::hal
