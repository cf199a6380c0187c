// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/system/notifier.hpp"

#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <limits>

namespace polygmap::daemon {
namespace {

// A whole number above zero; 0 for what is none.
std::int64_t number_in(const char* text) noexcept {
  char* end = nullptr;
  const long long number = std::strtoll(text, &end, 10);
  return end == text || *end != '\0' || number < 0 ? 0 : number;
}

}  // namespace

Notifier::~Notifier() {
  if (socket_ >= 0) ::close(socket_);
}

bool Notifier::open() noexcept {
  return open(std::getenv("NOTIFY_SOCKET"), std::getenv("WATCHDOG_USEC"), std::getenv("WATCHDOG_PID"));
}

bool Notifier::open(const char* socket, const char* watchdog_us, const char* watchdog_pid) noexcept {
  if (socket == nullptr || *socket == '\0') return true;
  const std::size_t length = std::strlen(socket);
  if ((socket[0] != '/' && socket[0] != '@') || length < 2 || length >= sizeof address_.sun_path) return false;
  address_ = {};
  address_.sun_family = AF_UNIX;
  std::memcpy(static_cast<char*>(address_.sun_path), socket, length);
  address_bytes_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length + 1);
  if (socket[0] == '@') {
    address_.sun_path[0] = '\0';
    --address_bytes_;  // a name in the abstract space has no end mark
  }
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0) return false;
  const bool is_for_us = watchdog_pid == nullptr || number_in(watchdog_pid) == ::getpid();
  constexpr std::int64_t kNsPerUs = 1000;
  if (watchdog_us != nullptr && is_for_us) {
    const std::int64_t us = number_in(watchdog_us);
    watchdog_ns_ = us > std::numeric_limits<std::int64_t>::max() / kNsPerUs ? 0 : us * kNsPerUs;
  }
  return true;
}

bool Notifier::tell(std::string_view state) noexcept {
  if (socket_ < 0) return false;
  const auto* address = reinterpret_cast<const sockaddr*>(&address_);
  return ::sendto(socket_, state.data(), state.size(), MSG_NOSIGNAL, address, address_bytes_) ==
         static_cast<ssize_t>(state.size());
}

}  // namespace polygmap::daemon
