// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>
#include <string>

namespace polygmap::daemon {

// An errno in English; of one that the C library does not know, its number.
[[nodiscard]] inline std::string error_text(int error_number) {
  const char* const text = ::strerrordesc_np(error_number);
  return text != nullptr ? text : "error " + std::to_string(error_number);
}

}  // namespace polygmap::daemon
