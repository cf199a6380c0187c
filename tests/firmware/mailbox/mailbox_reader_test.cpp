// SPDX-License-Identifier: Apache-2.0
// The example of a reader, as a program: mailbox_reader.c.
#include <cstdio>
#include <memory>

#include "tests/firmware/mailbox/mailbox_fixture.hpp"

namespace polygmap::test {
namespace {

struct Done {
  int code = -1;
  std::string said;  // on both streams
};

class MailboxReaderProgram : public MailboxFixture {
 protected:
  void SetUp() override {
    if (kProgram.empty()) GTEST_SKIP() << "this build has no program that could run here";
  }
  std::FILE* start(const std::string& arguments) const {
    return ::popen(("timeout 20 " + kProgram + " --name " + config_.name + " " + arguments + " 2>&1").c_str(), "r");
  }
  static Done end(std::FILE* pipe) {
    Done done;
    std::array<char, 4096> text{};
    while (std::fgets(text.data(), text.size(), pipe) != nullptr) done.said += text.data();
    const int status = ::pclose(pipe);
    done.code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + status;
    return done;
  }
  [[nodiscard]] Done run(const std::string& arguments) const { return end(start(arguments)); }
  static bool has(const Done& done, const std::string& part) { return done.said.find(part) != std::string::npos; }

  const std::string kProgram = POLYGMAP_MAILBOX_READER_PROGRAM;
};

TEST_F(MailboxReaderProgram, WriterIsThere_PrintsAtItsRate) {
  start_writing_child();
  const std::int64_t begin_ns = polygmap_mailbox_now_ns();
  const Done done = run("--rate 500 --lines 250");
  const double took_s = 1e-9 * static_cast<double>(polygmap_mailbox_now_ns() - begin_ns);
  EXPECT_EQ(done.code, 0) << done.said;
  EXPECT_EQ(std::count(done.said.begin(), done.said.end(), '\n'), 251) << "one says whose mailbox it is";
  EXPECT_TRUE(has(done, "reads what process " + std::to_string(child_) + " writes")) << done.said.substr(0, 500);
  EXPECT_TRUE(has(done, " off standing; age of pose ")) << done.said.substr(0, 500);
  EXPECT_GE(took_s, 0.49);
}

TEST_F(MailboxReaderProgram, WriterDies_IsSaidAndTheNextOneIsRead) {
  start_writing_child();
  std::FILE* const program = start("--rate 20 --lines 8");
  std::array<char, 4096> text{};
  while (std::fgets(text.data(), text.size(), program) != nullptr && std::strstr(text.data(), "standing") == nullptr) {
  }
  const std::string first = std::to_string(child_);
  end_child(SIGKILL);
  ::usleep(400'000);
  start_writing_child();
  const Done done = end(program);
  EXPECT_EQ(done.code, 0) << done.said;
  EXPECT_TRUE(has(done, "The writer, process " + first + ", has died")) << done.said;
  EXPECT_TRUE(has(done, "reads what process " + std::to_string(child_) + " writes")) << done.said;
}

TEST_F(MailboxReaderProgram, OtherLayout_EndsWithASentence) {
  polygmap_mailbox box{};
  box.header.magic = POLYGMAP_MAILBOX_MAGIC;
  box.header.version = POLYGMAP_MAILBOX_VERSION + 1;
  make_memory(&box, sizeof box);
  const Done done = run("");
  EXPECT_EQ(done.code, 1);
  EXPECT_TRUE(has(done, "has version 2 and layout 0000000000000000, and this program reads version 1")) << done.said;
}

TEST_F(MailboxReaderProgram, WrongArguments_AreASentence) {
  for (const char* arguments : {"--rate 0", "--rate x", "--lines", "--what", "--silent-ms 0"}) {
    const Done done = run(arguments);
    EXPECT_EQ(done.code, 2) << arguments;
    EXPECT_EQ(std::count(done.said.begin(), done.said.end(), '\n'), 1) << done.said;
  }
}

}  // namespace
}  // namespace polygmap::test
