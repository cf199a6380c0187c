// SPDX-License-Identifier: Apache-2.0
// CAN frames as text: what `candump -L` writes and canplayer reads.
#pragma once

#include <fstream>
#include <string>

#include "hal/codec/can_frame.hpp"

namespace polygmap::sim {

// "001#7FFF8007FF0A3800"
[[nodiscard]] std::string frame_text(const hal::CanFrame& frame);
// "(0000000001.002269) can0 001#7FFF8007FF0A3800"
[[nodiscard]] std::string candump_line(const hal::CanFrame& frame, const std::string& bus);

class CandumpLog {
 public:
  // Throws config::FileError when it cannot write there.
  explicit CandumpLog(const std::string& path);
  void write(const hal::CanFrame& frame, const std::string& bus) { file_ << candump_line(frame, bus) << '\n'; }
  // Throws config::FileError when not all of it could be written.
  void close();

 private:
  std::string path_;
  std::ofstream file_;
};

}  // namespace polygmap::sim
