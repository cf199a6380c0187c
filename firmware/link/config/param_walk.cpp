// SPDX-License-Identifier: Apache-2.0
#include "firmware/link/config/param_walk.hpp"

#include "firmware/params.hpp"

namespace polygmap::link {
namespace {

template <class T>
inline constexpr bool kIsReals = false;
template <std::size_t N>
inline constexpr bool kIsReals<std::array<double, N>> = true;
template <int N>
inline constexpr bool kIsReals<Eigen::Matrix<double, N, 1>> = true;

using Kind = ParamField::Kind;
[[nodiscard]] constexpr Kind kind_of(const std::int32_t&) noexcept { return Kind::kInt32; }
[[nodiscard]] constexpr Kind kind_of(const std::uint32_t&) noexcept { return Kind::kUint32; }
[[nodiscard]] constexpr Kind kind_of(const std::int64_t&) noexcept { return Kind::kInt64; }
[[nodiscard]] constexpr Kind kind_of(const double&) noexcept { return Kind::kReal; }

// What a struct's visit() calls: config::detail::Collector is the same for whoever may allocate.
class Walk {
 public:
  explicit Walk(ParamVisitor& visitor) noexcept : visitor_(visitor) {}

  template <class T>
  void operator()(std::string_view name, T& value, double least, double most, std::string_view) noexcept {
    if constexpr (kIsReals<T>) {
      take(name, Kind::kReals, value.data(), static_cast<std::size_t>(value.size()), {}, least, most);
    } else {
      take(name, kind_of(value), &value, 1, {}, least, most);
    }
  }
  void operator()(std::string_view name, bool& value, std::string_view) noexcept {
    take(name, Kind::kFlag, &value, 1, {}, 0.0, 1.0);
  }
  template <class Enum, std::size_t N>
  requires std::is_enum_v<Enum> &&(sizeof(Enum) == 1) void operator()(std::string_view name, Enum& value,
                                                                      const std::array<std::string_view, N>& names,
                                                                      std::string_view) noexcept {
    take(name, Kind::kChoice, &value, 1, names, 0.0, static_cast<double>(N - 1));
  }
  void operator()(std::string_view name, Mat3& value, std::string_view) noexcept {
    take(name, Kind::kRotation, &value, 1, {}, -kPi, kPi);
  }
  void operator()(std::string_view name, Transform& value, std::string_view text) noexcept {
    const Outer outer = enter(name);
    (*this)("p_m", value.p_m, -2.0, 2.0, text);
    (*this)("rpy_rad", value.R, text);
    leave(outer);
  }
  template <class T, std::size_t N>
  requires std::is_class_v<T>
  void operator()(std::string_view name, std::array<T, N>& values,
                  const std::array<std::string_view, N>& names) noexcept {
    const Outer outer = enter(name);
    for (std::size_t i = 0; i < N; ++i) (*this)(names[i], values[i]);
    leave(outer);
  }
  template <class T>
  requires std::is_class_v<T>
  void operator()(std::string_view name, T& value) noexcept {
    const Outer outer = enter(name);
    T::visit(value, *this);
    leave(outer);
  }
  void ordered(std::string_view less, std::string_view more) noexcept {
    if (skips_) return;
    const std::size_t outer = name_.size();
    FixedText<kMaxParamName> second = name_;
    name_.append(less);
    second.append(more);
    visitor_.ordered(name_.view(), second.view());
    name_.resize(outer);
  }

 private:
  // What it goes back to: how long the name is there, and whether nobody wants to be told.
  struct Outer {
    std::size_t size;
    bool skips;
  };
  [[nodiscard]] Outer enter(std::string_view table) noexcept {
    const Outer outer{name_.size(), skips_};
    if (skips_) return outer;
    name_.append(table);
    name_.append(".");
    skips_ = !visitor_.wants(name_.view());
    return outer;
  }
  void leave(const Outer& outer) noexcept {
    name_.resize(outer.size);
    skips_ = outer.skips;
  }
  // One for all types, or the walk over all fields is large.
  [[gnu::noinline]] void take(std::string_view name, Kind kind, void* value, std::size_t count,
                              std::span<const std::string_view> choices, double least, double most) noexcept {
    const std::size_t index = index_++, outer = name_.size();
    if (skips_) return;
    name_.append(name);
    visitor_.take({name_.view(), index, kind, value, count, choices, least, most});
    name_.resize(outer);
  }

  ParamVisitor& visitor_;
  FixedText<kMaxParamName> name_;
  std::size_t index_ = 0;
  bool skips_ = false;
};

}  // namespace

void walk_params(Params& params, ParamVisitor& visitor) noexcept {
  Walk walk(visitor);
  Params::visit(params, walk);
}

}  // namespace polygmap::link
