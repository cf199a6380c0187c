// SPDX-License-Identifier: Apache-2.0
// The beginning of a recording: all that a replay sets up before it lives the first record (format.hpp).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware/params.hpp"
#include "firmware/recording/stream/bytes.hpp"

namespace polygmap::recording {

struct RecordingHeader {
  Params params;
  CameraIntrinsics camera;
  std::vector<std::uint8_t> rows;  // the file's rows as places in this module's schedule
};

void put_recording_header(ByteWriter& out, const Params& params, const CameraIntrinsics& camera);
// Empty, or what is wrong with it.
[[nodiscard]] std::string read_recording_header(std::span<const std::byte> bytes, RecordingHeader& header);

}  // namespace polygmap::recording
