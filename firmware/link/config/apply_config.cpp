// SPDX-License-Identifier: Apache-2.0
#include "firmware/link/config/apply_config.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware/link/config/decimal.hpp"
#include "firmware/link/config/param_walk.hpp"

namespace polygmap::link {
namespace {

constexpr std::string_view kCamera = "camera.";

void say_range(Sentence& why, double least, double most, std::string_view given) noexcept {
  why.append("must be from ");
  append(why, least);
  why.append(" to ");
  append(why, most);
  why.append(", not ");
  why.append(part(given, 0, 40));
}

// False: why says what it must be.
[[nodiscard]] bool number_in(const ConfigNumber& number, double least, double most, bool whole,
                             Sentence& why) noexcept {
  if (whole && number.value != std::floor(number.value)) {
    why.append("must be a whole number, not ");
    why.append(part(number.text, 0, 40));
    return false;
  }
  if (number.value >= least && number.value <= most) return true;
  say_range(why, least, most, number.text);
  return false;
}
[[nodiscard]] bool single_number(const ConfigValue& value, double least, double most, bool whole,
                                 Sentence& why) noexcept {
  if (value.kind == ConfigValue::Kind::kNumber) return number_in(value.numbers[0], least, most, whole, why);
  why.append("must be a number");
  return false;
}

[[nodiscard]] std::array<double, 3> roll_pitch_yaw(const Mat3& R) noexcept {
  const double across = math::sqrt(R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0));
  return {math::atan2(R(2, 1), R(2, 2)), math::atan2(0.0 - R(2, 0), across), math::atan2(R(1, 0), R(0, 0))};
}

// One value into one parameter.
class FieldSetter {
 public:
  FieldSetter(const ParamField& field, const ConfigValue& value, Sentence& why) noexcept
      : field_(field), value_(value), why_(why) {}

  [[nodiscard]] bool set() noexcept {
    using Kind = ParamField::Kind;
    switch (field_.kind) {
      case Kind::kFlag:
        return set_flag();
      case Kind::kInt32:
        return set_number<std::int32_t>(true);
      case Kind::kUint32:
        return set_number<std::uint32_t>(true);
      case Kind::kInt64:
        return set_number<std::int64_t>(true);
      case Kind::kReal:
        return set_number<double>(false);
      case Kind::kReals:
        return set_numbers(static_cast<double*>(field_.value), field_.count);
      case Kind::kChoice:
        return set_choice();
      case Kind::kRotation:
        return set_rotation();
    }
    return false;
  }

 private:
  [[nodiscard]] bool set_flag() noexcept {
    if (value_.kind != ConfigValue::Kind::kFlag) {
      why_.append("must be true or false");
      return false;
    }
    *static_cast<bool*>(field_.value) = value_.flag;
    return true;
  }
  template <class Number>
  [[nodiscard]] bool set_number(bool whole) noexcept {
    if (!single_number(value_, field_.least, field_.most, whole, why_)) return false;
    *static_cast<Number*>(field_.value) = static_cast<Number>(value_.numbers[0].value);
    return true;
  }
  [[nodiscard]] bool set_numbers(double* to, std::size_t count) noexcept {
    if (value_.kind != ConfigValue::Kind::kNumbers || value_.numbers.size() != count) {
      why_.append("must be ");
      append(why_, static_cast<double>(count));
      why_.append(" numbers in brackets");
      return false;
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (!number_in(value_.numbers[i], field_.least, field_.most, false, why_)) return false;
    }
    for (std::size_t i = 0; i < count; ++i) to[i] = value_.numbers[i].value;
    return true;
  }
  [[nodiscard]] bool set_choice() noexcept {
    const auto named = std::find(field_.choices.begin(), field_.choices.end(), value_.text);
    if (value_.kind == ConfigValue::Kind::kText && named != field_.choices.end()) {
      *static_cast<std::uint8_t*>(field_.value) = static_cast<std::uint8_t>(named - field_.choices.begin());
      return true;
    }
    why_.append("must be ");
    for (const std::string_view choice : field_.choices) {
      why_.append(choice == field_.choices.front() ? "\"" : " or \"");
      why_.append(choice);
      why_.append("\"");
    }
    return false;
  }
  // What was listed is read back as it was, to the last bit: whoever listed it took its angles from the C library,
  // whose last bits are others.
  [[nodiscard]] bool set_rotation() noexcept {
    constexpr double kSame_rad = 1e-15;
    std::array<double, 3> given{};
    if (!set_numbers(given.data(), given.size())) return false;
    Mat3& R = *static_cast<Mat3*>(field_.value);
    const std::array<double, 3> before = roll_pitch_yaw(R);
    bool same = true;
    for (std::size_t i = 0; i < given.size(); ++i) same = same && std::abs(given[i] - before[i]) <= kSame_rad;
    if (!same) R = rotation_zyx(given[2], given[1], given[0]);
    return true;
  }

  const ParamField& field_;
  const ConfigValue& value_;
  Sentence& why_;
};

// The parameter of that name, if there is one.
class Find final : public ParamVisitor {
 public:
  Find(Params& params, std::string_view name) noexcept : name_(name) { walk_params(params, *this); }
  [[nodiscard]] bool wants(std::string_view table) const noexcept override { return name_.starts_with(table); }
  void take(const ParamField& field) noexcept override {
    if (field.name != name_) return;
    found_ = field;
    found_.name = name_;
  }
  void ordered(std::string_view, std::string_view) noexcept override {}
  [[nodiscard]] bool found() const noexcept { return found_.value != nullptr; }
  [[nodiscard]] const ParamField& field() const noexcept { return found_; }
  [[nodiscard]] double number() const noexcept {
    switch (found_.kind) {
      case ParamField::Kind::kInt32:
        return *static_cast<const std::int32_t*>(found_.value);
      case ParamField::Kind::kUint32:
        return *static_cast<const std::uint32_t*>(found_.value);
      case ParamField::Kind::kInt64:
        return static_cast<double>(*static_cast<const std::int64_t*>(found_.value));
      case ParamField::Kind::kReal:
        return *static_cast<const double*>(found_.value);
      default:
        return 0.0;
    }
  }

 private:
  std::string_view name_;
  ParamField found_;
};

class ParamEntries final : public ConfigEntries {
 public:
  explicit ParamEntries(Params& params) noexcept : params_(params) {}
  [[nodiscard]] bool take(std::string_view name, std::uint32_t line, const ConfigValue& value,
                          Sentence& why) noexcept override {
    if (name.starts_with(kCamera)) return true;
    const Find param(params_, name);
    if (!param.found() || param.field().index >= kMaxParams) {
      why.append("is no parameter");
      return false;
    }
    if (line_of(param) != 0) {
      why.append("is given twice");
      return false;
    }
    lines_[param.field().index] = line;
    return FieldSetter(param.field(), value, why).set();
  }
  [[nodiscard]] std::uint32_t line_of(const Find& param) const noexcept { return lines_[param.field().index]; }

 private:
  Params& params_;
  std::array<std::uint32_t, kMaxParams> lines_{};  // that gives it; 0: none
};

// Where one parameter may not exceed another.
class CheckOrders final : public ParamVisitor {
 public:
  CheckOrders(Params& params, const ParamEntries& entries, Sentence& wrong) noexcept
      : params_(params), entries_(entries), wrong_(wrong) {
    walk_params(params, *this);
  }
  [[nodiscard]] bool wants(std::string_view) const noexcept override { return true; }
  void take(const ParamField&) noexcept override {}
  void ordered(std::string_view less, std::string_view more) noexcept override {
    const Find a(params_, less), b(params_, more);
    if (!good_ || !a.found() || !b.found() || a.number() <= b.number()) return;
    good_ = false;
    begin_sentence(wrong_, std::max(entries_.line_of(a), entries_.line_of(b)));  // the one that was said last
    wrong_.append(less);
    wrong_.append(", ");
    append(wrong_, a.number());
    wrong_.append(", must not be more than ");
    wrong_.append(more);
    wrong_.append(", ");
    append(wrong_, b.number());
    wrong_.append(".");
  }
  [[nodiscard]] bool good() const noexcept { return good_; }

 private:
  Params& params_;
  const ParamEntries& entries_;
  Sentence& wrong_;
  bool good_ = true;
};

// The keys of a camera file. A camera is named as a whole, or not at all: of half of one nobody knows the rest.
class CameraEntries final : public ConfigEntries {
 public:
  CameraEntries(Params& params, CameraIntrinsics& camera) noexcept
      : surfaces_(params.surfaces),
        keys_{{{"width", 32.0, kDepthWidth_px, nullptr, &camera.width_px},
               {"height", 32.0, kDepthHeight_px, nullptr, &camera.height_px},
               {"fx", 1.0, 1e5, &camera.fx_px},
               {"fy", 1.0, 1e5, &camera.fy_px},
               {"cx", -1e5, 1e5, &camera.cx_px},
               {"cy", -1e5, 1e5, &camera.cy_px},
               {"depth_unit_m", 1e-6, 0.1, &camera.depth_unit_m},
               {"min_depth_m", 0.001, 1000.0, &params.surfaces.limits.min_depth_m},
               {"max_depth_m", 0.001, 1000.0, &params.surfaces.limits.max_depth_m},
               {"noise_base_m", 1e-6, 1.0, &params.surfaces.noise.base_m},
               {"noise_per_metre", 0.0, 1.0, &params.surfaces.noise.per_metre},
               {"noise_quadratic_per_m", 0.0, 1.0, &params.surfaces.noise.quadratic_per_m},
               {"noise_correlated_share", 0.0, 1.0, &params.surfaces.noise.correlated_share},
               {"noise_correlated_px", 1.0, 1e6, &params.surfaces.noise.correlated_px}}} {}

  [[nodiscard]] bool take(std::string_view name, std::uint32_t line, const ConfigValue& value,
                          Sentence& why) noexcept override {
    if (!name.starts_with(kCamera)) return true;
    const auto key = std::ranges::find(keys_, part(name, kCamera.size()), &Key::name);
    if (key == keys_.end() || key->line != 0) {
      why.append(key == keys_.end() ? "is no key of a camera" : "is given twice");
      return false;
    }
    if (last_line_ == 0) {  // what a camera file may leave out is then as it is for one
      surfaces_.noise = {};
      surfaces_.limits = {.min_depth_m = 0.2, .max_depth_m = 6.0};
    }
    key->line = last_line_ = line;
    const bool whole = key->pixels != nullptr;
    if (!single_number(value, key->least, key->most, whole, why)) return false;
    if (key->pixels != nullptr) *key->pixels = static_cast<std::int32_t>(value.numbers[0].value);
    if (key->number != nullptr) *key->number = value.numbers[0].value;
    return true;
  }
  // What the camera is as a whole.
  [[nodiscard]] bool good(const CameraIntrinsics& camera, const DepthLimits& limits, Sentence& wrong) const noexcept {
    if (last_line_ == 0) return true;
    for (std::size_t i = 0; i < kRequired; ++i) {
      if (keys_[i].line == 0)
        return fail(wrong, keys_[i].name, " is missing; a camera is given with all that is its own");
    }
    if (camera.width_px % 8 != 0) return fail(wrong, "width", " must be a multiple of 8");
    if (camera.height_px % 2 != 0) return fail(wrong, "height", " must be even");
    if (!(limits.min_depth_m < limits.max_depth_m)) return fail(wrong, "min_depth_m", " must be less than max_depth_m");
    constexpr double kMostUnits = 65534.0;
    if (limits.min_depth_m > kMostUnits * camera.depth_unit_m) {
      return fail(wrong, "min_depth_m", " is more than 16 bits of depth_unit_m reach");
    }
    return true;
  }

 private:
  struct Key {
    std::string_view name;
    double least, most;
    double* number;
    std::int32_t* pixels = nullptr;
    std::uint32_t line = 0;  // that gives it; 0: none
  };
  static constexpr std::size_t kRequired = 7;  // the first ones
  [[nodiscard]] bool fail(Sentence& wrong, std::string_view key, std::string_view what) const noexcept {
    begin_sentence(wrong, last_line_);
    wrong.append(kCamera);
    wrong.append(key);
    wrong.append(what);
    wrong.append(".");
    return false;
  }

  SurfaceExtractor::Params& surfaces_;
  std::array<Key, 14> keys_;
  std::uint32_t last_line_ = 0;
};

}  // namespace

bool apply_config(std::string_view text, Params& params, CameraIntrinsics& camera, Sentence& wrong) noexcept {
  {
    CameraEntries entries(params, camera);
    if (!read_config(text, entries, wrong) || !entries.good(camera, params.surfaces.limits, wrong)) return false;
  }
  ParamEntries entries(params);
  return read_config(text, entries, wrong) && CheckOrders(params, entries, wrong).good();
}

}  // namespace polygmap::link
