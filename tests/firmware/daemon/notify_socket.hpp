// SPDX-License-Identifier: Apache-2.0
// The service manager's end: a datagram socket in the abstract space or in the file system.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

namespace polygmap::test {

class NotifySocket {
 public:
  // name: "@..." or a path.
  explicit NotifySocket(std::string name) : name_(std::move(name)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(static_cast<char*>(address.sun_path), name_.c_str(), name_.size());
    const bool is_abstract = name_[0] == '@';
    if (is_abstract) address.sun_path[0] = '\0';
    if (!is_abstract) ::unlink(name_.c_str());
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const auto bytes = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name_.size() + (is_abstract ? 0 : 1));
    is_open_ = ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), bytes) == 0;
  }
  ~NotifySocket() {
    ::close(socket_);
    if (name_[0] != '@') ::unlink(name_.c_str());
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  [[nodiscard]] bool is_open() const { return is_open_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  // What came since the last call.
  [[nodiscard]] std::vector<std::string> read() {
    std::vector<std::string> all;
    std::array<char, 2048> text{};
    for (ssize_t n = 0; (n = ::recv(socket_, text.data(), text.size(), 0)) >= 0;) {
      all.emplace_back(text.data(), static_cast<std::size_t>(n));
    }
    return all;
  }

 private:
  std::string name_;
  int socket_ = -1;
  bool is_open_ = false;
};

}  // namespace polygmap::test
