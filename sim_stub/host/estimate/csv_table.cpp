// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/estimate/csv_table.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "firmware/config/file_error.hpp"

namespace polygmap::sim {
namespace {

constexpr std::size_t kMostShown = 24;                            // of a cell, in a sentence
constexpr std::size_t kMostFile_bytes = std::size_t{512} << 20U;  // of as many rows with 900 characters each
constexpr std::size_t kMostColumns = 1000;
constexpr std::size_t kMostRows = 600'000;  // ten minutes at 1 kHz: what is made of a row takes 2 KB

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

// The line has as many.
std::string_view nth_cell(std::string_view line, std::size_t n) {
  for (; n > 0; --n) line.remove_prefix(line.find(',') + 1);
  return trimmed(line.substr(0, line.find(',')));
}

std::string read_text(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::exists(path, none)) throw config::FileError("There is no file \"" + path + "\".");
  if (std::filesystem::is_directory(path, none)) throw config::FileError("\"" + path + "\" is a folder, not a file.");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string text;
  for (std::array<char, 1 << 16> block{}; file.read(block.data(), block.size()) || file.gcount() > 0;) {
    text.append(block.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > kMostFile_bytes) {
      throw config::FileError("\"" + path + "\" has more than " + std::to_string(kMostFile_bytes >> 20U) +
                              " MiB, more than a log that is read.");
    }
  }
  if (!file.is_open() || file.bad()) config::fail_to_read("the log", path);
  if (text.empty()) throw config::FileError("\"" + path + "\" is empty.");
  return text;
}

// As it may stand in a sentence on one line.
std::string shown(std::string_view text) {
  std::string clean(text.substr(0, kMostShown));
  std::replace_if(
      clean.begin(), clean.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return "\"" + clean + (text.size() > kMostShown ? "...\"" : "\"");
}

}  // namespace

CsvTable::CsvTable(std::string path, std::string_view landmark) : path_(std::move(path)), text_(read_text(path_)) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  std::string_view rest = text_;
  if (rest.substr(0, kByteOrderMark.size()) == kByteOrderMark) rest.remove_prefix(kByteOrderMark.size());
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (trimmed(line).empty() && trimmed(rest).empty() && number > 1) break;  // the file's end
    if (number == 1 && line.find(landmark) == std::string_view::npos) fail_as_no_log(line, landmark);
    const auto cells = static_cast<std::size_t>(1 + std::ranges::count(line, ','));
    if (cells > kMostColumns) {
      throw config::FileError("\"" + path_ + "\" line " + std::to_string(number) + ": has more than " +
                              std::to_string(kMostColumns) + " columns.");
    }
    if (number == 1) {
      read_header(line, landmark);
      continue;
    }
    if (lines_.size() == kMostRows) {
      throw config::FileError("\"" + path_ + "\" has more than " + std::to_string(kMostRows) +
                              " rows, more than a log that is read.");
    }
    lines_.push_back({number, line});
    if (cells != header_.size()) {
      fail(lines_.size() - 1, "has " + std::to_string(cells) + " values, but the header names " +
                                  std::to_string(header_.size()) + " columns");
    }
  }
  if (lines_.empty()) throw config::FileError("\"" + path_ + "\" has no rows of data.");
}

// A picture, a program or a page of text: what its cells lack says nothing to whoever gave it.
void CsvTable::fail_as_no_log(std::string_view line, std::string_view landmark) const {
  throw config::FileError("\"" + path_ +
                          "\" is no log: line 1 must name the columns, with commas between them, but in " +
                          shown(trimmed(line)) + " the column \"" + std::string(landmark) + "\" is missing.");
}

void CsvTable::read_header(std::string_view line, std::string_view landmark) {
  for (std::size_t i = 0; i <= static_cast<std::size_t>(std::ranges::count(line, ',')); ++i) {
    header_.push_back(nth_cell(line, i));
  }
  refuse_other_dialects(line);
  if (find(landmark) == header_.size()) fail_as_no_log(line, landmark);
  for (auto name = header_.begin(); name != header_.end(); ++name) {
    if (!name->empty() && std::find(name + 1, header_.end(), *name) != header_.end()) {
      throw config::FileError("\"" + path_ + "\" line 1: the column " + shown(*name) + " is named twice.");
    }
  }
}

void CsvTable::refuse_other_dialects(std::string_view line) const {
  for (const auto& [separator, name] : {std::pair{';', "semicolons"}, std::pair{'\t', "tabs"}}) {
    if (trimmed(line).find(separator) != std::string_view::npos) {
      throw config::FileError("\"" + path_ + "\" line 1: the columns are separated by " + name + ", not by commas.");
    }
  }
  if (trimmed(line).find('\r') != std::string_view::npos) {
    throw config::FileError("\"" + path_ + "\": its lines end in CR alone, not in LF or CR LF.");
  }
  if (line.find('"') != std::string_view::npos) {
    throw config::FileError("\"" + path_ + "\" line 1: the columns' names stand in quotes, which are not read.");
  }
}

bool CsvTable::has_any(std::string_view prefix) const noexcept {
  return std::any_of(header_.begin(), header_.end(),
                     [prefix](std::string_view name) { return name.substr(0, prefix.size()) == prefix; });
}

std::size_t CsvTable::find(std::string_view column) const noexcept {
  return static_cast<std::size_t>(std::find(header_.begin(), header_.end(), column) - header_.begin());
}

std::size_t CsvTable::column(std::string_view name) const {
  const std::size_t index = find(name);
  if (index == header_.size()) {
    throw config::FileError("\"" + path_ + "\" line 1: the column \"" + std::string(name) + "\" is missing.");
  }
  return index;
}

double CsvTable::number(std::size_t row, std::size_t column, double limit) const {
  const std::string_view cell = nth_cell(lines_[row].text, column);
  const std::string name(header_[column]);
  double value = 0.0;
  const char* const begin = cell.data() + (cell.size() > 1 && cell[0] == '+' && cell[1] != '-' ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, cell.data() + cell.size(), value);
  if (cell.empty() || end != cell.data() + cell.size() || error == std::errc::invalid_argument) {
    fail(row, name + " is " + (cell.empty() ? "empty" : shown(cell)) + ", not a number");
  }
  if (error == std::errc::result_out_of_range) fail(row, name + " is " + shown(cell) + ", which no double can hold");
  if (!std::isfinite(value)) fail(row, name + " is " + shown(cell) + ", not a finite number");
  if (!(std::abs(value) <= limit)) {
    std::ostringstream sentence;
    sentence << name << " is " << value << ", beyond what can be true (" << limit
             << "): is it in the unit that the column is named after?";
    fail(row, sentence.str());
  }
  return value;
}

void CsvTable::fail(std::size_t row, const std::string& sentence) const {
  throw config::FileError("\"" + path_ + "\" line " + std::to_string(lines_[row].number) + ": " + sentence +
                          (sentence.ends_with('?') ? "" : "."));
}

}  // namespace polygmap::sim
