// SPDX-License-Identifier: Apache-2.0
// The TOML reader's words, where it does not say to people what is wrong.
#pragma once

#include <string>
#include <string_view>

namespace polygmap::config {

// Without a full stop. A picture or a program given for a text file is told by its bytes alone.
[[nodiscard]] inline std::string toml_words(std::string_view description) {
  if (description.find("utf-8") == std::string_view::npos) return std::string(description);
  return "it is no text, or not in UTF-8, and TOML is expected";
}

}  // namespace polygmap::config
