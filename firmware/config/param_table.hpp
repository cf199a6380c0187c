// SPDX-License-Identifier: Apache-2.0
// The one table of parameters, made of the field lists that stand beside the structs.
//
// A struct lists its fields in their order in static void visit(auto& p, auto& field), which calls
//   field("name", p.name, least, most, "What it is.")  for a number, a Vec3 or an array of numbers,
//   field("name", p.name, "What it is.")               for a bool, a Transform or a rotation,
//   field("name", p.name, kNames, "What it is.")       for an enum of these names,
//   field("name", p.name)                              for a struct with a list of its own, a table in a file,
//   field("name", p.name, kNames)                      for an array of such, by these names, and
//   field.ordered("less", "more")                      where one field may not exceed another.
// Units are in the names. Nothing of it is compiled into the module.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "algorithms/core/math/transform.hpp"

namespace polygmap {
struct Params;
namespace config {

struct EnumValue {
  std::uint8_t* value;
  std::span<const std::string_view> names;  // of 0, 1, ...
};
// Said and read as roll, pitch and yaw (R = Rz Ry Rx), hashed as it is.
struct RotationValue {
  Mat3* value;
};
using ParamValue = std::variant<bool*, std::int32_t*, std::uint32_t*, std::int64_t*, double*, std::span<double>,
                                EnumValue, RotationValue>;

struct Param {
  std::string name;  // with those of its tables: gait.planner.stand_off_m
  ParamValue value;  // where it lives
  double least = 0.0, most = 0.0;
  std::string_view text;
};

struct ParamOrder {
  std::string less, more;  // names of parameters; less <= more
};

struct ParamTable {
  std::vector<Param> params;
  std::vector<ParamOrder> orders;
  std::string listed_by = "polygmap params list";  // the command that names them all
};

// "m/s" of walk_speed_mps; empty for a plain number.
[[nodiscard]] std::string_view unit_of(std::string_view name);
// As a TOML file has it; numbers in the fewest digits that read back as the same.
[[nodiscard]] std::string text_of(const Param& param);
[[nodiscard]] std::string text_of(double number);
[[nodiscard]] std::array<double, 3> roll_pitch_yaw(const Mat3& R);
// Of one number, else 0.
[[nodiscard]] double number_of(const Param& param);
[[nodiscard]] bool same_value(const Param& a, const Param& b);
// FNV-1a of all names and values to the last bit, 16 hexadecimal digits.
[[nodiscard]] std::string hash_of(const ParamTable& table);

namespace detail {

template <class T>
inline constexpr bool kIsReals = false;
template <std::size_t N>
inline constexpr bool kIsReals<std::array<double, N>> = true;
template <int N>
inline constexpr bool kIsReals<Eigen::Matrix<double, N, 1>> = true;

class Collector {
 public:
  explicit Collector(std::string prefix);

  template <class T>
  void operator()(std::string_view name, T& value, double least, double most, std::string_view text) {
    if constexpr (kIsReals<T>) {
      add(name, std::span<double>(value.data(), static_cast<std::size_t>(value.size())), least, most, text);
    } else {
      add(name, &value, least, most, text);
    }
  }
  void operator()(std::string_view name, bool& value, std::string_view text);
  template <class Enum, std::size_t N>
  requires std::is_enum_v<Enum> &&(sizeof(Enum) == 1) void operator()(std::string_view name, Enum& value,
                                                                      const std::array<std::string_view, N>& names,
                                                                      std::string_view text) {
    add(name, EnumValue{reinterpret_cast<std::uint8_t*>(&value), names}, 0.0, static_cast<double>(N - 1), text);
  }
  void operator()(std::string_view name, Mat3& value, std::string_view text);
  void operator()(std::string_view name, Transform& value, std::string_view text);
  template <class T, std::size_t N>
  requires std::is_class_v<T>
  void operator()(std::string_view name, std::array<T, N>& values, const std::array<std::string_view, N>& names) {
    for (std::size_t i = 0; i < N; ++i) (*this)(std::string(name) + "." + std::string(names[i]), values[i]);
  }
  template <class T>
  requires std::is_class_v<T>
  void operator()(std::string_view name, T& value) {
    Collector inner(full(name) + ".");
    T::visit(value, inner);
    append(std::move(inner).take());
  }
  void ordered(std::string_view less, std::string_view more);

  // A struct's own fields, then those of the structs in it: each table in one piece, as a file has it.
  [[nodiscard]] ParamTable take() &&;

 private:
  [[nodiscard]] std::string full(std::string_view name) const;
  void add(std::string_view name, ParamValue value, double least, double most, std::string_view text);
  void append(ParamTable inner);
  std::string prefix_;
  ParamTable own_;
  std::vector<Param> nested_;
};

}  // namespace detail

// Of the fields of root, which it points into.
template <class T>
[[nodiscard]] ParamTable param_table(T& root) {
  detail::Collector collector("");
  T::visit(root, collector);
  return std::move(collector).take();
}
// Compiled once: the walk over all fields is large.
extern template ParamTable param_table(Params& root);
template <class T>
[[nodiscard]] std::string hash_of(const T& root) {
  T copy = root;
  return hash_of(param_table(copy));
}

}  // namespace config
}  // namespace polygmap
