// SPDX-License-Identifier: Apache-2.0
// Parameters and camera from a configuration's text, without the heap. The same text means the same to the reader of
// parameter files (firmware/config), to the bit; what that takes and this does not is refused.
#pragma once

#include <string_view>

#include "algorithms/core/messages/samples.hpp"
#include "firmware/link/config/config_text.hpp"
#include "firmware/params.hpp"

namespace polygmap::link {

// What the text names is changed, all else stays: a table [camera] the camera, its noise and range, every other one the
// parameters, which are the stronger where both speak of noise and range. False: wrong says why, and both may be half
// changed.
[[nodiscard]] bool apply_config(std::string_view text, Params& params, CameraIntrinsics& camera,
                                Sentence& wrong) noexcept;

}  // namespace polygmap::link
