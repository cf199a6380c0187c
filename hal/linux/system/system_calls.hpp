// SPDX-License-Identifier: Apache-2.0
// Every system call that a driver makes goes through this table, so that a test decides what it answers: a fault of the
// n-th call, a device that this machine does not have. Each has the meaning of its name in section 2 of the manual.
#pragma once

#include <sys/socket.h>
#include <sys/types.h>
#include <termios.h>

#include <cstddef>
#include <ctime>

namespace polygmap::hal {

struct SystemCalls {
  int (*open)(const char* path, int flags) noexcept;
  int (*close)(int fd) noexcept;
  int (*ioctl)(int fd, unsigned long request, void* argument) noexcept;
  ssize_t (*read)(int fd, void* buffer, std::size_t size) noexcept;
  void* (*mmap)(std::size_t size, int protection, int flags, int fd, off_t offset) noexcept;
  int (*munmap)(void* address, std::size_t size) noexcept;
  int (*socket)(int domain, int type, int protocol) noexcept;
  int (*bind)(int fd, const sockaddr* address, socklen_t size) noexcept;
  int (*setsockopt)(int fd, int level, int option, const void* value, socklen_t size) noexcept;
  int (*recvmmsg)(int fd, mmsghdr* messages, unsigned int count, int flags) noexcept;
  int (*sendmmsg)(int fd, mmsghdr* messages, unsigned int count, int flags) noexcept;
  int (*tcgetattr)(int fd, termios* settings) noexcept;
  int (*tcsetattr)(int fd, int when, const termios* settings) noexcept;
  int (*clock_gettime)(clockid_t clock, timespec* time) noexcept;
};

// The kernel's.
[[nodiscard]] const SystemCalls& kernel_calls() noexcept;

// EINTR is answered by calling again, this often: a storm of signals must not hold a lane.
inline constexpr int kInterruptedRetries = 3;

}  // namespace polygmap::hal
