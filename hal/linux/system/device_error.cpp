// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/system/device_error.hpp"

#include <cstdarg>
#include <cstdio>
#include <cstring>

namespace polygmap::hal {

DeviceError system_error(const char* device, const char* what, int error_number) noexcept {
  DeviceError error{.kind = DeviceErrorKind::kSystem, .error_number = error_number};
  const char* text = ::strerrordesc_np(error_number);  // strerror may translate, and allocate for it
  std::snprintf(error.text.data(), error.text.size(), "%.100s: %s: %s", device, what,
                text != nullptr ? text : "unknown error");
  return error;
}

DeviceError device_error(DeviceErrorKind kind, const char* device, const char* format, ...) noexcept {
  DeviceError error{.kind = kind};
  const int used = std::snprintf(error.text.data(), error.text.size(), "%.100s: ", device);
  if (used < 0) return error;
  va_list arguments;
  va_start(arguments, format);
  const auto begin = static_cast<std::size_t>(used);
  std::vsnprintf(error.text.data() + begin, error.text.size() - begin, format, arguments);
  va_end(arguments);
  return error;
}

}  // namespace polygmap::hal
