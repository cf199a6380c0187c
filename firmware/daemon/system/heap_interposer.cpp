// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/system/heap_interposer.hpp"

#ifndef POLYGMAP_HEAP_IS_SANITIZED

#include <cerrno>
#include <cstddef>

// glibc's own entry points: no dlsym, which allocates before main.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);
}

using polygmap::heap::on_heap_call;

extern "C" {

__attribute__((noinline)) void* malloc(std::size_t size) noexcept {
  on_heap_call("malloc");
  return __libc_malloc(size);
}

__attribute__((noinline)) void* calloc(std::size_t count, std::size_t size) noexcept {
  on_heap_call("calloc");
  return __libc_calloc(count, size);
}

__attribute__((noinline)) void* realloc(void* block, std::size_t size) noexcept {
  on_heap_call("realloc");
  return __libc_realloc(block, size);
}

__attribute__((noinline)) void* reallocarray(void* block, std::size_t count, std::size_t size) noexcept {
  on_heap_call("reallocarray");
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  return __libc_realloc(block, bytes);
}

__attribute__((noinline)) void* memalign(std::size_t alignment, std::size_t size) noexcept {
  on_heap_call("memalign");
  return __libc_memalign(alignment, size);
}

__attribute__((noinline)) void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  on_heap_call("aligned_alloc");
  return __libc_memalign(alignment, size);
}

__attribute__((noinline)) int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  on_heap_call("posix_memalign");
  if (alignment % sizeof(void*) != 0 || alignment == 0 || (alignment & (alignment - 1)) != 0) return EINVAL;
  void* const block = __libc_memalign(alignment, size);
  if (block == nullptr) return ENOMEM;
  *out = block;
  return 0;
}

// Freeing nothing touches no heap.
__attribute__((noinline)) void free(void* block) noexcept {
  if (block == nullptr) return;
  on_heap_call("free");
  __libc_free(block);
}

}  // extern "C"

#endif
