// SPDX-License-Identifier: Apache-2.0
// On the kernel's own loopback, and with its answers replaced.
#include "hal/linux/lio_udp.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "sim_stub/heap_trap.hpp"
#include "tests/hal/linux/call_sweep.hpp"
#include "tests/hal/linux/clock_now.hpp"
#include "tests/hal/linux/scripted_calls.hpp"
#include "tests/hal/linux/udp_sender.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap {
namespace {

using codec::LioPacket;
using PacketBytes = std::array<std::uint8_t, codec::kLioPacket_bytes>;

[[nodiscard]] PacketBytes bytes_of(const LioPacket& packet) {
  PacketBytes bytes{};
  codec::encode(packet, bytes);
  return bytes;
}

struct Fixture {
  test::ScriptedCalls calls;
  std::uint16_t port_number = test::free_udp_port();
  test::UdpSender sender{port_number};
  hal::LioUdp lio{calls.table()};
  LioPacket next{.sequence = 7,
                 .stamp_ns = test::monotonic_now_ns() - 300'000'000,
                 .position_m = {1.0, -2.0, 0.5},
                 .rotation_wxyz = {0.8, 0.0, 0.6, 0.0},
                 .position_sigma_m = {0.01, 0.02, 0.03},
                 .rotation_sigma_rad = {0.001, 0.002, 0.003}};

  Fixture() { open({.udp = {.port = port_number}, .time = {.most_age_ns = test::half_of_uptime_ns()}}); }
  void open(const hal::LioUdp::Config& config) {
    const hal::DeviceError error = lio.open(config);
    EXPECT_FALSE(error.failed()) << error.sentence();
  }
  hal::LidarOdometry& port() { return lio; }
  // One more packet, 1 ms after the last.
  LioPacket advance() {
    ++next.sequence;
    next.stamp_ns += 1'000'000;
    return next;
  }
  std::int64_t feed() {
    sender.send(bytes_of(advance()));
    return next.stamp_ns;
  }
  int read_all() {
    const heap::ModuleCall trap("LioUdp::try_read");
    int count = 0;
    for (LioSample sample; lio.try_read(sample);) ++count;
    return count;
  }
};

}  // namespace

namespace contract {
struct LioUdpHarness : Fixture {
  static constexpr int kFlood = 30;
};
INSTANTIATE_TYPED_TEST_SUITE_P(Udp, LidarOdometryContract, LioUdpHarness);
}  // namespace contract

namespace {

TEST(LioUdp, TryRead_Packet_IsThePoseThatWasSent) {
  Fixture f;
  f.feed();
  LioSample s;
  ASSERT_TRUE(f.lio.try_read(s));
  EXPECT_EQ(s.lio_T_lidar.p_m, Vec3(1.0, -2.0, 0.5));
  Mat3 R;  // of 0.8 + 0.6 j: a turn about y by 2 atan(0.75)
  R << 0.28, 0.0, 0.96, 0.0, 1.0, 0.0, -0.96, 0.0, 0.28;
  EXPECT_LT((s.lio_T_lidar.R - R).norm(), 1e-12);
  EXPECT_EQ(s.position_sigma_m, Vec3(0.01, 0.02, 0.03));
  EXPECT_EQ(s.rotation_sigma_rad, Vec3(0.001, 0.002, 0.003));
}

TEST(LioUdp, TryRead_BadDatagrams_EachCountedByItsName) {
  Fixture f;
  PacketBytes bytes = bytes_of(f.advance());
  f.sender.send(std::span(bytes).first(0));
  f.sender.send(std::span(bytes).first(131));
  EXPECT_EQ(f.read_all(), 0);
  EXPECT_EQ(f.lio.counters().too_short, 2U);
  std::vector<std::uint8_t> longer(bytes.begin(), bytes.end());
  longer.push_back(0);
  f.sender.send(longer);
  longer.resize(1400);
  f.sender.send(longer);
  EXPECT_EQ(f.read_all(), 0);
  EXPECT_EQ(f.lio.counters().too_long, 2U);
  PacketBytes other = bytes;
  other[0] ^= 1;
  f.sender.send(other);
  other = bytes;
  other[4] = 2;
  f.sender.send(other);
  other = bytes;
  other[50] ^= 4;
  f.sender.send(other);
  LioPacket nan = f.next;
  nan.position_m[1] = std::numeric_limits<double>::quiet_NaN();
  f.sender.send(bytes_of(nan));
  EXPECT_EQ(f.read_all(), 0);
  const auto& c = f.lio.counters();
  EXPECT_EQ(c.foreign, 1U);
  EXPECT_EQ(c.wrong_version, 1U);
  EXPECT_EQ(c.corrupted, 1U);
  EXPECT_EQ(c.invalid, 1U);
  EXPECT_EQ(c.good, 0U);
  f.sender.send(bytes);
  EXPECT_EQ(f.read_all(), 1);
}

TEST(LioUdp, TryRead_SequenceOff_CountedByItsName) {
  Fixture f;
  f.feed();
  const LioPacket first = f.next;
  f.sender.send(bytes_of(first));
  EXPECT_EQ(f.read_all(), 1);
  EXPECT_EQ(f.lio.counters().sequence.repeated, 1U);
  f.next.sequence += 3;  // three are lost
  f.feed();
  LioPacket late_one = f.next;
  late_one.sequence -= 2;
  late_one.stamp_ns -= 500'000;
  f.sender.send(bytes_of(late_one));
  LioPacket forged = f.next;
  forged.sequence += 1'000'000;
  forged.stamp_ns += 1;
  f.sender.send(bytes_of(forged));
  LioPacket back = f.next;  // the right number, an earlier stamp
  ++back.sequence;
  back.stamp_ns -= 100;
  f.sender.send(bytes_of(back));
  EXPECT_EQ(f.read_all(), 1);
  EXPECT_EQ(f.lio.counters().sequence.missing, 3U);
  EXPECT_EQ(f.lio.counters().sequence.out_of_order, 2U);
  EXPECT_EQ(f.lio.counters().sequence.jumped, 1U);
  EXPECT_EQ(f.lio.counters().good, 2U);
}

TEST(LioUdp, TryRead_SenderStartsAnew_TakenFromTheFifthPacketOn) {
  Fixture f;
  f.feed();
  EXPECT_EQ(f.read_all(), 1);
  f.next.sequence = 900'000;
  for (int i = 0; i < 8; ++i) f.feed();
  EXPECT_EQ(f.read_all(), 4);
  EXPECT_EQ(f.lio.counters().sequence.jumped, 4U);
  EXPECT_EQ(f.lio.counters().sequence.restarts, 1U);
}

TEST(LioUdp, TryRead_SenderStartsAnewWithItsOwnClock_SequenceAndClockRestartTogether) {
  Fixture f;
  f.lio.close();
  f.open({.udp = {.port = f.port_number}, .time = {.base = hal::TimeBase::kEstimated}});
  f.next = {.sequence = 500'000, .stamp_ns = 900'000'000'000};
  f.next.position_sigma_m = f.next.rotation_sigma_rad = {0.01, 0.01, 0.01};
  for (int i = 0; i < 5; ++i) f.feed();
  EXPECT_EQ(f.read_all(), 5);
  f.next.sequence = 0;
  f.next.stamp_ns = 1'000'000;  // since its new start
  int taken = 0;
  for (int i = 0; i < 8; ++i) {
    f.feed();
    for (LioSample s; f.lio.try_read(s);) {
      ++taken;
      EXPECT_NEAR(static_cast<double>(s.stamp_ns), static_cast<double>(test::monotonic_now_ns()), 50e6);
    }
  }
  EXPECT_EQ(taken, 4) << "from the fifth on, as of any sender that starts anew";
  EXPECT_EQ(f.lio.counters().sequence.restarts, 1U);
  EXPECT_EQ(f.lio.counters().time.clock_jumped, 0U);
}

TEST(LioUdp, TryRead_StampOff_CountedByItsName) {
  Fixture f;
  LioPacket p = f.advance();
  p.stamp_ns = 1;
  f.sender.send(bytes_of(p));
  p.stamp_ns = test::monotonic_now_ns() + 60'000'000'000;
  f.sender.send(bytes_of(p));
  EXPECT_EQ(f.read_all(), 0);
  EXPECT_EQ(f.lio.counters().time.late, 1U);
  EXPECT_EQ(f.lio.counters().time.early, 1U);
}

TEST(LioUdp, TryRead_OldPacketsReplayed_DoNotPassForANewStart) {
  Fixture f;
  std::vector<PacketBytes> old;
  for (int i = 0; i < 20; ++i) {
    LioPacket p = f.next;
    p.sequence = 1000U + static_cast<unsigned>(i);
    p.stamp_ns = 1 + i;
    old.push_back(bytes_of(p));
  }
  f.feed();
  EXPECT_EQ(f.read_all(), 1);
  for (const PacketBytes& bytes : old) f.sender.send(bytes);
  f.feed();
  EXPECT_EQ(f.read_all(), 1);
  EXPECT_EQ(f.lio.counters().time.late, 20U);
  EXPECT_EQ(f.lio.counters().sequence.restarts, 0U);
}

TEST(LioUdp, TryRead_AnotherSender_IsNotHeard) {
  for (const bool kernel_filters : {true, false}) {
    Fixture f;
    f.lio.close();
    if (!kernel_filters) f.calls.fail(test::Call::kSetsockopt, EPERM, 1, 2);
    f.open({.udp = {.port = f.port_number, .sender = "127.0.0.2"}});
    f.feed();
    EXPECT_EQ(f.read_all(), 0);
    test::UdpSender right(f.port_number, "127.0.0.2");
    right.send(bytes_of(f.advance()));
    EXPECT_EQ(f.read_all(), 1);
    EXPECT_EQ(f.lio.udp_counters().foreign_sender, kernel_filters ? 0U : 1U);
    EXPECT_EQ(f.lio.udp_counters().lost, kernel_filters ? 1U : 0U);
  }
}

TEST(LioUdp, TryRead_Flood_IsReadForSoLongInACycleAndNoLonger) {
  Fixture f;
  const auto most = static_cast<std::uint32_t>(hal::UdpSocket::kMostBatches * hal::UdpSocket::kBatch);
  const std::vector<std::uint8_t> foreign(132, 1);
  for (int i = 0; i < 200; ++i) f.sender.send(foreign);
  EXPECT_EQ(f.read_all(), 0);
  EXPECT_EQ(f.lio.udp_counters().datagrams, most);
  EXPECT_EQ(f.lio.udp_counters().cut_short, 1U);
}

TEST(LioUdp, TryRead_OwnClockOfTheSender_IsMappedByTheFastestPacket) {
  Fixture f;
  f.lio.close();
  f.open({.udp = {.port = f.port_number},
          .time = {.base = hal::TimeBase::kEstimated, .offset = {.least_delay_ns = 80'000'000}}});
  f.next.stamp_ns = 5'000;  // since the sender's start
  const std::int64_t before_ns = test::monotonic_now_ns();
  f.feed();
  LioSample s;
  ASSERT_TRUE(f.lio.try_read(s));
  const std::int64_t after_ns = test::monotonic_now_ns();
  EXPECT_GE(s.stamp_ns, before_ns - 80'000'000 - 1'000'000);
  EXPECT_LE(s.stamp_ns, after_ns - 80'000'000 + 1'000'000);
}

TEST(LioUdp, TryRead_MoreThanTheKernelKeeps_LossIsCounted) {
  Fixture f;
  const std::vector<std::uint8_t> foreign(200, 1);
  for (int i = 0; i < 3000; ++i) f.sender.send(foreign);
  for (int i = 0; i < 100; ++i) static_cast<void>(f.read_all());
  f.feed();  // the count comes with the next datagram
  EXPECT_EQ(f.read_all(), 1);
  const auto& c = f.lio.udp_counters();
  EXPECT_EQ(c.datagrams + c.lost, 3001U);
  EXPECT_GT(c.lost, 0U);
}

TEST(LioUdp, Open_ConfigThatCannotBe_SaysWhy) {
  test::ScriptedCalls calls;
  hal::LioUdp lio(calls.table());
  EXPECT_STREQ(lio.open({}).sentence(), "UDP port 0: a port is 1 to 65535");
  EXPECT_STREQ(lio.open({.udp = {.port = 5, .address = "10.0.0.256"}}).sentence(),
               "UDP port 5: the address '10.0.0.256' is not an IPv4 address");
  EXPECT_STREQ(lio.open({.udp = {.port = 5, .sender = "robot"}}).sentence(),
               "UDP port 5: the sender 'robot' is not an IPv4 address");
  EXPECT_EQ(calls.open_descriptors(), 0);
}

TEST(LioUdp, Open_PortTaken_SaysSo) {
  Fixture f;
  hal::LioUdp second;
  const hal::DeviceError error = second.open({.udp = {.port = f.port_number}});
  EXPECT_EQ(error.kind, hal::DeviceErrorKind::kSystem);
  EXPECT_EQ(error.error_number, EADDRINUSE);
  EXPECT_EQ(std::string(error.sentence()),
            "UDP port " + std::to_string(f.port_number) + ": cannot listen: Address already in use");
}

TEST(LioUdp, TryRead_Interrupted_TriesAgainAndNotForEver) {
  Fixture f;
  f.feed();
  f.calls.fail(test::Call::kRecvmmsg, EINTR, 2);
  EXPECT_EQ(f.read_all(), 1);
  f.feed();
  f.calls.fail(test::Call::kRecvmmsg, EINTR, 1000);
  EXPECT_EQ(f.read_all(), 0);
  EXPECT_EQ(f.lio.udp_counters().interrupted, 2U + 4U);
}

// Opens, reads three packets and closes; what can be counted of failures.
test::SweepOutcome open_and_read(test::ScriptedCalls& calls) {
  test::SweepOutcome o;
  const std::uint16_t port = test::free_udp_port();
  test::UdpSender sender(port);
  hal::LioUdp lio(calls.table());
  const hal::DeviceError error = lio.open({.udp = {.port = port}});
  o.opened = !error.failed();
  if (!o.opened) {
    EXPECT_NE(std::string(error.sentence()).find("UDP port "), std::string::npos);
  }
  LioPacket p{.stamp_ns = test::monotonic_now_ns(), .position_sigma_m = {1, 1, 1}, .rotation_sigma_rad = {1, 1, 1}};
  for (int i = 0; i < 3; ++i) {
    ++p.sequence;
    p.stamp_ns += 1000;
    sender.send(bytes_of(p));
    LioSample sample;
    while (lio.try_read(sample)) ++o.read;
  }
  for (LioSample sample; lio.try_read(sample);) ++o.read;
  o.failures = lio.udp_counters().failed_calls + lio.udp_counters().interrupted;
  return o;
}

TEST(LioUdp, EverySystemCall_EveryFault_IsToldOrCountedAndNothingLeaks) {
  // Once open, a call that fails once loses nothing; without the clock a packet has no time of arrival.
  test::sweep_failing_calls(3, open_and_read, test::is_harmless_to_udp,
                            [](test::Call hit) { return hit == test::Call::kClockGettime ? 0 : 3; });
}

}  // namespace
}  // namespace polygmap
