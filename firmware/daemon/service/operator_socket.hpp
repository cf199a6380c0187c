// SPDX-License-Identifier: Apache-2.0
// The operator's commands, a word a datagram on a Unix socket, as `polygmapd --ask` sends them. The daemon's own thread
// listens, and hands one command at a time to control's lane, which calls nothing of the system for it.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

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
  // Some hundred times a second, on the daemon's own thread, while the lanes run. Whoever asked hears what came of it:
  // the state, or that it has no answer; who sends anything else hears what may be asked. A command that control has
  // not taken within half a second is dropped, and its sender told so.
  void serve(ModuleState state, std::int64_t now_ns) noexcept;
  // What was sent before the lanes ran is not theirs.
  void drop_waiting() noexcept;

  [[nodiscard]] bool try_read(OperatorCommand& command) noexcept override;
  void answer(bool obeyed) noexcept override;

 private:
  // Of a command: from the daemon's thread to control's lane and back. Above them the command's number.
  enum Stage : std::uint8_t { kNone, kAsked, kTaken, kObeyed, kRefused };

  [[nodiscard]] bool is_answered(ModuleState state, std::int64_t now_ns) noexcept;
  void listen(ModuleState state, std::int64_t now_ns) noexcept;
  void tell(const std::string_view& text) noexcept;

  std::string path_;
  int fd_ = -1;
  std::atomic<std::uint8_t> stage_{kNone};
  std::atomic<OperatorCommand> command_{};  // written before kAsked is
  std::int64_t asked_ns_ = 0;
  bool was_answered_ = false;  // at the last look: by this one its cycle has published the state
  sockaddr_un asker_{};
  socklen_t asker_bytes_ = 0;
};

inline constexpr std::string_view kRefusedAnswer = "refused: ";  // begins the answer to a command that does nothing

// As a client: sends the word and waits for a second for the answer. False: text says why, without its full stop. What
// nobody has answered by then nobody will do later.
[[nodiscard]] bool try_ask(const std::string& path, const std::string& word, std::string& text);

}  // namespace polygmap::daemon
