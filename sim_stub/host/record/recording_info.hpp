// SPDX-License-Identifier: Apache-2.0
// What is in an MCAP file, and the same file made small.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace polygmap::sim {

struct TopicInfo {
  std::string topic, schema;
  std::uint64_t messages = 0, bytes = 0;
};
struct RecordingInfo {
  std::string complaint;  // of a file that is none, or that is damaged from a place on; what came before is told
  bool is_finished = false;
  double first_s = 0.0, last_s = 0.0;
  std::uint64_t bytes = 0;  // of the file
  std::vector<TopicInfo> topics;
  std::string parameters_hash;  // empty: no recording of this module's
  std::string verdict;          // empty: nobody judged it
};
[[nodiscard]] RecordingInfo info_of(const std::string& path);
[[nodiscard]] std::string text_of(const RecordingInfo& info);
[[nodiscard]] std::string json_of(const RecordingInfo& info);

// Writes the same messages in zstd chunks, and then puts that file in the place of the old one, or at `to`. Empty, or
// one sentence; then the old file is as it was.
[[nodiscard]] std::string pack_recording(const std::string& path, const std::string& to);

}  // namespace polygmap::sim
