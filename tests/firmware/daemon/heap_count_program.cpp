// SPDX-License-Identifier: Apache-2.0
// The daemon's interposer, in a program of its own: GoogleTest's programs have the heap trap's. Linked statically, as
// the daemon is. Exit code 0: every call between start() and stop() was counted, and no other.
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>

#include "firmware/daemon/system/heap_count.hpp"

namespace {

int bad = 0;

template <typename Do>
void expect(const char* what, std::uint64_t calls, Do&& act) {
  const polygmap::daemon::HeapCount heap = polygmap::daemon::counted_heap();
  const std::uint64_t before = heap.calls();
  heap.start();
  act();
  heap.stop();
  const std::uint64_t made = heap.calls() - before;
  if (made == calls) return;
  std::fprintf(stderr, "%s: %llu calls counted instead of %llu\n", what, static_cast<unsigned long long>(made),
               static_cast<unsigned long long>(calls));
  ++bad;
}
// The compiler may leave out what nobody looks at.
void look_at(void* block) { asm volatile("" : : "r"(block) : "memory"); }

}  // namespace

int main() {
  expect("nothing", 0, [] {});
  expect("malloc and free", 2, [] {
    void* const block = std::malloc(10);
    look_at(block);
    std::free(block);
  });
  expect("free of nothing", 0, [] { std::free(nullptr); });
  expect("calloc, realloc, free", 3, [] {
    void* block = std::calloc(2, 8);
    block = std::realloc(block, 100);
    look_at(block);
    std::free(block);
  });
  expect("aligned_alloc, posix_memalign and two frees", 4, [] {
    void* first = std::aligned_alloc(64, 128);
    void* second = nullptr;
    if (posix_memalign(&second, 256, 10) != 0) ++bad;
    look_at(first);
    look_at(second);
    std::free(first);
    std::free(second);
  });
  expect("a text that is long", 2, [] {
    const std::string text(100, 'x');
    look_at(const_cast<char*>(text.data()));
  });
  std::atomic<int> turn{0};
  std::thread other([&turn] {
    while (turn != 1) std::this_thread::yield();
    void* const block = std::malloc(10);
    look_at(block);
    std::free(block);
    turn = 2;
    while (turn != 3) std::this_thread::yield();
  });
  expect("another thread's malloc and free", 2, [&turn] {
    turn = 1;
    while (turn != 2) std::this_thread::yield();
  });
  turn = 3;
  other.join();
  look_at(std::malloc(1));  // after stop(): not counted
  expect("nothing again", 0, [] {});
  return bad == 0 ? 0 : 1;
}
