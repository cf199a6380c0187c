// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/doctor/doctor.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include "firmware/pipeline.hpp"

namespace polygmap::daemon {
namespace {

namespace fs = std::filesystem;

// A robot's machine as it should be, in files; a test changes one of them.
class DoctorTest : public testing::Test {
 protected:
  void SetUp() override {
    put("proc/version", "Linux version 6.1.0-rt11 #1 SMP PREEMPT_RT");
    put("proc/sys/kernel/osrelease", "6.1.0-rt11");
    put("proc/sys/kernel/sched_rt_runtime_us", "-1");
    put("sys/kernel/realtime", "1");
    put("sys/devices/system/cpu/online", "0-5");
    put("sys/devices/system/cpu/isolated", "4-5");
    for (int cpu = 0; cpu < 6; ++cpu) put(governor(cpu), "performance");
    put(kClock, "arch_sys_counter");
    put("sys/class/video4linux/video0/name", "Depth");
    put("dev/video0", "");
    for (const char* bus : {"can0", "can1"}) {
      const std::string folder = std::string("sys/class/net/") + bus;
      put(folder + "/type", "280");
      put(folder + "/flags", "0x40081");
      put(folder + "/tx_queue_len", "100");
    }
    put("sys/class/net/lo/type", "772");
    in_.proc = (root_ / "proc").string();
    in_.sys = (root_ / "sys").string();
    in_.camera = (root_ / "dev/video0").string();
    in_.buses = {"can0", "can1"};
    in_.processors = {4, 5};
    in_.bitrate_bps = 1'000'000;
    in_.limits.may_have_any_priority = in_.limits.may_lock_any_memory = true;
    in_.can_link = [this](const std::string& bus) { return std::optional<CanLink>(links_.at(bus)); };
  }
  void TearDown() override { fs::remove_all(root_); }

  void put(const std::string& path, const std::string& text) {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text << "\n";
  }
  static std::string governor(int cpu) {
    return "sys/devices/system/cpu/cpu" + std::to_string(cpu) + "/cpufreq/scaling_governor";
  }
  [[nodiscard]] Finding found(const std::string& name) const {
    const std::vector<Finding> all = examine(in_);
    const auto at = std::ranges::find(all, name, &Finding::name);
    EXPECT_NE(at, all.end()) << name;
    return at == all.end() ? Finding{} : *at;
  }
  // All else stays good, and what is not says what to do.
  void expect(const std::string& name, Verdict verdict, const std::string& what, const std::string& to_do) const {
    for (const Finding& finding : examine(in_)) {
      EXPECT_EQ(finding.verdict, finding.name == name ? verdict : Verdict::kGood)
          << finding.name << ": " << finding.what;
      EXPECT_EQ(finding.to_do.empty(), finding.verdict == Verdict::kGood) << finding.name;
    }
    EXPECT_NE(found(name).what.find(what), std::string::npos) << found(name).what;
    EXPECT_NE(found(name).to_do.find(to_do), std::string::npos) << found(name).to_do;
  }

  static constexpr const char* kClock = "sys/devices/system/clocksource/clocksource0/current_clocksource";
  const fs::path root_ = fs::path(testing::TempDir()) / ("polygmap_doctor_" + std::to_string(::getpid()));
  std::map<std::string, CanLink> links_{{"can0", {CanLink::State::kActive, 1'000'000, 100}},
                                        {"can1", {CanLink::State::kActive, 1'000'000, 100}}};
  DoctorInput in_;
};

TEST_F(DoctorTest, MachineAsItShouldBe_HasNothingToDo) {
  const std::vector<Finding> all = examine(in_);
  EXPECT_EQ(all.size(), 10U);
  for (const Finding& finding : all) {
    EXPECT_EQ(finding.verdict, Verdict::kGood) << finding.name << ": " << finding.what;
    EXPECT_EQ(finding.to_do, "") << finding.name;
    EXPECT_TRUE(finding.what.ends_with('.')) << finding.what;
  }
}

TEST_F(DoctorTest, OrdinaryKernel_IsNamed) {
  put("sys/kernel/realtime", "0");
  put("proc/version", "Linux version 6.1.0 #1 SMP PREEMPT_DYNAMIC");
  put("proc/sys/kernel/osrelease", "6.1.0");
  expect("kernel", Verdict::kWarning, "Linux 6.1.0 has no PREEMPT_RT", "nvidia-l4t-rt-kernel");
}
TEST_F(DoctorTest, GovernorOfOneProcessor_IsNamed) {
  put(governor(3), "schedutil");
  expect("governor", Verdict::kWarning, "processor 3: schedutil", "jetson_clocks");
}
TEST_F(DoctorTest, MachineWithoutGovernors_IsGood) {
  for (int cpu = 0; cpu < 6; ++cpu) fs::remove(root_ / governor(cpu));
  EXPECT_EQ(found("governor").verdict, Verdict::kGood);
}
TEST_F(DoctorTest, SharedProcessor_IsNamed) {
  put("sys/devices/system/cpu/isolated", "4");
  expect("isolation", Verdict::kWarning, "(5)", "isolcpus=managed_irq,domain");
}
TEST_F(DoctorTest, LanesOnAnyProcessor_ShareTheirsWhateverIsIsolated) {
  in_.processors.clear();
  expect("isolation", Verdict::kWarning, "(any)", "control.cpu and perception.cpu");
}
TEST_F(DoctorTest, ProcessorThatTheMachineLacks_IsBad) {
  in_.processors = {4, 11};
  expect("isolation", Verdict::kBad, "no processor 11", "control.cpu");
}
TEST_F(DoctorTest, ThrottledRealTime_IsNamed) {
  put("proc/sys/kernel/sched_rt_runtime_us", "950000");
  expect("throttling", Verdict::kWarning, "950 ms of a second", "sched_rt_runtime_us=-1");
}
TEST_F(DoctorTest, LowPriorityLimit_IsBad) {
  in_.limits.may_have_any_priority = false;
  in_.limits.rt_priority = 79;
  expect("rtprio", Verdict::kBad, "up to 79, and the lanes need 80", "LimitRTPRIO=");
  in_.limits.rt_priority = 80;
  EXPECT_EQ(found("rtprio").verdict, Verdict::kGood);
}
TEST_F(DoctorTest, LowMemoryLimit_IsBad) {
  in_.limits.may_lock_any_memory = false;
  in_.limits.locked_bytes = 8192U * 1024U;
  expect("memlock", Verdict::kBad, "8192 KiB", "LimitMEMLOCK=infinity");
  in_.limits.locked_bytes = in_.needed_bytes - 1;
  EXPECT_EQ(found("memlock").verdict, Verdict::kBad);
  in_.limits.locked_bytes = in_.needed_bytes;
  EXPECT_EQ(found("memlock").verdict, Verdict::kGood);
  EXPECT_GT(in_.needed_bytes, sizeof(Pipeline));
}
TEST_F(DoctorTest, SlowClock_IsNamed) {
  put(kClock, "hpet");
  expect("clock", Verdict::kWarning, "\"hpet\"", "clocksource=arch_sys_counter");
}
TEST_F(DoctorTest, MissingCamera_IsBadAndThoseThatAreThereAreNamed) {
  in_.camera = (root_ / "dev/video9").string();
  expect("camera", Verdict::kBad, "The machine has /dev/video0 Depth.", "camera.device");
}
TEST_F(DoctorTest, NoCameraAndNoneAsked_IsAWarning) {
  in_.camera.clear();
  fs::remove_all(root_ / "sys/class/video4linux");
  expect("camera", Verdict::kWarning, "no camera", "uvcvideo");
}
TEST_F(DoctorTest, MissingBus_IsBad) {
  fs::remove_all(root_ / "sys/class/net/can1");
  expect("can can1", Verdict::kBad, "no CAN interface can1", "mttcan");
}
TEST_F(DoctorTest, InterfaceOfAnotherKind_IsNoBus) {
  put("sys/class/net/can1/type", "1");
  expect("can can1", Verdict::kBad, "no CAN interface can1", "mttcan");
}
TEST_F(DoctorTest, BusThatIsDown_IsBad) {
  put("sys/class/net/can1/flags", "0x40080");
  expect("can can1", Verdict::kBad, "can1 is down", "ip link set can1 up");
}
TEST_F(DoctorTest, ShortQueue_IsNamed) {
  put("sys/class/net/can0/tx_queue_len", "3");
  expect("can can0", Verdict::kWarning, "holds 3 frames", "txqueuelen 100");
}
TEST_F(DoctorTest, ControllerThatLeftItsBus_IsBad) {
  links_["can0"].state = CanLink::State::kBusOff;
  expect("can can0", Verdict::kBad, "bus-off", "terminating resistors");
}
TEST_F(DoctorTest, ControllerThatStaysOff_IsNamed) {
  links_["can1"].restart_ms = 0;
  expect("can can1", Verdict::kWarning, "after bus-off it stays off", "restart-ms 100");
}
TEST_F(DoctorTest, OtherBitRateThanTheBusFile_IsBad) {
  links_["can1"].bitrate_bps = 500'000;
  expect("can can1", Verdict::kBad, "500000 bit/s; the bus file says 1000000", "bitrate 1000000");
}
TEST_F(DoctorTest, KernelThatDoesNotAnswer_IsAWarning) {
  in_.can_link = [this](const std::string& bus) {
    return bus == "can0" ? std::optional<CanLink>{} : std::optional<CanLink>(links_.at(bus));
  };
  expect("can can0", Verdict::kWarning, "did not say how its controller is", "ip -details link show can0");
}
TEST_F(DoctorTest, VirtualBus_HasNoController) {
  links_["can1"].state.reset();
  EXPECT_EQ(found("can can1").verdict, Verdict::kGood);
  EXPECT_NE(found("can can1").what.find("without a controller"), std::string::npos);
}
TEST_F(DoctorTest, WithoutNames_ItLooksAtTheBusesThatThereAre) {
  in_.buses.clear();
  EXPECT_EQ(found("can can1").verdict, Verdict::kGood);
  EXPECT_EQ(examine(in_).size(), 10U) << "lo is no bus";
}
TEST_F(DoctorTest, EmptyFolders_EndInFindingsNotInAFault) {
  in_.proc = in_.sys = (root_ / "nothing").string();
  const std::vector<Finding> all = examine(in_);
  EXPECT_GT(std::ranges::count_if(all, [](const Finding& f) { return f.verdict != Verdict::kGood; }), 4);
}

TEST(DoctorLimits, Capabilities_AreReadFromProc) {
  const fs::path proc = fs::path(testing::TempDir()) / ("polygmap_proc_" + std::to_string(::getpid()));
  fs::create_directories(proc / "self");
  std::ofstream(proc / "self/status") << "Name:\tpolygmapd\nCapEff:\t0000000000804000\n";
  EXPECT_TRUE(limits_of_this_process(proc.string()).may_have_any_priority);
  EXPECT_TRUE(limits_of_this_process(proc.string()).may_lock_any_memory);
  std::ofstream(proc / "self/status") << "CapEff:\t0000000000002000\n";
  EXPECT_FALSE(limits_of_this_process(proc.string()).may_have_any_priority);
  EXPECT_FALSE(limits_of_this_process(proc.string()).may_lock_any_memory);
  fs::remove_all(proc);
}

TEST(WakeUpsTest, EachIsInItsBucket) {
  WakeUps wake_ups;
  for (const std::uint64_t late_ns : {0ULL, 4'999ULL, 5'000ULL, 9'999ULL, 2'559'999ULL, 3'000'000'000ULL})
    wake_ups.add(late_ns);
  EXPECT_EQ(wake_ups.woken, 6U);
  EXPECT_EQ(wake_ups.counts[0], 2U);
  EXPECT_EQ(wake_ups.counts[1], 2U);
  EXPECT_EQ(wake_ups.counts[WakeUps::kBuckets - 1], 2U);
  EXPECT_EQ(wake_ups.max_ns, 3'000'000'000U);
}
TEST(WakeUpsTest, LateOnes_AreFound) {
  LaneWakeUps lane{"perception", {.processor = 5, .priority = 75}, {}};
  WakeUps& wake_ups = lane.wake_ups;
  wake_ups.was_real_time = true;
  constexpr std::uint64_t kSlack_ns = 800'000;
  wake_ups.add(400'000);
  EXPECT_EQ(finding_of(lane, kSlack_ns).verdict, Verdict::kGood);
  wake_ups.add(400'001);
  EXPECT_EQ(finding_of(lane, kSlack_ns).verdict, Verdict::kWarning);
  wake_ups.add(800'001);
  EXPECT_EQ(finding_of(lane, kSlack_ns).verdict, Verdict::kBad);
  EXPECT_EQ(finding_of(lane, kSlack_ns).name, "wake-up perception");
  EXPECT_NE(finding_of(lane, kSlack_ns).what.find("3 wake-ups on processor 5 "), std::string::npos);
  wake_ups.was_real_time = false;
  EXPECT_EQ(finding_of(lane, kSlack_ns).verdict, Verdict::kWarning);
  EXPECT_TRUE(finding_of(lane, kSlack_ns).to_do.starts_with("Run it as root"));
  wake_ups.lacks_processor = true;
  EXPECT_TRUE(finding_of(lane, kSlack_ns).to_do.starts_with("Give the lane a processor"));
}
TEST(WakeUpsTest, SlackIsOfTheSchedule_AndLessInOneLane) {
  EXPECT_GT(slack_ns(1), 0U);
  EXPECT_LT(slack_ns(1), slack_ns(2));
  EXPECT_LT(slack_ns(2), 2'000'000U);
}
TEST(WakeUpsTest, EveryLane_IsMeasuredWhereItRuns) {
  DaemonConfig config;
  config.placement = {{{.processor = 0, .priority = 0}, {.processor = 1000, .priority = 75}}};
  std::vector<LaneWakeUps> lanes = lanes_of(config);
  ASSERT_EQ(lanes.size(), 2U);
  measure_wake_ups(lanes, 50);
  for (const LaneWakeUps& lane : lanes) {
    EXPECT_EQ(lane.wake_ups.woken, 50U) << lane.lane;
    std::uint32_t sum = 0;
    for (const std::uint32_t count : lane.wake_ups.counts) sum += count;
    EXPECT_EQ(sum, 50U);
  }
  EXPECT_EQ(lanes[0].lane, "control");
  EXPECT_TRUE(lanes[0].wake_ups.was_real_time) << "as it is placed";
  EXPECT_EQ(lanes[1].lane, "perception");
  EXPECT_FALSE(lanes[1].wake_ups.was_real_time) << "no machine has processor 1000: it was measured on another";
  EXPECT_TRUE(lanes[1].wake_ups.lacks_processor);
  config.lanes = 1;
  EXPECT_EQ(lanes_of(config).size(), 1U);
}

TEST(DoctorReport, TextAndJson_SayTheSame) {
  const std::vector<Finding> findings{{"kernel", Verdict::kBad, "It says \"no\".", "Do \\ that."},
                                      {"clock", Verdict::kGood, "Fine.", ""}};
  std::vector<LaneWakeUps> lanes{{"control", {.processor = 4, .priority = 80}, {}},
                                 {"perception", {.processor = 5, .priority = 75}, {}}};
  lanes[0].wake_ups.add(7'000);
  lanes[1].wake_ups.add(90'000);
  const std::string text = text_of(findings, lanes);
  EXPECT_NE(text.find("bad      kernel: It says \"no\".\n         Do: Do \\ that.\n"), std::string::npos) << text;
  EXPECT_NE(text.find("good     clock: Fine.\n"), std::string::npos) << text;
  EXPECT_NE(text.find("below    10 us      1\n"), std::string::npos) << text;
  EXPECT_NE(text.find("wake-ups of perception by how late they came:\n"), std::string::npos) << text;
  EXPECT_NE(text.find("below   160 us      1\n"), std::string::npos) << text;
  const std::string json = json_of(findings, lanes);
  EXPECT_NE(json.find(R"({"lane": "perception", "processor": 5, "priority": 75, "count": 1, "max_ns": 90000,)"),
            std::string::npos)
      << json;
  EXPECT_NE(json.find(R"({"name": "kernel", "verdict": "bad", "what": "It says \"no\".", "do": "Do \\ that."})"),
            std::string::npos)
      << json;
  EXPECT_NE(json.find(R"({"below_us": 10, "count": 1})"), std::string::npos) << json;
  EXPECT_EQ(std::ranges::count(json, '{'), std::ranges::count(json, '}'));
}

TEST(CanLinkTest, InterfaceThatIsNone_HasNoAnswer) { EXPECT_FALSE(ask_can_link("nocan77").has_value()); }
TEST(CanLinkTest, InterfaceThatIsNoBus_HasNoController) {
  const auto link = ask_can_link("lo");
  if (!link) GTEST_SKIP() << "the kernel says nothing of its interfaces here";
  EXPECT_FALSE(link->state.has_value());
}

}  // namespace
}  // namespace polygmap::daemon
