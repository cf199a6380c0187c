// SPDX-License-Identifier: Apache-2.0
// Feeds a recording to the module and compares what comes out, bit by bit.
#pragma once

#include <cstdint>
#include <string>

#include "firmware/recording/mcap/mcap_reader.hpp"

namespace polygmap::recording {

enum class ReplayVerdict : std::uint8_t { kSame = 0, kDiffers = 1, kUnreadable = 2, kUnfinished = 3 };

struct ReplayResult {
  ReplayVerdict verdict = ReplayVerdict::kUnreadable;
  std::uint64_t ticks = 0;   // cycles replayed
  std::uint64_t differ = 0;  // of those
  // The first difference: tick, stage, field, recorded and computed value; or a topic that is not what the records say.
  // Empty when there is none.
  std::string difference;
  std::string complaint;  // of an unreadable file: file, byte and what is wrong there
  std::string ends;       // of an unfinished one: how
  // There are no pictures in it: what perception had found was believed, and all else replayed.
  bool without_perception = false;
};

// Goes on after a difference, with the recorded inputs, to the end. Throws nothing but for memory.
[[nodiscard]] ReplayResult replay(const std::string& path, mcap::McapReader::Decompress decompress = {});

// What a program prints of it, line by line; the last one of a readable recording is "replay: N ticks, M differ".
[[nodiscard]] std::string text_of(const ReplayResult& result);

}  // namespace polygmap::recording
