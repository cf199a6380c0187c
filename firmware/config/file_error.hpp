// SPDX-License-Identifier: Apache-2.0
// What a user is told about a file that cannot be used.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace polygmap::config {

// A sentence goes to a terminal and a journal, and what it quotes is a stranger's: each control character, of ASCII or
// of Unicode's second block in UTF-8, becomes a question mark.
[[nodiscard]] inline std::string without_controls(std::string text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool second_block = byte == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0;
    if (second_block) text.erase(i, 1);
    if (second_block || byte < 0x20 || byte == 0x7F) text[i] = '?';
  }
  return text;
}

// One sentence, with the file's name in it.
struct FileError : std::runtime_error {
  explicit FileError(std::string sentence) : std::runtime_error(without_controls(std::move(sentence))) {}
};

// What a file is called in sentences about it: "bus", "/etc/polygmap/legs.toml". Without a kind it is no file but an
// option of the command line, path all of it.
struct FileName {
  std::string kind;
  std::string path;

  // As: Bus file "legs.toml"
  [[nodiscard]] std::string text() const;
  [[noreturn]] void fail(std::size_t line, const std::string& what) const;
};

// Of a file that could not be opened or read; what: "the bus file". Throws FileError with errno's reason, where there
// is one: who reads sets errno to 0 before, since a read that ends short leaves an earlier call's.
[[noreturn]] void fail_to_read(const std::string& what, const std::string& path);

}  // namespace polygmap::config
