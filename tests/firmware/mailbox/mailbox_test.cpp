// SPDX-License-Identifier: Apache-2.0
// Who may make the mailbox, who may read it, and what is said where that is not so.
#include <sys/stat.h>

#include <array>

#include "tests/firmware/mailbox/mailbox_fixture.hpp"

namespace polygmap::test {
namespace {

class Mailbox : public MailboxFixture {
 protected:
  [[nodiscard]] bool says(const char* part) const { return std::strstr(why_, part) != nullptr; }
  // The header of a mailbox that somebody else has made so.
  [[nodiscard]] polygmap_mailbox header_of_another() const {
    polygmap_mailbox box{};
    box.header.magic = POLYGMAP_MAILBOX_MAGIC;
    box.header.layout_hash = kMailboxLayoutHash;
    box.header.segment_bytes = sizeof box;
    box.header.version = POLYGMAP_MAILBOX_VERSION;
    box.header.state = POLYGMAP_MAILBOX_IS_OPEN;
    box.header.writer_pid = ::getpid();
    return box;
  }
};

TEST_F(Mailbox, Hash_ChangesWithNamePlaceAndSizeOfAField) {
  const std::uint64_t hash = polygmap_mailbox_hash(1, "a.b", 8, 4);
  EXPECT_NE(hash, polygmap_mailbox_hash(1, "a.c", 8, 4));
  EXPECT_NE(hash, polygmap_mailbox_hash(1, "a.b", 12, 4));
  EXPECT_NE(hash, polygmap_mailbox_hash(1, "a.b", 8, 8));
  EXPECT_EQ(polygmap_mailbox_layout_hash(), kMailboxLayoutHash);
}

TEST_F(Mailbox, Made_HasItsPermissionsAndItsNames) {
  MailboxWriter writer;
  ASSERT_EQ(writer.open(config_), "");
  struct stat about {};
  ASSERT_EQ(::stat(("/dev/shm" + config_.name).c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 07777U, 0640U);
  EXPECT_EQ(about.st_size, static_cast<off_t>(sizeof(polygmap_mailbox)));
  ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
  const polygmap_mailbox_names& names = reader_.box->names;
  EXPECT_STREQ(names.module_states[0].text, "off");
  EXPECT_STREQ(names.gait_phases[2].text, "swing");
  EXPECT_STREQ(names.rows[0].text, "sense");
  EXPECT_EQ(names.row_budgets_us[0], 120);
  EXPECT_STREQ(names.events[0].text, "cycle_overrun");
  EXPECT_EQ(names.event_numbers[0], 1);
}

TEST_F(Mailbox, WrongName_IsASentence) {
  for (const char* name : {"", "/", "polygmap", "/a/b"}) {
    config_.name = name;
    EXPECT_NE(MailboxWriter().open(config_).find("must be a slash"), std::string::npos) << name;
  }
}

TEST_F(Mailbox, UnknownGroup_IsASentence) {
  config_.group = "no_such_group";
  EXPECT_EQ(MailboxWriter().open(config_), "the mailbox's group no_such_group is not in /etc/group");
  EXPECT_EQ(attach(), POLYGMAP_MAILBOX_ABSENT);
}

TEST_F(Mailbox, GroupGiven_HasIt) {
  if (::getuid() != 0) GTEST_SKIP() << "only root may give a file to any group";
  config_.group = "video";
  MailboxWriter writer;
  ASSERT_EQ(writer.open(config_), "");
  struct stat about {};
  ASSERT_EQ(::stat(("/dev/shm" + config_.name).c_str(), &about), 0);
  EXPECT_NE(about.st_gid, ::getgid());
}

TEST_F(Mailbox, SecondWriter_IsRefusedWithTheFirstOnesNumber) {
  MailboxWriter first, second;
  ASSERT_EQ(first.open(config_), "");
  EXPECT_EQ(second.open(config_),
            "the mailbox " + config_.name + " is written by process " + std::to_string(::getpid()) + " already");
  ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
  first.close();
  EXPECT_EQ(second.open(config_), "");
}

TEST_F(Mailbox, SecondWritersProcess_IsRefused) {
  start_writing_child();
  const std::string wrong = MailboxWriter().open(config_);
  EXPECT_NE(wrong.find("is written by process " + std::to_string(child_)), std::string::npos) << wrong;
}

TEST_F(Mailbox, WriterCloses_ReadersHearAndNameIsGone) {
  MailboxWriter writer;
  ASSERT_EQ(writer.open(config_), "");
  ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
  EXPECT_EQ(look(100), POLYGMAP_MAILBOX_OK);
  writer.close();
  EXPECT_EQ(look(100), POLYGMAP_MAILBOX_CLOSED);
  EXPECT_TRUE(says("has closed the mailbox")) << why_;
  EXPECT_EQ(attach(), POLYGMAP_MAILBOX_ABSENT);
  EXPECT_TRUE(says("nobody writes one")) << why_;
}

TEST_F(Mailbox, DeadWriter_IsReplacedAndItsReadersHear) {
  start_writing_child();
  ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
  end_child(SIGKILL);
  (void)look(0);  // sees what was written last
  EXPECT_EQ(look(0), POLYGMAP_MAILBOX_DEAD);
  EXPECT_TRUE(says("has died")) << why_;
  polygmap_mailbox_reader late = POLYGMAP_MAILBOX_READER;
  EXPECT_EQ(polygmap_mailbox_attach(&late, config_.name.c_str(), why_), POLYGMAP_MAILBOX_DEAD) << why_;

  MailboxWriter writer;
  ASSERT_EQ(writer.open(config_), "");
  EXPECT_EQ(look(1000), POLYGMAP_MAILBOX_CLOSED) << "the old one, which this reader still has";
  ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
  EXPECT_EQ(reader_.box->header.writer_pid, ::getpid());
  EXPECT_EQ(reader_.box->pose_lock.sequence, 0U) << "nothing of the old one is in it";
}

TEST_F(Mailbox, WriterKilledInTheMiddleOfAWrite_IsSaidAndNothingIsRead) {
  bool seen = false;
  for (int i = 0; i < 200 && !seen; ++i) {
    start_writing_child();
    ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
    ::usleep(200);
    end_child(SIGKILL);
    const bool pose_torn = reader_.box->pose_lock.sequence % 2 != 0;
    seen = pose_torn;
    if (!seen) continue;
    polygmap_mailbox_pose pose{};
    EXPECT_FALSE(try_read(pose));
    (void)look(0);
    EXPECT_EQ(look(0), POLYGMAP_MAILBOX_DEAD);
    EXPECT_TRUE(says("in the middle of a write")) << why_;
  }
  EXPECT_TRUE(seen) << "no kill came in the middle of a write";
  MailboxWriter writer;
  EXPECT_EQ(writer.open(config_), "");
}

TEST_F(Mailbox, WriterStopped_IsSilentWithItsNumber) {
#ifdef POLYGMAP_EMULATED
  GTEST_SKIP() << "qemu-user tells a process another time of its start than the kernel tells others";
#endif
  start_writing_child();
  ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
  ASSERT_EQ(::kill(child_, SIGSTOP), 0);
  ASSERT_EQ(::waitpid(child_, nullptr, WUNTRACED), child_);
  (void)look(0);
  EXPECT_EQ(look(60'000), POLYGMAP_MAILBOX_OK);
  EXPECT_EQ(look(0), POLYGMAP_MAILBOX_SILENT);
  EXPECT_TRUE(says(("process " + std::to_string(child_) + ", has written nothing").c_str())) << why_;
  ASSERT_EQ(::kill(child_, SIGCONT), 0);
  ::usleep(50'000);
  EXPECT_EQ(look(0), POLYGMAP_MAILBOX_OK);
}

TEST_F(Mailbox, SamePidStartedAtAnotherTime_IsDead) {
  polygmap_mailbox box = header_of_another();
  box.header.writer_start_ticks = 1;
  make_memory(&box, sizeof box);
  EXPECT_EQ(attach(), POLYGMAP_MAILBOX_DEAD) << why_;
}

TEST_F(Mailbox, OtherLayout_IsRefused) {
  polygmap_mailbox box = header_of_another();
  ++box.header.layout_hash;
  make_memory(&box, sizeof box);
  EXPECT_EQ(attach(), POLYGMAP_MAILBOX_OTHER_LAYOUT);
  EXPECT_TRUE(says("build it with the writer's polygmap_mailbox.h")) << why_;
  EXPECT_EQ(reader_.box, nullptr);
}

TEST_F(Mailbox, TooSmall_IsRefused) {
  const polygmap_mailbox box = header_of_another();
  make_memory(&box, sizeof box - 1);
  EXPECT_EQ(attach(), POLYGMAP_MAILBOX_TOO_SMALL);
  EXPECT_TRUE(says("bytes, and a mailbox as this program knows it has")) << why_;
}

TEST_F(Mailbox, ForeignMemory_IsNeitherReadNorReplaced) {
  std::array<char, sizeof(polygmap_mailbox)> foreign{};
  foreign.fill('x');
  make_memory(foreign.data(), foreign.size());
  EXPECT_EQ(attach(), POLYGMAP_MAILBOX_FOREIGN);
  EXPECT_TRUE(says("is no mailbox of PolygMap's")) << why_;
  EXPECT_EQ(MailboxWriter().open(config_), "the shared memory " + config_.name + " is no mailbox; it is left alone");
  EXPECT_EQ(attach(), POLYGMAP_MAILBOX_FOREIGN);
}

TEST_F(Mailbox, OnlyBeingMade_IsAbsentAndMayBeReplaced) {
  make_memory("", 0);
  EXPECT_EQ(attach(), POLYGMAP_MAILBOX_ABSENT);
  EXPECT_TRUE(says("only being made")) << why_;
  MailboxWriter writer;
  EXPECT_EQ(writer.open(config_), "");
}

// Of a user who is neither its owner nor in its group.
TEST_F(Mailbox, AnotherUser_MayNeitherReadNorWrite) {
  if (::getuid() != 0) GTEST_SKIP() << "only root may become another user";
  MailboxWriter writer;
  ASSERT_EQ(writer.open(config_), "");
  const pid_t other = ::fork();
  ASSERT_GE(other, 0);
  if (other == 0) {
    const bool is_other = ::setgid(65534) == 0 && ::setuid(65534) == 0;
    const bool reads = attach() != POLYGMAP_MAILBOX_NOT_PERMITTED || !says("This user may not read");
    const std::string wrong = MailboxWriter().open(config_);
    ::_exit(!is_other ? 1 : reads ? 2 : wrong.find("is somebody else's") == std::string::npos ? 3 : 0);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(other, &status, 0), other);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace polygmap::test
