// SPDX-License-Identifier: Apache-2.0
// Words of the command line where CLI11 takes them for others than people mean, or does not say clearly what is wrong.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace polygmap::sim {

// What is wrong with the words, without a full stop.
[[nodiscard]] std::string complaint_of(const CLI::ParseError& error, const CLI::App& app,
                                       const std::vector<std::string>& words);

// Validators: empty, or what is wrong. From 0 to 2^64 - 1.
[[nodiscard]] std::string whole_number(const std::string& text);
// Takes leading zeros off.
[[nodiscard]] std::string decimal(std::string& text);
[[nodiscard]] std::string not_empty(const std::string& text);

}  // namespace polygmap::sim
