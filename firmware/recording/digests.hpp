// SPDX-License-Identifier: Apache-2.0
// A recording's outputs, in a few lines of text: who records a run once more sees by them where it went another way.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/recording/mcap/mcap_reader.hpp"

namespace polygmap::recording {

// FNV-1a of all that a row of the schedule left behind in one second, bit by bit.
struct Digest {
  std::int64_t second = 0;  // since the first frame
  std::string_view stage;   // the row's task
  std::uint64_t hash = 0;
};
struct RecordingDigests {
  std::vector<Digest> digests;  // by second, then in the schedule's order; of the stages that left anything
  std::string complaint;        // of a file that is none, or is damaged
  bool is_finished = false;
};
[[nodiscard]] RecordingDigests digests_of(const std::string& path, mcap::McapReader::Decompress decompress = {});

// "12 gait 0123456789abcdef", line by line.
[[nodiscard]] std::string text_of(const RecordingDigests& digests);

}  // namespace polygmap::recording
