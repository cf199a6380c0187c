// SPDX-License-Identifier: Apache-2.0
// Self-contained pages: report.html about one run or two, and those of other commands with their own data.
#pragma once

#include <string>
#include <vector>

#include "sim_stub/host/report/report_blocks.hpp"

namespace polygmap::sim {

// Each empty, or one sentence about the first such file.
struct ReportedFiles {
  std::string unreadable;  // no page was written
  std::string unsound;     // cut off or damaged: the page has what there is, and says so
};
// Reads the recordings and writes DIR/report.html, in a directory that exists. Throws config::FileError for what cannot
// be written.
[[nodiscard]] ReportedFiles write_report(const std::vector<std::string>& recordings, const std::string& directory);

// Writes the page with these data in it (page/DATA.md), whose first key, "format", says what it shows. Throws
// config::FileError for what cannot be written.
void write_page(const std::string& path, const ReportJson& data);

}  // namespace polygmap::sim
