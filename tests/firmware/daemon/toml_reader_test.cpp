// SPDX-License-Identifier: Apache-2.0
// What toml++ by itself would read past its end, end the program for, or refuse without a line.
#include "firmware/config/toml_reader.hpp"

#include <gtest/gtest.h>

namespace polygmap::config {
namespace {

std::string complaint(std::string_view text) {
  try {
    (void)parse_toml({"daemon", "a.toml"}, text);
  } catch (const FileError& error) {
    return error.what();
  }
  return {};
}

TEST(TomlReader, NoText_IsToldWithItsLine) {
  const std::string no_text = "Daemon file \"a.toml\", line 2: it is no text, or not in UTF-8, and TOML is expected.";
  for (const char* bytes : {"\xFF", "\xC3", "\xC0\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xE2\x82"}) {
    EXPECT_EQ(complaint("a = 1\n# " + std::string(bytes)), no_text);
  }
  const std::string control = "Daemon file \"a.toml\", line 3: it has a control character, and TOML is expected.";
  for (const std::string& bytes :
       {std::string(1, '\0'), std::string("\x1B[2J"), std::string("\x7F"), std::string("\r")}) {
    EXPECT_EQ(complaint("a = 1\n\nb = \"" + bytes + "\""), control);
  }
}

TEST(TomlReader, OtherLettersAndLineBreaks_AreTaken) {
  EXPECT_EQ(complaint("\xEF\xBB\xBF# m\xC3\xBCller \xF0\x9F\xA4\x96\r\na = \"\xC3\xA9\"\r\n\tb = 1\r\n"), "");
  EXPECT_EQ(complaint(""), "");
}

TEST(TomlReader, WhatItsParserDeclaresImpossible_IsOneSentenceWithALine) {
  for (const char* text :
       {"a = \xC3\xA9", "[=]", "[\xC3\xA9]", "a\xC3\xA9 = 1", "[[]]", "a = \"\\\xC3\xA9\"", "a =", "[a", "\"a\nb\""}) {
    const std::string sentence = complaint(text);
    EXPECT_EQ(sentence.find("Daemon file \"a.toml\", line "), 0U) << text << ": " << sentence;
    EXPECT_TRUE(sentence.ends_with('.')) << sentence;
  }
}

TEST(FileError, ControlCharacters_BecomeQuestionMarks) {
  EXPECT_STREQ(FileError("a\nb\x1B[2J \x7F\xC2\x85z \xC3\xA9.").what(), "a?b?[2J ??z \xC3\xA9.");
}

}  // namespace
}  // namespace polygmap::config
