// SPDX-License-Identifier: Apache-2.0
// report.html: one self-contained page about one run or two.
#pragma once

#include <string>
#include <vector>

namespace polygmap::sim {

// Reads the recordings and writes DIR/report.html, in a directory that exists. Empty, or one sentence about the file
// that cannot be read. Throws config::FileError for what cannot be written.
[[nodiscard]] std::string write_report(const std::vector<std::string>& recordings, const std::string& directory);

}  // namespace polygmap::sim
