// SPDX-License-Identifier: Apache-2.0
// On a virtual CAN interface of the kernel where there is one (its name in POLYGMAP_VCAN, otherwise vcan0), and on one
// made up behind the system calls.
#include "hal/linux/socket_can.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "sim_stub/heap_trap.hpp"
#include "tests/hal/linux/clock_now.hpp"
#include "tests/hal/linux/fake_can.hpp"
#include "tests/hal/linux/scripted_calls.hpp"
#include "tests/support/can_channel_contract.hpp"

namespace polygmap {
namespace contract {

struct FakeSocketCanHarness {
  static constexpr bool kFd = true;
  test::FakeCan bus;
  test::ScriptedCalls calls{test::FakeCan::calls()};
  hal::SocketCan can{calls.table()};
  FakeSocketCanHarness() { open({.interface = "can0", .fd = true}); }
  void open(const hal::SocketCan::Config& config) {
    const hal::DeviceError error = can.open(config);
    EXPECT_FALSE(error.failed()) << error.sentence();
  }
  hal::CanChannel& port() { return can; }
  void arrive(const hal::CanFrame& frame) { bus.arrive(frame); }
  void refuse_after(std::size_t frames) { bus.room = frames; }
  std::vector<hal::CanFrame> sent() {
    std::vector<hal::CanFrame> frames;
    for (const auto& raw : bus.sent) frames.push_back(test::FakeCan::frame_of(raw));
    bus.sent.clear();
    return frames;
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(MadeUp, CanChannelContract, FakeSocketCanHarness);

[[nodiscard]] const char* virtual_can() {
  const char* name = std::getenv("POLYGMAP_VCAN");
  return name != nullptr ? name : "vcan0";
}

// Another node of the same bus is another socket.
struct KernelCanHarness {
  hal::SocketCan can, other;
  static constexpr bool kFd = true;  // a virtual interface's MTU is 72 unless it was set
  hal::DeviceError error = can.open({.interface = virtual_can(), .fd = true});
  std::string why;
  KernelCanHarness() {
    if (!error.failed()) error = other.open({.interface = virtual_can(), .fd = true});
    if (error.failed()) why = std::string("no virtual CAN interface here: ") + error.sentence();
  }
  const char* absent() { return error.failed() ? why.c_str() : nullptr; }
  hal::CanChannel& port() { return can; }
  void arrive(const hal::CanFrame& frame) { EXPECT_EQ(other.write({&frame, 1}), 1U); }
  std::vector<hal::CanFrame> sent() {
    std::vector<hal::CanFrame> frames(200);
    frames.resize(other.read(frames));
    return frames;
  }
};
INSTANTIATE_TYPED_TEST_SUITE_P(Kernel, CanChannelContract, KernelCanHarness);

}  // namespace contract

namespace {

using contract::can_frame;
using contract::FakeSocketCanHarness;
using contract::KernelCanHarness;

[[nodiscard]] hal::CanFrame error_frame(std::uint32_t error_class, std::uint8_t controller = 0) {
  hal::CanFrame frame{.id = error_class, .length = 8, .error = true};
  frame.data[1] = controller;
  return frame;
}
[[nodiscard]] std::vector<hal::CanFrame> read(hal::SocketCan& can, std::size_t most = 50) {
  std::vector<hal::CanFrame> frames(most);
  const heap::ModuleCall trap("SocketCan::read");
  const std::size_t count = can.read(frames);
  const heap::HostCall host;
  frames.resize(count);
  return frames;
}

TEST(SocketCan, Kernel_ManyFramesOneFilter_OnlyThoseArriveWithStamps) {
  KernelCanHarness h;
  if (h.absent() != nullptr) GTEST_SKIP() << h.absent();
  hal::SocketCan filtered;
  hal::SocketCan::Config config{.interface = contract::virtual_can()};
  ASSERT_TRUE(config.receive.try_push_back({.id = 0x12}));
  ASSERT_TRUE(config.receive.try_push_back({.id = 0x12, .extended = true}));
  ASSERT_FALSE(filtered.open(config).failed());
  const std::int64_t before_ns = test::monotonic_now_ns();
  for (std::uint32_t id = 0; id < 0x20; ++id) {
    h.arrive(can_frame(id));
    h.arrive(can_frame(id, 4, true));
  }
  const auto frames = read(filtered);
  ASSERT_EQ(frames.size(), 2U);
  contract::expect_same(frames[0], can_frame(0x12));
  contract::expect_same(frames[1], can_frame(0x12, 4, true));
  for (const auto& frame : frames) {
    EXPECT_GE(frame.stamp_ns, before_ns - 1'000'000);
    EXPECT_LE(frame.stamp_ns, test::monotonic_now_ns() + 1'000'000);
  }
}

TEST(SocketCan, Kernel_NobodyReads_TheKernelsLossIsCounted) {
  KernelCanHarness h;
  if (h.absent() != nullptr) GTEST_SKIP() << h.absent();
  for (std::uint32_t i = 0; i < 5000; ++i) h.arrive(can_frame(i % 0x700));
  std::size_t got = 0;
  for (auto frames = read(h.can); !frames.empty(); frames = read(h.can)) got += frames.size();
  h.arrive(can_frame(1));  // the count comes with the next frame
  got += read(h.can).size();
  EXPECT_GT(h.can.status().lost, 0U);
  EXPECT_EQ(got + h.can.status().lost, 5001U);
}

TEST(SocketCan, Read_FilterOfIds_OthersStayOut) {
  FakeSocketCanHarness h;
  hal::SocketCan::Config config{.interface = "can0"};
  ASSERT_TRUE(config.receive.try_push_back({.id = 0x12}));
  ASSERT_TRUE(config.receive.try_push_back({.id = 0x1812, .extended = true}));
  h.open(config);
  for (const bool extended : {false, true}) {
    for (const std::uint32_t id : {0x11U, 0x12U, 0x1812U}) {
      if (extended || id < 0x800) h.arrive(can_frame(id, 1, extended));
    }
  }
  h.arrive(error_frame(CAN_ERR_BUSOFF));
  const auto frames = read(h.can);
  ASSERT_EQ(frames.size(), 3U);
  contract::expect_same(frames[0], can_frame(0x12, 1));
  contract::expect_same(frames[1], can_frame(0x1812, 1, true));
  EXPECT_TRUE(frames[2].error) << "errors come whatever the filter";
}

TEST(SocketCan, Read_ErrorFrames_StateFollowsTheController) {
  FakeSocketCanHarness h;
  const auto after = [&h](const hal::CanFrame& frame) {
    h.arrive(frame);
    const auto frames = read(h.can);
    EXPECT_EQ(frames.size(), 1U);
    EXPECT_TRUE(frames[0].error);
    EXPECT_EQ(frames[0].id, frame.id);
    return h.can.status();
  };
  EXPECT_TRUE(after(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE)).error_passive);
  EXPECT_FALSE(after(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING)).error_passive);
  EXPECT_TRUE(after(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE)).error_passive);
  EXPECT_TRUE(after(error_frame(CAN_ERR_BUSOFF)).bus_off);
  h.arrive(can_frame(5));
  static_cast<void>(read(h.can));
  EXPECT_TRUE(h.can.status().bus_off) << "until the controller was started anew";
  EXPECT_FALSE(after(error_frame(CAN_ERR_RESTARTED)).bus_off);
  EXPECT_FALSE(h.can.status().error_passive);
  EXPECT_EQ(h.can.status().error_frames, 5U);
  EXPECT_EQ(h.can.status().received, 1U);
}

TEST(SocketCan, Read_WrongSizes_AreCountedAndKeptOut) {
  FakeSocketCanHarness h;
  auto raw = test::FakeCan::raw_of(can_frame(1));
  for (const std::size_t size : {std::size_t{0}, std::size_t{8}, std::size_t{15}, std::size_t{17}, std::size_t{200}}) {
    raw.size = size;
    h.bus.arrive(raw);
  }
  raw = test::FakeCan::raw_of(can_frame(1));
  raw.frame.len = 9;  // in a classic frame
  h.bus.arrive(raw);
  raw.size = CANFD_MTU;
  raw.frame.len = 65;
  h.bus.arrive(raw);
  raw = test::FakeCan::raw_of(can_frame(1));
  raw.frame.can_id |= CAN_RTR_FLAG;
  h.bus.arrive(raw);
  h.arrive(can_frame(2));
  const auto frames = read(h.can);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 2U);
  EXPECT_EQ(h.can.counters().wrong_size, 7U);
  EXPECT_EQ(h.can.counters().remote_frames, 1U);
}

TEST(SocketCan, Read_KernelDropped_LostRisesByTheDifference) {
  FakeSocketCanHarness h;
  h.bus.dropped = 3;
  h.arrive(can_frame(1));
  EXPECT_EQ(read(h.can).size(), 1U);
  h.bus.dropped = 10;
  h.arrive(can_frame(1));
  h.arrive(can_frame(1));
  EXPECT_EQ(read(h.can).size(), 2U);
  EXPECT_EQ(h.can.status().lost, 10U);
}

TEST(SocketCan, Write_Interrupted_TriesAgainAndNotForEver) {
  FakeSocketCanHarness h;
  const hal::CanFrame frame = can_frame(1);
  h.calls.fail(test::Call::kSendmmsg, EINTR, 2);
  EXPECT_EQ(h.can.write({&frame, 1}), 1U);
  h.calls.fail(test::Call::kSendmmsg, EINTR, 1000);
  EXPECT_EQ(h.can.write({&frame, 1}), 0U);
  EXPECT_EQ(h.can.counters().interrupted, 2U + 4U);
}

TEST(SocketCan, ReadWrite_InterfaceDownAndUp_SameSocketGoesOn) {
  FakeSocketCanHarness h;
  const hal::CanFrame frame = can_frame(1);
  h.bus.up = false;
  h.bus.pending_error = ENETDOWN;
  EXPECT_EQ(read(h.can).size(), 0U);
  EXPECT_EQ(h.can.write({&frame, 1}), 0U);
  EXPECT_EQ(h.can.counters().interface_down, 2U);
  EXPECT_FALSE(h.can.is_lost());
  h.bus.up = true;
  EXPECT_EQ(h.can.write({&frame, 1}), 1U);
}

// A controller that left its bus, and an interface set down and up, which starts it anew.
TEST(SocketCan, ReadWrite_InterfaceDownWhileBusOff_EachBusOffIsSeen) {
  FakeSocketCanHarness h;
  const auto set_down = [&h] {
    h.bus.up = false;
    h.bus.pending_error = ENETDOWN;
    EXPECT_EQ(read(h.can).size(), 0U);
    EXPECT_FALSE(h.can.status().bus_off);
    EXPECT_FALSE(h.can.status().error_passive);
  };
  for (std::uint32_t i = 1; i <= 2; ++i) {
    h.arrive(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE));
    h.arrive(error_frame(CAN_ERR_BUSOFF));
    EXPECT_EQ(read(h.can).size(), 2U);
    EXPECT_TRUE(h.can.status().bus_off);
    set_down();
    EXPECT_EQ(h.can.counters().interface_down, i);
    EXPECT_EQ(read(h.can).size(), 0U);
    h.bus.up = true;
  }
  // The kernel tells of the interface first, then it gives what had come before.
  h.arrive(error_frame(CAN_ERR_BUSOFF));
  set_down();
  EXPECT_EQ(read(h.can).size(), 1U);
  EXPECT_FALSE(h.can.status().bus_off);
  h.bus.up = true;
  h.arrive(error_frame(CAN_ERR_BUSOFF));
  EXPECT_EQ(read(h.can).size(), 1U);
  EXPECT_TRUE(h.can.status().bus_off);
}

TEST(SocketCan, ReadWrite_InterfaceGoesAndComesBack_MaintainOpensItAnew) {
  FakeSocketCanHarness h;
  h.arrive(error_frame(CAN_ERR_BUSOFF));
  EXPECT_EQ(read(h.can).size(), 1U);
  h.bus.pull_out();
  EXPECT_EQ(read(h.can).size(), 0U);
  EXPECT_TRUE(h.can.is_lost());
  EXPECT_EQ(h.can.counters().interface_gone, 1U);
  const hal::CanFrame frame = can_frame(1);
  EXPECT_EQ(h.can.write({&frame, 1}), 0U);
  EXPECT_EQ(h.can.status().refused, 1U);
  h.can.maintain();
  EXPECT_TRUE(h.can.is_lost());
  h.bus.present = true;
  h.bus.up = false;
  h.can.maintain();
  EXPECT_TRUE(h.can.is_lost());
  EXPECT_EQ(h.can.reopen_counters().failed.load(), 2U);
  h.bus.up = true;
  h.can.maintain();
  EXPECT_FALSE(h.can.is_lost());
  EXPECT_FALSE(h.can.status().bus_off);
  EXPECT_EQ(h.can.write({&frame, 1}), 1U);
  h.arrive(can_frame(9));
  EXPECT_EQ(read(h.can).size(), 1U);
  h.can.close();
  EXPECT_EQ(h.calls.open_descriptors(), 0);
}

TEST(SocketCan, Open_ThatCannotBe_SaysWhy) {
  test::FakeCan bus;
  test::ScriptedCalls calls(test::FakeCan::calls());
  hal::SocketCan can(calls.table());
  EXPECT_STREQ(can.open({}).sentence(), "CAN: an interface's name has 1 to 15 characters");
  EXPECT_STREQ(can.open({.interface = "can9"}).sentence(), "can9: no such interface: No such device");
  bus.up = false;
  EXPECT_STREQ(can.open({.interface = "can0"}).sentence(), "can0: the interface is down: ip link set can0 up");
  bus.up = true;
  bus.mtu = CAN_MTU;
  EXPECT_STREQ(can.open({.interface = "can0", .fd = true}).sentence(), "can0: its MTU of 16 takes no CAN FD frames");
  hal::SocketCan::Config config{.interface = "can0"};
  ASSERT_TRUE(config.receive.try_push_back({.id = 0x800}));
  EXPECT_STREQ(can.open(config).sentence(), "can0: 0x800 is no 11 bit id");
  calls.fail(test::Call::kSocket, EAFNOSUPPORT);
  EXPECT_STREQ(can.open({.interface = "can0"}).sentence(),
               "can0: cannot make a CAN socket: Address family not supported by protocol");
  EXPECT_EQ(calls.open_descriptors(), 0);
}

struct Outcome {
  bool opened = false;
  std::size_t read = 0, written = 0;
  std::uint32_t failures = 0;
};
Outcome open_and_use(test::FakeCan& bus, test::ScriptedCalls& calls) {
  Outcome o;
  hal::SocketCan can(calls.table());
  hal::SocketCan::Config config{.interface = "can0", .fd = true};
  EXPECT_TRUE(config.receive.try_push_back({.id = 7}));
  const hal::DeviceError error = can.open(config);
  o.opened = !error.failed();
  if (!o.opened) {
    EXPECT_EQ(std::string(error.sentence()).find("can0: "), 0U);
  }
  const hal::CanFrame frame = can_frame(7);
  for (int i = 0; o.opened && i < 4; ++i) {
    bus.arrive(frame);
    o.read += read(can, 3).size();
    o.written += can.write({&frame, 1});
    can.maintain();
  }
  o.failures = can.status().failed_calls + can.status().refused + can.counters().interrupted;
  return o;
}

TEST(SocketCan, EverySystemCall_EveryFault_IsToldOrCountedAndNothingLeaks) {
  std::size_t calls_made = 0;
  {
    test::FakeCan bus;
    test::ScriptedCalls calls(test::FakeCan::calls());
    const Outcome o = open_and_use(bus, calls);
    EXPECT_TRUE(o.opened);
    EXPECT_EQ(o.read, 4U);
    EXPECT_EQ(o.written, 4U);
    calls_made = calls.all_calls();
    EXPECT_EQ(calls.open_descriptors(), 0);
  }
  ASSERT_GT(calls_made, 20U);
  for (const int error_number : test::kErrors) {
    for (std::size_t nth = 0; nth < calls_made; ++nth) {
      test::FakeCan bus;
      test::ScriptedCalls calls(test::FakeCan::calls());
      calls.fail_any(nth, error_number);
      const Outcome o = open_and_use(bus, calls);
      EXPECT_EQ(calls.open_descriptors(), 0) << nth << " " << error_number;
      ASSERT_TRUE(calls.failed_any());
      const test::Call hit = *calls.failed_any();
      // Without the option frames have no stamp; without the clock neither; both judge age only.
      const bool harmless = hit == test::Call::kClose || hit == test::Call::kSetsockopt ||
                            hit == test::Call::kClockGettime ||
                            (hit == test::Call::kRecvmmsg && error_number == EAGAIN);
      EXPECT_TRUE(harmless || !o.opened || o.failures > 0) << nth << " " << error_number;
      if (o.opened) {
        EXPECT_GE(o.read, 2U) << nth << " " << error_number;
        EXPECT_GE(o.written, 2U) << nth << " " << error_number;
      }
    }
  }
}

}  // namespace
}  // namespace polygmap
