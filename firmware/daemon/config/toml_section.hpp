// SPDX-License-Identifier: Apache-2.0
// A table of a TOML file, read key by key: what is wrong becomes one sentence with file, line and key.
#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/config/param_table.hpp"
#include "firmware/config/toml_reader.hpp"

namespace polygmap::daemon {

struct Range {
  double least, most;
  std::string_view unit;
};

class TomlSection {
 public:
  // name: "" of the file itself. line: of the table, for what is missing in it.
  TomlSection(std::string path, std::string name, const toml::table& table, toml::source_index line)
      : path_(std::move(path)), name_(std::move(name)), table_(table), line_(line) {}

  [[noreturn]] void fail(toml::source_index line, const std::string& what) const {
    config::FileName{"daemon", path_}.fail(line, what);
  }
  [[noreturn]] void fail(std::string_view key, const std::string& what) const {
    fail(line_of(key), full(key) + " " + what);
  }

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  // The table's own where it has no such key.
  [[nodiscard]] toml::source_index line_of(std::string_view key) const {
    const toml::node* node = table_.get(key);
    return node == nullptr ? line_ : node->source().begin.line;
  }
  // As "robot.toml, line 7, camera.device".
  [[nodiscard]] std::string place_of(std::string_view key) const {
    return path_ + ", line " + std::to_string(line_of(key)) + ", " + full(key);
  }

  void only(std::initializer_list<std::string_view> keys) const {
    for (const auto& entry : table_) {
      if (std::ranges::find(keys, entry.first.str()) != keys.end()) continue;
      std::string all;
      for (const std::string_view key : keys) all.append(all.empty() ? "" : ", ").append(key);
      std::string what = full(entry.first.str());
      what.append(" is no key of ").append(name_.empty() ? "a daemon file" : name_).append("; there are ").append(all);
      fail(entry.first.source().begin.line, what);
    }
  }
  [[nodiscard]] double number(std::string_view key, Range range, std::optional<double> otherwise = {}) const {
    const toml::node* node = find(key, otherwise.has_value());
    if (node == nullptr) return *otherwise;
    return checked(*node, key, range);
  }
  [[nodiscard]] std::int64_t whole(std::string_view key, Range range,
                                   std::optional<std::int64_t> otherwise = {}) const {
    const toml::node* node = find(key, otherwise.has_value());
    if (node == nullptr) return *otherwise;
    const double value = checked(*node, key, range);
    if (value != std::floor(value)) fail(key, "must be a whole number, not " + config::text_of(value));
    return static_cast<std::int64_t>(value);
  }
  // A time in milliseconds, as nanoseconds.
  [[nodiscard]] std::int64_t milliseconds(std::string_view key, double most_ms, std::int64_t otherwise_ns) const {
    return std::llround(1e6 * number(key, {0.0, most_ms, "ms"}, 1e-6 * static_cast<double>(otherwise_ns)));
  }
  [[nodiscard]] bool flag(std::string_view key, bool otherwise) const {
    const toml::node* node = find(key, true);
    if (node == nullptr) return otherwise;
    if (!node->is_boolean()) fail(key, "must be true or false");
    return *node->value<bool>();
  }
  [[nodiscard]] std::string text(std::string_view key, std::optional<std::string> otherwise = {}) const {
    const toml::node* node = find(key, otherwise.has_value());
    if (node == nullptr) return *otherwise;
    if (!node->is_string()) fail(key, "must be a text in quotes");
    return *node->value<std::string>();
  }
  // Which of the words it is.
  [[nodiscard]] std::size_t choice(std::string_view key, std::initializer_list<std::string_view> words,
                                   std::optional<std::size_t> otherwise = {}) const {
    const toml::node* node = find(key, otherwise.has_value());
    if (node == nullptr) return *otherwise;
    const std::string said = text(key);
    if (const auto* at = std::ranges::find(words, said); at != words.end()) {
      return static_cast<std::size_t>(at - words.begin());
    }
    std::string all;
    for (const std::string_view word : words) all.append(all.empty() ? "\"" : " or \"").append(word).append("\"");
    fail(key, "must be " + all + ", not \"" + said + "\"");
  }
  // Three numbers in brackets.
  [[nodiscard]] Vec3 vector(std::string_view key, Range range) const {
    const toml::node* node = find(key, true);
    if (node == nullptr) return Vec3::Zero();
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != 3) fail(key, "must be three numbers in brackets");
    Vec3 vector;
    for (std::size_t i = 0; i < 3; ++i) vector[static_cast<Eigen::Index>(i)] = checked(*array->get(i), key, range);
    return vector;
  }
  // none: there is no such table.
  [[nodiscard]] std::optional<TomlSection> section(std::string_view key, bool required) const {
    const toml::node* node = find(key, !required);
    if (node == nullptr) return std::nullopt;
    if (!node->is_table()) fail(key, "must be a table: [" + full(key) + "]");
    return TomlSection(path_, full(key), *node->as_table(), node->source().begin.line);
  }

 private:
  [[nodiscard]] std::string full(std::string_view key) const {
    return name_.empty() ? std::string(key) : name_ + "." + std::string(key);
  }
  [[nodiscard]] const toml::node* find(std::string_view key, bool may_lack) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr && !may_lack) fail(key, "is missing");
    return node;
  }
  [[nodiscard]] double checked(const toml::node& node, std::string_view key, Range range) const {
    if (!node.is_number()) fail(key, "must be a number");
    // A whole number that no double holds has no value<double>().
    const double value = node.is_integer() ? static_cast<double>(node.as_integer()->get()) : *node.value<double>();
    if (!(value >= range.least && value <= range.most)) {
      fail(key, "must be from " + config::text_of(range.least) + " to " + config::text_of(range.most) +
                    (range.unit.empty() ? "" : " ") + std::string(range.unit) + ", not " + config::text_of(value));
    }
    return value;
  }

  std::string path_, name_;
  const toml::table& table_;
  toml::source_index line_;
};

}  // namespace polygmap::daemon
