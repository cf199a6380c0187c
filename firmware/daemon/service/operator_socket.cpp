// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/operator_socket.hpp"

#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace polygmap::daemon {
namespace {

constexpr std::size_t kMostWord_bytes = 32;
constexpr const char* kWhatMayBeAsked = "ask for arm, start, pause, resume, stop, reset or state\n";

// False: the path is longer than an address holds, or empty.
[[nodiscard]] bool address_of(const std::string& path, sockaddr_un& address) {
  address = {};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return false;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return true;
}
[[nodiscard]] const sockaddr* generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}
[[nodiscard]] std::string reason() { return ::strerrordesc_np(errno); }

}  // namespace

OperatorSocket::~OperatorSocket() {
  if (fd_ < 0) return;
  ::close(fd_);
  ::unlink(path_.c_str());
}

std::string OperatorSocket::open(const std::string& path) {
  sockaddr_un address{};
  if (!address_of(path, address)) return "the socket's path \"" + path + "\" is too long";
  struct stat found {};
  if (::lstat(path.c_str(), &found) == 0 && S_ISSOCK(found.st_mode)) ::unlink(path.c_str());  // of a former run
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0 || ::bind(fd, generic(address), sizeof address) != 0) {
    const std::string why = reason();
    if (fd >= 0) ::close(fd);
    return "the socket \"" + path + "\" cannot be made: " + why;
  }
  path_ = path;
  fd_ = fd;
  return {};
}

void OperatorSocket::answer(const char* text) noexcept {
  if (asker_bytes_ <= sizeof(sa_family_t)) return;  // without a name nobody can be answered
  (void)::sendto(fd_, text, std::strlen(text), MSG_DONTWAIT, generic(asker_), asker_bytes_);
}

void OperatorSocket::serve(ModuleState state) noexcept {
  if (asked_.load(std::memory_order_acquire) != 0) return;  // control's next cycle takes it
  if (owes_state_) {
    answer(name_of(state).data());  // a literal: it ends with a null
    owes_state_ = false;
  }
  std::array<char, kMostWord_bytes> bytes{};
  asker_bytes_ = sizeof asker_;
  const auto got = ::recvfrom(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_TRUNC,
                              reinterpret_cast<sockaddr*>(&asker_), &asker_bytes_);
  if (got < 0) return;
  std::string_view word(bytes.data(), std::min(static_cast<std::size_t>(got), bytes.size()));
  while (!word.empty() && (word.back() == '\n' || word.back() == '\0')) word.remove_suffix(1);
  const auto command = operator_command_of(word);
  owes_state_ = command.has_value() || word == "state";
  if (!owes_state_) return answer(kWhatMayBeAsked);
  if (command) asked_.store(static_cast<std::uint8_t>(1 + static_cast<int>(*command)), std::memory_order_release);
}

bool OperatorSocket::try_read(OperatorCommand& command) noexcept {
  if (asked_.load(std::memory_order_relaxed) == 0) return false;
  command = static_cast<OperatorCommand>(asked_.exchange(0, std::memory_order_acq_rel) - 1);
  return true;
}

bool try_ask(const std::string& path, const std::string& word, std::string& text) {
  sockaddr_un address{}, own{};
  own.sun_family = AF_UNIX;
  const int fd = address_of(path, address) ? ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0) : -1;
  // Bound to no path it gets a name of the kernel's, to be answered at.
  const bool sent = fd >= 0 && ::bind(fd, generic(own), sizeof(sa_family_t)) == 0 &&
                    ::sendto(fd, word.data(), word.size(), 0, generic(address), sizeof address) >= 0;
  text = sent ? std::string("no answer within a second") : "nobody listens at \"" + path + "\": " + reason();
  pollfd answer{fd, POLLIN, 0};
  std::array<char, 256> bytes{};
  const auto got = sent && ::poll(&answer, 1, 1000) > 0 ? ::recv(fd, bytes.data(), bytes.size(), 0) : -1;
  if (fd >= 0) ::close(fd);
  if (got < 0) return false;
  text.assign(bytes.data(), static_cast<std::size_t>(got));
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return true;
}

}  // namespace polygmap::daemon
