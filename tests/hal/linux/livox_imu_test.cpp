// SPDX-License-Identifier: Apache-2.0
// On the kernel's own loopback, and with its answers replaced.
#include "hal/linux/livox_imu.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "sim_stub/heap_trap.hpp"
#include "tests/hal/linux/call_sweep.hpp"
#include "tests/hal/linux/clock_now.hpp"
#include "tests/hal/linux/scripted_calls.hpp"
#include "tests/hal/linux/udp_sender.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap {
namespace {

using codec::LivoxImuPacket;
using PacketBytes = std::array<std::uint8_t, codec::kLivoxImuPacket_bytes>;

[[nodiscard]] PacketBytes bytes_of(const LivoxImuPacket& packet) {
  PacketBytes bytes{};
  codec::encode(packet, bytes);
  return bytes;
}

struct Fixture {
  test::ScriptedCalls calls;
  std::uint16_t port_number = test::free_udp_port();
  test::UdpSender sender{port_number};
  hal::LivoxImu imu{calls.table()};
  LivoxImuPacket next{.stamp_ns = test::monotonic_now_ns() - 500'000'000,
                      .gyro_radps = {0.1F, 0.2F, 0.3F},
                      .accel_mps2 = {0.0F, 0.0F, codec::kStandardGravity_mps2}};

  explicit Fixture(hal::TimeBase base = hal::TimeBase::kMonotonic) {
    open({.udp = {.port = port_number}, .time = {.base = base, .most_age_ns = test::half_of_uptime_ns()}});
  }
  void open(const hal::LivoxImu::Config& config) {
    const hal::DeviceError error = imu.open(config);
    EXPECT_FALSE(error.failed()) << error.sentence();
  }
  hal::Imu& port() { return imu; }
  std::int64_t feed(std::int64_t step_ns = 1'000'000) {
    next.stamp_ns += step_ns;
    ++next.udp_count;
    sender.send(bytes_of(next));
    return next.stamp_ns;
  }
  int read_all() {
    const heap::ModuleCall trap("LivoxImu::try_read");
    int count = 0;
    for (ImuSample sample; imu.try_read(sample);) ++count;
    return count;
  }
};

}  // namespace

namespace contract {
struct LivoxImuHarness : Fixture {
  static constexpr int kFlood = 30;
};
INSTANTIATE_TYPED_TEST_SUITE_P(Livox, ImuContract, LivoxImuHarness);
}  // namespace contract

namespace {

TEST(LivoxImu, TryRead_MountTurned_SampleIsInTheBaseFrame) {
  Fixture f;
  f.imu.close();
  f.open({.udp = {.port = f.port_number},
          .time = {.base = hal::TimeBase::kMonotonic, .most_age_ns = test::half_of_uptime_ns()},
          .base_R_imu = rotation_x(kPi)});
  f.feed();
  ImuSample s;
  ASSERT_TRUE(f.imu.try_read(s));
  EXPECT_LT((s.gyro_radps - Vec3(0.1, -0.2, -0.3)).norm(), 1e-7);
  EXPECT_LT((s.accel_mps2 - Vec3(0.0, 0.0, -9.80665)).norm(), 1e-5);
}

TEST(LivoxImu, TryRead_BadDatagrams_EachCountedByItsName) {
  Fixture f;
  f.next.stamp_ns += 1;
  const PacketBytes good = bytes_of(f.next);
  std::vector<std::uint8_t> longer(good.begin(), good.end());
  f.sender.send(std::span(good).first(35));
  f.sender.send(std::span(good).first(59));
  longer.push_back(0);
  f.sender.send(longer);
  PacketBytes other = good;
  other[10] = 1;  // points
  f.sender.send(other);
  other = good;
  other[40] ^= 1;
  f.sender.send(other);
  LivoxImuPacket wild = f.next;
  wild.accel_mps2[0] = 1e30F;
  f.sender.send(bytes_of(wild));
  EXPECT_EQ(f.read_all(), 0);
  const auto& c = f.imu.counters();
  EXPECT_EQ(c.too_short, 2U);
  EXPECT_EQ(c.too_long, 1U);
  EXPECT_EQ(c.foreign, 1U);
  EXPECT_EQ(c.corrupted, 1U);
  EXPECT_EQ(c.invalid, 1U);
  f.sender.send(good);
  f.sender.send(good);
  EXPECT_EQ(f.read_all(), 1);
  EXPECT_EQ(c.repeated, 1U);
  f.next.stamp_ns -= 1000;
  f.sender.send(bytes_of(f.next));
  EXPECT_EQ(f.read_all(), 0);
  EXPECT_EQ(c.out_of_order, 1U);
}

TEST(LivoxImu, TryRead_StampOff_CountedByItsName) {
  Fixture f;
  f.next.stamp_ns = 1;
  f.sender.send(bytes_of(f.next));
  f.next.stamp_ns = test::monotonic_now_ns() + 60'000'000'000;
  f.sender.send(bytes_of(f.next));
  EXPECT_EQ(f.read_all(), 0);
  EXPECT_EQ(f.imu.counters().time.late, 1U);
  EXPECT_EQ(f.imu.counters().time.early, 1U);
}

TEST(LivoxImu, TryRead_CrcOff_BelievesAnyCrc) {
  Fixture f;
  f.imu.close();
  f.open({.udp = {.port = f.port_number},
          .check_crc = false,
          .time = {.base = hal::TimeBase::kMonotonic, .most_age_ns = test::half_of_uptime_ns()}});
  f.next.stamp_ns += 1;
  PacketBytes bytes = bytes_of(f.next);
  bytes[24] ^= 0xFF;
  f.sender.send(bytes);
  EXPECT_EQ(f.read_all(), 1);
}

TEST(LivoxImu, TryRead_LidarStartsAnew_StampsGoOnInMonotonicTime) {
  Fixture f(hal::TimeBase::kEstimated);
  f.next.stamp_ns = 40'000'000'000;  // 40 s after the lidar's start
  ImuSample last, s;
  for (int i = 0; i < 30; ++i) {
    f.feed(0);
    f.next.stamp_ns += 5'000;  // faster than it would come: the test does not wait
    while (f.imu.try_read(s)) last = s;
  }
  const std::int64_t before_ns = last.stamp_ns;
  EXPECT_NEAR(static_cast<double>(before_ns), static_cast<double>(test::monotonic_now_ns()), 50e6);
  f.next.stamp_ns = 1'000'000'000;
  const std::int64_t anew_ns = test::monotonic_now_ns();
  int taken = 0;
  while (taken == 0 && test::monotonic_now_ns() < anew_ns + 5 * kNsPerS) {
    ::usleep(2000);
    f.feed(2'000'000);
    while (f.imu.try_read(s)) {
      ++taken;
      EXPECT_GT(s.stamp_ns, before_ns);
      EXPECT_NEAR(static_cast<double>(s.stamp_ns), static_cast<double>(test::monotonic_now_ns()), 50e6);
    }
  }
  EXPECT_GE(f.imu.counters().time.clock_jumped, 4U);
  EXPECT_LE(f.imu.counters().time.clock_jumped, 20U);
  EXPECT_EQ(taken, 1);
}

TEST(LivoxImu, TryRead_OtherTimeType_EstimatesAnewAtOnce) {
  Fixture f(hal::TimeBase::kEstimated);
  f.feed();
  EXPECT_EQ(f.read_all(), 1);
  f.next.time = codec::LivoxTime::kPtp;
  f.next.stamp_ns = 1'700'000'000'000'000'000;
  f.feed();
  EXPECT_EQ(f.read_all(), 1);
  EXPECT_EQ(f.imu.counters().clock_changed, 1U);
  EXPECT_EQ(f.imu.counters().time.clock_jumped, 0U);
}

TEST(LivoxImu, TryRead_NumbersLeftOut_MissingCountsThem) {
  Fixture f;
  const auto count_after = [&f](std::uint16_t udp_count) {
    f.next.udp_count = static_cast<std::uint16_t>(udp_count - 1);
    f.feed();
    EXPECT_EQ(f.read_all(), 1);
    return f.imu.counters().missing;
  };
  EXPECT_EQ(count_after(65'530), 0U) << "the first has no last one";
  EXPECT_EQ(count_after(65'531), 0U);
  EXPECT_EQ(count_after(65'535), 3U);
  EXPECT_EQ(count_after(2), 5U) << "0 and 1, when numbers wrap around";
  EXPECT_EQ(count_after(1), 5U) << "behind";
  EXPECT_EQ(count_after(3), 5U) << "and its successor is missed by nobody";
  EXPECT_EQ(count_after(20), 21U);
  EXPECT_EQ(count_after(0), 21U) << "numbers begin anew";
  EXPECT_EQ(count_after(2), 22U);
  EXPECT_EQ(count_after(30'000), 22U) << "so far away is another start";
  EXPECT_EQ(count_after(30'001), 22U);
}

// As a cycle reads: until it is false, four samples at most.
int read_a_cycle(hal::Imu& imu) {
  int read = 0;
  for (ImuSample sample; read < 4 && imu.try_read(sample);) ++read;
  return read;
}

TEST(LivoxImu, TryRead_FloodOfOthers_TakesNoTimeAndNoRoom) {
  Fixture f;
  f.imu.close();
  f.open({.udp = {.port = f.port_number, .sender = "127.0.0.2"},
          .time = {.base = hal::TimeBase::kMonotonic, .most_age_ns = test::half_of_uptime_ns()}});
  test::UdpSender right(f.port_number, "127.0.0.2");
  for (int i = 0; i < 2000; ++i) f.feed(1000);
  ++f.next.udp_count;
  f.next.stamp_ns += 1'000'000;
  right.send(bytes_of(f.next));
  EXPECT_EQ(read_a_cycle(f.imu), 1) << "the sender's finds room";
  EXPECT_EQ(f.imu.udp_counters().datagrams, 1U) << "the rest was never copied";
  EXPECT_EQ(f.imu.udp_counters().lost, 2000U);
  EXPECT_EQ(f.imu.udp_counters().cut_short, 0U);
}

// Of one that can forge the sender's address, or where none is named.
constexpr auto kMostInACycle = static_cast<std::uint32_t>(hal::UdpSocket::kMostBatches * hal::UdpSocket::kBatch);

TEST(LivoxImu, TryRead_FloodOfGarbage_IsReadForSoLongInACycleAndNoLonger) {
  Fixture f;
  const std::array<std::uint8_t, 60> foreign{1};
  for (int i = 0; i < 200; ++i) f.sender.send(foreign);
  for (std::uint32_t cycle = 1; cycle <= 3; ++cycle) {
    EXPECT_EQ(read_a_cycle(f.imu), 0);
    EXPECT_EQ(f.imu.udp_counters().datagrams, cycle * kMostInACycle);
    EXPECT_EQ(f.imu.udp_counters().cut_short, cycle);
  }
}

TEST(LivoxImu, TryRead_FloodOfSamples_IsReadForSoLongInACycleAndAllInTheEnd) {
  Fixture f;
  for (int i = 0; i < 200; ++i) f.feed();
  std::uint32_t before = 0;
  for (int cycle = 0; cycle < 60; ++cycle) {
    (void)read_a_cycle(f.imu);
    EXPECT_LE(f.imu.udp_counters().datagrams, before + kMostInACycle) << cycle;
    before = f.imu.udp_counters().datagrams;
  }
  EXPECT_EQ(before, 200U);
}

test::SweepOutcome open_and_read(test::ScriptedCalls& calls) {
  test::SweepOutcome o;
  const std::uint16_t port = test::free_udp_port();
  test::UdpSender sender(port);
  hal::LivoxImu imu(calls.table());
  const hal::DeviceError error = imu.open(
      {.udp = {.port = port}, .time = {.base = hal::TimeBase::kMonotonic, .most_age_ns = test::half_of_uptime_ns()}});
  o.opened = !error.failed();
  if (!o.opened) {
    EXPECT_EQ(std::string(error.sentence()).find("UDP port "), 0U);
  }
  LivoxImuPacket packet{.stamp_ns = test::monotonic_now_ns()};
  for (int i = 0; i < 3; ++i) {
    ++packet.udp_count;
    packet.stamp_ns += 1000;
    sender.send(bytes_of(packet));
    for (ImuSample sample; imu.try_read(sample);) ++o.read;
  }
  for (ImuSample sample; imu.try_read(sample);) ++o.read;
  o.failures = imu.udp_counters().failed_calls + imu.udp_counters().interrupted;
  return o;
}

TEST(LivoxImu, EverySystemCall_EveryFault_IsToldOrCountedAndNothingLeaks) {
  test::sweep_failing_calls(3, open_and_read, test::is_harmless_to_udp,
                            [](test::Call hit) { return hit == test::Call::kClockGettime ? 0 : 3; });
}

TEST(LivoxImu, TryRead_KernelSaysMoreBytesThanThereIsRoomFor_ReadsNoneBeyond) {
  Fixture f;
  f.feed();
  f.calls.after_recvmmsg = [](mmsghdr* messages, int n) {
    for (int i = 0; i < n; ++i) messages[i].msg_len = 100'000;
  };
  EXPECT_EQ(f.read_all(), 0);
  EXPECT_EQ(f.imu.counters().too_long, 1U);
}

}  // namespace
}  // namespace polygmap
