// SPDX-License-Identifier: Apache-2.0
// Keys that come through a pipe.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <optional>
#include <sstream>
#include <string_view>

#include "sim_stub/host/operator/keyboard.hpp"

namespace polygmap::sim {
namespace {

// The standard input is the pipe's end for as long as a test takes.
class KeyboardTest : public testing::Test {
 protected:
  KeyboardTest() : usual_input_(::dup(STDIN_FILENO)) {
    EXPECT_EQ(::pipe(pipe_.data()), 0);
    EXPECT_EQ(::dup2(pipe_[0], STDIN_FILENO), STDIN_FILENO);
    keyboard_.emplace(out_);
  }
  ~KeyboardTest() override {
    (void)::dup2(usual_input_, STDIN_FILENO);
    for (const int fd : {usual_input_, pipe_[0]}) ::close(fd);
    close_input();
  }
  void type(std::string_view keys) const {
    EXPECT_EQ(::write(pipe_[1], keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  void close_input() {
    if (pipe_[1] >= 0) ::close(pipe_[1]);
    pipe_[1] = -1;
  }
  [[nodiscard]] std::optional<OperatorCommand> read() {
    OperatorRequest request;
    if (!keyboard_->try_read(request)) return std::nullopt;
    return request.command;
  }

  std::ostringstream out_;
  std::array<int, 2> pipe_{-1, -1};
  int usual_input_;
  std::optional<Keyboard> keyboard_;
};

TEST_F(KeyboardTest, CommandRefused_IsSaidWithStateAndReason) {
  type("s");
  keyboard_->look(2 * kNsPerS, ModuleState::kOff);
  ASSERT_EQ(read(), OperatorCommand::kStart);
  keyboard_->answer({Refusal::kState, {}});
  EXPECT_TRUE(out_.str().ends_with("    2.00 s  off\n    2.00 s  start refused: off\n")) << out_.str();
  EXPECT_FALSE(keyboard_->has_left());
}

TEST_F(KeyboardTest, InputEnds_HasLeftOnceAllThatItAskedIsRead) {
  type("a\n");
  close_input();
  keyboard_->look(0, ModuleState::kOff);
  EXPECT_FALSE(keyboard_->has_left());
  EXPECT_TRUE(keyboard_->has_more());
  EXPECT_EQ(read(), OperatorCommand::kArm);
  EXPECT_TRUE(keyboard_->has_left());
  EXPECT_FALSE(keyboard_->has_more());
}

TEST_F(KeyboardTest, QuitKey_HasLeft) {
  type("q");
  keyboard_->look(0, ModuleState::kOff);
  EXPECT_TRUE(keyboard_->has_left());
}

}  // namespace
}  // namespace polygmap::sim
