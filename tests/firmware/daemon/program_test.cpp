// SPDX-License-Identifier: Apache-2.0
// The shipped program: what it says, and its exit codes.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "firmware/mailbox/mailbox_writer.hpp"
#include "firmware/mailbox/polygmap_mailbox_reader.h"
#include "firmware/recording/recorder.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::daemon {
namespace {

// The first ticks of a fake robot's life.
void record(const std::string& path, int ticks) {
  test::FakeRobot robot(0.062);
  robot.camera_speaks = false;
  const auto recorder = std::make_unique<recording::Recorder>(robot.ports());
  const auto module = std::make_unique<Pipeline>(recorder->ports(), Params{});
  recording::RecordedTasks<Pipeline> tasks(*module, recorder.get());
  OneLaneExecutive<recording::RecordedTasks<Pipeline>> executive(tasks, robot.clock, module->lane_health(0));
  recorder->begin(path, Params{}, 1);
  recorder->watch(*module);
  executive.start(robot.clock.now_ns() + kCycle_ns);
  for (int i = 0; i < ticks; ++i) {
    robot.advance();
    executive.tick(robot.clock.now_ns());
    recorder->flush();
  }
  EXPECT_EQ(recorder->finish(), "");
}

struct Done {
  int code = -1;
  std::string said;  // on both streams
};

class ProgramTest : public testing::Test {
 protected:
  void SetUp() override {
    if (kProgram.empty()) GTEST_SKIP() << "this build has no program that could run here";
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] Done run(const std::string& arguments, const std::string& before = "") const {
    return run_as("timeout 60", arguments, before);
  }
  [[nodiscard]] Done run_as(const std::string& timed, const std::string& arguments,
                            const std::string& before = "") const {
    const std::string command = before + "env -u NOTIFY_SOCKET " + timed + " " + kProgram + " " + arguments + " 2>&1";
    Done done;
    std::FILE* pipe = ::popen(command.c_str(), "r");
    std::array<char, 4096> text{};
    while (std::fgets(text.data(), text.size(), pipe) != nullptr) done.said += text.data();
    const int status = ::pclose(pipe);
    done.code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + status;
    return done;
  }
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::string config(const std::string& camera = "/dev/video9") {
    return write("robot.toml",
                 "bus = \"" POLYGMAP_SOURCE "/firmware/buses/cubemars.toml\"\n[camera]\ndevice = \"" + camera +
                     "\"\nfile = \"" POLYGMAP_SOURCE "/firmware/cameras/d435.toml\"\n[imu]\ndriver = \"livox\"\n");
  }

  // code < 0: a verdict, whichever.
  void expect_refusal(const std::string& path, int code, const std::string& words, const std::string& name) const {
    // All of the program's memory, with its code and its stack, is below 100 MB; sanitizers map more.
    const std::string limited = test::kSlowMachine ? "" : "ulimit -v 102400; ";
    const auto begun = std::chrono::steady_clock::now();
    const Done done = run("--replay " + path, limited);
    EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(test::kSlowMachine ? 30 : 2)) << name;
    EXPECT_TRUE(code < 0 ? done.code >= 0 && done.code <= 3 : done.code == code)
        << name << ": " << done.code << ": " << done.said;
    EXPECT_NE(done.said.find(words), std::string::npos) << name << ": " << done.said;
    EXPECT_TRUE(!done.said.empty() && done.said.back() == '\n') << name;
    EXPECT_TRUE(code != 2 || std::ranges::count(done.said, '\n') == 1) << name << ": " << done.said;
  }

  const std::string kProgram = POLYGMAPD;
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("polygmapd_" + std::to_string(::getpid()));
  const std::string recording_ = (folder_ / "run.mcap").string();
};

TEST_F(ProgramTest, WrongArguments_AreConfigurationErrorsWithTheUsage) {
  for (const char* wrong :
       {"", "--config", "--replay", "--frobnicate", "--json --config x", "--doctor --replay x", "--check",
        "--check --doctor", "--record", "--config x --record", "--record x", "--config x --record y --check",
        "--replay x --record y", "--ask", "--ask arm", "--ask stopp --config x", "--ask arm --check --config x"}) {
    const Done done = run(wrong);
    EXPECT_EQ(done.code, 2) << wrong;
    EXPECT_NE(done.said.find("polygmapd --config FILE"), std::string::npos) << wrong << ": " << done.said;
  }
}

TEST_F(ProgramTest, HelpAndVersion_AreTold) {
  EXPECT_EQ(run("--help").code, 0);
  const Done version = run("--version");
  EXPECT_EQ(version.code, 0);
  EXPECT_TRUE(version.said.starts_with("polygmapd 0.")) << version.said;
}

TEST_F(ProgramTest, WrongFile_IsCodeTwoAndOneSentence) {
  const std::string path = write("robot.toml", "bus = 3\n");
  for (const char* also : {"", " --check"}) {
    const Done done = run("--config " + path + also);
    EXPECT_EQ(done.code, 2);
    EXPECT_NE(done.said.find("robot.toml"), std::string::npos) << done.said;
    EXPECT_EQ(std::ranges::count(done.said, '\n'), 1) << done.said;
  }
}

TEST_F(ProgramTest, Check_OpensNothing) {
  const Done done = run("--check --config " + config());
  EXPECT_EQ(done.code, 0) << done.said;
  EXPECT_NE(done.said.find("can be used"), std::string::npos) << done.said;
}

TEST_F(ProgramTest, Ask_SaysWhereNobodyListens) {
  const Done none = run("--ask state --config " + config());
  EXPECT_EQ(none.code, 2) << none.said;
  EXPECT_NE(none.said.find("has no key operator"), std::string::npos) << none.said;
  const std::string text = "operator = \"" + (folder_ / "socket").string() + "\"\n";
  const std::string path = config();
  std::ifstream robot(path);
  const std::string all = text + std::string{std::istreambuf_iterator<char>(robot), {}};
  const Done silent = run("--ask state --config " + write("operated.toml", all));
  EXPECT_EQ(silent.code, 3) << silent.said;
  EXPECT_NE(silent.said.find("nobody listens at"), std::string::npos) << silent.said;
}

// Looks on at a mailbox that this test writes; ended by a signal.
class WatchTest : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (IsSkipped()) return;
    path_ = write("watched.toml", "mailbox = \"" + mailbox_ + "\"\nbus = 3\n");
    ASSERT_EQ(writer_.open({.name = mailbox_, .group = {}}), "");
    status_.module_state = static_cast<std::uint32_t>(ModuleState::kClimbing);
  }
  void TearDown() override {
    ends_ = true;
    if (writes_.joinable()) writes_.join();
    writer_.close();
    ProgramTest::TearDown();
  }
  void start_writing() {
    writes_ = std::thread([this] {
      for (std::uint64_t cycles = 1; !ends_; ++cycles) {
        status_.stamp_ns = polygmap_mailbox_now_ns();
        status_.cycles = cycles;
        writer_.write(status_, status_.stamp_ns);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
  }
  [[nodiscard]] Done watch(const std::string& seconds, const std::string& arguments = "") const {
    return run_as("timeout --preserve-status --signal=INT " + seconds, "--watch --config " + path_ + arguments);
  }

  const std::string mailbox_ = "/polygmap_watch_" + std::to_string(::getpid());
  std::string path_;
  MailboxWriter writer_;
  polygmap_mailbox_status status_{};
  std::thread writes_;
  std::atomic<bool> ends_{false};
};

TEST_F(WatchTest, Pipe_GetsALineASecondAndASignalIsNoFailure) {
  start_writing();
  const Done done = watch("2.6");
  EXPECT_EQ(done.code, 0) << done.said;
  const auto lines = std::ranges::count(done.said, '\n');
  EXPECT_GE(lines, 2) << done.said;
  EXPECT_LE(lines, 4) << done.said;
  EXPECT_NE(done.said.find(" s climbing, standing; no step yet"), std::string::npos) << done.said;
  EXPECT_EQ(done.said.find('\x1b'), std::string::npos);
}

TEST_F(WatchTest, Json_IsAnObjectASecond) {
  start_writing();
  const Done done = watch("1.6", " --json");
  EXPECT_EQ(done.code, 0) << done.said;
  EXPECT_TRUE(done.said.starts_with("{\"t_s\":")) << done.said;
  EXPECT_NE(done.said.find("\"clock\":\"monotonic\",\"state\":\"climbing\""), std::string::npos) << done.said;
}

TEST_F(WatchTest, NobodyWritesAnyMore_IsSaid) {
  writer_.write(status_, 1);
  const Done silent = watch("1.5");
  EXPECT_NE(silent.said.find("has written nothing for"), std::string::npos) << silent.said;
  writer_.close();
  const Done absent = watch("0.5");
  EXPECT_EQ(absent.code, 0) << absent.said;
  EXPECT_EQ(absent.said, "There is no mailbox " + mailbox_ + ": nobody writes one. Waiting for a writer.\n");
}

TEST_F(WatchTest, CannotBeRead_IsASentenceAndItsCode) {
  EXPECT_EQ(run("--watch --config " + config()).code, 2);
  EXPECT_NE(run("--watch --config " + config()).said.find("has no key mailbox"), std::string::npos);
  writer_.close();
  const int other = ::shm_open(mailbox_.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
  ASSERT_GE(other, 0);
  EXPECT_EQ(::write(other, "something else", 14), 14);
  ::close(other);
  const Done done = watch("5");
  ::shm_unlink(mailbox_.c_str());
  EXPECT_EQ(done.code, 3) << done.said;
  EXPECT_EQ(std::ranges::count(done.said, '\n'), 1) << done.said;
  EXPECT_NE(done.said.find("has 14 bytes"), std::string::npos) << done.said;
}

// Somebody edits the file while the robot climbs: it must be possible to stop it all the same.
TEST_F(ProgramTest, AskWithAFileThatIsBeingEdited_ReadsTheKeyOperatorAlone) {
  for (const char* rest : {"bus = \"nowhere.toml\"\n", "params = \"nowhere.toml\"\n", "lanes = \"x\"\n[imu]\n",
                           "hold_s = \n", "[camera\n", "[imu]\noperator = 3\n", "\"unfinished"}) {
    const std::string path =
        write("edited.toml", "# a robot\n \toperator =\t\"socket\"  # here\r\n" + std::string(rest));
    const Done done = run("--ask stop --config " + path);
    EXPECT_EQ(done.code, 3) << rest << done.said;
    EXPECT_NE(done.said.find("nobody listens at \"" + (folder_ / "socket").string()), std::string::npos) << done.said;
  }
  for (const char* wrong : {"operator = 3\n", "operator = \"\"\n", "operator = \"socket\n", "operator =\n"}) {
    const Done done = run("--ask stop --config " + write("edited.toml", "\n" + std::string(wrong)));
    EXPECT_EQ(done.code, 2) << wrong << done.said;
    EXPECT_NE(done.said.find("line 2"), std::string::npos) << done.said;
  }
  for (const char* none : {"", "operators = \"x\"\n", "[imu]\noperator = \"socket\"\n"}) {
    const Done done = run("--ask stop --config " + write("edited.toml", none));
    EXPECT_EQ(done.code, 2) << none << done.said;
    EXPECT_NE(done.said.find("has no key operator"), std::string::npos) << done.said;
  }
}

TEST_F(ProgramTest, MissingDevice_IsCodeThreeWithFileLineAndKey) {
  if (std::filesystem::exists("/sys/class/net/can0")) GTEST_SKIP() << "this machine has a can0";
  const Done done = run("--config " + config());
  EXPECT_EQ(done.code, 3) << done.said;
  EXPECT_NE(done.said.find("cubemars.toml, line "), std::string::npos) << done.said;
  EXPECT_NE(done.said.find("can0"), std::string::npos) << done.said;
}

TEST_F(ProgramTest, Doctor_SaysWhatItFinds) {
  const Done text = run("--doctor");
  EXPECT_TRUE(text.code == 0 || text.code == 1) << text.said;
  for (const char* name : {"kernel: ", "governor: ", "isolation: ", "rtprio: ", "memlock: ", "clock: ", "wake-up: "}) {
    EXPECT_NE(text.said.find(name), std::string::npos) << name << text.said;
  }
  const Done json = run("--doctor --json --config " + config());
  EXPECT_EQ(json.code, 1) << "no such camera: " << json.said;
  EXPECT_NE(json.said.find("There is no /dev/video9"), std::string::npos) << json.said;
  EXPECT_EQ(run("--doctor --config " + write("robot.toml", "bus = 3")).code, 2);
}

TEST_F(ProgramTest, Replay_OfTheSameModule_IsCodeZero) {
  record(recording_, 50);
  const Done done = run("--replay " + recording_);
  EXPECT_EQ(done.code, 0) << done.said;
  EXPECT_EQ(done.said, "replay: 50 ticks, 0 differ\n");
}

TEST_F(ProgramTest, ReplayWithAFlippedBit_IsCodeTwoAndNamesTheTopicAndTheChunk) {
  record(recording_, 120);  // it listens for the first fifty
  std::ifstream in(recording_, std::ios::binary);
  std::vector<char> bytes((std::istreambuf_iterator<char>(in)), {});
  in.close();
  // Of a standing robot the IMU's vertical acceleration is gravity.
  const double gravity_mps2 = kGravity_mps2;
  const auto* pattern = reinterpret_cast<const char*>(&gravity_mps2);
  const auto at = std::search(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2), bytes.end(), pattern,
                              pattern + sizeof gravity_mps2);
  ASSERT_NE(at, bytes.end());
  at[3] = static_cast<char>(at[3] ^ 1);
  std::ofstream(recording_, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  const Done done = run("--replay " + recording_);
  EXPECT_EQ(done.code, 2) << done.said;
  EXPECT_NE(done.said.find("first difference: "), std::string::npos) << done.said;
  EXPECT_NE(done.said.find("\"" + recording_ + "\", byte "), std::string::npos) << done.said;
  EXPECT_NE(done.said.find("(CRC)"), std::string::npos) << done.said;
}

// Whatever it is given: one sentence, at once, and little memory.
TEST_F(ProgramTest, ReplayOfWhatIsNone_IsOneSentence) {
  record(recording_, 300);
  std::ifstream in(recording_, std::ios::binary);
  const std::string good{std::istreambuf_iterator<char>(in), {}};
  const auto with_length = [&](std::size_t at, std::uint64_t length) {
    std::string bytes = good;
    std::memcpy(&bytes[at], &length, sizeof length);
    return bytes;
  };
  const std::size_t first_record = 8;
  struct Case {
    std::string name, bytes;
    int code = 2;
    std::string words = "is no recording: ";
  };
  std::vector<Case> cases{{"empty", ""},
                          {"foreign", std::string(5'000'000, 'x')},
                          {"magic alone", good.substr(0, 8), 2, "it has no topic /parameters"},
                          {"long first record", with_length(first_record + 1, ~std::uint64_t{0}), 2, "no topic"},
                          {"cut in the middle", good.substr(0, good.size() / 2), 3, "it was cut off"}};
  for (const std::size_t part : {5U, 9U, 90U, 95U}) {
    Case flipped{"flipped at " + std::to_string(part) + " %", good, -1, ""};
    char& byte = flipped.bytes[good.size() * part / 100];
    byte = static_cast<char>(byte ^ 0x10);
    cases.push_back(flipped);
  }
  for (const Case& c : cases) {
    const std::string path = write("none.mcap", c.bytes);
    expect_refusal(path, c.code, c.words, c.name);
  }
  expect_refusal(folder_.string(), 2, "is no recording: it is a directory", "a folder");
  expect_refusal((folder_ / "nowhere").string(), 2, "there is no such file", "nothing");
  const std::string fifo = (folder_ / "fifo").string();
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  expect_refusal(fifo, 2, "it is no plain file", "a pipe");
  expect_refusal("/dev/zero", 2, "it is no plain file", "a device");
}

}  // namespace
}  // namespace polygmap::daemon
