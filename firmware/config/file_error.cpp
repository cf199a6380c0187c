// SPDX-License-Identifier: Apache-2.0
#include "firmware/config/file_error.hpp"

#include <cctype>
#include <cerrno>
#include <system_error>

namespace polygmap::config {

std::string FileName::text() const {
  if (kind.empty()) return path;
  std::string text = kind + " file \"" + path + "\"";
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}
void FileName::fail(std::size_t line, const std::string& what) const {
  throw FileError(text() + (kind.empty() ? "" : ", line " + std::to_string(line)) + ": " + what + ".");
}

void fail_to_read(const std::string& what, const std::string& path) {
  const int why = errno;
  throw FileError("Cannot read " + what + " \"" + path + "\"" +
                  (why == 0 ? "" : ": " + std::generic_category().message(why)) + ".");
}

}  // namespace polygmap::config
