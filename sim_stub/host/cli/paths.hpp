// SPDX-License-Identifier: Apache-2.0
// Whether two names are one file.
#pragma once

#include <filesystem>
#include <string>

namespace polygmap::sim {

// The file's one name, whether it exists yet or not.
[[nodiscard]] inline std::string one_name(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  if (error) return path;
  const fs::path canonical = fs::weakly_canonical(absolute, error);
  return (error ? absolute.lexically_normal() : canonical).string();
}

}  // namespace polygmap::sim
