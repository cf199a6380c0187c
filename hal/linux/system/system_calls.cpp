// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/system/system_calls.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace polygmap::hal {

const SystemCalls& kernel_calls() noexcept {
  static constexpr SystemCalls kCalls{
      .open = [](const char* path, int flags) noexcept { return ::open(path, flags); },
      .close = [](int fd) noexcept { return ::close(fd); },
      .ioctl = [](int fd, unsigned long request, void* argument) noexcept { return ::ioctl(fd, request, argument); },
      .read = [](int fd, void* buffer, std::size_t size) noexcept { return ::read(fd, buffer, size); },
      .mmap = [](std::size_t size, int protection, int flags, int fd,
                 off_t offset) noexcept { return ::mmap(nullptr, size, protection, flags, fd, offset); },
      .munmap = [](void* address, std::size_t size) noexcept { return ::munmap(address, size); },
      .socket = [](int domain, int type, int protocol) noexcept { return ::socket(domain, type, protocol); },
      .bind = [](int fd, const sockaddr* address, socklen_t size) noexcept { return ::bind(fd, address, size); },
      .setsockopt = [](int fd, int level, int option, const void* value,
                       socklen_t size) noexcept { return ::setsockopt(fd, level, option, value, size); },
      .recvmmsg = [](int fd, mmsghdr* messages, unsigned int count,
                     int flags) noexcept { return ::recvmmsg(fd, messages, count, flags, nullptr); },
      .sendmmsg = [](int fd, mmsghdr* messages, unsigned int count,
                     int flags) noexcept { return ::sendmmsg(fd, messages, count, flags); },
      .tcgetattr = [](int fd, termios* settings) noexcept { return ::tcgetattr(fd, settings); },
      .tcsetattr = [](int fd, int when, const termios* settings) noexcept { return ::tcsetattr(fd, when, settings); },
      .clock_gettime = [](clockid_t clock, timespec* time) noexcept { return ::clock_gettime(clock, time); },
  };
  return kCalls;
}

}  // namespace polygmap::hal
