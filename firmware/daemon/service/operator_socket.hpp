// SPDX-License-Identifier: Apache-2.0
// The operator's commands on a Unix socket, a datagram each, as `polygmapd --ask` sends them: the word and the
// CLOCK_MONOTONIC time of its sending, "start 81234567890123" in ns. The daemon's own thread listens, and hands one
// command at a time to control's lane, which calls nothing of the system for it.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

#include "firmware/operator_answer_text.hpp"
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
  // the state, or why not; who sends anything else hears what may be asked. A command that control has not taken within
  // half a second of its sending is dropped, and its sender told so: by then he may have gone, or changed his mind.
  void serve(ModuleState state, std::int64_t now_ns) noexcept;
  // What was sent before the lanes ran is not theirs.
  void drop_waiting() noexcept;

  [[nodiscard]] bool try_read(OperatorRequest& request) noexcept override;
  void answer(const OperatorAnswer& answer) noexcept override;

 private:
  // Of a command: from the daemon's thread to control's lane and back.
  enum Stage : std::uint8_t { kNone, kAsked, kTaken, kAnswered };

  [[nodiscard]] bool is_answered(ModuleState state, std::int64_t now_ns) noexcept;
  void listen(ModuleState state, std::int64_t now_ns) noexcept;
  void tell(const std::string_view& text) noexcept;

  std::string path_;
  int fd_ = -1;
  std::atomic<std::uint8_t> stage_{kNone};
  OperatorRequest request_;  // written before kAsked is
  OperatorAnswer answer_;    // written before kAnswered is
  std::int64_t sent_ns_ = 0;
  bool was_answered_ = false;  // at the last look: by this one its cycle has published the state
  sockaddr_un asker_{};
  socklen_t asker_bytes_ = 0;
};

// As a client: sends the word, and when that was, and waits for a second for the answer. False: text says why, without
// its full stop. What nobody has answered by then nobody will do later.
[[nodiscard]] bool try_ask(const std::string& path, const std::string& word, std::string& text);

}  // namespace polygmap::daemon
