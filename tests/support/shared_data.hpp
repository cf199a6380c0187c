// SPDX-License-Identifier: Apache-2.0
// Third-party test inputs. They are no part of the repository: a test that needs them skips where they are absent.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace polygmap::test {

// The file below $POLYGMAP_SHARED_DATA, or below shared/data beside the checkout; empty when it is not there. Use:
//   const auto path = shared_data("depth/tum_fr3_desk.png");
//   if (!path) GTEST_SKIP() << "no shared data";
[[nodiscard]] inline std::optional<std::filesystem::path> shared_data(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (const char* root = std::getenv("POLYGMAP_SHARED_DATA"); root != nullptr) {
    const fs::path path = fs::path(root) / file;
    return fs::exists(path, ignored) ? std::optional(path) : std::nullopt;
  }
  // The checkout is the directory above tests/, whose place this header's own path tells.
  const fs::path checkout = fs::absolute(fs::path(__FILE__)).parent_path().parent_path().parent_path();
  const fs::path path = checkout.parent_path() / "shared" / "data" / file;
  return fs::exists(path, ignored) ? std::optional(path) : std::nullopt;
}

}  // namespace polygmap::test
