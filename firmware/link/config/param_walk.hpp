// SPDX-License-Identifier: Apache-2.0
// Every parameter of the module by its full name, without the heap: the field lists that stand beside the structs
// (firmware/config/param_table.hpp explains them) are walked for a visitor.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include "algorithms/core/math/transform.hpp"
#include "firmware/link/config/fixed_text.hpp"

namespace polygmap {
struct Params;
namespace link {

inline constexpr std::size_t kMaxParams = 1024;
inline constexpr std::size_t kMaxParamName = 96;

// A parameter where it lives.
struct ParamField {
  enum class Kind : std::uint8_t { kFlag, kInt32, kUint32, kInt64, kReal, kReals, kChoice, kRotation };
  std::string_view name;  // with those of its tables: gait.planner.stand_off_m
  std::size_t index = 0;  // of all parameters, in the order of the walk
  Kind kind = Kind::kFlag;
  void* value = nullptr;
  std::size_t count = 1;                        // of kReals
  std::span<const std::string_view> choices{};  // of kChoice: the names of 0, 1, ...
  double least = 0.0, most = 0.0;
};

class ParamVisitor {
 public:
  // Whether it is to be told of what is in that table: "gait.planner.".
  [[nodiscard]] virtual bool wants(std::string_view table) const noexcept = 0;
  virtual void take(const ParamField& field) noexcept = 0;
  // One may not exceed the other.
  virtual void ordered(std::string_view less, std::string_view more) noexcept = 0;

 protected:
  ~ParamVisitor() = default;
};

void walk_params(Params& params, ParamVisitor& visitor) noexcept;

}  // namespace link
}  // namespace polygmap
