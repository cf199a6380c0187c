// SPDX-License-Identifier: Apache-2.0
// Numbers from a comma-separated file with a header line. Strict: what is not a finite number is an error that names
// file and line. (Debian's libcsv splits cells, which is the little of it, and knows no lines.)
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace polygmap::sim {

class CsvTable {
 public:
  // Reads the whole file; a file without a column called landmark is taken for something else than a table. Throws
  // config::FileError: absent, a folder, unreadable, empty, no such table, not separated by commas, names in quotes, a
  // column named twice, a row of another length, too many rows.
  CsvTable(std::string path, std::string_view landmark);

  [[nodiscard]] std::size_t rows() const noexcept { return lines_.size(); }
  // Does any column's name begin so?
  [[nodiscard]] bool has_any(std::string_view prefix) const noexcept;
  // Index of a column. Throws config::FileError when it is missing.
  [[nodiscard]] std::size_t column(std::string_view name) const;
  // Throws config::FileError when the cell is no finite number within +-limit.
  [[nodiscard]] double number(std::size_t row, std::size_t column, double limit) const;
  // Throws config::FileError: "FILE line N: sentence.", or as a question where the sentence is one.
  [[noreturn]] void fail(std::size_t row, const std::string& sentence) const;

 private:
  struct Line {
    std::size_t number;  // in the file, from 1
    std::string_view text;
  };
  void read_header(std::string_view line, std::string_view landmark);
  [[noreturn]] void fail_as_no_log(std::string_view line, std::string_view landmark) const;
  void refuse_other_dialects(std::string_view header) const;
  [[nodiscard]] std::size_t find(std::string_view column) const noexcept;

  std::string path_, text_;
  std::vector<std::string_view> header_;
  std::vector<Line> lines_;
};

}  // namespace polygmap::sim
