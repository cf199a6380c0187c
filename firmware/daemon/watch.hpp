// SPDX-License-Identifier: Apache-2.0
// Looks on at a module that writes a mailbox, from a process of its own.
#pragma once

#include <string>

#include "firmware/daemon/service/stop_signals.hpp"

namespace polygmap::daemon {

// Shows what the mailbox of that name says until a signal comes, in place on a terminal, else a line a second, or an
// object a second. Waits for a writer, says when one has gone, and goes on with the next. Returns the exit code: 0, or
// kDevice with a sentence on the standard error where that mailbox cannot be read.
[[nodiscard]] int run_watch(const std::string& mailbox, bool json, const StopSignals& signals);

}  // namespace polygmap::daemon
