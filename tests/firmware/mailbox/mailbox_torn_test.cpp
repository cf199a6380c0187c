// SPDX-License-Identifier: Apache-2.0
// Whole sections or none, while a thread or a process writes at full speed.
#include <atomic>
#include <thread>

#include "tests/firmware/mailbox/mailbox_fixture.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::test {
namespace {

constexpr int kReads = kSlowMachine ? 10'000 : 200'000;
constexpr std::int64_t kMost_ns = 60'000'000'000;

class MailboxTorn : public MailboxFixture {
 protected:
  // So many reads that gave something; each of these is whole and none is older than the one before. A writer that the
  // machine does not let run, in the middle of a write, gives nothing for that long.
  void expect_whole_reads() {
    const std::int64_t begin_ns = polygmap_mailbox_now_ns();
    std::int64_t newest = 0;
    for (int given = 0; given < kReads && !HasFailure();) {
      polygmap_mailbox_pose pose{};
      if (try_read(pose)) {
        ++given;
        EXPECT_TRUE(is_whole(pose)) << "read " << given;
        EXPECT_GE(pose.stamp_ns, newest);
        newest = pose.stamp_ns;
      } else {
        std::this_thread::yield();
        EXPECT_LT(polygmap_mailbox_now_ns() - begin_ns, kMost_ns) << given << " reads in all";
      }
    }
  }
};

TEST_F(MailboxTorn, WriterThreadAtFullSpeed_ReadsAreWhole) {
  MailboxWriter writer;
  ASSERT_EQ(writer.open(config_), "");
  ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
  std::atomic<bool> ends{false};
  std::atomic<std::uint64_t> written{0};
  std::thread thread([&] {
    for (std::uint64_t n = 1; !ends; ++n) {
      writer.write(pose_of(n), static_cast<std::int64_t>(n));
      written = n;
    }
  });
  while (written == 0) std::this_thread::yield();
  expect_whole_reads();
  ends = true;
  thread.join();
  EXPECT_GT(written, 100U);
  polygmap_mailbox_pose last{};
  ASSERT_TRUE(try_read(last));
  EXPECT_EQ(static_cast<std::uint64_t>(last.stamp_ns), written);
}

TEST_F(MailboxTorn, WriterProcessAtFullSpeed_ReadsAreWhole) {
  start_writing_child();
  ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
  expect_whole_reads();
}

TEST_F(MailboxTorn, SequenceOddOrZero_NothingIsRead) {
  const polygmap_mailbox_pose shared = pose_of(7);
  polygmap_mailbox_pose pose{};
  for (const std::uint64_t sequence : {0U, 1U, 3U}) {
    const polygmap_mailbox_lock lock{sequence, 0};
    EXPECT_FALSE(polygmap_mailbox_try_copy(&lock, &shared, &pose, sizeof pose)) << sequence;
  }
  const polygmap_mailbox_lock lock{2, 0};
  EXPECT_TRUE(polygmap_mailbox_try_copy(&lock, &shared, &pose, sizeof pose));
  EXPECT_TRUE(is_whole(pose));
}

}  // namespace
}  // namespace polygmap::test
