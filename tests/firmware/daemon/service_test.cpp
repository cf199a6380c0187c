// SPDX-License-Identifier: Apache-2.0
// The service on this machine's clock and threads, with a fake robot behind the ports.
#include "firmware/daemon/service/service.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "firmware/config/operator_request_text.hpp"
#include "firmware/mailbox/mailbox_layout.hpp"
#include "firmware/mailbox/polygmap_mailbox_reader.h"
#include "firmware/recording/replay.hpp"
#include "sim_stub/heap_trap.hpp"
#include "tests/firmware/daemon/live_robot.hpp"
#include "tests/firmware/daemon/notify_socket.hpp"

namespace polygmap::daemon {
namespace {

using namespace std::chrono_literals;
using test::LiveRobot;
using test::NotifySocket;

constexpr auto kEstimates = test::kSlowMachine ? 5000ms : 1500ms;  // from the first feedback on

bool has(const std::vector<std::string>& all, std::string_view part) {
  return std::ranges::any_of(all, [part](const std::string& one) { return one.find(part) != std::string::npos; });
}

class ServiceTest : public testing::Test {
 protected:
  ServiceTest() {
    config_.lanes = 1;
    config_.needs_real_time = false;  // a test's machine may not give it
    config_.hold_ns = 100 * kNsPerMs;
    config_.placement[0] = {.processor = -1, .priority = 0};
    // The fake robot lives in the module's own rows.
    config_.params.overload.most_late_cycles = 10'000;
    // Without pictures the gait waits for them, and then stops.
    config_.params.gait.standing.start_patience_ticks = 100'000;
    config_.params.gait.planner.max_map_age_ns = 10'000'000'000;
  }
  void SetUp() override {
#ifdef POLYGMAP_EMULATED
    GTEST_SKIP() << "runs in real time, which toolchain/vm/daemon_test has emulated";
#endif
  }
  ServiceParts parts() {
    Ports ports = robot_.ports();
    if (operator_socket_ != nullptr) ports.operator_input = operator_socket_;
    return {.ports = ports,
            .maintain = [this] { ++maintained_; },
            .let_go = [this] { ++let_go_; },
            .heap = {},
            .operator_socket = operator_socket_,
            .devices = &counts_,
            .recorder = nullptr,
            .mailbox = mailbox_,
            .hook = nullptr};
  }
  // The same, with a recorder before the ports.
  ServiceParts recorded_parts(recording::Recorder& recorder) {
    ServiceParts all = parts();
    return {.ports = recorder.ports(),
            .maintain = std::move(all.maintain),
            .let_go = std::move(all.let_go),
            .heap = {},
            .operator_socket = operator_socket_,
            .devices = &counts_,
            .recorder = &recorder,
            .mailbox = mailbox_,
            .hook = nullptr};
  }
  // Runs the service on a thread of its own, as long as during() takes, then SIGTERM.
  template <typename During>
  Outcome run(During&& during, bool then_stop = true, recording::Recorder* recorder = nullptr) {
    EXPECT_TRUE(notifier_.open(manager_.name().c_str(), "400000", nullptr));
    Service service(config_, recorder != nullptr ? recorded_parts(*recorder) : parts(), signals_, notifier_);
    Outcome outcome;
    std::atomic<bool> ended{false};
    std::thread thread([&] {
      outcome = service.run();
      ended = true;
    });
    during();
    const auto asked = std::chrono::steady_clock::now();
    while (!then_stop && !ended && std::chrono::steady_clock::now() < asked + 5s) std::this_thread::sleep_for(1ms);
    if (!ended) ::pthread_kill(thread.native_handle(), SIGTERM);
    thread.join();
    stopped_after_ = std::chrono::steady_clock::now() - asked;
    const auto heard = manager_.read();
    heard_.insert(heard_.end(), heard.begin(), heard.end());
    return outcome;
  }
  void listen_until(std::string_view part, std::chrono::seconds most) {
    for (const auto end = std::chrono::steady_clock::now() + most; std::chrono::steady_clock::now() < end;) {
      for (const std::string& one : manager_.read()) heard_.push_back(one);
      if (has(heard_, part)) return;
      std::this_thread::sleep_for(5ms);
    }
    ADD_FAILURE() << "nobody said " << part;
  }

  const StopSignals signals_;
  DaemonConfig config_;
  LiveRobot robot_;
  NotifySocket manager_{"@polygmap_service_" + std::to_string(::getpid())};
  Notifier notifier_;
  DeviceCounts counts_;
  OperatorSocket* operator_socket_ = nullptr;
  MailboxWriter* mailbox_ = nullptr;
  std::vector<std::string> heard_;
  std::chrono::steady_clock::duration stopped_after_{};
  std::atomic<int> maintained_ = 0;
  int let_go_ = 0;
};

TEST_F(ServiceTest, AskedToStopWhileItArms_LetsGoOfTheDrives) {
  robot_.drives_answer = false;
  const Outcome outcome = run([&] { listen_until("STATUS=arming", 5s); });
  EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
  EXPECT_EQ(outcome.module.state, ModuleState::kArming);
  EXPECT_EQ(let_go_, 1);
  EXPECT_FALSE(robot_.has_gains);
  EXPECT_LT(stopped_after_, 1s);
}

TEST_F(ServiceTest, JointBeyondItsRange_IsNamedAndTheDrivesAreLetGo) {
  robot_.robot.encoder_offset_rad[kKnee] = -2.0;
  const Outcome outcome = run([&] { listen_until("STATUS=arming, out of range: left_knee;", 5s); });
  EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
  EXPECT_EQ(outcome.module.state, ModuleState::kArming);
  EXPECT_EQ(outcome.module.waits_for.joints.bits(), 1U << kKnee);
  EXPECT_EQ(let_go_, 1);
  EXPECT_FALSE(robot_.has_gains);
}

TEST_F(ServiceTest, ImuMountIsNotAsConfigured_IsSaidAndTheDrivesAreLetGo) {
  config_.params.robot.mounts.base_R_imu = rotation_y(13.0 * kPi / 180.0);
  const Outcome outcome = run([&] { listen_until("STATUS=arming, 13 deg between gravity as the IMU feels it", 5s); });
  EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
  EXPECT_EQ(outcome.module.state, ModuleState::kArming);
  EXPECT_EQ(let_go_, 1);
  EXPECT_FALSE(robot_.has_gains);
}

// What a program beside the service reads is whole, new in every cycle, and costs no call of the heap.
TEST_F(ServiceTest, Mailbox_IsWrittenInEveryCycle) {
  MailboxWriter mailbox;
  const std::string name = "/polygmap_service_" + std::to_string(::getpid());
  ASSERT_EQ(mailbox.open({.name = name, .group = {}}), "");
  mailbox_ = &mailbox;
  polygmap_mailbox_reader reader = POLYGMAP_MAILBOX_READER;
  char why[POLYGMAP_MAILBOX_SENTENCE];
  ASSERT_EQ(polygmap_mailbox_attach(&reader, name.c_str(), why), POLYGMAP_MAILBOX_OK) << why;
  polygmap_mailbox_pose pose{};
  polygmap_mailbox_status status{};
  polygmap_mailbox_timing timing{};
  std::uint64_t cycles = 0, writes = 0;
  std::int64_t age_ns = 0;
  const Outcome outcome = run([&] {
    listen_until("STATUS=walking_up", 5s);
    const auto read = [](const auto& lock, const auto& section, auto& copy) {
      return polygmap_mailbox_try_copy(&lock, &section, &copy, sizeof copy);
    };
    EXPECT_TRUE(read(reader.box->status_lock, reader.box->status, status));
    cycles = status.cycles;
    writes = reader.box->pose_lock.sequence / 2;
    std::this_thread::sleep_for(300ms);
    EXPECT_TRUE(read(reader.box->status_lock, reader.box->status, status));
    EXPECT_TRUE(read(reader.box->pose_lock, reader.box->pose, pose));
    age_ns = polygmap_mailbox_now_ns() - pose.stamp_ns;
    writes = reader.box->pose_lock.sequence / 2 - writes;
    EXPECT_TRUE(read(reader.box->timing_lock, reader.box->timing, timing));
    EXPECT_EQ(polygmap_mailbox_look(&reader, 1000, why), POLYGMAP_MAILBOX_OK) << why;
  });
  EXPECT_GT(status.cycles, cycles + 20);
  EXPECT_GE(writes + 1, status.cycles - cycles);
  EXPECT_EQ(status.module_state, static_cast<std::uint32_t>(ModuleState::kWalkingUp));
  EXPECT_LT(age_ns, kNsPerS) << "not of the machine's own clock";
  EXPECT_GT(reader.box->plan_lock.sequence / 2, status.cycles / 20) << "a plan in every tenth cycle";
  EXPECT_EQ(timing.lane_count, 1U);
  EXPECT_EQ(timing.row_count, kSchedule.size());
  const polygmap_mailbox_row& gait = timing.rows[row_named(kSchedule, "gait")];
  EXPECT_GT(gait.runs, 100U);
  EXPECT_GT(gait.robot.most_ns, 0U);
  EXPECT_LE(gait.robot.least_slack_ns, 1000 * kSchedule[row_named(kSchedule, "gait")].budget_us);
  EXPECT_EQ(gait.host.most_ns, 0U) << "a robot is no simulation's host";
  EXPECT_EQ(outcome.heap_calls, 0U);
  polygmap_mailbox_detach(&reader);
}

TEST_F(ServiceTest, AskedToStopWhileItRuns_StandsOnItsDrives) {
  const Outcome outcome = run([&] {
    listen_until("STATUS=walking_up", 5s);
    std::this_thread::sleep_for(kEstimates);
  });
  EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
  EXPECT_EQ(outcome.module.state, ModuleState::kSafeStop);
  EXPECT_EQ(outcome.module.phase, GaitPhase::kStopped);
  EXPECT_EQ(outcome.module.reason, StopReason::kOperator);
  EXPECT_EQ(let_go_, 0) << "a robot that stands on its drives would fall";
  EXPECT_TRUE(robot_.has_gains);
  EXPECT_LT(stopped_after_, 1s);
  EXPECT_GT(outcome.cycles, 10U);
  EXPECT_GT(outcome.stack_bytes, 1000U);
}

TEST_F(ServiceTest, AskedToStopBeforeThereIsAnEstimate_StandsOnItsDrives) {
  const Outcome outcome = run([&] { listen_until("STATUS=walking_up", 5s); });
  EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
  EXPECT_EQ(outcome.module.state, ModuleState::kSafeStop);
  EXPECT_EQ(outcome.module.reason, StopReason::kOperator);
  EXPECT_EQ(let_go_, 0);
  EXPECT_LT(stopped_after_, 1s);
}

// The estimate begins with a lean, as of a robot that falls: without the check at arming a wrong mount makes one.
TEST_F(ServiceTest, RobotThatFalls_IsSaidHeldAndEndsTheService) {
  config_.params.stance.most_gravity_rad = 3.2;
  config_.params.robot.mounts.base_R_imu = rotation_y(0.6);
  const Outcome outcome = run([&] { listen_until("STATUS=fallen", 10s); }, false);
  EXPECT_EQ(outcome.code, ExitCode::kStoppedItself) << outcome.why;
  EXPECT_EQ(outcome.why, "the robot has fallen.");
  EXPECT_EQ(outcome.module.state, ModuleState::kFallen);
  EXPECT_EQ(let_go_, 0) << "its joints are damped";
  EXPECT_GE(stopped_after_, 90ms) << "held for hold_s";
}

// As polygmapd --ask does it, through the socket.
TEST_F(ServiceTest, OperatorAsks_ArmsStartsStopsAndResetsThenAndNotBefore) {
  const std::string path = testing::TempDir() + "polygmap_operator_" + std::to_string(::getpid());
  OperatorSocket socket;
  ASSERT_EQ(socket.open(path), "");
  operator_socket_ = &socket;
  config_.params.supervisor.autostart = false;
  const auto ask = [&](const std::string& word) {
    std::string text;
    EXPECT_TRUE(try_ask(path, word, text)) << text;
    return text;
  };
  const Outcome outcome = run([&] {
    listen_until("STATUS=off;", 5s);
    EXPECT_EQ(ask("state"), "off");
    EXPECT_EQ(ask("start"), "refused: off");
    EXPECT_FALSE(robot_.has_gains);
    (void)ask("arm");
    listen_until("STATUS=standing", 5s);
    std::this_thread::sleep_for(kEstimates);
    EXPECT_EQ(ask("start"), "walking_up");
    EXPECT_EQ(ask("dance"), "refused: ask for state, or one of " + std::string(kWhatMayBeAsked));
    EXPECT_EQ(ask(std::string(100, 'a')), "refused: ask for state, or one of " + std::string(kWhatMayBeAsked));
    EXPECT_EQ(ask("pause\n"), "holding");
    (void)ask("stop");
    listen_until("STATUS=safe_stop", 5s);
    std::this_thread::sleep_for(std::chrono::nanoseconds(3 * config_.hold_ns));
    EXPECT_EQ(ask("state"), "safe_stop") << "it waits for a reset";
    EXPECT_EQ(ask("reset"), "standing");
    EXPECT_EQ(ask("arm"), "refused: standing");
  });
  EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
  EXPECT_EQ(outcome.module.state, ModuleState::kSafeStop);
}

TEST_F(ServiceTest, RobotIsHandedOver_EndsAsAskedAndItsDrivesHoldIt) {
  const std::string path = testing::TempDir() + "polygmap_hand_over_" + std::to_string(::getpid());
  OperatorSocket socket;
  ASSERT_EQ(socket.open(path), "");
  operator_socket_ = &socket;
  config_.params.supervisor.autostart = false;
  config_.params.hand_over.rest_ticks = 100;
  std::string heard;
  const Outcome outcome = run(
      [&] {
        listen_until("STATUS=off;", 5s);
        EXPECT_TRUE(try_ask(path, "arm", heard));
        listen_until("STATUS=standing", 5s);
        std::this_thread::sleep_for(kEstimates);
        EXPECT_TRUE(try_ask(path, "hand_over", heard));
      },
      false);
  EXPECT_EQ(heard, "handing_over");
  EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
  EXPECT_EQ(outcome.module.state, ModuleState::kReleased);
  EXPECT_EQ(let_go_, 0) << "a robot that stands on its drives would fall";
  EXPECT_TRUE(robot_.has_gains);
}

// A climb to the top takes too long here: what the module then says, and what comes of it.
TEST(ServiceDecisionTest, AskedToStopOnTop_IsWhatWasAskedFor) {
  const auto code_of = [](ModuleState state, StopReason reason) {
    ModuleView view;
    view.state = state;
    view.phase = GaitPhase::kFinished;
    view.reason = reason;
    const auto decision = Service::decision_when_asked(view);
    return decision ? number_of(decision->code) : -1;
  };
  EXPECT_EQ(code_of(ModuleState::kOnTop, StopReason::kNone), 0) << "SIGTERM on top";
  EXPECT_EQ(code_of(ModuleState::kSafeStop, StopReason::kOperator), 0) << "stop on top, then SIGTERM";
  EXPECT_EQ(code_of(ModuleState::kSafeStop, StopReason::kTimeShort), 1) << "it had to stop on top, then SIGTERM";
}

// It takes 1.0 s at most, on these stairs 0.9 s; a machine of others' may be late.
TEST_F(ServiceTest, AskedToStopInASwing_PutsTheFootDownFirst) {
  if constexpr (test::kSlowMachine) GTEST_SKIP() << "climbs in real time";
  robot_.sees = true;
  const Outcome outcome = run([&] {
    listen_until(", swing,", 20s);
    std::this_thread::sleep_for(100ms);
    EXPECT_FALSE(robot_.robot.stands(Foot::kLeft) && robot_.robot.stands(Foot::kRight));
  });
  EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
  EXPECT_EQ(outcome.module.phase, GaitPhase::kStopped);
  EXPECT_TRUE(robot_.robot.stands(Foot::kLeft) && robot_.robot.stands(Foot::kRight));
  EXPECT_EQ(let_go_, 0);
  EXPECT_LT(stopped_after_, 1500ms);
}

TEST_F(ServiceTest, ItTellsTheServiceManager) {
  const Outcome outcome = run([&] {
    listen_until("STATUS=walking_up", 5s);
    listen_until("WATCHDOG=1", 5s);
  });
  EXPECT_EQ(std::ranges::count(heard_, "READY=1"), 1);
  EXPECT_TRUE(has(heard_, "STOPPING=1"));
  EXPECT_TRUE(has(heard_, "overruns 0, skipped 0, heap calls 0") || outcome.overruns + outcome.skipped > 0);
  EXPECT_GT(maintained_, 0);
}

TEST_F(ServiceTest, GaitThatStopsByItself_IsHeldAndEndsTheService) {
  config_.params.gait.standing.start_patience_ticks = 50;
  const Outcome outcome = run([&] { listen_until("STATUS=safe_stop", 5s); }, false);
  EXPECT_EQ(outcome.code, ExitCode::kStoppedItself) << outcome.why;
  EXPECT_EQ(outcome.module.state, ModuleState::kSafeStop);
  EXPECT_EQ(outcome.module.reason, StopReason::kNothingSeen);
  EXPECT_TRUE(has(heard_, "stopped: it saw no surface to step on"));
  EXPECT_GE(stopped_after_, 90ms);
  EXPECT_EQ(let_go_, 0);
}

TEST_F(ServiceTest, AskedWhileItHoldsAfterAStopOfItsOwn_SaysThatItStoppedItself) {
  config_.params.gait.standing.start_patience_ticks = 50;
  config_.hold_ns = 3600 * kNsPerS;
  const Outcome outcome = run([&] { listen_until("STATUS=safe_stop", 5s); });
  EXPECT_EQ(outcome.code, ExitCode::kStoppedItself) << outcome.why;
  EXPECT_LT(stopped_after_, 1s);
}

TEST_F(ServiceTest, SilentImu_EndsInASafeStop) {
  const Outcome outcome = run(
      [&] {
        listen_until("STATUS=walking_up", 5s);
        std::this_thread::sleep_for(kEstimates);
        robot_.imu_speaks = false;
        listen_until("STATUS=safe_stop", 2s);
      },
      false);
  EXPECT_EQ(outcome.code, ExitCode::kStoppedItself) << outcome.why;
  EXPECT_EQ(outcome.module.reason, StopReason::kStateStale);
  EXPECT_TRUE(has(heard_, "imu_missing"));
}

TEST_F(ServiceTest, SilentImuBeforeThereIsAnEstimate_EndsInASafeStopToo) {
  const Outcome outcome = run(
      [&] {
        listen_until("STATUS=walking_up", 5s);
        robot_.imu_speaks = false;
        listen_until("STATUS=safe_stop", 2s);
      },
      false);
  EXPECT_EQ(outcome.code, ExitCode::kStoppedItself) << outcome.why;
  EXPECT_EQ(outcome.module.reason, StopReason::kStateStale);
  EXPECT_GE(stopped_after_, 90ms) << "held for hold_s";
}

TEST_F(ServiceTest, LaneThatHangs_IsNotFedAndEndsTheService) {
  std::atomic<bool> hangs{false};
  robot_.in_every_read = [&hangs] {
    while (hangs) std::this_thread::sleep_for(1ms);
  };
  ASSERT_TRUE(notifier_.open(manager_.name().c_str(), "400000", nullptr));
  Service service(config_, parts(), signals_, notifier_);
  Outcome outcome;
  std::thread thread([&] { outcome = service.run(); });
  listen_until("STATUS=walking_up", 5s);
  hangs = true;
  std::this_thread::sleep_for(300ms);
  (void)manager_.read();
  thread.join();
  EXPECT_FALSE(has(manager_.read(), "WATCHDOG=1"));
  EXPECT_EQ(outcome.code, ExitCode::kStoppedItself);
  EXPECT_TRUE(outcome.threads_hang);
  EXPECT_NE(outcome.why.find("a lane has not finished a cycle"), std::string::npos) << outcome.why;
  hangs = false;  // the service's end waits for its threads
}

// It had done a cycle not a second before: nothing but waiting for its end tells.
TEST_F(ServiceTest, LaneThatHangsAsItIsToEnd_IsNotWaitedForForEver) {
  std::atomic<bool> hangs{false};
  robot_.drives_answer = false;
  robot_.in_every_read = [&hangs] {
    while (hangs) std::this_thread::sleep_for(1ms);
  };
  ASSERT_TRUE(notifier_.open(manager_.name().c_str(), "400000", nullptr));
  Service service(config_, parts(), signals_, notifier_);
  Outcome outcome;
  std::atomic<bool> ended{false};
  std::thread thread([&] {
    outcome = service.run();
    ended = true;
  });
  listen_until("STATUS=arming", 5s);
  hangs = true;
  ::pthread_kill(thread.native_handle(), SIGTERM);
  for (int i = 0; i < 2000 && !ended; ++i) std::this_thread::sleep_for(1ms);
  EXPECT_TRUE(ended);
  hangs = false;  // the service's end waits for its threads
  thread.join();
  EXPECT_EQ(outcome.code, ExitCode::kStoppedItself) << outcome.why;
  EXPECT_NE(outcome.why.find("a lane did not end"), std::string::npos) << outcome.why;
  EXPECT_TRUE(outcome.threads_hang);
  EXPECT_EQ(let_go_, 0) << "the lane may be writing to the drives";
}

// As a camera that is opened anew, on a slow USB bus.
TEST_F(ServiceTest, DeviceThatBlocksItsMaintenance_HoldsUpNeitherWatchdogNorStop) {
  std::atomic<bool> blocks{true};
  ServiceParts blocked = parts();
  blocked.maintain = [&] {
    ++maintained_;
    while (blocks) std::this_thread::sleep_for(1ms);
  };
  ASSERT_TRUE(notifier_.open(manager_.name().c_str(), "400000", nullptr));
  Service service(config_, std::move(blocked), signals_, notifier_);
  Outcome outcome;
  std::thread thread([&] { outcome = service.run(); });
  while (maintained_ == 0) std::this_thread::sleep_for(1ms);
  (void)manager_.read();
  listen_until("WATCHDOG=1", 5s);
  const auto asked = std::chrono::steady_clock::now();
  ::pthread_kill(thread.native_handle(), SIGTERM);
  thread.join();
  EXPECT_LT(std::chrono::steady_clock::now() - asked, 1s);
  EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
  EXPECT_TRUE(outcome.threads_hang);
  blocks = false;  // the service's end waits for its threads
}

TEST_F(ServiceTest, HeapIsWatchedFromTheLanesToTheirEnd) {
  static int started = 0, stopped = 0;
  started = stopped = 0;
  ServiceParts watched = parts();
  watched.heap = {.start = []() noexcept { ++started; },
                  .stop = []() noexcept { ++stopped; },
                  .calls = []() noexcept { return std::uint64_t{7}; }};
  ::pthread_kill(::pthread_self(), SIGINT);  // waits to be heard
  Service service(config_, std::move(watched), signals_, notifier_);
  const Outcome outcome = service.run();
  EXPECT_EQ(started, 1);
  EXPECT_EQ(stopped, 1);
  EXPECT_EQ(outcome.heap_calls, 7U);
  EXPECT_NE(text_of(outcome).find(" heap_calls=7 "), std::string::npos) << text_of(outcome);
}

TEST_F(ServiceTest, ProcessorThatTheMachineLacks_IsNoRealTime) {
  config_.placement[0].processor = 1000;
  Service service(config_, parts(), signals_, notifier_);
  const Outcome outcome = service.run();
  EXPECT_EQ(outcome.code, ExitCode::kNoRealTime);
  EXPECT_NE(outcome.why.find("control"), std::string::npos) << outcome.why;
  EXPECT_NE(outcome.why.find("processor 1000"), std::string::npos) << outcome.why;
}

// In a process that may neither lock memory nor have a priority.
TEST_F(ServiceTest, WithoutTheRights_IsNoRealTime) {
  config_.needs_real_time = true;
  config_.placement[0].priority = 80;
  const auto run_without_rights = [this] {
    const rlimit none{0, 0};
    ::setrlimit(RLIMIT_MEMLOCK, &none);
    ::setrlimit(RLIMIT_RTPRIO, &none);
    if (::geteuid() == 0 && ::setresuid(65534, 65534, 65534) != 0) ::_exit(99);
    Service service(config_, parts(), signals_, notifier_);
    const Outcome outcome = service.run();
    std::fprintf(stderr, "%s\n", outcome.why.c_str());
    ::_exit(number_of(outcome.code));
  };
  EXPECT_EXIT(run_without_rights(), testing::ExitedWithCode(4),
              "CAP_IPC_LOCK.*LimitMEMLOCK|CAP_SYS_NICE.*LimitRTPRIO");  // a sanitizer locks no memory
}

// All that went in and came out, in a file that a replay takes; the request to stop is in it.
TEST_F(ServiceTest, WithARecorder_TheReplayHasTheSameBits) {
  const std::string path = testing::TempDir() + "/polygmap_service_" + std::to_string(::getpid()) + ".mcap";
  robot_.sees = !test::kSlowMachine;  // a writer that slow loses pictures, and says so
  for (const std::size_t lanes : {1U, 2U}) {
    if (lanes == 2) robot_.sees = false;  // the fake robot's camera is for one lane
    config_.lanes = lanes;
    const auto recorder = std::make_unique<recording::Recorder>(robot_.ports(), &robot_.robot.camera);
    recorder->begin(path, config_.params, lanes);
    const auto during = [&] {
      listen_until("STATUS=walking_up", 5s);
      std::this_thread::sleep_for(kEstimates);
    };
    const Outcome outcome = run(during, true, recorder.get());
    // A machine that starves the lanes stops the robot: such a run is replayed, too.
    const bool starved = test::kSlowMachine && outcome.module.reason == StopReason::kStateStale;
    if (!starved) {
      EXPECT_EQ(outcome.code, ExitCode::kAsked) << outcome.why;
      EXPECT_EQ(outcome.module.reason, StopReason::kOperator);
    }
    EXPECT_EQ(outcome.recording_failure, "");
    const recording::ReplayResult replay = recording::replay(path);
    EXPECT_EQ(replay.verdict, recording::ReplayVerdict::kSame) << recording::text_of(replay);
    EXPECT_EQ(replay.ticks, outcome.cycles);
  }
  std::filesystem::remove(path);
}

// The disk is full before the robot walks.
TEST_F(ServiceTest, RecordingThatEndsEarly_IsSaidByTheExitCodeAndTheModuleGoesOn) {
  const std::string path = testing::TempDir() + "/polygmap_early_" + std::to_string(::getpid()) + ".mcap";
  const auto recorder = std::make_unique<recording::Recorder>(robot_.ports());
  recorder->begin(path, config_.params, 1);
  ASSERT_FALSE(recorder->failed());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit full{1U << 20U, before.rlim_max};
  const auto signalled = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  const auto during = [&] {
    listen_until("STATUS=walking_up", 5s);
    std::this_thread::sleep_for(500ms);
  };
  const Outcome outcome = run(during, true, recorder.get());
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, signalled);
  EXPECT_EQ(outcome.code, ExitCode::kRecording) << outcome.why;
  EXPECT_EQ(outcome.recording_failure, "Cannot write \"" + path + "\": File too large.");
  EXPECT_GT(outcome.cycles, 250U);
  const recording::ReplayResult replay = recording::replay(path);
  EXPECT_EQ(replay.verdict, recording::ReplayVerdict::kUnfinished) << recording::text_of(replay);
  std::filesystem::remove(path);
}

// In a process that may have one more thread: the lane's. The user is no other process's.
TEST_F(ServiceTest, NoThreadForTheDevices_IsNoRealTime) {
  if (::geteuid() != 0) GTEST_SKIP() << "becomes a user that has no other processes";
  const auto run_with_one_thread = [this] {
#ifdef __SANITIZE_THREAD__
    constexpr rlim_t kThreads = 3;  // the sanitizer has one of its own
#else
    constexpr rlim_t kThreads = 2;
#endif
    const rlimit threads{kThreads, kThreads};
    ::setrlimit(RLIMIT_NPROC, &threads);
    const auto user = static_cast<uid_t>(70'000 + ::getpid());
    if (::setresuid(user, user, user) != 0) ::_exit(99);
    ::alarm(10);  // it would wait for its lane for ever
    ExitCode code{};
    {
      Service service(config_, parts(), signals_, notifier_);
      const Outcome outcome = service.run();
      std::fprintf(stderr, "%s\n", outcome.why.c_str());
      code = outcome.code;
    }
    ::_exit(number_of(code));
  };
  EXPECT_EXIT(run_with_one_thread(), testing::ExitedWithCode(4), "no thread for the devices.*TasksMax");
}

TEST_F(ServiceTest, TooLittleMemory_IsNoRealTime) {
#ifdef POLYGMAP_SANITIZED
  GTEST_SKIP() << "a sanitizer ends the process when it has no memory";
#else
  const auto run_without_memory = [this] {
    const rlimit none{0, 0};
    ::setrlimit(RLIMIT_AS, &none);  // what the heap holds free already is left
    constexpr std::size_t kPiece_bytes = 64U * 1024U;
    static_assert(sizeof(Pipeline) > 4 * kPiece_bytes);
    void* last = nullptr;
    while (void* const piece = std::malloc(kPiece_bytes)) last = piece;
    std::free(last);  // enough for a sentence
    ::alarm(10);
    Service service(config_, parts(), signals_, notifier_);
    const Outcome outcome = service.run();
    std::fprintf(stderr, "%s\n", outcome.why.c_str());
    ::_exit(number_of(outcome.code));
  };
  EXPECT_EXIT(run_without_memory(), testing::ExitedWithCode(4), "too little memory.*LimitMEMLOCK");
#endif
}

TEST(ModuleViewTest, PackedAndUnpacked_IsTheSame) {
  ModuleView view;
  view.state = ModuleState::kSafeStop;
  view.phase = GaitPhase::kStopped;
  view.reason = StopReason::kStateStale;
  view.waits_for = {ArmingWait::For::kFeet, JointSet::of_bits(0x801)};
  view.silent = JointSet::of_bits(0xFFE);
  view.hot = JointSet::of_bits(0x7FF);
  view.treads = 0xFF;
  EXPECT_EQ(ModuleView::unpacked(view.packed()), view);
  EXPECT_EQ(ModuleView::unpacked(view.packed()).silent.bits(), 0xFFE);
  EXPECT_EQ(ModuleView::unpacked(view.packed()).hot.bits(), 0x7FF);
  EXPECT_EQ(ModuleView::unpacked(view.packed()).treads, 0xFF);
  EXPECT_EQ(ModuleView::unpacked(view.packed()).waits_for, view.waits_for);
  view.waits_for = {ArmingWait::For::kGravity, {}, 180};
  EXPECT_EQ(ModuleView::unpacked(view.packed()).waits_for, view.waits_for);
  EXPECT_FALSE(view == ModuleView{});
}

TEST_F(ServiceTest, RowThatOverran_IsNamedInTheStatusAndAtTheEnd) {
  robot_.in_every_read = [] { std::this_thread::sleep_for(300us); };  // in the row sense, of 120 us
  const Outcome outcome = run([&] { listen_until("rows over their budget: sense ", 10s); });
  EXPECT_GT(outcome.rows[0].overruns, 0U);
  EXPECT_GE(outcome.rows[0].longest_ns, 300'000U);
  EXPECT_NE(text_of(outcome).find("row sense budget_us=120 overruns="), std::string::npos) << text_of(outcome);
}

TEST_F(ServiceTest, CountersOfDevices_AreOfTheirEndWhenItEnds) {
  std::uint32_t reads = 0;  // the lane's
  robot_.in_every_read = [&reads] { ++reads; };
  counts_.add("imu", kControlLane, {{"reads", CounterMeans::kWork, [&reads] { return reads; }}});
  counts_.add("camera", kPerceptionLane, {{"one", CounterMeans::kTrouble, [] { return 1U; }}});
  (void)run([&] { listen_until("READY=1", 5s); });
  EXPECT_GT(reads, 0U);
  EXPECT_EQ(counts_.text(), "device imu reads=" + std::to_string(reads) + "\ndevice camera one=1\n");
}

TEST(DeviceCountsTest, WhatMeansTrouble_IsToldOnceWithHowMuchMore) {
  std::uint32_t lost = 2, sent = 7, late = 0;
  DeviceCounts counts;
  counts.add("can0", kControlLane,
             {{"sent", CounterMeans::kWork, [&sent] { return sent; }},
              {"lost", CounterMeans::kTrouble, [&lost] { return lost; }}});
  counts.add("camera", kPerceptionLane, {{"late", CounterMeans::kTrouble, [&late] { return late; }}});
  const auto told = [&counts] {
    StatusText text;
    counts.write_trouble(text);
    return std::string(text.view());
  };
  EXPECT_EQ(told(), "");  // nothing is published
  counts.publish(kControlLane);
  EXPECT_EQ(told(), "can0: lost 2 (+2)");
  EXPECT_EQ(told(), "");
  ++sent, lost = 5, late = 1;
  counts.publish(kControlLane);
  EXPECT_EQ(told(), "can0: lost 5 (+3)");  // the camera is the other lane's
  ++lost;
  counts.publish(kControlLane);
  counts.publish(kPerceptionLane);
  EXPECT_EQ(told(), "can0: lost 6 (+1); camera: late 1 (+1)");
  EXPECT_EQ(counts.text(), "device can0 sent=8 lost=6\ndevice camera late=1\n");
}

TEST(StatusTest, Arming_SaysWhatItWaitsFor) {
  const auto status_of = [](const ArmingWait& wait) {
    ModuleView view;
    view.waits_for = wait;
    StatusText text;
    write_module(text, view);
    return std::string(text.view());
  };
  using For = ArmingWait::For;
  const JointSet two = JointSet::of_bits(0x9);
  EXPECT_EQ(status_of({For::kNothing, {}}), "arming");
  EXPECT_EQ(status_of({For::kAnswers, two}), "arming, no answer yet from left_hip_roll, left_knee");
  EXPECT_EQ(status_of({For::kErrors, two}), "arming, in error: left_hip_roll, left_knee");
  EXPECT_EQ(status_of({For::kCooler, two}), "arming, too hot: left_hip_roll, left_knee");
  EXPECT_EQ(status_of({For::kRange, two}), "arming, out of range: left_hip_roll, left_knee");
  EXPECT_EQ(status_of({For::kImu, {}}), "arming, too few IMU samples");
  EXPECT_EQ(status_of({For::kFeet, {}}), "arming, no forces of the feet");
  EXPECT_EQ(status_of({For::kSoles, {}, 12}),
            "arming, 12 deg between the soles' normals by the encoders: suspect an encoder's zero or sign, or a foot "
            "that does not stand");
  EXPECT_EQ(status_of({For::kGravity, {}, 13}),
            "arming, 13 deg between gravity as the IMU feels it and the soles' normal: suspect the IMU's mount "
            "(imu.base_rpy_rad, robot.mounts.base_R_imu), then both legs' encoders, then the floor");
}

TEST(LateRowsTest, RowsAreToldOnceWithHowManyMore) {
  StatusBoard board;
  RowOverruns told{};
  StatusText text, again, status;
  board.rows[5].overruns = 3;
  board.rows[5].longest_ns = 177'000;
  write_more_late_rows(text, board, told);
  write_more_late_rows(again, board, told);
  write_late_rows(status, board);
  EXPECT_EQ(text.view(), "rows over their budget: intake 3 (+3, up to 177 us of 40)");
  EXPECT_EQ(again.view(), "");
  EXPECT_EQ(status.view(), "; rows over their budget: intake 3 (up to 177 us)");
}

TEST(StatusTextTest, LongText_IsCutAndEnds) {
  StatusText text;
  for (int i = 0; i < 100; ++i) text.add("%s", "a text of some length, again and again");
  EXPECT_EQ(text.length, text.text.size() - 1);
  EXPECT_EQ(text.text.back(), '\0');
}

}  // namespace
}  // namespace polygmap::daemon
