// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/system/heap_count.hpp"

#include <atomic>
#include <cerrno>
#include <cstddef>

// glibc's own entry points.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);
}

namespace polygmap::daemon {
namespace {

constinit std::atomic<bool> counting{false};
constinit std::atomic<std::uint64_t> calls{0};

void note_call() noexcept {
  if (counting.load(std::memory_order_relaxed)) calls.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

HeapCount counted_heap() noexcept {
  return {.start = []() noexcept { counting.store(true); },
          .stop = []() noexcept { counting.store(false); },
          .calls = []() noexcept { return calls.load(); }};
}

}  // namespace polygmap::daemon

using polygmap::daemon::note_call;

extern "C" {

__attribute__((noinline)) void* malloc(std::size_t size) noexcept {
  note_call();
  return __libc_malloc(size);
}

__attribute__((noinline)) void* calloc(std::size_t count, std::size_t size) noexcept {
  note_call();
  return __libc_calloc(count, size);
}

__attribute__((noinline)) void* realloc(void* block, std::size_t size) noexcept {
  note_call();
  return __libc_realloc(block, size);
}

__attribute__((noinline)) void* reallocarray(void* block, std::size_t count, std::size_t size) noexcept {
  note_call();
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  return __libc_realloc(block, bytes);
}

__attribute__((noinline)) void* memalign(std::size_t alignment, std::size_t size) noexcept {
  note_call();
  return __libc_memalign(alignment, size);
}

__attribute__((noinline)) void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  note_call();
  return __libc_memalign(alignment, size);
}

__attribute__((noinline)) int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  note_call();
  if (alignment % sizeof(void*) != 0 || alignment == 0 || (alignment & (alignment - 1)) != 0) return EINVAL;
  void* const block = __libc_memalign(alignment, size);
  if (block == nullptr) return ENOMEM;
  *out = block;
  return 0;
}

__attribute__((noinline)) void free(void* block) noexcept {
  if (block != nullptr) note_call();
  __libc_free(block);
}

}  // extern "C"
