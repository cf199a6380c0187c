// SPDX-License-Identifier: Apache-2.0
#include "firmware/config/param_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "firmware/params.hpp"

namespace polygmap::config {
namespace {

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;  // which clang 14 does not deduce for aggregates

struct Suffix {
  std::string_view end, unit;
};
// The longest that fits counts.
constexpr std::array kSuffixes{Suffix{"_m", "m"},
                               Suffix{"_m2", "m^2"},
                               Suffix{"_mps", "m/s"},
                               Suffix{"_mps2", "m/s^2"},
                               Suffix{"_m2ps", "m^2/s"},
                               Suffix{"_mprs", "m/sqrt(s)"},
                               Suffix{"_mprm", "m/sqrt(m)"},
                               Suffix{"_mpsrs", "m/s/sqrt(s)"},
                               Suffix{"_mps2rs", "m/s^2/sqrt(s)"},
                               Suffix{"_m_per_sqrt_s", "m/sqrt(s)"},
                               Suffix{"_s", "s"},
                               Suffix{"_per_s", "1/s"},
                               Suffix{"_ps", "1/s"},
                               Suffix{"_spm", "s/m"},
                               Suffix{"_ns", "ns"},
                               Suffix{"_rad", "rad"},
                               Suffix{"_rad2", "rad^2"},
                               Suffix{"_radps", "rad/s"},
                               Suffix{"_radprs", "rad/sqrt(s)"},
                               Suffix{"_radpsrs", "rad/s/sqrt(s)"},
                               Suffix{"_radpnm", "rad/(N m)"},
                               Suffix{"_px", "px"},
                               Suffix{"_ticks", "ticks"},
                               Suffix{".ticks", "ticks"},
                               Suffix{"_ticks_per_m", "ticks/m"},
                               Suffix{"_per_m", "1/m"},
                               Suffix{"_n", "N"},
                               Suffix{"_nm", "N m"},
                               Suffix{"_pn", "1/N"},
                               Suffix{"_nmprad", "N m/rad"},
                               Suffix{"_nmsprad", "N m s/rad"},
                               Suffix{"_kg", "kg"},
                               Suffix{"_degc", "degrees C"},
                               Suffix{"_kgm2", "kg m^2"},
                               Suffix{"_sigma", "sigma"},
                               Suffix{"_sigmas", "sigma"}};

std::string joined(std::span<const double> numbers) {
  std::string out = "[";
  for (const double number : numbers) out.append(out.size() > 1 ? ", " : "").append(text_of(number));
  return out + "]";
}

void append_exact(std::string& out, double number) {
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, number, std::chars_format::hex).ptr;
  out.append(buffer, end).push_back(' ');
}

std::string exact_text(const Param& param) {
  std::string out;
  std::visit(Overloaded{[&](const double* number) { append_exact(out, *number); },
                        [&](std::span<const double> numbers) {
                          for (const double number : numbers) append_exact(out, number);
                        },
                        [&](RotationValue rotation) {
                          for (const double number : rotation.value->reshaped()) append_exact(out, number);
                        },
                        [&](auto) { out = text_of(param); }},
             param.value);
  return out;
}

}  // namespace

std::string_view unit_of(std::string_view name) {
  Suffix best{"", ""};
  for (const Suffix& suffix : kSuffixes) {
    if (suffix.end.size() > best.end.size() && name.ends_with(suffix.end)) best = suffix;
  }
  return best.unit;
}

std::array<double, 3> roll_pitch_yaw(const Mat3& R) {
  const double across = std::hypot(R(0, 0), R(1, 0));
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(0.0 - R(2, 0), across), std::atan2(R(1, 0), R(0, 0))};
}

std::string text_of(double number) {
  const double size = std::abs(number);
  const bool plain = number == 0.0 || (size >= 1e-4 && size < 1e10);
  const auto format = plain ? std::chars_format::fixed : std::chars_format::general;
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, number, format).ptr};
}

std::string text_of(const Param& param) {
  return std::visit(Overloaded{[](const bool* flag) { return std::string(*flag ? "true" : "false"); },
                               [](const double* number) { return text_of(*number); },
                               [](std::span<const double> numbers) { return joined(numbers); },
                               [](EnumValue choice) {
                                 return std::string(1, '"').append(choice.names[*choice.value]).append(1, '"');
                               },
                               [](RotationValue rotation) { return joined(roll_pitch_yaw(*rotation.value)); },
                               [](const auto* whole) { return std::to_string(*whole); }},
                    param.value);
}

double number_of(const Param& param) {
  return std::visit(
      [](auto value) {
        if constexpr (requires { static_cast<double>(*value); }) {
          return static_cast<double>(*value);
        } else {
          return 0.0;
        }
      },
      param.value);
}

bool same_value(const Param& a, const Param& b) { return exact_text(a) == exact_text(b); }

std::string hash_of(const ParamTable& table) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const Param& param : table.params) {
    for (const char c : param.name + "=" + exact_text(param) + "\n") {
      hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    }
  }
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
  return digits;
}

namespace detail {

Collector::Collector(std::string prefix) : prefix_(std::move(prefix)) {}

void Collector::operator()(std::string_view name, bool& value, std::string_view text) {
  add(name, &value, 0.0, 1.0, text);
}

void Collector::operator()(std::string_view name, Mat3& value, std::string_view text) {
  add(name, RotationValue{&value}, -kPi, kPi, text);
}

void Collector::operator()(std::string_view name, Transform& value, std::string_view text) {
  Collector inner(full(name) + ".");
  inner("p_m", value.p_m, -2.0, 2.0, text);
  inner("rpy_rad", value.R, "Roll, pitch and yaw of the same, R = Rz Ry Rx.");
  append(std::move(inner).take());
}

void Collector::ordered(std::string_view less, std::string_view more) {
  own_.orders.push_back({full(less), full(more)});
}

ParamTable Collector::take() && {
  std::ranges::move(nested_, std::back_inserter(own_.params));
  return std::move(own_);
}

std::string Collector::full(std::string_view name) const { return prefix_ + std::string(name); }

void Collector::add(std::string_view name, ParamValue value, double least, double most, std::string_view text) {
  own_.params.push_back({full(name), value, least, most, text});
}

void Collector::append(ParamTable inner) {
  std::ranges::move(inner.params, std::back_inserter(nested_));
  std::ranges::move(inner.orders, std::back_inserter(own_.orders));
}

}  // namespace detail

template ParamTable param_table(Params& root);

}  // namespace polygmap::config
