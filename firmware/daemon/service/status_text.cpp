// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/status_text.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>

namespace polygmap::daemon {

void StatusText::add(const char* format, ...) noexcept {
  va_list arguments;
  va_start(arguments, format);
  const int wanted = std::vsnprintf(text.data() + length, text.size() - length, format, arguments);
  va_end(arguments);
  if (wanted > 0) length = std::min(length + static_cast<std::size_t>(wanted), text.size() - 1);
}

}  // namespace polygmap::daemon
