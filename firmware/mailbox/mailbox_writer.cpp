// SPDX-License-Identifier: Apache-2.0
#include "firmware/mailbox/mailbox_writer.hpp"

#include <fcntl.h>
#include <grp.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <optional>

#include "firmware/mailbox/mailbox_sections.hpp"
#include "firmware/mailbox/polygmap_mailbox_reader.h"

namespace polygmap {
namespace {

constexpr mode_t kMode = 0640;
constexpr std::size_t kMostName_bytes = 201;
constexpr int kMostTries = 8;  // others that start or end at the same time

std::string error_text(int error_number) {
  const char* const text = ::strerrordesc_np(error_number);
  return text != nullptr ? text : "error " + std::to_string(error_number);
}

// Not getgrnam(), which loads libraries into a static program.
std::optional<gid_t> group_of(const std::string& name) {
  std::FILE* const file = std::fopen("/etc/group", "re");
  if (file == nullptr) return std::nullopt;
  std::optional<gid_t> id;
  while (const ::group* const entry = ::fgetgrent(file)) {
    if (name == entry->gr_name) id = entry->gr_gid;
  }
  std::fclose(file);
  return id;
}

bool same_file(int fd, const std::string& name) noexcept {
  struct stat own {
  }, named{};
  const int other = ::shm_open(name.c_str(), O_RDONLY, 0);
  const bool same = other >= 0 && ::fstat(other, &named) == 0 && ::fstat(fd, &own) == 0 && own.st_ino == named.st_ino;
  if (other >= 0) ::close(other);
  return same;
}

// Whoever still reads a mailbox that is replaced is told so.
void mark_closed(int fd) noexcept {
  struct stat about {};
  if (::fstat(fd, &about) != 0 || about.st_size < static_cast<off_t>(sizeof(polygmap_mailbox_header))) return;
  void* const mapped = ::mmap(nullptr, sizeof(polygmap_mailbox_header), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  if (mapped == MAP_FAILED) return;
  auto* const header = static_cast<polygmap_mailbox_header*>(mapped);
  if (header->magic == POLYGMAP_MAILBOX_MAGIC) {
    __atomic_store_n(&header->state, std::uint32_t{POLYGMAP_MAILBOX_IS_CLOSED}, __ATOMIC_RELEASE);
  }
  ::munmap(mapped, sizeof(polygmap_mailbox_header));
}

// What may be replaced: a mailbox, or one that was never finished.
bool is_mailbox(int fd) noexcept {
  std::uint64_t magic = 0;
  const ssize_t got = ::pread(fd, &magic, sizeof magic, 0);
  return got == 0 || (got == sizeof magic && (magic == 0 || magic == POLYGMAP_MAILBOX_MAGIC));
}

// Whose it is, for a sentence.
std::string writer_of(int fd) {
  polygmap_mailbox_header header{};
  const bool known = ::pread(fd, &header, sizeof header, 0) == sizeof header && header.magic == POLYGMAP_MAILBOX_MAGIC;
  return known ? "process " + std::to_string(header.writer_pid) : "another process";
}

}  // namespace

std::string MailboxWriter::open(const MailboxConfig& config) {
  close();
  const bool good_name = config.name.size() > 1 && config.name.size() <= kMostName_bytes && config.name[0] == '/' &&
                         config.name.find('/', 1) == std::string::npos;
  if (!good_name) {
    return "the mailbox's name must be a slash and 1 to 200 characters without one, not \"" + config.name + "\"";
  }
  std::optional<gid_t> group;
  if (!config.group.empty() && !(group = group_of(config.group))) {
    return "the mailbox's group " + config.group + " is not in /etc/group";
  }
  const int fd = take_name(config);
  if (fd < 0) return why_;
  fd_ = fd;
  name_ = config.name;
  const auto fail = [this](const std::string& what) {
    const int error_number = errno;
    ::shm_unlink(name_.c_str());
    ::close(fd_);
    fd_ = -1;
    return "the mailbox " + name_ + " cannot " + what + " (" + error_text(error_number) + ")";
  };
  if (::fchmod(fd, kMode) != 0) return fail("be given its permissions");
  if (group && ::fchown(fd, static_cast<uid_t>(-1), *group) != 0) {
    return fail("be given to the group " + config.group + ", in which this process has to be");
  }
  // Room that is there, so that no write can fail for want of it.
  if (const int error_number = ::posix_fallocate(fd, 0, sizeof(polygmap_mailbox)); error_number != 0) {
    errno = error_number;
    return fail("have its " + std::to_string(sizeof(polygmap_mailbox)) + " bytes");
  }
  void* const mapped =
      ::mmap(nullptr, sizeof(polygmap_mailbox), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
  if (mapped == MAP_FAILED) return fail("be mapped");
  box_ = static_cast<polygmap_mailbox*>(mapped);
  polygmap_mailbox_header& header = box_->header;
  header.layout_hash = kMailboxLayoutHash;
  header.segment_bytes = sizeof(polygmap_mailbox);
  header.version = POLYGMAP_MAILBOX_VERSION;
  header.state = POLYGMAP_MAILBOX_IS_OPEN;
  header.writer_pid = ::getpid();
  char state = '?';
  header.writer_start_ticks = polygmap_mailbox_start_ticks(header.writer_pid, &state);
  header.opened_ns = polygmap_mailbox_now_ns();
  header.clock = config.clock;
  header.cycle_us = kCycle_us;
  fill(box_->names);
  __atomic_store_n(&header.magic, POLYGMAP_MAILBOX_MAGIC, __ATOMIC_RELEASE);
  return {};
}

// The name is the mailbox of whoever holds the lock on it. A dead writer's is replaced, not written on: its readers
// have it mapped, and it may be of another size.
int MailboxWriter::take_name(const MailboxConfig& config) {
  const char* const name = config.name.c_str();
  for (int i = 0; i < kMostTries; ++i) {
    const int old = ::shm_open(name, O_RDWR, 0);
    if (old >= 0) {
      if (::flock(old, LOCK_EX | LOCK_NB) != 0) {
        why_ = "the mailbox " + config.name + " is written by " + writer_of(old) + " already";
        ::close(old);
        return -1;
      }
      if (!is_mailbox(old)) {
        why_ = "the shared memory " + config.name + " is no mailbox; it is left alone";
        ::close(old);
        return -1;
      }
      if (same_file(old, config.name)) {
        mark_closed(old);
        if (::shm_unlink(name) != 0) {
          why_ =
              "the mailbox " + config.name + " that a dead writer left cannot be removed (" + error_text(errno) + ")";
          ::close(old);
          return -1;
        }
      }
      ::close(old);
    } else if (errno != ENOENT) {
      why_ = "the mailbox " + config.name + " is somebody else's (" + error_text(errno) + ")";
      return -1;
    }
    const int fresh = ::shm_open(name, O_RDWR | O_CREAT | O_EXCL, S_IRUSR | S_IWUSR);
    if (fresh < 0 && errno == EEXIST) continue;
    if (fresh < 0) {
      why_ = "the mailbox " + config.name + " cannot be made (" + error_text(errno) + ")";
      return -1;
    }
    if (::flock(fresh, LOCK_EX | LOCK_NB) == 0 && same_file(fresh, config.name)) return fresh;
    ::close(fresh);
  }
  why_ = "the mailbox " + config.name + " is made by several processes at once";
  return -1;
}

void MailboxWriter::tell_closed() noexcept {
  if (box_ == nullptr) return;
  __atomic_store_n(&box_->header.state, std::uint32_t{POLYGMAP_MAILBOX_IS_CLOSED}, __ATOMIC_RELEASE);
  if (same_file(fd_, name_)) ::shm_unlink(name_.c_str());
}

void MailboxWriter::close() noexcept {
  if (box_ == nullptr) return;
  tell_closed();
  ::munmap(box_, sizeof(polygmap_mailbox));
  ::close(fd_);
  box_ = nullptr;
  fd_ = -1;
}

}  // namespace polygmap
