// SPDX-License-Identifier: Apache-2.0
// The operator's commands, a word a datagram on a Unix socket, as `polygmapd --ask` sends them. The daemon's own thread
// listens, and hands one command at a time to control's lane, which calls nothing of the system for it.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <atomic>
#include <cstdint>
#include <string>

#include "firmware/supervisor.hpp"
#include "hal/ports/operator_input.hpp"

namespace polygmap::daemon {

class OperatorSocket final : public hal::OperatorInput {
 public:
  OperatorSocket() = default;
  OperatorSocket(const OperatorSocket&) = delete;
  OperatorSocket& operator=(const OperatorSocket&) = delete;
  ~OperatorSocket();

  // Empty, or why nobody can be listened to: one sentence without its full stop. What lies at the path and is no socket
  // stays there.
  [[nodiscard]] std::string open(const std::string& path);
  // Some hundred times a second, on the daemon's own thread. Whoever asked hears the state that came of it, and who
  // sends anything else what may be asked.
  void serve(ModuleState state) noexcept;

  [[nodiscard]] bool try_read(OperatorCommand& command) noexcept override;

 private:
  void answer(const char* text) noexcept;

  std::string path_;
  int fd_ = -1;
  std::atomic<std::uint8_t> asked_{0};  // 1 + the command that control has not taken; 0: none
  bool owes_state_ = false;             // to who asked last
  sockaddr_un asker_{};
  socklen_t asker_bytes_ = 0;
};

// As a client: sends the word and waits for a second for the answer. False: text says why, without its full stop.
[[nodiscard]] bool try_ask(const std::string& path, const std::string& word, std::string& text);

}  // namespace polygmap::daemon
