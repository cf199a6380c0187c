// SPDX-License-Identifier: Apache-2.0
// Words of the command line where CLI11 takes them for others than people mean, or does not say clearly what is wrong.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
class ParseError;
}  // namespace CLI

namespace polygmap::sim {

// What is wrong with the words, without a full stop.
[[nodiscard]] std::string complaint_of(const CLI::ParseError& error, const CLI::App& app,
                                       const std::vector<std::string>& words);

// The exit code of a command that is done: whether its standard output took everything, or a sentence on err.
[[nodiscard]] int written(std::ostream& out, std::ostream& err);

// Makes the directory and tries to write into it before minutes are spent. Empty, or why it cannot be.
[[nodiscard]] std::string directory_complaint(const std::string& directory, const std::string& option = "--out");

// "polygmap can encode ": the command that the words got as far as, to ask for its help.
[[nodiscard]] std::string command_of(const CLI::App& app);

// 100, 0.05, 1e+06: as short as it is exact.
[[nodiscard]] std::string number(double value);

// The option's numbers are from least to most, which its help and the sentence about another one say; nan is none.
void keep_within(CLI::Option& option, double least, double most, const std::string& unit = "");
// The option is one of the words, which its help and the sentence about another one say.
void keep_among(CLI::Option& option, const std::vector<std::string>& words);

// Validators: empty, or what is wrong. From 0 to 2^64 - 1.
[[nodiscard]] std::string whole_number(const std::string& text);
// Takes leading zeros off.
[[nodiscard]] std::string decimal(std::string& text);
[[nodiscard]] std::string not_empty(const std::string& text);

}  // namespace polygmap::sim
