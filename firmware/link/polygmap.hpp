// SPDX-License-Identifier: Apache-2.0
// polygmap.h for C++17: an instance that ends with its scope, and structs that know their size. A header alone; it
// throws nothing, allocates nothing and includes nothing but the standard library. The contracts stand in polygmap.h.
//
//   alignas(POLYGMAP_ALIGNMENT) static unsigned char memory[POLYGMAP_MEMORY_BYTES];
//   polygmap_module::Module module(memory, sizeof memory);
//   if (!module) return fail(module.why());
//   auto imu = polygmap_module::sized<polygmap_imu>();
//   ...
//   module.push(imu);
//   module.step(now_ns);
//   polygmap_command command;
//   if (module.read(command) == POLYGMAP_OK) send(command);
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "polygmap.h"

namespace polygmap_module {

// All zero but the size.
template <class Struct>
[[nodiscard]] constexpr Struct sized() noexcept {
  Struct value{};
  value.size = sizeof(Struct);
  return value;
}

class Module {
 public:
  // The memory outlives it. config: as for polygmap_create().
  Module(void* memory, std::size_t bytes, const char* config = nullptr) noexcept : memory_(memory) {
    error_ = polygmap_create(&instance_, memory, bytes, config);
  }
  ~Module() { polygmap_destroy(instance_); }
  Module(Module&& other) noexcept { swap(other); }
  Module& operator=(Module&& other) noexcept {
    Module(std::move(other)).swap(*this);
    return *this;
  }
  Module(const Module&) = delete;
  Module& operator=(const Module&) = delete;

  // False: it could not be made, or was moved from; then every call answers POLYGMAP_E_NULL.
  [[nodiscard]] explicit operator bool() const noexcept { return instance_ != nullptr; }
  [[nodiscard]] int error() const noexcept { return error_; }
  // Why it could not be made, as a sentence.
  [[nodiscard]] const char* why() const noexcept {
    return error_ == POLYGMAP_E_CONFIG ? polygmap_create_error(memory_) : polygmap_error_text(error_);
  }

  [[nodiscard]] int push(const polygmap_imu& sample) noexcept { return polygmap_push_imu(instance_, &sample); }
  [[nodiscard]] int push(const polygmap_joints& feedback) noexcept {
    return polygmap_push_joints(instance_, &feedback);
  }
  [[nodiscard]] int push(const polygmap_lio& pose) noexcept { return polygmap_push_lio(instance_, &pose); }
  [[nodiscard]] int push(const polygmap_depth& picture) noexcept { return polygmap_push_depth(instance_, &picture); }
  [[nodiscard]] int step(std::int64_t now_ns) noexcept { return polygmap_step(instance_, now_ns); }
  [[nodiscard]] int operate(polygmap_operation operation) noexcept { return polygmap_operate(instance_, operation); }
  [[nodiscard]] int go_to(double ahead_m, double left_m, double turn_rad, double up_m) noexcept {
    return polygmap_go_to(instance_, ahead_m, left_m, turn_rad, up_m);
  }

  // Their sizes need not be set.
  [[nodiscard]] int read(polygmap_command& to) const noexcept { return read(polygmap_read_command, to); }
  [[nodiscard]] int read(polygmap_plan& to) const noexcept { return read(polygmap_read_plan, to); }
  [[nodiscard]] int read(polygmap_pose& to) const noexcept { return read(polygmap_read_pose, to); }
  [[nodiscard]] int read(polygmap_status& to) const noexcept { return read(polygmap_read_status, to); }
  [[nodiscard]] int read(polygmap_faults& to) const noexcept { return read(polygmap_read_faults, to); }

  // For calls of polygmap.h; null where there is none.
  [[nodiscard]] polygmap* get() noexcept { return instance_; }
  [[nodiscard]] const polygmap* get() const noexcept { return instance_; }

  void swap(Module& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(instance_, other.instance_);
    std::swap(error_, other.error_);
  }

 private:
  template <class Struct>
  [[nodiscard]] int read(int (*function)(const polygmap*, Struct*), Struct& to) const noexcept {
    to.size = sizeof(Struct);
    return function(instance_, &to);
  }

  void* memory_ = nullptr;
  polygmap* instance_ = nullptr;
  int error_ = POLYGMAP_E_NULL;
};

}  // namespace polygmap_module
