// SPDX-License-Identifier: Apache-2.0
// The lines of a configuration, without the heap: the part of TOML that parameter and camera files are made of. That is
// tables, keys, and values that are true, false, a number, a text without backslashes, or numbers in brackets. Anything
// else is refused with its line.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "algorithms/core/containers/static_vector.hpp"
#include "firmware/link/config/fixed_text.hpp"

namespace polygmap::link {

inline constexpr std::size_t kMaxConfigName = 128;

struct ConfigNumber {
  double value = 0.0;
  std::string_view text;  // as it was written
};
struct ConfigValue {
  enum class Kind : std::uint8_t { kFlag, kNumber, kText, kNumbers };
  Kind kind = Kind::kFlag;
  bool flag = false;
  std::string_view text;
  StaticVector<ConfigNumber, 16> numbers;  // one of kNumber
};

// What is wrong, and where.
using Sentence = FixedText<240>;

class ConfigEntries {
 public:
  // name: with that of its table. False: it cannot be used, and why says so, as what may follow the name.
  [[nodiscard]] virtual bool take(std::string_view name, std::uint32_t line, const ConfigValue& value,
                                  Sentence& why) noexcept = 0;

 protected:
  ~ConfigEntries() = default;
};

// False: wrong has a sentence with line and key, and some entries may have been taken.
[[nodiscard]] bool read_config(std::string_view text, ConfigEntries& entries, Sentence& wrong) noexcept;

// "config, line 7: "
void begin_sentence(Sentence& sentence, std::uint32_t line) noexcept;

}  // namespace polygmap::link
