// SPDX-License-Identifier: Apache-2.0
// A climb that is watched: its pace, its objects, its mailbox, and the program on a terminal.
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "firmware/live/live_display.hpp"
#include "firmware/mailbox/mailbox_layout.hpp"
#include "firmware/mailbox/polygmap_mailbox_reader.h"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/live/pacer.hpp"
#include "sim_stub/sensors/virtual_clock.hpp"

namespace polygmap::sim {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// So much of a climb, without physics and files.
ClimbOptions some_climb(double simulated_s) {
  ClimbOptions options;
  options.plant = PlantKind::kKinematic;
  options.stairs.steps = 1;
  options.time_limit_s = seconds(VirtualClock::kStart_ns) + simulated_s;
  return options;
}

TEST(Pacer, HalfASecondAtTheWallClocksSpeed_TakesIt) {
  Pacer pacer(1.0);
  const auto begin = Clock::now();
  for (std::int64_t now_ns = 0; now_ns <= 500'000'000; now_ns += 2'000'000) pacer.wait_for(now_ns);
  EXPECT_GE(seconds_since(begin), 0.5);
  EXPECT_LT(seconds_since(begin), 5.0);
}

TEST(Pacer, NoPace_WaitsForNothing) {
  Pacer pacer(0.0);
  const auto begin = Clock::now();
  for (std::int64_t now_ns = 0; now_ns < 3'600'000'000'000; now_ns += 2'000'000'000) pacer.wait_for(now_ns);
  EXPECT_LT(seconds_since(begin), 1.0);
}

TEST(Pacer, FellBehind_DoesNotRushThroughWhatWasMissed) {
  Pacer pacer(1.0);
  pacer.wait_for(0);
  std::this_thread::sleep_for(400ms);
  const auto begin = Clock::now();
  for (std::int64_t now_ns = 0; now_ns <= 200'000'000; now_ns += 2'000'000) pacer.wait_for(now_ns);
  EXPECT_GE(seconds_since(begin), 0.09);
}

TEST(Pacer, Signal_EndsTheWaitSoon) {
  std::atomic<int> interrupt{0};
  Pacer pacer(1e-3, &interrupt);
  std::thread signal([&interrupt] {
    std::this_thread::sleep_for(50ms);
    interrupt = SIGINT;
  });
  const auto begin = Clock::now();
  pacer.wait_for(0);
  pacer.wait_for(2'000'000'000);  // 2000 s
  EXPECT_LT(seconds_since(begin), 5.0);
  signal.join();
}

TEST(LiveClimb, PaceOfTwo_IsKept) {
  ClimbOptions options = some_climb(1.0);
  options.pace = 2.0;
  const auto begin = Clock::now();
  (void)run_climb(options, {});
  EXPECT_GE(seconds_since(begin), 0.49);
}

// The keys of an object, those in others as a.b, those of lists' objects as a[].b.
void add_keys(const nlohmann::json& value, const std::string& path, std::set<std::string>& keys) {
  const bool lists_objects = value.is_array() && !value.empty() && value[0].is_object();
  if (!value.is_object() && !lists_objects) {
    keys.insert(path);
    return;
  }
  for (const auto& [key, inner] : value.items()) {
    add_keys(inner, lists_objects ? path + "[]" : path.empty() ? key : path + "." + key, keys);
  }
}
// The first column of the page's table.
std::set<std::string> documented_keys() {
  std::set<std::string> keys;
  std::ifstream page(POLYGMAP_LIVE_PAGE);
  for (std::string line; std::getline(page, line);) {
    const std::size_t end = line.find('`', 3);
    if (line.starts_with("| `") && end != std::string::npos) keys.insert(line.substr(3, end - 3));
  }
  return keys;
}

TEST(LiveClimb, Json_IsAnObjectASimulatedSecondWithTheDocumentedKeys) {
  std::ostringstream out;
  LiveDisplay display(out, LiveDisplay::Form::kJson);
  ClimbOptions options = some_climb(8.0);
  options.display = &display;
  (void)run_climb(options, {});
  std::istringstream lines(out.str());
  std::set<std::string> keys;
  std::vector<double> times_s;
  bool has_next = false;
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json object = nlohmann::json::parse(line);
    times_s.push_back(object.at("t_s"));
    EXPECT_EQ(object.at("clock"), "simulated");
    EXPECT_EQ(object.at("rows").size(), 9U);
    for (const char* count : {"faults", "limits"}) {
      for (const auto& [name, times] : object.at(count).items()) EXPECT_GT(times.get<int>(), 0) << name;
    }
    has_next = has_next || object.at("next").at("left").is_object();
    nlohmann::json counted = object;
    counted["faults"] = counted["limits"] = 0;
    add_keys(counted, "", keys);
  }
  EXPECT_TRUE(has_next) << "no foothold was ever shown";
  ASSERT_EQ(times_s.size(), 9U) << "eight seconds, and the end";
  for (std::size_t i = 1; i + 1 < times_s.size(); ++i) EXPECT_NEAR(times_s[i] - times_s[i - 1], 1.0, 0.003);
  for (const char* null : {"step", "next.left", "next.right", "worst_row"}) keys.erase(null);
  keys.insert("worst_row");
  EXPECT_EQ(keys, documented_keys());
}

TEST(LiveClimb, Mailbox_HoldsWhatTheClimbDoes) {
  const std::string name = "/polygmap_climb_" + std::to_string(::getpid());
  ClimbOptions options = some_climb(8.0);
  options.mailbox = name;
  options.pace = 4.0;
  std::atomic<int> interrupt{0};
  options.interrupt = &interrupt;
  std::thread climb([&options] { (void)run_climb(options, {}); });
  polygmap_mailbox_reader reader = POLYGMAP_MAILBOX_READER;
  char why[POLYGMAP_MAILBOX_SENTENCE];
  for (int i = 0; i < 500 && polygmap_mailbox_attach(&reader, name.c_str(), why) != POLYGMAP_MAILBOX_OK; ++i) {
    std::this_thread::sleep_for(10ms);
  }
  ASSERT_NE(reader.box, nullptr) << why;
  EXPECT_EQ(reader.box->header.clock, static_cast<std::uint32_t>(POLYGMAP_MAILBOX_VIRTUAL));
  static polygmap_plan plan;
  bool has_steps = false, has_polygons = false;
  for (int i = 0; i < 1000 && !(has_steps && has_polygons); ++i) {
    std::this_thread::sleep_for(10ms);
    if (!polygmap_mailbox_try_copy(&reader.box->plan_lock, &reader.box->plan, &plan, sizeof plan)) continue;
    has_steps = plan.step_count > 0 && plan.contact_count > 1 && plan.body_count > 1 && std::isfinite(plan.step[0].x_m);
    has_polygons = plan.polygon_count > 0 && plan.polygon[0].vertices >= 3 && plan.map_stamp_ns > 0;
  }
  EXPECT_TRUE(has_steps);
  EXPECT_TRUE(has_polygons);
  EXPECT_THROW((void)run_climb(options, {}), std::runtime_error) << "a second writer";
  interrupt = SIGINT;
  climb.join();
  EXPECT_EQ(polygmap_mailbox_look(&reader, 100, why), POLYGMAP_MAILBOX_CLOSED);
  polygmap_mailbox_detach(&reader);
}

TEST(LiveCommand, JsonWithoutWatch_IsRefused) {
  std::ostringstream out, err;
  const auto never = [](const ClimbOptions&, const ClimbProgressFunction&) -> ClimbSummary {
    ADD_FAILURE();
    return {};
  };
  EXPECT_EQ(polygmap_main({"climb", "--json"}, never, out, err, false), kExitUsage);
  EXPECT_NE(err.str().find("--watch"), std::string::npos) << err.str();
  EXPECT_EQ(polygmap_main({"climb", "--pace", "-1"}, never, out, err, false), kExitUsage);
}

TEST(LiveCommand, WatchJson_VerdictIsNoObjectAmongThem) {
  std::ostringstream out, err;
  const auto run = [](const ClimbOptions& options, const ClimbProgressFunction&) {
    EXPECT_NE(options.display, nullptr);
    EXPECT_EQ(options.pace, 2.5);
    return ClimbSummary{};
  };
  (void)polygmap_main({"climb", "--watch", "--json", "--pace", "2.5", "--out", testing::TempDir()}, run, out, err,
                      false);
  EXPECT_EQ(out.str(), "");
  EXPECT_TRUE(err.str().starts_with("FAIL")) << err.str();
}

TEST(LiveCommand, Operator_IsAtTheWallClocksSpeedUnlessSaidOtherwise) {
  std::ostringstream out, err;
  double pace = -1.0;
  const auto run = [&pace](const ClimbOptions& options, const ClimbProgressFunction&) {
    pace = options.pace;
    return ClimbSummary{};
  };
  (void)polygmap_main({"climb", "--operator", "--out", testing::TempDir()}, run, out, err, false);
  EXPECT_EQ(pace, 1.0);
  (void)polygmap_main({"climb", "--operator", "--pace", "0", "--out", testing::TempDir()}, run, out, err, false);
  EXPECT_EQ(pace, 0.0);
  (void)polygmap_main({"climb", "--out", testing::TempDir()}, run, out, err, false);
  EXPECT_EQ(pace, 0.0);
}

// The program itself, on a terminal of 90 columns; ended by Ctrl-C after a second.
TEST(LiveProgram, OnATerminal_DrawsInPlaceAndEndsPromptly) {
  winsize size{};
  size.ws_col = 90;
  size.ws_row = 40;
  int terminal = -1;
  const std::string folder = testing::TempDir() + "polygmap_live_" + std::to_string(::getpid());
  const pid_t program = ::forkpty(&terminal, nullptr, nullptr, &size);
  ASSERT_GE(program, 0);
  if (program == 0) {
    // A terminal throws away what is not read yet when Ctrl-C is pressed: two lines would be read as one.
    termios modes{};
    ::tcgetattr(STDIN_FILENO, &modes);
    modes.c_lflag |= NOFLSH;
    ::tcsetattr(STDIN_FILENO, TCSANOW, &modes);
    ::setenv("TERM", "xterm", 1);
    ::execl(POLYGMAP_PROGRAM, "polygmap", "climb", "--plant", "kinematic", "--steps", "3", "--watch", "--pace", "1",
            "--out", folder.c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  std::string written;
  const auto begin = Clock::now();
  bool asked = false;
  double ended_after_s = 0.0;
  Clock::time_point asked_at;
  for (std::array<char, 4096> bytes{};;) {
    pollfd input{terminal, POLLIN, 0};
    if (!asked && seconds_since(begin) > 1.5 && written.find("cycles/s") != std::string::npos) {
      asked = true;
      asked_at = Clock::now();
      EXPECT_EQ(::write(terminal, "\x03", 1), 1);  // Ctrl-C
    }
    if (seconds_since(begin) > 60.0) break;
    if (::poll(&input, 1, 50) == 0) continue;
    const ssize_t got = ::read(terminal, bytes.data(), bytes.size());
    if (got <= 0) break;
    written.append(bytes.data(), static_cast<std::size_t>(got));
  }
  ended_after_s = seconds_since(asked_at);
  int status = 0;
  ASSERT_EQ(::waitpid(program, &status, 0), program);
  ::close(terminal);
  EXPECT_TRUE(asked) << written;
  EXPECT_EQ(WEXITSTATUS(status), 128 + SIGINT) << written;
  EXPECT_LT(ended_after_s, 5.0);
  EXPECT_NE(written.find("A\r"), std::string::npos) << "the cursor never went up";
  EXPECT_NE(written.find("asked 1.00"), std::string::npos) << written;
  std::istringstream lines(written);
  for (std::string line; std::getline(lines, line) && line.find("FAIL") == std::string::npos;) {
    std::size_t columns = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (line[i] == '\x1b') {
        i = line.find_first_of("AHJK", i);
      } else if (line[i] != '\r' && line[i] != '^' && line[i] != 'C') {
        ++columns;
      }
    }
    EXPECT_LT(columns, 90U) << line;
  }
}

}  // namespace
}  // namespace polygmap::sim
