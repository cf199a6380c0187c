// SPDX-License-Identifier: Apache-2.0
// Texts that a reader of files may meet: good ones with pieces changed, cut, doubled, moved, or replaced by what has
// troubled readers before. The same seed gives the same texts.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace polygmap::test {

class TextMutator {
 public:
  explicit TextMutator(unsigned seed) : random_(seed) {}

  [[nodiscard]] std::string mutated(std::string_view good) {
    std::string text(good);
    for (std::uint64_t changes = 1 + random_() % 3; changes > 0; --changes) change(text);
    return text;
  }
  [[nodiscard]] std::size_t below(std::size_t count) { return static_cast<std::size_t>(random_() % count); }

 private:
  using Piece = std::pair<std::size_t, std::size_t>;  // where, how long

  void change(std::string& text) {
    if (text.empty()) text = "\n";
    switch (below(12)) {
      case 0:
        text[below(text.size())] = static_cast<char>(random_());
        break;
      case 1:
        text[below(text.size())] ^= static_cast<char>(1U << below(8));
        break;
      case 2:
        text.insert(below(text.size() + 1), word());
        break;
      case 3:
        text.insert(below(text.size() + 1), 1, static_cast<char>(random_()));
        break;
      case 4:
        text.erase(below(text.size()), 1 + below(8));
        break;
      case 5:
        if (below(4) == 0) text.resize(below(text.size()));
        break;
      case 6: {
        const Piece line = any_line(text);
        text.erase(line.first, line.second);
        break;
      }
      case 7: {
        const Piece line = any_line(text);
        const std::string copy = text.substr(line.first, line.second);
        text.insert(any_line(text).first, copy);
        break;
      }
      default:
        replace_value(text);
    }
  }
  // What stands behind an equals sign or in front of one.
  void replace_value(std::string& text) {
    const Piece line = any_line(text);
    const std::size_t equals = text.find('=', line.first);
    const std::size_t end = line.first + line.second;
    if (equals == std::string::npos || equals >= end) return;
    if (below(8) == 0) {
      text.replace(line.first, equals - line.first, word());
    } else {
      text.replace(equals + 1, end - equals - 1, " " + (below(3) == 0 ? word() : number()) + "\n");
    }
  }
  [[nodiscard]] Piece any_line(const std::string& text) {
    if (text.empty()) return {0, 0};
    const std::size_t at = below(text.size());
    const std::size_t before = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
    const std::size_t begin = before == std::string::npos ? 0 : before + 1;
    const std::size_t end = text.find('\n', begin);
    return {begin, (end == std::string::npos ? text.size() : end + 1) - begin};
  }
  [[nodiscard]] std::string number() {
    const double scale = std::array{1.0, 100.0, 1e5, 1e9}[below(4)];
    const double value = scale * (static_cast<double>(random_() % 2001) / 1000.0 - (below(3) == 0 ? 1.0 : 0.0));
    return below(2) == 0 ? std::to_string(value) : std::to_string(static_cast<long long>(value));
  }
  [[nodiscard]] std::string word() {
    static const std::vector<std::string> kWords{"nan",
                                                 "-nan",
                                                 "inf",
                                                 "-inf",
                                                 "1e308",
                                                 "1e999",
                                                 "-1e-320",
                                                 "0",
                                                 "-0",
                                                 "-0.0",
                                                 "+1",
                                                 "9223372036854775807",
                                                 "-9223372036854775808",
                                                 "9223372036854775808",
                                                 "18446744073709551616",
                                                 "0x7fffffffffffffff",
                                                 "0xFFFFFFFFFFFFFFFFF",
                                                 "0o777",
                                                 "0b1",
                                                 "0b",
                                                 "0x",
                                                 "1_000",
                                                 "1__0",
                                                 "_1",
                                                 "1_",
                                                 "1.",
                                                 ".1",
                                                 "1e",
                                                 "1e+",
                                                 "1.e1",
                                                 "01",
                                                 "true",
                                                 "false",
                                                 "tru",
                                                 "\"",
                                                 "\"\"",
                                                 "\"\"\"",
                                                 "\"\"\"\"\"\"",
                                                 "\"\"\"\n\"\"\"",
                                                 "'",
                                                 "''",
                                                 "'''",
                                                 "''''''",
                                                 "\\",
                                                 "\"\\\"",
                                                 "\"\\u0007\"",
                                                 "\"\\u001b[2J\"",
                                                 "\"\\U0010FFFF\"",
                                                 "\"\\uD800\"",
                                                 "\"\\u000A\"",
                                                 "\"\\x41\"",
                                                 "\"\\u0085\"",
                                                 "\"\\u00\"",
                                                 "\"\"\"\\\n  \"\"\"",
                                                 "[",
                                                 "]",
                                                 "[[",
                                                 "]]",
                                                 "[]",
                                                 "[[]]",
                                                 "[1, 2",
                                                 "[1, 2, 3]",
                                                 "[[[[[[[[",
                                                 "{",
                                                 "}",
                                                 "{}",
                                                 "{ a = 1 }",
                                                 "{ a = { b = [",
                                                 "{a.b=1,}",
                                                 "=",
                                                 "==",
                                                 ".",
                                                 ",",
                                                 "#",
                                                 "\n",
                                                 "\r",
                                                 "\r\n",
                                                 "\t",
                                                 " ",
                                                 "a.b.c",
                                                 "\"a b\"",
                                                 "\"\" = 1\n",
                                                 "a = 1\n",
                                                 "[a]\n",
                                                 "[[a]]\n",
                                                 "[drive]\n",
                                                 "[[drive]]\n",
                                                 "[feet]\n",
                                                 "drive = []\n",
                                                 "1979-05-27T07:32:00Z",
                                                 "1979-05-27",
                                                 "07:32:00",
                                                 "07:32",
                                                 "1979-05-27 07:32:00.999999999999-07:00",
                                                 "1979-13-41",
                                                 "1979-05-27T",
                                                 "\xEF\xBB\xBF",
                                                 "\xC2\x85",
                                                 "\xC3\xA9",
                                                 "\xE2\x80\xA8",
                                                 "\xF0\x9F\xA4\x96",
                                                 "\xC3",
                                                 "\xFF\xFE",
                                                 "\xED\xA0\x80",
                                                 "\xF4\x90\x80\x80",
                                                 "\xC0\x80",
                                                 std::string(1, '\0'),
                                                 "\x01",
                                                 "\x1B[31m",
                                                 "\x7F",
                                                 std::string(40, '['),
                                                 std::string(300, '['),
                                                 std::string(300, '{'),
                                                 std::string(2000, '9'),
                                                 std::string(2000, 'a'),
                                                 std::string(64, '"'),
                                                 "1e" + std::string(400, '9')};
    return kWords[below(kWords.size())];
  }

  std::mt19937_64 random_;
};

}  // namespace polygmap::test
