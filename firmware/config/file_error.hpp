// SPDX-License-Identifier: Apache-2.0
// What a user is told about a file that cannot be used.
#pragma once

#include <stdexcept>

namespace polygmap::config {

// One sentence, with the file's name in it.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace polygmap::config
