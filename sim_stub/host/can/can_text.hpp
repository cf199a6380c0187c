// SPDX-License-Identifier: Apache-2.0
// CAN frames of a bus file's drives, for people and for tools: one frame as JSON, all frames as a DBC.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "firmware/config/bus_file.hpp"
#include "hal/codec/can_frame.hpp"

namespace polygmap::sim {

// "001#7FFF8007FF0A3800", identifier and up to 8 bytes in hexadecimal digits; nothing when it is none.
[[nodiscard]] std::optional<hal::CanFrame> read_frame(const std::string& text);

// What a frame says by each drive, or the feet's board, that has its identifier.
struct FrameReading {
  std::string json;                 // a line break at its end
  std::vector<std::string> doubts;  // a sentence for each of those that has the identifier but no such frame
};
// on: of one bus alone, empty: of all. Throws config::FileError, one sentence, for a frame that says nothing by any.
[[nodiscard]] FrameReading frame_reading(const config::BusFile& bus, const std::string& on, const hal::CanFrame& frame);

// Motorola byte order. on: as above. Throws config::FileError where one identifier means two frames.
[[nodiscard]] std::string dbc_text(const config::BusFile& bus, const std::string& on);

}  // namespace polygmap::sim
