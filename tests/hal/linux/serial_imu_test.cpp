// SPDX-License-Identifier: Apache-2.0
// On a pseudo-terminal pair of the kernel, and with its answers replaced.
#include "hal/linux/serial_imu.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <string>
#include <thread>
#include <vector>

#include "sim_stub/heap_trap.hpp"
#include "tests/hal/linux/call_sweep.hpp"
#include "tests/hal/linux/clock_now.hpp"
#include "tests/hal/linux/scripted_calls.hpp"
#include "tests/support/port_contract.hpp"

namespace polygmap {
namespace {

using codec::ImuFrame;
using FrameBytes = std::array<std::uint8_t, codec::kImuFrame_bytes>;

[[nodiscard]] FrameBytes bytes_of(const ImuFrame& frame) {
  FrameBytes bytes{};
  codec::encode(frame, bytes);
  return bytes;
}

// The IMU's end of the line.
class Terminal {
 public:
  Terminal() : fd_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    EXPECT_GE(fd_, 0);
    EXPECT_EQ(::grantpt(fd_), 0);
    EXPECT_EQ(::unlockpt(fd_), 0);
    std::array<char, 64> name{};
    EXPECT_EQ(::ptsname_r(fd_, name.data(), name.size()), 0);
    name_ = name.data();
    watch_ = ::open(name_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
  }
  ~Terminal() { hang_up(); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  [[nodiscard]] const std::string& name() const { return name_; }
  // Returns when the bytes have come through to the driver's end, or after a second.
  void write(std::span<const std::uint8_t> bytes) {
    const int before = waiting();
    EXPECT_EQ(::write(fd_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    for (int i = 0; i < 10'000 && waiting() < before + static_cast<int>(bytes.size()); ++i) ::usleep(100);
  }
  void hang_up() {
    if (watch_ >= 0) ::close(watch_);
    if (fd_ >= 0) ::close(fd_);
    fd_ = watch_ = -1;
  }

 private:
  [[nodiscard]] int waiting() const {
    int bytes = 0;
    EXPECT_EQ(::ioctl(watch_, FIONREAD, &bytes), 0);
    return bytes;
  }
  int fd_;
  int watch_ = -1;
  std::string name_;
};

struct Fixture {
  test::ScriptedCalls calls;
  Terminal line;
  std::string link = "/tmp/polygmap_serial_imu_" + std::to_string(::getpid());
  hal::SerialImu imu{calls.table()};
  ImuFrame next{.sequence = 3,
                .stamp_ns = test::monotonic_now_ns() - 500'000'000,
                .gyro_radps = {0.1F, 0.2F, 0.3F},
                .accel_mps2 = {1.0F, 2.0F, 9.5F}};

  explicit Fixture(hal::TimeBase base = hal::TimeBase::kMonotonic) {
    link_to(line);
    const hal::DeviceError error =
        imu.open({.device = link, .baud = 115'200, .time = {.base = base, .most_age_ns = test::half_of_uptime_ns()}});
    EXPECT_FALSE(error.failed()) << error.sentence();
  }
  ~Fixture() { ::unlink(link.c_str()); }
  void link_to(const Terminal& terminal) {
    ::unlink(link.c_str());
    EXPECT_EQ(::symlink(terminal.name().c_str(), link.c_str()), 0);
  }
  hal::Imu& port() { return imu; }
  ImuFrame advance() {
    ++next.sequence;
    next.stamp_ns += 1'000'000;
    return next;
  }
  std::int64_t feed() {
    line.write(bytes_of(advance()));
    return next.stamp_ns;
  }
  int read_all() {
    const heap::ModuleCall trap("SerialImu::try_read");
    int count = 0;
    for (ImuSample sample; imu.try_read(sample);) ++count;
    return count;
  }
};

}  // namespace

namespace contract {
struct SerialImuHarness : Fixture {
  static constexpr int kFlood = 64;
};
INSTANTIATE_TYPED_TEST_SUITE_P(Serial, ImuContract, SerialImuHarness);
}  // namespace contract

namespace {

TEST(SerialImu, TryRead_FrameInPieces_IsReadWhenItIsWhole) {
  Fixture f;
  const FrameBytes bytes = bytes_of(f.advance());
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
    f.line.write(std::span(bytes).subspan(i, 1));
    ASSERT_EQ(f.read_all(), 0) << i;
  }
  f.line.write(std::span(bytes).last(1));
  ImuSample s;
  ASSERT_TRUE(f.imu.try_read(s));
  EXPECT_EQ(s.stamp_ns, f.next.stamp_ns);
  EXPECT_LT((s.gyro_radps - Vec3(0.1, 0.2, 0.3)).norm(), 1e-7);
  EXPECT_LT((s.accel_mps2 - Vec3(1.0, 2.0, 9.5)).norm(), 1e-6);
}

TEST(SerialImu, TryRead_ShortReads_LoseNothing) {
  Fixture f;
  f.calls.most_read_bytes = 5;
  for (int i = 0; i < 6; ++i) f.feed();
  int read = 0;
  for (int i = 0; i < 100; ++i) read += f.read_all();
  EXPECT_EQ(read, 6);
  EXPECT_EQ(f.imu.frame_counters().garbage_bytes, 0U);
}

TEST(SerialImu, TryRead_ControlCharacters_ComeThroughUnchanged) {
  Fixture f;
  f.next.sequence = 0x03041A1C - 1U;  // interrupt, end of file, suspend, quit
  f.next.stamp_ns = (f.next.stamp_ns & ~0xFFFFFFLL) | 0x0D0A13LL;
  f.line.write(bytes_of(ImuFrame{.sequence = 0x03041A1C, .stamp_ns = f.next.stamp_ns}));
  ImuSample s;
  ASSERT_TRUE(f.imu.try_read(s));
  EXPECT_EQ(s.stamp_ns, f.next.stamp_ns);
}

TEST(SerialImu, TryRead_GarbageAndFlippedBit_CountedAndFramesAfterThemRead) {
  Fixture f;
  const std::array<std::uint8_t, 7> garbage{0xA5, 0xA5, 0x5A, 0, 17, 0xA5, 0x5A};
  f.line.write(garbage);
  f.feed();
  FrameBytes flipped = bytes_of(f.advance());
  flipped[20] ^= 0x10;
  f.line.write(flipped);
  f.feed();
  EXPECT_EQ(f.read_all(), 2);
  EXPECT_EQ(f.imu.frame_counters().corrupted, 1U);
  EXPECT_EQ(f.imu.frame_counters().garbage_bytes, 7U + 44U);
  EXPECT_EQ(f.imu.counters().sequence.missing, 1U);
}

TEST(SerialImu, TryRead_RepeatedLateEarly_CountedByName) {
  Fixture f;
  f.feed();
  f.line.write(bytes_of(f.next));
  ImuFrame other = f.advance();
  other.stamp_ns = 1;
  f.line.write(bytes_of(other));
  other = f.advance();
  other.stamp_ns += 60'000'000'000;
  f.line.write(bytes_of(other));
  EXPECT_EQ(f.read_all(), 1);
  EXPECT_EQ(f.imu.counters().sequence.repeated, 1U);
  EXPECT_EQ(f.imu.counters().time.late, 1U);
  EXPECT_EQ(f.imu.counters().time.early, 1U);
}

TEST(SerialImu, TryRead_OwnClockOfTheSender_StampIsNearTheArrival) {
  Fixture f(hal::TimeBase::kEstimated);
  f.next.stamp_ns = 0;
  const std::int64_t before_ns = test::monotonic_now_ns();
  f.feed();
  ImuSample s;
  ASSERT_TRUE(f.imu.try_read(s));
  EXPECT_GE(s.stamp_ns, before_ns);
  EXPECT_LE(s.stamp_ns, test::monotonic_now_ns());
}

TEST(SerialImu, TryRead_HangUp_IsLostAndMaintainOpensTheNextOne) {
  Fixture f;
  f.feed();
  EXPECT_EQ(f.read_all(), 1);
  f.line.hang_up();
  EXPECT_EQ(f.read_all(), 0);
  EXPECT_TRUE(f.imu.is_lost());
  EXPECT_EQ(f.imu.counters().hang_ups, 1U);
  EXPECT_EQ(f.read_all(), 0);  // a lost line is left alone
  EXPECT_EQ(f.imu.counters().hang_ups, 1U);
  f.imu.maintain();
  EXPECT_EQ(f.imu.reopen_counters().failed.load(), 1U);
  EXPECT_TRUE(f.imu.is_lost());
  Terminal again;  // another number: as with an adapter that udev's link follows
  f.link_to(again);
  f.imu.maintain();
  EXPECT_FALSE(f.imu.is_lost());
  again.write(bytes_of(f.advance()));
  EXPECT_EQ(f.read_all(), 1);
  f.imu.close();
  EXPECT_EQ(f.calls.open_descriptors(), 0);
}

TEST(SerialImu, Maintain_InAnotherThread_HandsTheLineOver) {
  Fixture f;
  f.calls.fail(test::Call::kRead, EIO);
  EXPECT_EQ(f.read_all(), 0);
  ASSERT_TRUE(f.imu.is_lost());
  std::thread service([&f] { f.imu.maintain(); });
  while (f.imu.is_lost()) static_cast<void>(f.read_all());
  service.join();
  f.feed();
  EXPECT_EQ(f.read_all(), 1);
}

TEST(SerialImu, Open_ThatCannotBe_SaysWhy) {
  test::ScriptedCalls calls;
  hal::SerialImu imu(calls.table());
  EXPECT_STREQ(imu.open({}).sentence(), "serial IMU: a device's path has 1 to 63 characters");
  EXPECT_STREQ(imu.open({.device = "/dev/none"}).sentence(), "/dev/none: cannot open: No such file or directory");
  EXPECT_STREQ(imu.open({.device = "/dev/null"}).sentence(),
               "/dev/null: is no serial line: Inappropriate ioctl for device");
  EXPECT_STREQ(imu.open({.device = "/dev/null", .baud = 12345}).sentence(),
               "/dev/null: 12345 baud is none of the kernel's rates");
  EXPECT_EQ(imu.open({.device = std::string(70, 'x')}).kind, hal::DeviceErrorKind::kConfiguration);
  EXPECT_EQ(calls.open_descriptors(), 0);
}

test::SweepOutcome open_and_read(test::ScriptedCalls& calls) {
  test::SweepOutcome o;
  Terminal line;
  hal::SerialImu imu(calls.table());
  const hal::DeviceError error = imu.open(
      {.device = line.name(), .time = {.base = hal::TimeBase::kMonotonic, .most_age_ns = test::half_of_uptime_ns()}});
  o.opened = !error.failed();
  if (!o.opened) {
    EXPECT_EQ(std::string(error.sentence()).find("/dev/pts/"), 0U);
  }
  ImuFrame frame{.stamp_ns = test::monotonic_now_ns()};
  for (int i = 0; o.opened && i < 3; ++i) {
    ++frame.sequence;
    frame.stamp_ns += 1000;
    line.write(bytes_of(frame));
    for (ImuSample sample; imu.try_read(sample);) ++o.read;
    imu.maintain();
  }
  o.failures = imu.counters().failed_calls + imu.counters().interrupted + imu.counters().hang_ups;
  return o;
}

TEST(SerialImu, EverySystemCall_EveryFault_IsToldOrCountedAndNothingLeaks) {
  const auto is_harmless = [](test::Call hit, int error_number) {
    return hit == test::Call::kClose || hit == test::Call::kIoctl ||
           (hit == test::Call::kRead && error_number == EAGAIN);
  };
  test::sweep_failing_calls(3, open_and_read, is_harmless, [](test::Call) { return 1; });  // it comes back
}

}  // namespace
}  // namespace polygmap
