// SPDX-License-Identifier: Apache-2.0
// Lines of a configuration: what is read, and the sentence about what is not.
#include "firmware/link/config/config_text.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace polygmap::link {
namespace {

// Takes all, and remembers it as text.
class Listed final : public ConfigEntries {
 public:
  [[nodiscard]] bool take(std::string_view name, std::uint32_t line, const ConfigValue& value,
                          Sentence&) noexcept override {
    std::string text = std::to_string(line) + " " + std::string(name);
    switch (value.kind) {
      case ConfigValue::Kind::kFlag:
        text += value.flag ? " true" : " false";
        break;
      case ConfigValue::Kind::kText:
        text += " '" + std::string(value.text) + "'";
        break;
      default:
        text += value.kind == ConfigValue::Kind::kNumbers ? " [" : " ";
        for (const ConfigNumber& number : value.numbers) text += std::to_string(number.value) + " ";
    }
    lines.push_back(text);
    return true;
  }
  std::vector<std::string> lines;
};

std::vector<std::string> entries_of(const std::string& text) {
  Listed listed;
  Sentence wrong;
  EXPECT_TRUE(read_config(text, listed, wrong)) << wrong.view();
  return listed.lines;
}
std::string refusal(const std::string& text) {
  Listed listed;
  Sentence wrong;
  EXPECT_FALSE(read_config(text, listed, wrong)) << text;
  return std::string(wrong.view());
}

TEST(ConfigText, NothingToSay_IsNoError) {
  EXPECT_TRUE(entries_of("").empty());
  EXPECT_TRUE(entries_of("\n\r\n  # a comment\n\t\n#").empty());
}

TEST(ConfigText, KeysTablesAndValues_AreNamedInFull) {
  EXPECT_EQ(
      entries_of("a = 1\nb.c = true # why\n[t]\nd = 'x'\r\n[ t.u ]\n  e=\"y z\"\nf = -2.5e-1"),
      (std::vector<std::string>{"1 a 1.000000 ", "2 b.c true", "4 t.d 'x'", "6 t.u.e 'y z'", "7 t.u.f -0.250000 "}));
}

TEST(ConfigText, NumbersInBrackets_MaySpanLines) {
  EXPECT_EQ(entries_of("a = [1, +2.0, # two\n  3_000,\n]\nb = [ ]\n"),
            (std::vector<std::string>{"1 a [1.000000 2.000000 3000.000000 ", "4 b ["}));
}

TEST(ConfigText, WhatIsNoEntry_IsRefusedWithItsLine) {
  EXPECT_EQ(refusal("\n= 3"),
            "config, line 2: expected a key of letters, digits and underscores, or a table's name in brackets.");
  EXPECT_EQ(refusal("a"), "config, line 1: a has no '=' behind it.");
  EXPECT_EQ(refusal("[t\n"), "config, line 1: a table's name has no closing ']'.");
  EXPECT_EQ(refusal("[[t]]\n"), "config, line 1: tables in double brackets hold no parameters.");
  EXPECT_EQ(refusal("[t]\n[u]\n[t]\n"), "config, line 3: t is given twice as a table.");
  EXPECT_EQ(refusal("[t] x\n"), "config, line 1: expected nothing more on this line.");
  EXPECT_EQ(refusal("a = 1 2\n"), "config, line 1: expected nothing more on this line.");
  EXPECT_EQ(refusal("# \x01\n"), "config, line 1: a comment has a control character.");
}

TEST(ConfigText, WhatIsNoValue_IsRefusedWithLineAndKey) {
  const std::string kNoNumber = "config, line 1: a is no number, such as 5, 0.5 or 1e-3.";
  for (const char* word :
       {"x", "1.", ".5", "1e", "1e+", "0x10", "1__0", "1_", "nan", "inf", "True", "1.2.3", "--1", "1-2"}) {
    EXPECT_EQ(refusal("a = " + std::string(word)), kNoNumber) << word;
  }
  EXPECT_EQ(refusal("a ="),
            "config, line 1: a has no value that is a number, true, false, a text in quotes or numbers in brackets.");
  EXPECT_EQ(refusal("a = 01"), "config, line 1: a has a number that begins with 0.");
  EXPECT_EQ(refusal("a = 1.23456789012345678901"), "config, line 1: a has a number of more than 19 digits.");
  EXPECT_EQ(refusal("a = 1e99"), "config, line 1: a has a number that is too large.");
  EXPECT_EQ(refusal("a = 1e-99999999999"), "config, line 1: a has a number that is too small to matter.");
  EXPECT_EQ(refusal("a = \"x\n"), "config, line 1: a has a text without a closing quote on its line.");
  EXPECT_EQ(refusal("a = \"x\\n\""), "config, line 1: a has a text with a backslash, which is not read here.");
  EXPECT_EQ(refusal("a = {b = 1}"),
            "config, line 1: a is a table in braces, which is not read here: give it a table's name in brackets.");
  EXPECT_EQ(refusal("a = [1 2]"), "config, line 1: a has numbers in brackets without a comma between them.");
  EXPECT_EQ(refusal("a = [1,\n2"), "config, line 2: a has brackets that are not closed.");
  EXPECT_EQ(refusal("a = [1, [2]]"), kNoNumber);
}

TEST(ConfigText, DigitsThatAreZeros_AreNoDigitsTooMany) {
  EXPECT_EQ(entries_of("a = 0.50000000000000000000000000000"), (std::vector<std::string>{"1 a 0.500000 "}));
  EXPECT_EQ(entries_of("a = 0.0e500"), (std::vector<std::string>{"1 a 0.000000 "}));
}

TEST(ConfigText, LongAndHostileNames_AreCutAndClean) {
  const std::string said = refusal(std::string(100, 'a') + "." + std::string(100, 'b') + " = 1");
  EXPECT_NE(said.find("is too long a name"), std::string::npos) << said;
  EXPECT_EQ(refusal("a\x07 = 1"), "config, line 1: a has no '=' behind it.");
}

}  // namespace
}  // namespace polygmap::link
