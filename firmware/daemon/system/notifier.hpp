// SPDX-License-Identifier: Apache-2.0
// Tells the service manager how the daemon is: systemd's protocol, datagrams to the socket that NOTIFY_SOCKET names.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <cstdint>
#include <string_view>

namespace polygmap::daemon {

class Notifier {
 public:
  Notifier() noexcept = default;
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  // The values of NOTIFY_SOCKET (a path, or @ and a name in the abstract space), WATCHDOG_USEC and WATCHDOG_PID, null
  // where they are not set. False for a socket that cannot be used; without one nothing is told, and that is no error.
  [[nodiscard]] bool open(const char* socket, const char* watchdog_us, const char* watchdog_pid) noexcept;
  // From the environment.
  [[nodiscard]] bool open() noexcept;

  // "READY=1", "STATUS=...", "WATCHDOG=1", one assignment a line. Never blocks; false when it was not taken.
  bool tell(std::string_view state) noexcept;
  [[nodiscard]] bool is_open() const noexcept { return socket_ >= 0; }
  // WATCHDOG=1 must be told at least this often; 0: nobody waits for it.
  [[nodiscard]] std::int64_t watchdog_ns() const noexcept { return watchdog_ns_; }

 private:
  int socket_ = -1;
  sockaddr_un address_{};
  socklen_t address_bytes_ = 0;
  std::int64_t watchdog_ns_ = 0;
};

}  // namespace polygmap::daemon
