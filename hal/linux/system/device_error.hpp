// SPDX-License-Identifier: Apache-2.0
// Why a device could not be opened: a kind for the program, a sentence for the user.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace polygmap::hal {

// Text of fixed capacity: a path, a name, an address. What does not fit makes it too long, and an open() refuses it.
template <std::size_t Capacity>
class FixedText {
 public:
  constexpr FixedText() noexcept = default;
  template <typename Text>
  requires std::convertible_to<const Text&, std::string_view>
  constexpr FixedText(const Text& source) noexcept {  // NOLINT(google-explicit-constructor): as a literal is
    const std::string_view text = source;
    too_long_ = text.size() > Capacity;
    for (std::size_t i = 0; i < text.size() && i < Capacity; ++i) chars_[i] = text[i];
  }
  [[nodiscard]] constexpr const char* c_str() const noexcept { return chars_.data(); }
  [[nodiscard]] constexpr std::string_view view() const noexcept { return chars_.data(); }
  [[nodiscard]] constexpr bool empty() const noexcept { return chars_[0] == '\0'; }
  [[nodiscard]] constexpr bool too_long() const noexcept { return too_long_; }

 private:
  std::array<char, Capacity + 1> chars_{};
  bool too_long_ = false;
};

enum class DeviceErrorKind : std::uint8_t {
  kNone,
  kConfiguration,  // a value of the Config cannot be used
  kSystem,         // a system call failed: error_number
  kUnsuitable,     // the device is there and is not what the driver needs
};

struct DeviceError {
  DeviceErrorKind kind = DeviceErrorKind::kNone;
  int error_number = 0;  // errno, of kSystem
  std::array<char, 256> text{};

  [[nodiscard]] bool failed() const noexcept { return kind != DeviceErrorKind::kNone; }
  // "can0: cannot bind the socket: No such device"; empty without a failure.
  [[nodiscard]] const char* sentence() const noexcept { return text.data(); }
};

// "device: what: the error's own text"
[[nodiscard]] DeviceError system_error(const char* device, const char* what, int error_number) noexcept;
// "device: " and a format of printf's.
[[nodiscard]] [[gnu::format(printf, 3, 4)]] DeviceError device_error(DeviceErrorKind kind, const char* device,
                                                                     const char* format, ...) noexcept;

}  // namespace polygmap::hal
