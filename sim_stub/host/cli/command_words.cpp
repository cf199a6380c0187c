// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/command_words.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <system_error>

#include "sim_stub/host/cli/climb_command.hpp"

namespace polygmap::sim {
namespace {

// "The following arguments were not expected: 3 --stepz", from the last to the first.
std::string unexpected(const std::string& message, const CLI::App& app, const std::vector<std::string>& words) {
  const std::string left = message.substr(std::min(message.find(": "), message.size() - 1) + 1) + " ";
  const auto is_left = [&left](const std::string& word) { return left.find(" " + word + " ") != std::string::npos; };
  const auto is_option = [&is_left](const std::string& word) { return word.starts_with("-") && is_left(word); };
  if (words.empty()) return message;
  const bool commanded = !app.get_subcommands().empty();
  if (!commanded && !words[0].starts_with("-")) return "\"" + words[0] + "\" is no command";
  auto culprit = std::ranges::find_if(words, is_option);
  if (culprit != words.end()) return "There is no option " + *culprit;
  culprit = std::find_if(words.begin() + 1, words.end(), is_left);
  return culprit == words.end() ? message : "\"" + *culprit + "\" is a word too many";
}

// The commands that the words got as far as, from the outermost to the innermost: can, encode.
std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  std::vector<const CLI::App*> commands;
  for (const CLI::App* at = &app; !at->get_subcommands().empty();) commands.push_back(at = at->get_subcommands()[0]);
  return commands;
}

// "Could not convert: --steps = abc"
std::string unconverted(const std::string& message, const CLI::App& app) {
  const std::size_t name_at = message.find(": "), value_at = message.find(" = ");
  if (name_at == std::string::npos || value_at == std::string::npos) return message;
  const std::string name = message.substr(name_at + 2, value_at - name_at - 2);
  std::string type;
  for (const CLI::App* command : commands_of(app)) {
    const CLI::Option* option = command->get_option_no_throw(name);
    if (option != nullptr) type = option->get_type_name();
  }
  const bool whole = type.starts_with("INT") || type.starts_with("UINT");  // all others that are converted are FLOAT
  return "\"" + message.substr(value_at + 3) + "\" is " + (whole ? "no whole number" : "no number") + " that " + name +
         " can take";
}

// "--steps: 1 required INT missing", "--gravity: At least 3 required but received 2", "--steps: At Most 1 required ..."
std::string mismatched(const std::string& message) {
  const std::size_t end = message.find(": ");
  const std::size_t count_at = message.find_first_of("0123456789", end);
  if (end == std::string::npos || count_at == std::string::npos) return message;
  const std::string name = message.substr(0, end);
  const std::string count = message.substr(count_at, message.find(' ', count_at) - count_at);
  if (message.find("At Most") != std::string::npos) {
    return name + (count == "1" ? " is given more than once" : " takes no more than " + count + " values");
  }
  return name + (count == "1" ? " needs a value" : " needs " + count + " values");
}

// As it may stand in a sentence on one line: words of the command line may hold anything.
std::string on_one_line(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return (c >= 0 && c < ' ') || c == 127; }, '?');
  return text;
}

// "lst is no command of params; there are list, docs and diff"; empty where the command asks for none, or has it.
std::string no_such_command(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.size() < 2 || words[1].starts_with("-")) return {};
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() != words[0]) continue;
    const std::vector<const CLI::App*> inner = command->get_subcommands({});
    if (inner.empty() || std::ranges::any_of(inner, [&](auto* one) { return one->get_name() == words[1]; })) return {};
    std::string all;
    for (const CLI::App* one : inner) {
      all += (all.empty() ? "" : (one == inner.back() ? " and " : ", ")) + one->get_name();
    }
    return "\"" + words[1] + "\" is no command of " + words[0] + "; there are " + all;
  }
  return {};
}

}  // namespace

std::string complaint_of(const CLI::ParseError& error, const CLI::App& app, const std::vector<std::string>& words) {
  std::string message = error.what();
  if (std::string sentence = no_such_command(app, words); !sentence.empty()) return on_one_line(sentence);
  switch (static_cast<CLI::ExitCodes>(error.get_exit_code())) {
    case CLI::ExitCodes::ExtrasError:
      return on_one_line(unexpected(message, app, words));
    case CLI::ExitCodes::ConversionError:
      return on_one_line(unconverted(message, app));
    case CLI::ExitCodes::ArgumentMismatch:
      return on_one_line(mismatched(message));
    case CLI::ExitCodes::ValidationError:  // "--seed: must be a whole number"
      if (const std::size_t end = message.find(": must "); end != std::string::npos) message.erase(end, 1);
      return on_one_line(message);
    default:
      return on_one_line(message);
  }
}

int written(std::ostream& out, std::ostream& err) {
  if (out << std::flush) return kExitPass;
  err << "polygmap: Cannot write to the standard output.\n";
  return kExitUsage;
}

std::string directory_complaint(const std::string& directory, const std::string& option) {
  namespace fs = std::filesystem;
  std::error_code why, error;
  fs::create_directories(directory, why);
  if (!fs::is_directory(directory, error)) {
    return "Cannot create the directory \"" + directory + "\" given by " + option + ": " + why.message() + ".";
  }
  const fs::path probe = fs::path(directory) / ".polygmap_probe";
  std::ofstream file(probe);
  file << "x";
  file.close();
  const bool written = static_cast<bool>(file);
  fs::remove(probe, error);
  return written ? "" : "Cannot write into the directory \"" + directory + "\" given by " + option + ".";
}

std::string command_of(const CLI::App& app) {
  std::string words = app.get_name() + " ";
  for (const CLI::App* command : commands_of(app)) words += command->get_name() + " ";
  return words;
}

std::string number(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%g", value);
  return buffer;
}

// CLI11 2.1's own range lets nan pass.
void keep_within(CLI::Option& option, double least, double most, const std::string& unit) {
  option.type_name(option.get_type_name() + " in [" + number(least) + ", " + number(most) + "]");
  option.check(CLI::Validator(
      [least, most, unit](std::string& text) -> std::string {
        double value = 0.0;
        if (!CLI::detail::lexical_cast(text, value)) return {};  // the conversion that follows says so
        if (value >= least && value <= most) return {};
        return "must be from " + number(least) + " to " + number(most) + (unit.empty() ? "" : " ") + unit + ", not " +
               text;
      },
      ""));
}

void keep_among(CLI::Option& option, const std::vector<std::string>& words) {
  std::string all, either;
  for (const std::string& word : words) {
    all += (all.empty() ? "" : "|") + word;
    either += (either.empty() ? "" : (word == words.back() ? " or " : ", ")) + word;
  }
  option.type_name(all);
  option.check(CLI::Validator(
      [words, either](std::string& text) -> std::string {
        if (std::ranges::find(words, text) != words.end()) return {};
        return "must be " + either + ", not \"" + text + "\"";
      },
      ""));
}

// CLI11 2.1 lets -1 and 2^64 wrap around.
std::string whole_number(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool good = error == std::errc{} && end == text.data() + text.size();
  return good ? "" : "must be a whole number from 0 to 2^64 - 1, not " + text;
}

// CLI11 2.1 reads 010 as eight: here digits are decimal.
std::string decimal(std::string& text) {
  const std::size_t first = text.find_first_not_of("+-");
  if (first == std::string::npos || text[first] != '0') return "";
  if (text.find_first_not_of("0123456789", first) != std::string::npos)
    return "must be a whole decimal number, not " + text;
  text.erase(first, std::min(text.find_first_not_of('0', first), text.size() - 1) - first);
  return "";
}

// CLI11 2.1 takes an empty word for the number 0.
std::string not_empty(const std::string& text) { return text.empty() ? "must not be empty" : ""; }

}  // namespace polygmap::sim
