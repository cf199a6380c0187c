// SPDX-License-Identifier: Apache-2.0
// Which of the drivers' counters mean trouble; docs/drivers.md says what each counts.
#include "firmware/daemon/devices.hpp"

namespace polygmap::daemon {
namespace {

using Counters = std::vector<DeviceCounts::Counter>;
using enum CounterMeans;

// Every counter of a driver is named below, or the sizes differ.
template <typename Struct>
constexpr std::size_t kCounters = sizeof(Struct) / sizeof(std::uint32_t);

void add_reopens(Counters& all, const hal::ReopenCounters& c) {
  all.push_back({"reopened", kTrouble, [&c] { return c.reopened.load(std::memory_order_relaxed); }});
  all.push_back({"reopen_failed", kTrouble, [&c] { return c.failed.load(std::memory_order_relaxed); }});
}
void add_udp(Counters& all, const hal::UdpCounters& c) {
  static_assert(kCounters<hal::UdpCounters> == 6);
  all.push_back({"datagrams", kWork, [&c] { return c.datagrams; }});
  all.push_back({"foreign_sender", kTrouble, [&c] { return c.foreign_sender; }});
  all.push_back({"lost", kTrouble, [&c] { return c.lost; }});
  all.push_back({"cut_short", kTrouble, [&c] { return c.cut_short; }});
  all.push_back({"interrupted", kWork, [&c] { return c.interrupted; }});
  all.push_back({"failed_calls", kTrouble, [&c] { return c.failed_calls; }});
}
void add_time(Counters& all, const hal::TimeCounters& c) {
  static_assert(kCounters<hal::TimeCounters> == 3);
  all.push_back({"late", kTrouble, [&c] { return c.late; }});
  all.push_back({"early", kTrouble, [&c] { return c.early; }});
  all.push_back({"clock_jumped", kTrouble, [&c] { return c.clock_jumped; }});
}
void add_sequence(Counters& all, const hal::SequenceCounters& c) {
  static_assert(kCounters<hal::SequenceCounters> == 5);
  all.push_back({"repeated", kTrouble, [&c] { return c.repeated; }});
  all.push_back({"out_of_order", kTrouble, [&c] { return c.out_of_order; }});
  all.push_back({"jumped", kTrouble, [&c] { return c.jumped; }});
  all.push_back({"missing", kTrouble, [&c] { return c.missing; }});
  all.push_back({"restarts", kTrouble, [&c] { return c.restarts; }});
}

Counters counters_of(const hal::SocketCan& can) {
  const hal::SocketCan::Counters& c = can.counters();
  static_assert(kCounters<hal::SocketCan::Counters> == 6);
  static_assert(sizeof(hal::CanChannelStatus) == 7 * sizeof(std::uint32_t));  // two flags in the first
  Counters all{
      {"received", kWork, [&can] { return can.status().received; }},
      {"sent", kWork, [&can] { return can.status().sent; }},
      {"refused", kTrouble, [&can] { return can.status().refused; }},
      {"lost", kTrouble, [&can] { return can.status().lost; }},
      {"error_frames", kTrouble, [&can] { return can.status().error_frames; }},
      {"failed_calls", kTrouble, [&can] { return can.status().failed_calls; }},
      {"wrong_size", kTrouble, [&c] { return c.wrong_size; }},
      {"remote_frames", kTrouble, [&c] { return c.remote_frames; }},
      {"unsendable", kTrouble, [&c] { return c.unsendable; }},
      {"interrupted", kWork, [&c] { return c.interrupted; }},
      {"interface_down", kTrouble, [&c] { return c.interface_down; }},
      {"interface_gone", kTrouble, [&c] { return c.interface_gone; }},
  };
  add_reopens(all, can.reopen_counters());
  return all;
}

// Pictures that nobody acquired are no trouble: the module takes the next one when it has done with the last.
Counters counters_of(const hal::V4l2Camera& camera) {
  const hal::V4l2Camera::Counters& c = camera.counters();
  static_assert(kCounters<hal::V4l2Camera::Counters> == 10);
  Counters all{
      {"good", kWork, [&c] { return c.good; }},
      {"flagged", kTrouble, [&c] { return c.flagged; }},
      {"short_ones", kTrouble, [&c] { return c.short_ones; }},
      {"wrong_stamp", kTrouble, [&c] { return c.wrong_stamp; }},
      {"missing", kTrouble, [&c] { return c.missing; }},
      {"pushed_out", kWork, [&c] { return c.pushed_out; }},
      {"timeouts", kTrouble, [&c] { return c.timeouts; }},
      {"io_errors", kTrouble, [&c] { return c.io_errors; }},
      {"interrupted", kWork, [&c] { return c.interrupted; }},
      {"failed_calls", kTrouble, [&c] { return c.failed_calls; }},
  };
  add_reopens(all, camera.reopen_counters());
  return all;
}

Counters counters_of(const hal::LivoxImu& imu) {
  const hal::LivoxImu::Counters& c = imu.counters();
  static_assert(kCounters<hal::LivoxImu::Counters> == 11 + kCounters<hal::TimeCounters>);
  Counters all{
      {"good", kWork, [&c] { return c.good; }},
      {"foreign", kTrouble, [&c] { return c.foreign; }},
      {"too_short", kTrouble, [&c] { return c.too_short; }},
      {"too_long", kTrouble, [&c] { return c.too_long; }},
      {"corrupted", kTrouble, [&c] { return c.corrupted; }},
      {"invalid", kTrouble, [&c] { return c.invalid; }},
      {"repeated", kTrouble, [&c] { return c.repeated; }},
      {"out_of_order", kTrouble, [&c] { return c.out_of_order; }},
      {"clock_changed", kTrouble, [&c] { return c.clock_changed; }},
      {"missing", kTrouble, [&c] { return c.missing; }},
      {"overwritten", kTrouble, [&c] { return c.overwritten; }},
  };
  add_time(all, c.time);
  add_udp(all, imu.udp_counters());
  return all;
}

Counters counters_of(const hal::SerialImu& imu) {
  const hal::SerialImu::Counters& c = imu.counters();
  const codec::ImuFrameCounters& frames = imu.frame_counters();
  static_assert(kCounters<hal::SerialImu::Counters> ==
                5 + kCounters<hal::SequenceCounters> + kCounters<hal::TimeCounters>);
  Counters all{
      {"good", kWork, [&c] { return c.good; }},
      {"overwritten", kTrouble, [&c] { return c.overwritten; }},
      {"hang_ups", kTrouble, [&c] { return c.hang_ups; }},
      {"interrupted", kWork, [&c] { return c.interrupted; }},
      {"failed_calls", kTrouble, [&c] { return c.failed_calls; }},
      {"corrupted", kTrouble, [&frames] { return frames.corrupted; }},
      {"invalid", kTrouble, [&frames] { return frames.invalid; }},
      {"garbage_bytes", kTrouble, [&frames] { return frames.garbage_bytes; }},
  };
  add_sequence(all, c.sequence);
  add_time(all, c.time);
  add_reopens(all, imu.reopen_counters());
  return all;
}

Counters counters_of(const hal::LioUdp& lio) {
  const hal::LioUdp::Counters& c = lio.counters();
  static_assert(kCounters<hal::LioUdp::Counters> ==
                8 + kCounters<hal::SequenceCounters> + kCounters<hal::TimeCounters>);
  Counters all{
      {"good", kWork, [&c] { return c.good; }},
      {"foreign", kTrouble, [&c] { return c.foreign; }},
      {"wrong_version", kTrouble, [&c] { return c.wrong_version; }},
      {"too_short", kTrouble, [&c] { return c.too_short; }},
      {"too_long", kTrouble, [&c] { return c.too_long; }},
      {"corrupted", kTrouble, [&c] { return c.corrupted; }},
      {"invalid", kTrouble, [&c] { return c.invalid; }},
      {"overwritten", kTrouble, [&c] { return c.overwritten; }},
  };
  add_sequence(all, c.sequence);
  add_time(all, c.time);
  add_udp(all, lio.udp_counters());
  return all;
}

}  // namespace

void Devices::count_in(DeviceCounts& counts) const {
  for (std::size_t bus = 0; bus < sockets_.size(); ++bus) {
    counts.add(buses_[bus], kControlLane, counters_of(*sockets_[bus]));
  }
  if (livox_) counts.add("imu", kControlLane, counters_of(*livox_));
  if (serial_) counts.add("imu", kControlLane, counters_of(*serial_));
  if (lio_) counts.add("lio", kControlLane, counters_of(*lio_));
  counts.add("camera", kPerceptionLane, counters_of(camera_));
}

}  // namespace polygmap::daemon
