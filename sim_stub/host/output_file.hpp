// SPDX-License-Identifier: Apache-2.0
// Files that a run leaves: whole or not at all.
#pragma once

#include <string>
#include <string_view>

namespace polygmap::sim {

// Writes beside the path and renames: whoever reads the path finds the old file or the whole new one. A path that is no
// regular file, as /dev/stdout, is written to directly. Throws config::FileError.
void write_output(const std::string& path, std::string_view content);

// What a former run left at path must not be taken for this one's: a file goes, one behind a link is emptied, a device
// stays. Nothing there is fine. Throws config::FileError.
void remove_output(const std::string& path);

}  // namespace polygmap::sim
