// SPDX-License-Identifier: Apache-2.0
// Proves that the module makes no heap call. A program that links this has malloc and its relatives interposed, shared
// libraries' calls included; they are watched per thread, exactly while a module call is on the stack.
#pragma once

#include <cstdint>
#include <string>

namespace polygmap::heap {

enum class OnCall : std::uint8_t {
  kAbort,  // name the caller on stderr and abort: tests
  kCount,  // count, remember the first caller and go on: programs that must not fall over on the robot
};

// For the whole process; kAbort until set.
void set_on_call(OnCall action) noexcept;

// While one lives, this thread may not touch the heap. Nests.
class [[nodiscard]] ModuleCall {
 public:
  // name: a string literal, e.g. the stage.
  explicit ModuleCall(const char* name) noexcept;
  ~ModuleCall();
  ModuleCall(const ModuleCall&) = delete;
  ModuleCall& operator=(const ModuleCall&) = delete;

 private:
  const char* outer_;
};

// Host code that a module call calls back (a simulated port) and that may use the heap.
class [[nodiscard]] HostCall {
 public:
  HostCall() noexcept;
  ~HostCall();
  HostCall(const HostCall&) = delete;
  HostCall& operator=(const HostCall&) = delete;

 private:
  const char* outer_;
};

// All heap calls made inside module calls since the start or the last reset, of all threads.
struct Report {
  std::uint64_t calls = 0;
  std::string first_module_call;  // name of the scope; empty when there was none
  std::string first_caller;       // function that made the first call
};
[[nodiscard]] Report report();
void reset() noexcept;

// False where a sanitizer owns malloc: then nothing is watched and report() stays empty.
[[nodiscard]] bool is_watching() noexcept;

}  // namespace polygmap::heap
