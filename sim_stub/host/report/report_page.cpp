// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/report/report_page.hpp"

#include <string_view>

#include "sim_stub/host/output_file.hpp"
#include "sim_stub/host/report/report_run.hpp"

// The page's bundle as it lies in the tree.
asm(".section .rodata\n"
    ".global polygmap_report_page\n"
    ".global polygmap_report_page_end\n"
    "polygmap_report_page:\n"
    ".incbin \"" POLYGMAP_REPORT_PAGE
    "\"\n"
    "polygmap_report_page_end:\n"
    ".previous\n");
extern "C" const char polygmap_report_page[], polygmap_report_page_end[];  // NOLINT: arrays of the assembler's

namespace polygmap::sim {
namespace {

// JSON that may stand in a page: no tag can begin in it.
std::string page_text(const ReportJson& data) {
  const std::string json = data.dump(-1, ' ', false, ReportJson::error_handler_t::replace);
  std::string text;
  text.reserve(json.size());
  for (const char c : json) c == '<' ? text += "\\u003c" : text += c;
  return text;
}

}  // namespace

void write_page(const std::string& path, const ReportJson& data) {
  constexpr std::string_view kPlace = "@POLYGMAP_DATA@";
  const std::string_view page(polygmap_report_page,
                              static_cast<std::size_t>(polygmap_report_page_end - polygmap_report_page));
  const std::size_t at = page.find(kPlace);
  write_output(path, std::string(page.substr(0, at)) + page_text(data) + std::string(page.substr(at + kPlace.size())));
}

ReportedFiles write_report(const std::vector<std::string>& recordings, const std::string& directory) {
  ReportJson data{{"format", "polygmap-report"}, {"version", 1}, {"runs", ReportJson::array()}};
  ReportedFiles files;
  for (const std::string& path : recordings) {
    ReportRun run(path);
    files.unreadable = run.read();
    if (!files.unreadable.empty()) return files;
    if (files.unsound.empty() && !run.unsound().empty()) files.unsound = "\"" + path + "\": " + run.unsound();
    try {
      data["runs"].push_back(run.json());
    } catch (const ReportJson::exception&) {  // of another program's making
      files.unreadable = "\"" + path + "\" has a verdict that is no summary.json.";
      return files;
    }
  }
  write_page(directory + "/report.html", data);
  return files;
}

}  // namespace polygmap::sim
