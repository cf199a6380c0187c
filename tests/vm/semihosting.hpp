// SPDX-License-Identifier: Apache-2.0
// Files of the emulator's host, by Arm's semihosting calls; the emulator has to allow them to user space. A call takes
// no time of the guest, however long the host takes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace polygmap::vm {

class HostFile {
 public:
  enum class Mode : std::uintptr_t { kRead = 1, kWrite = 5 };  // "rb", "wb"

  HostFile(const std::string& path, Mode mode) noexcept {
    const Words words{reinterpret_cast<std::uintptr_t>(path.c_str()), static_cast<std::uintptr_t>(mode), path.size()};
    handle_ = call(kOpen, words);
  }
  [[nodiscard]] bool is_open() const noexcept { return handle_ >= 0; }
  // False: the file ended, or cannot be read. The memory has to be there: a page that was never touched is not.
  [[nodiscard]] bool read(void* data, std::size_t bytes) const noexcept { return whole(kRead, data, bytes); }
  [[nodiscard]] bool write(const void* data, std::size_t bytes) const noexcept {
    return whole(kWrite, const_cast<void*>(data), bytes);
  }

 private:
  struct Words {
    std::uintptr_t word[3];
  };
  enum Operation : std::uintptr_t { kOpen = 0x01, kWrite = 0x05, kRead = 0x06 };

  // Both say how many bytes they left.
  [[nodiscard]] bool whole(Operation operation, void* data, std::size_t bytes) const noexcept {
    auto* at = static_cast<std::byte*>(data);
    while (bytes > 0) {
      const Words words{static_cast<std::uintptr_t>(handle_), reinterpret_cast<std::uintptr_t>(at), bytes};
      const std::intptr_t left = call(operation, words);
      if (left < 0 || static_cast<std::size_t>(left) >= bytes) return false;
      at += bytes - static_cast<std::size_t>(left);
      bytes = static_cast<std::size_t>(left);
    }
    return true;
  }
  [[nodiscard]] static std::intptr_t call(Operation operation, const Words& words) noexcept {
#if defined(__aarch64__)
    register std::uintptr_t x0 asm("x0") = operation;
    register const Words* x1 asm("x1") = &words;
    asm volatile("hlt #0xf000" : "+r"(x0) : "r"(x1) : "memory");
    return static_cast<std::intptr_t>(x0);
#else
    static_cast<void>(operation), static_cast<void>(words);
    return -1;  // no emulated machine
#endif
  }

  std::intptr_t handle_ = -1;
};

}  // namespace polygmap::vm
