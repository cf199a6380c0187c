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

TEST(TomlReader, WrongSyntax_IsToldInPlainWords) {
  const std::pair<const char*, const char*> cases[] = {
      {"a = 1\nb =\n", "2: expected a value after '='."},
      {"a = 1\nb", "2: the file ends where '=' and a value were expected."},
      {"a : 1\n", "1: expected '=' after the key."},
      {"a = 12 Nm\n", "1: expected nothing more after the value."},
      {"a = yes\n", "1: expected a value: a number, true, false or a text in quotes."},
      {"a = True\n", "1: expected true or false."},
      {"a = \"x\n", "1: a text has no closing quote."},
      {"a = 'x", "1: a text has no closing quote."},
      {"a = \"C:\\q\"\n", "1: a text has a backslash that means nothing; two of them are one."},
      {"\n[a\n", "2: a table's name has no closing ']'."},
      {"[a] b\n", "1: expected nothing more after the table's name."},
      {"[]\n", "1: a table has no name."},
      {"// a\n", "1: expected a key, or a table's name in brackets."},
      {"a. = 1\n", "1: expected a key."},
      {"[a]\n[a]\n", "2: 'a' is given twice."},
      {"a = 1\na = 2\n", "2: 'a' is given twice."},
      {"a = 1\na.b = 2\n", "2: a key is both a value and a table."},
      {"a = [1 2]\n", "1: expected ',' or ']' in an array."},
      {"a = [1,,2]\n", "1: an array has a comma too many."},
      {"a = [1,\n", "1: an array has no closing ']'."},
      {"a = {b = 1,}\n", "1: a table in braces has a comma too many."},
      {"a = {b = 1\n", "1: expected a key, ',' or '}' on the same line, in a table in braces."},
      {"a = .5\n", "1: expected a number such as 5, 0.5 or 1e-3."},
      {"a = 05\n", "1: a number must not begin with 0."},
      {"a = 99999999999999999999\n", "1: a number is too large."},
      {"a = 1e999\n", "1: a number is too large."},
      {"a = 1979-13-01\n", "1: this is no date."},
      {"a = 12:99:00\n", "1: this is no time of day."}};
  for (const auto& [text, words] : cases) {
    EXPECT_EQ(complaint(text), std::string("Daemon file \"a.toml\", line ") + words) << text;
  }
}

TEST(TomlReader, WordsThatItsParserNeverSaid_AreNoToml) {
  EXPECT_EQ(detail::plain_words("something else"), "this is no TOML");
  EXPECT_EQ(detail::plain_words("Error while parsing a dream: it ended"), "this is no TOML");
}

TEST(FileError, ControlCharacters_BecomeQuestionMarks) {
  EXPECT_STREQ(FileError("a\nb\x1B[2J \x7F\xC2\x85z \xC3\xA9.").what(), "a?b?[2J ??z \xC3\xA9.");
}

}  // namespace
}  // namespace polygmap::config
