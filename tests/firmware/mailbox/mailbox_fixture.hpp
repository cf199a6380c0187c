// SPDX-License-Identifier: Apache-2.0
// A mailbox of a test's own name, and processes that write it.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>

#include "firmware/mailbox/mailbox_writer.hpp"
#include "firmware/mailbox/polygmap_mailbox_reader.h"

namespace polygmap::test {

// Every number of it says n: a copy of two writes shows.
[[nodiscard]] inline polygmap_mailbox_pose pose_of(std::uint64_t n) {
  polygmap_mailbox_pose pose{};
  static_assert(sizeof pose % sizeof n == 0);
  for (std::size_t at = 0; at < sizeof pose; at += sizeof n)
    std::memcpy(reinterpret_cast<char*>(&pose) + at, &n, sizeof n);
  return pose;
}
[[nodiscard]] inline bool is_whole(const polygmap_mailbox_pose& pose) {
  const polygmap_mailbox_pose same = pose_of(static_cast<std::uint64_t>(pose.stamp_ns));
  return std::memcmp(&pose, &same, sizeof pose) == 0;
}

class MailboxFixture : public testing::Test {
 protected:
  MailboxFixture() { config_.name = "/polygmap_test_" + std::to_string(::getpid()); }
  ~MailboxFixture() override {
    polygmap_mailbox_detach(&reader_);
    end_child(SIGKILL);
    ::shm_unlink(config_.name.c_str());
  }

  [[nodiscard]] polygmap_mailbox_result attach() {
    return polygmap_mailbox_attach(&reader_, config_.name.c_str(), why_);
  }
  [[nodiscard]] polygmap_mailbox_result look(int silent_ms) { return polygmap_mailbox_look(&reader_, silent_ms, why_); }
  [[nodiscard]] bool try_read(polygmap_mailbox_pose& pose) const {
    return polygmap_mailbox_try_copy(&reader_.box->pose_lock, &reader_.box->pose, &pose, sizeof pose);
  }
  // Some memory of that name.
  void make_memory(const void* bytes, std::size_t count, mode_t mode = 0600) const {
    const int fd = ::shm_open(config_.name.c_str(), O_RDWR | O_CREAT | O_EXCL, mode);
    ASSERT_GE(fd, 0);
    EXPECT_EQ(::write(fd, bytes, count), static_cast<ssize_t>(count));
    ::close(fd);
  }

  // A process that does this and, when that returns, waits to be killed; returns once it has said so by returning.
  void start_child(const std::function<void()>& work) {
    std::array<int, 2> pipe{};
    ASSERT_EQ(::pipe(pipe.data()), 0);
    child_ = ::fork();
    ASSERT_GE(child_, 0);
    if (child_ == 0) {
      const char done = 1;
      work();
      (void)!::write(pipe[1], &done, 1);
      for (;;) ::pause();
    }
    char done = 0;
    EXPECT_EQ(::read(pipe[0], &done, 1), 1);
    for (const int fd : pipe) ::close(fd);
  }
  // One that writes poses as fast as it can; returns once the mailbox is there.
  void start_writing_child() {
    std::array<int, 2> pipe{};
    ASSERT_EQ(::pipe(pipe.data()), 0);
    child_ = ::fork();
    ASSERT_GE(child_, 0);
    if (child_ == 0) {
      MailboxWriter writer;
      const char done = writer.open(config_).empty() ? 1 : 0;
      (void)!::write(pipe[1], &done, 1);
      const polygmap_mailbox_status status{};
      static const polygmap_plan kPlan{};
      writer.write(kPlan, true, 1);
      for (std::uint64_t n = 1;; ++n) {
        writer.write(pose_of(n), static_cast<std::int64_t>(n));
        writer.write(status, static_cast<std::int64_t>(n));
      }
    }
    char done = 0;
    EXPECT_EQ(::read(pipe[0], &done, 1), 1);
    EXPECT_EQ(done, 1);
    for (const int fd : pipe) ::close(fd);
  }
  void end_child(int signal) {
    if (child_ <= 0) return;
    ::kill(child_, signal);
    ::waitpid(child_, nullptr, 0);
    child_ = -1;
  }

  MailboxConfig config_;
  pid_t child_ = -1;
  polygmap_mailbox_reader reader_ = POLYGMAP_MAILBOX_READER;
  char why_[POLYGMAP_MAILBOX_SENTENCE] = "";
};

}  // namespace polygmap::test
