// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/digests.hpp"

#include <array>
#include <cstdio>
#include <map>
#include <memory>
#include <utility>

#include "firmware/recording/recording_file.hpp"

namespace polygmap::recording {

RecordingDigests digests_of(const std::string& path, mcap::McapReader::Decompress decompress) {
  RecordingDigests result;
  RecordingFile file(std::move(decompress));
  const auto record = std::make_unique<Record>();
  std::map<std::pair<std::int64_t, std::size_t>, std::uint64_t> hashes;  // by second and row
  std::int64_t first_ns = -1;
  RecordingFile::Found found = file.open(path) ? file.read(*record) : RecordingFile::Found::kBad;
  for (; found == RecordingFile::Found::kRecord; found = file.read(*record)) {
    if (record->kind != RecordKind::kRow || record->row.outputs.at_end()) continue;
    const RowCall& row = record->row;
    if (first_ns < 0) first_ns = row.cycle_ns;
    const std::pair key{(row.cycle_ns - first_ns) / kNsPerS, row.row};
    std::uint64_t& hash = hashes.try_emplace(key, 0xcbf29ce484222325U).first->second;
    for (const std::byte byte : row.outputs.rest()) hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3U;
  }
  for (const auto& [key, hash] : hashes) {
    result.digests.push_back({key.first, kTasks[key.second].row.task, hash});
  }
  result.complaint = file.complaint().empty() ? file.damage() : file.complaint();
  result.is_finished = found == RecordingFile::Found::kEnd;
  return result;
}

std::string text_of(const RecordingDigests& digests) {
  std::string text;
  for (const Digest& digest : digests.digests) {
    std::array<char, 80> line{};
    std::snprintf(line.data(), line.size(), "%lld %.*s %016llx\n", static_cast<long long>(digest.second),
                  static_cast<int>(digest.stage.size()), digest.stage.data(),
                  static_cast<unsigned long long>(digest.hash));
    text += line.data();
  }
  return text;
}

}  // namespace polygmap::recording
