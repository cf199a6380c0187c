// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/bus/candump_log.hpp"

#include <array>
#include <cstdio>

#include "algorithms/core/time.hpp"
#include "firmware/config/file_error.hpp"

namespace polygmap::sim {

std::string frame_text(const hal::CanFrame& frame) {
  std::array<char, 16> buffer{};
  std::snprintf(buffer.data(), buffer.size(), frame.extended ? "%08X#" : "%03X#", frame.id);
  std::string text = buffer.data();
  for (std::size_t i = 0; i < frame.length && i < frame.data.size(); ++i) {
    std::snprintf(buffer.data(), buffer.size(), "%02X", frame.data[i]);
    text += buffer.data();
  }
  return text;
}

std::string candump_line(const hal::CanFrame& frame, const std::string& bus) {
  std::array<char, 40> stamp{};
  std::snprintf(stamp.data(), stamp.size(), "(%010lld.%06lld) ", static_cast<long long>(frame.stamp_ns / kNsPerS),
                static_cast<long long>(frame.stamp_ns % kNsPerS / 1000));
  return stamp.data() + bus + " " + frame_text(frame);
}

CandumpLog::CandumpLog(const std::string& path) : path_(path), file_(path) {
  if (!file_) throw config::FileError("Cannot write \"" + path + "\".");
}

void CandumpLog::close() {
  file_.close();
  if (!file_) throw config::FileError("Cannot write all of \"" + path_ + "\".");
}

}  // namespace polygmap::sim
