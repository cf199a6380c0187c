// SPDX-License-Identifier: Apache-2.0
#include "firmware/config/param_file.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "firmware/config/toml_reader.hpp"

namespace polygmap::config {
namespace {

// Letters to change, add or leave out.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({changed, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

std::string_view last_word(std::string_view name) { return name.substr(name.rfind('.') + 1); }

std::string kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "a bool";
    default:
      return "a date or time";
  }
}

class ParamFile {
 public:
  ParamFile(FileName name, const ParamTable& table) : name_(std::move(name)), table_(table) {}

  void read(std::string_view text) {
    const toml::table root = parse_toml(name_, text);
    refuse_others(root);
    take(root, "");
    for (const ParamOrder& order : table_.orders) check(order);
  }

 private:
  [[noreturn]] void fail(toml::source_index line, const std::string& what) const { name_.fail(line, what); }
  [[noreturn]] void fail(const toml::node& node, const std::string& what) const {
    fail(node.source().begin.line, what);
  }
  // Whoever gives one for the other needs no nearest name.
  void refuse_others(const toml::table& from) const {
    if (from.contains("width") && from.contains("height") && from.contains("fx")) {
      throw FileError(name_.text() +
                      " looks like a camera file (it has width, height and fx), which holds no parameters.");
    }
    if (from.contains("drive")) {
      throw FileError(name_.text() + " looks like a bus file (it has drives), which holds no parameters.");
    }
  }
  [[nodiscard]] const Param* find(const std::string& full) const {
    const auto at = std::ranges::find(table_.params, full, &Param::name);
    return at == table_.params.end() ? nullptr : &*at;
  }
  [[nodiscard]] bool is_table(const std::string& full) const {
    return std::ranges::any_of(table_.params, [&](const Param& p) { return p.name.starts_with(full + "."); });
  }

  void take(const toml::table& from, const std::string& prefix) {
    for (const auto& [key, node] : from) {
      const std::string full = prefix + std::string(key.str());
      if (const Param* param = find(full)) {
        take(node, *param);
      } else if (is_table(full)) {
        if (!node.is_table()) fail(node, full + " is a table of parameters, not " + kind_of(node));
        take(*node.as_table(), full + ".");
      } else {
        const std::string near = nearest(full, node.is_table());
        fail(key.source().begin.line,
             full + (node.is_table() ? " is no table of parameters; " : " is no parameter; ") +
                 (near.empty() ? "`" + table_.listed_by + "` names all" : "the nearest is " + near));
      }
    }
  }

  // The parameter, or the table, whose name it may be; that of another table counts when its last word is alike. Empty
  // when none is near: a third of the last word's letters, or two, may be wrong.
  [[nodiscard]] std::string nearest(const std::string& full, bool tables) const {
    std::string best;
    const std::string_view last = last_word(full);
    std::size_t least = std::max<std::size_t>(2, last.size() / 3) + 1;
    for (const Param& param : table_.params) {
      const std::string name = tables ? param.name.substr(0, param.name.rfind('.')) : param.name;
      const std::size_t off = std::min(distance(full, name), 2 + 2 * distance(last, last_word(name)));
      if (off < least) {
        best = name;
        least = off;
      }
    }
    return best;
  }

  void take(const toml::node& node, const Param& param) {
    lines_.emplace_back(param.name, node.source().begin.line);
    std::visit([&](auto value) { take(node, param, value); }, param.value);
  }
  void take(const toml::node& node, const Param& param, bool* value) {
    if (!node.is_boolean()) fail(node, param.name + " must be true or false, not " + kind_of(node));
    *value = *node.value<bool>();
  }
  template <class Whole>
  void take(const toml::node& node, const Param& param, Whole* value) {
    const double given = number(node, param);
    if (given != std::floor(given)) fail(node, param.name + " must be a whole number, not " + text_of(given));
    *value = static_cast<Whole>(given);
  }
  void take(const toml::node& node, const Param& param, double* value) { *value = number(node, param); }
  void take(const toml::node& node, const Param& param, std::span<double> value) {
    const toml::array* array = node.as_array();
    if (array == nullptr || array->size() != value.size()) {
      fail(node, param.name + " must be " + std::to_string(value.size()) + " numbers in brackets");
    }
    for (std::size_t i = 0; i < value.size(); ++i) value[i] = number(*array->get(i), param);
  }
  void take(const toml::node& node, const Param& param, EnumValue value) {
    std::string all;
    for (std::size_t i = 0; i < value.names.size(); ++i) {
      if (node.is_string() && *node.value<std::string_view>() == value.names[i]) {
        *value.value = static_cast<std::uint8_t>(i);
        return;
      }
      all.append(i == 0 ? "\"" : " or \"").append(value.names[i]).append("\"");
    }
    fail(node, param.name + " must be " + all);
  }
  void take(const toml::node& node, const Param& param, RotationValue value) {
    std::array<double, 3> given{};
    take(node, param, std::span<double>(given));
    // What was listed is read back as it was, to the last bit.
    if (given != roll_pitch_yaw(*value.value)) *value.value = rotation_zyx(given[2], given[1], given[0]);
  }

  [[nodiscard]] double number(const toml::node& node, const Param& param) const {
    if (!node.is_number()) fail(node, param.name + " must be a number, not " + kind_of(node));
    // A whole number that no double holds has no value<double>().
    const double value = node.is_integer() ? static_cast<double>(node.as_integer()->get()) : *node.value<double>();
    if (!(value >= param.least && value <= param.most)) {
      const std::string_view unit = unit_of(param.name);
      fail(node, param.name + " must be from " + text_of(param.least) + " to " + text_of(param.most) +
                     (unit.empty() ? "" : " ") + std::string(unit) + ", not " + text_of(value));
    }
    return value;
  }

  void check(const ParamOrder& order) const {
    const Param *less = find(order.less), *more = find(order.more);
    if (less == nullptr || more == nullptr || number_of(*less) <= number_of(*more)) return;
    // Of the two, the one that the file says last.
    toml::source_index line = 0;
    for (const auto& [name, at] : lines_) {
      if (name == order.less || name == order.more) line = std::max(line, at);
    }
    fail(line, order.less + ", " + text_of(*less) + ", must not be more than " + order.more + ", " + text_of(*more));
  }

  FileName name_;
  const ParamTable& table_;
  std::vector<std::pair<std::string, toml::source_index>> lines_;  // of what the file says
};

}  // namespace

void parse_params(const FileName& name, std::string_view text, const ParamTable& table) {
  ParamFile(name, table).read(text);
}
void read_params(const std::string& path, const ParamTable& table) {
  const FileName name{"parameter", path};
  parse_params(name, read_text(name), table);
}

}  // namespace polygmap::config
