// SPDX-License-Identifier: Apache-2.0
// recorded_frames RECORDING BUS_FILE LOG: the commands of the daemon's recording, encoded here, against the frames that
// the drives got (a log as candump -L writes it). Of each drive the n-th frame is the n-th command that the bus took,
// or a frame that enters motor mode in its place. Prints "FRAMES frames= frames_differ= special= missing= cycles=
// pictures= lost=".
#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "firmware/config/bus_file.hpp"
#include "firmware/recording/recording_file.hpp"

namespace polygmap::vm {
namespace {

using Frames = std::array<std::vector<hal::MitBytes>, kJointCount>;

int refuse(const std::string& why) {
  std::fprintf(stderr, "recorded_frames: %s\n", why.c_str());
  return 2;
}

// "(0.002000) vcan0 001#0102030405060708"; the guest's vcan0 is can0.
bool read_log(const std::string& path, const config::BusFile& file, Frames& frames) {
  std::ifstream log(path);
  std::string time, bus, text;
  while (log >> time >> bus >> text) {
    const std::size_t hash = text.find('#');
    if (hash == std::string::npos || text.size() != hash + 17) return false;
    const unsigned long id = std::stoul(text.substr(0, hash), nullptr, 16);
    hal::MitBytes bytes{};
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<std::uint8_t>(std::stoul(text.substr(hash + 1 + 2 * i, 2), nullptr, 16));
    }
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const hal::CanDrive& drive = file.table.drives[n];
      if ("v" + file.buses[drive.bus] == bus && drive.id == id) frames[n].push_back(bytes);
    }
  }
  return log.eof();
}

int compare(const std::string& path, const config::BusFile& file, const Frames& seen) {
  recording::RecordingFile recording;
  if (!recording.open(path)) return refuse(recording.complaint());
  std::array<std::size_t, kJointCount> next{};
  std::size_t frames = 0, differ = 0, special = 0, missing = 0, cycles = 0, pictures = 0;
  std::uint32_t last = 0, lost = 0;  // by the pictures' numbers, from the first one on
  const auto memory = std::make_unique<recording::Record>();
  recording::Record& record = *memory;
  bool ended = false;
  while (!ended && recording.read(record) == recording::RecordingFile::Found::kRecord) {
    ended = record.kind == recording::RecordKind::kEnd;
    if (record.kind != recording::RecordKind::kRow) continue;
    for (const recording::PortCall& call : record.row.calls) {
      if (call.kind == recording::CallKind::kAcquire && call.gave) {
        lost += pictures > 0 ? call.frame.sequence - last - 1 : 0;
        last = call.frame.sequence;
        ++pictures;
      }
      if (call.kind != recording::CallKind::kWriteJoints) continue;
      ++cycles;
      for (std::size_t n = 0; n < kJointCount; ++n) {
        if (!call.taken.contains(n)) continue;
        if (next[n] == seen[n].size()) {
          ++missing;
          continue;
        }
        const hal::MitBytes& got = seen[n][next[n]++];
        hal::MitBytes meant{};
        std::uint32_t clamped = 0;
        (void)hal::try_encode_command(call.command.joints[n], file.table.drives[n].ranges, meant, clamped);
        const bool is_special = got == hal::special_frame(hal::MitSpecial::kEnter) ||
                                got == hal::special_frame(hal::MitSpecial::kClearErrors);
        ++frames;
        special += is_special ? 1 : 0;
        differ += !is_special && got != meant ? 1 : 0;
      }
    }
  }
  for (std::size_t n = 0; n < kJointCount; ++n) differ += seen[n].size() - next[n];  // that no command was
  std::printf("FRAMES frames=%zu frames_differ=%zu special=%zu missing=%zu cycles=%zu pictures=%zu lost=%u\n", frames,
              differ, special, missing, cycles, pictures, lost);
  if (!ended) return refuse(recording.complaint().empty() ? "the recording is unfinished" : recording.complaint());
  return frames > 0 && differ == 0 && missing == 0 ? 0 : 1;
}

}  // namespace
}  // namespace polygmap::vm

int main(int argc, char** argv) {
  using namespace polygmap;
  if (argc != 4) return vm::refuse("usage: recorded_frames RECORDING BUS_FILE LOG");
  const config::BusFile file = config::read_bus(argv[2]);
  vm::Frames frames;
  if (!vm::read_log(argv[3], file, frames)) return vm::refuse(std::string(argv[3]) + " is no log of candump -L");
  return vm::compare(argv[1], file, frames);
}
