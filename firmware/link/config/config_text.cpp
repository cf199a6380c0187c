// SPDX-License-Identifier: Apache-2.0
#include "firmware/link/config/config_text.hpp"

#include <algorithm>

#include "firmware/link/config/decimal.hpp"

namespace polygmap::link {
namespace {

constexpr std::size_t kMaxTables = 256;

[[nodiscard]] constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }
[[nodiscard]] constexpr bool is_key(char c) noexcept {
  return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '-';
}

// FNV-1a: a table that is given twice is found by it.
[[nodiscard]] constexpr std::uint64_t hash_of(std::string_view text) noexcept {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

// What ends a value, an element or a comment.
[[nodiscard]] constexpr bool ends_word(char c) noexcept {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == ']' || c == '#' || c == '\0';
}

// [+-]whole[.decimals][e[+-]power], each with underscores between digits. False: why.
class NumberReader {
 public:
  explicit NumberReader(std::string_view text) noexcept : text_(text) {}
  [[nodiscard]] const char* read(double& value) noexcept {
    const bool negative = next() == '-';
    if (next() == '-' || next() == '+') ++at_;
    const std::size_t begin = at_;
    if (!digits(0)) return "is no number, such as 5, 0.5 or 1e-3";
    if (text_[begin] == '0' && at_ > begin + 1) return "has a number that begins with 0";
    if (next() == '.') {
      is_whole_ = false;
      ++at_;
      if (!digits(-1)) return "is no number, such as 5, 0.5 or 1e-3";
    }
    if ((next() == 'e' || next() == 'E') && !power()) return "is no number, such as 5, 0.5 or 1e-3";
    if (at_ != text_.size()) return "is no number, such as 5, 0.5 or 1e-3";
    if (too_many_) return "has a number of more than 19 digits";
    if (decimal_.digits == 0) decimal_.exponent = 0;
    if (decimal_.digits == 0 && is_whole_) return nullptr;  // and there is no -0 of those
    // Zeros at the end are no digits that matter.
    while (decimal_.exponent < 0 && decimal_.digits % 10 == 0 && decimal_.digits != 0) {
      decimal_.digits /= 10;
      ++decimal_.exponent;
    }
    if (decimal_.exponent < Decimal::kLeastExponent) return "has a number that is too small to matter";
    if (decimal_.exponent > Decimal::kMostExponent) return "has a number that is too large";
    value = negative ? -to_double(decimal_) : to_double(decimal_);
    return nullptr;
  }

 private:
  [[nodiscard]] char next() const noexcept { return at_ < text_.size() ? text_[at_] : '\0'; }
  // One or more. each: what a digit adds to the exponent.
  [[nodiscard]] bool digits(int each) noexcept {
    if (!is_digit(next())) return false;
    for (; is_digit(next()) || next() == '_'; ++at_) {
      if (next() == '_') {
        if (at_ + 1 >= text_.size() || !is_digit(text_[at_ + 1]) || !is_digit(text_[at_ - 1])) return false;
        continue;
      }
      add(static_cast<std::uint64_t>(next() - '0'), each);
    }
    return true;
  }
  void add(std::uint64_t digit, int each) noexcept {
    constexpr std::uint64_t kRoom = 1'000'000'000'000'000'000;  // ten times that has 19 digits and fits
    if (decimal_.digits < kRoom) {
      decimal_.digits = decimal_.digits * 10 + digit;
      decimal_.exponent += each;
    } else {  // a digit that has no room is none that matters if it is zero
      too_many_ = too_many_ || digit != 0;
      decimal_.exponent += each + 1;
    }
  }
  [[nodiscard]] bool power() noexcept {
    constexpr int kMost = 1000;
    is_whole_ = false;
    ++at_;
    const bool negative = next() == '-';
    if (next() == '-' || next() == '+') ++at_;
    if (!is_digit(next())) return false;
    int power = 0;
    for (; is_digit(next()); ++at_) power = std::min(power * 10 + (next() - '0'), kMost);
    decimal_.exponent += negative ? -power : power;
    return true;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  Decimal decimal_;
  bool too_many_ = false, is_whole_ = true;
};

class ConfigReader {
 public:
  ConfigReader(std::string_view text, ConfigEntries& entries, Sentence& wrong) noexcept
      : text_(text), entries_(entries), wrong_(wrong) {}

  [[nodiscard]] bool read() noexcept {
    while (skip_to_entry()) {
      if (at_ == text_.size()) return true;
      if (!(next() == '[' ? read_table() : read_entry()) || !end_line()) return false;
    }
    return false;
  }

 private:
  [[nodiscard]] char next() const noexcept { return at_ < text_.size() ? text_[at_] : '\0'; }
  [[nodiscard]] bool fail(std::string_view what, std::string_view quoted = {}) noexcept {
    begin_sentence(wrong_, line_);
    if (!quoted.empty()) {
      quote(quoted);
      wrong_.append(" ");
    }
    wrong_.append(what);
    wrong_.append(".");
    return false;
  }
  // What a stranger wrote goes to a terminal: control characters become question marks, and long words are cut.
  void quote(std::string_view words) noexcept {
    constexpr std::size_t kMost = 80;
    for (const char c : part(words, 0, kMost))
      wrong_.append(static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? "?" : std::string_view(&c, 1));
    if (words.size() > kMost) wrong_.append("...");
  }
  void skip_blanks() noexcept {
    while (next() == ' ' || next() == '\t' || (next() == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n')) {
      ++at_;
    }
  }
  // Up to its end. False: it has a control character.
  [[nodiscard]] bool skip_comment() noexcept {
    if (next() != '#') return true;
    for (; at_ < text_.size() && next() != '\n'; ++at_) {
      const auto c = static_cast<unsigned char>(next());
      const bool ends = c == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n';
      if ((c < 0x20 && c != '\t' && !ends) || c == 0x7F) return fail("a comment has a control character");
    }
    return true;
  }
  // Past blank lines and comments, here and inside brackets.
  [[nodiscard]] bool skip_to_entry() noexcept {
    for (;;) {
      skip_blanks();
      if (!skip_comment()) return false;
      if (next() != '\n' || at_ == text_.size()) return true;
      ++at_;
      ++line_;
    }
  }
  [[nodiscard]] bool end_line() noexcept {
    skip_blanks();
    if (!skip_comment()) return false;
    return at_ == text_.size() || next() == '\n' || fail("expected nothing more on this line");
  }
  // key.key, appended to name.
  [[nodiscard]] bool read_key(FixedText<kMaxConfigName>& name) noexcept {
    for (;;) {
      const std::size_t begin = at_;
      while (is_key(next())) ++at_;
      if (at_ == begin) return fail("expected a key of letters, digits and underscores, or a table's name in brackets");
      if (name.size() + (at_ - begin) + 1 > kMaxConfigName) return fail("is too long a name", name.view());
      name.append(part(text_, begin, at_ - begin));
      skip_blanks();
      if (next() != '.') return true;
      name.append(".");
      ++at_;
      skip_blanks();
    }
  }
  [[nodiscard]] bool read_table() noexcept {
    ++at_;
    if (next() == '[') return fail("tables in double brackets hold no parameters");
    table_.clear();
    skip_blanks();
    if (!read_key(table_)) return false;
    if (next() != ']') return fail("a table's name has no closing ']'");
    ++at_;
    const std::uint64_t hash = hash_of(table_.view());
    if (std::find(tables_.begin(), tables_.end(), hash) != tables_.end()) {
      return fail("is given twice as a table", table_.view());
    }
    return tables_.try_push_back(hash) || fail("there are too many tables");
  }
  [[nodiscard]] bool read_entry() noexcept {
    FixedText<kMaxConfigName> name = table_;
    if (name.size() > 0) name.append(".");
    if (!read_key(name)) return false;
    if (next() != '=') return fail("has no '=' behind it", name.view());
    ++at_;
    skip_blanks();
    const std::uint32_t line = line_;
    if (!read_value(name.view())) return false;
    Sentence why;
    if (entries_.take(name.view(), line, value_, why)) return true;
    line_ = line;
    return fail(why.view(), name.view());
  }
  [[nodiscard]] bool read_value(std::string_view name) noexcept {
    value_ = {};
    switch (next()) {
      case '"':
      case '\'':
        return read_text(name);
      case '[':
        return read_numbers(name);
      case '{':
        return fail("is a table in braces, which is not read here: give it a table's name in brackets", name);
      default:
        break;
    }
    const std::string_view word = read_word();
    value_.flag = word == "true";
    value_.kind = ConfigValue::Kind::kFlag;
    if (value_.flag || word == "false") return true;
    value_.kind = ConfigValue::Kind::kNumber;
    return take_number(name, word);
  }
  [[nodiscard]] std::string_view read_word() noexcept {
    const std::size_t begin = at_;
    while (!ends_word(next())) ++at_;
    return part(text_, begin, at_ - begin);
  }
  [[nodiscard]] bool take_number(std::string_view name, std::string_view word) noexcept {
    if (word.empty())
      return fail("has no value that is a number, true, false, a text in quotes or numbers in brackets", name);
    ConfigNumber number{0.0, word};
    if (const char* why = NumberReader(word).read(number.value)) return fail(why, name);
    return value_.numbers.try_push_back(number) || fail("has more numbers in brackets than any parameter", name);
  }
  [[nodiscard]] bool read_text(std::string_view name) noexcept {
    const char quote = next();
    const std::size_t begin = ++at_;
    for (; next() != quote; ++at_) {
      const auto c = static_cast<unsigned char>(next());
      if (c < 0x20 || c == 0x7F) return fail("has a text without a closing quote on its line", name);
      if (c == '\\' && quote == '"') return fail("has a text with a backslash, which is not read here", name);
    }
    value_.kind = ConfigValue::Kind::kText;
    value_.text = part(text_, begin, at_++ - begin);
    return true;
  }
  [[nodiscard]] bool read_numbers(std::string_view name) noexcept {
    value_.kind = ConfigValue::Kind::kNumbers;
    ++at_;
    for (;;) {
      if (!skip_to_entry()) return false;
      if (next() == ']') break;
      if (at_ == text_.size()) return fail("has brackets that are not closed", name);
      if (!take_number(name, read_word()) || !skip_to_entry()) return false;
      if (next() == ']') break;
      if (at_ == text_.size()) continue;
      if (next() != ',') return fail("has numbers in brackets without a comma between them", name);
      ++at_;
    }
    ++at_;
    return true;
  }

  std::string_view text_;
  ConfigEntries& entries_;
  Sentence& wrong_;
  std::size_t at_ = 0;
  std::uint32_t line_ = 1;
  FixedText<kMaxConfigName> table_;
  ConfigValue value_;
  StaticVector<std::uint64_t, kMaxTables> tables_;
};

}  // namespace

bool read_config(std::string_view text, ConfigEntries& entries, Sentence& wrong) noexcept {
  ConfigReader reader(text, entries, wrong);
  return reader.read();
}

void begin_sentence(Sentence& sentence, std::uint32_t line) noexcept {
  sentence.clear();
  sentence.append("config");
  if (line == 0) {
    sentence.append(": ");
    return;
  }
  std::array<char, 12> reversed{};
  std::size_t count = 0;
  for (; line > 0; line /= 10) reversed[count++] = static_cast<char>('0' + line % 10);
  sentence.append(", line ");
  while (count > 0) sentence.append({&reversed[--count], 1});
  sentence.append(": ");
}

}  // namespace polygmap::link
