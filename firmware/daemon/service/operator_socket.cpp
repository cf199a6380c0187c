// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/operator_socket.hpp"

#include <poll.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <utility>

#include "algorithms/core/messages/samples.hpp"
#include "firmware/config/operator_request_text.hpp"
#include "firmware/daemon/system/error_text.hpp"
#include "firmware/daemon/system/monotonic_clock.hpp"

namespace polygmap::daemon {
namespace {

constexpr std::size_t kMostAsked_bytes = 128;  // a go_to in full precision and its time are 101
constexpr std::int64_t kDrop_ns = 500'000'000;
constexpr std::string_view kNoTime = "refused: its time is missing, CLOCK_MONOTONIC in ns, as polygmapd --ask sends it";
constexpr std::string_view kTooOld = "refused: it was not heard within half a second";

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
[[nodiscard]] std::string_view without_end(std::string_view text) noexcept {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\0')) text.remove_suffix(1);
  return text;
}
[[nodiscard]] std::optional<std::int64_t> number_in(std::string_view text) noexcept {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

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
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (::lstat(path.c_str(), &found) == 0 && S_ISSOCK(found.st_mode)) {
    const int other = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const bool is_left = ::connect(other, generic(address), sizeof address) != 0 && errno == ECONNREFUSED;
    if (other >= 0) ::close(other);
    if (is_left) ::unlink(path.c_str());  // by a former run; of any other failure somebody may live there
  }
  if (fd < 0 || ::bind(fd, generic(address), sizeof address) != 0) {
    const std::string why = error_text(errno);
    if (fd >= 0) ::close(fd);
    return "the socket \"" + path + "\" cannot be made: " + why;
  }
  path_ = path;
  fd_ = fd;
  return {};
}

void OperatorSocket::tell(const std::string_view& text) noexcept {
  if (asker_bytes_ <= sizeof(sa_family_t)) return;  // without a name nobody can be answered
  (void)::sendto(fd_, text.data(), text.size(), MSG_DONTWAIT, generic(asker_), asker_bytes_);
}

void OperatorSocket::drop_waiting() noexcept {
  char byte = 0;
  while (::recv(fd_, &byte, 1, MSG_DONTWAIT) >= 0) {
  }
}

void OperatorSocket::serve(ModuleState state, std::int64_t now_ns) noexcept {
  if (is_answered(state, now_ns)) listen(state, now_ns);
}

// False: control is at it.
bool OperatorSocket::is_answered(ModuleState state, std::int64_t now_ns) noexcept {
  std::uint8_t stage = stage_.load(std::memory_order_acquire);
  if (stage == kNone) return true;
  if (stage == kAsked && now_ns - sent_ns_ > kDrop_ns && stage_.compare_exchange_strong(stage, kNone)) {
    tell("refused: control did not take it");
    return true;
  }
  if (stage != kAnswered) return false;
  if (!std::exchange(was_answered_, true)) return false;  // its cycle has yet to end
  tell(text_of(answer_, state).view());
  stage_.store(kNone, std::memory_order_release);
  return true;
}

void OperatorSocket::listen(ModuleState state, std::int64_t now_ns) noexcept {
  std::array<char, kMostAsked_bytes> bytes{};
  asker_bytes_ = sizeof asker_;
  const auto got = ::recvfrom(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_TRUNC,
                              reinterpret_cast<sockaddr*>(&asker_), &asker_bytes_);
  if (got < 0) return;
  const std::string_view asked(bytes.data(), std::min(static_cast<std::size_t>(got), bytes.size()));
  const std::size_t space = std::min(asked.find(' '), asked.size());
  const std::string_view word = without_end(asked.substr(0, space));
  const auto sent_ns = number_in(without_end(asked.substr(std::min(space + 1, asked.size()))));
  const auto request = operator_request_of(word);
  if (!request && word == "state") return tell(name_of(state));
  if (!request) return tell("refused: ask for state, or one of " + std::string(kWhatMayBeAsked));
  if (!sent_ns) return tell(kNoTime);
  // Of the future, too: it is of another clock.
  if (*sent_ns < now_ns - kDrop_ns || *sent_ns > now_ns + kDrop_ns) return tell(kTooOld);
  request_ = *request;
  sent_ns_ = *sent_ns;
  was_answered_ = false;
  stage_.store(kAsked, std::memory_order_release);
}

bool OperatorSocket::try_read(OperatorRequest& request) noexcept {
  std::uint8_t asked = kAsked;
  if (!stage_.compare_exchange_strong(asked, kTaken, std::memory_order_acq_rel)) return false;
  request = request_;
  return true;
}

void OperatorSocket::answer(const OperatorAnswer& answer) noexcept {
  answer_ = answer;
  stage_.store(kAnswered, std::memory_order_release);
}

bool try_ask(const std::string& path, const std::string& word, std::string& text) {
  sockaddr_un address{}, own{};
  own.sun_family = AF_UNIX;
  const int fd = address_of(path, address) ? ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0) : -1;
  // Bound to no path it gets a name of the kernel's, to be answered at.
  const timeval most{1, 0};
  const std::string stamped = word + " " + std::to_string(monotonic_ns());
  const bool sent = fd >= 0 && ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &most, sizeof most) == 0 &&
                    ::bind(fd, generic(own), sizeof(sa_family_t)) == 0 &&
                    ::sendto(fd, stamped.data(), stamped.size(), 0, generic(address), sizeof address) >= 0;
  text = sent ? std::string("no answer within a second") : "nobody listens at \"" + path + "\": " + error_text(errno);
  pollfd answer{fd, POLLIN, 0};
  std::array<char, sizeof(AnswerText::text)> bytes{};
  const auto got = sent && ::poll(&answer, 1, 1000) > 0 ? ::recv(fd, bytes.data(), bytes.size(), 0) : -1;
  if (fd >= 0) ::close(fd);
  if (got < 0) return false;
  text.assign(bytes.data(), static_cast<std::size_t>(got));
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return true;
}

}  // namespace polygmap::daemon
