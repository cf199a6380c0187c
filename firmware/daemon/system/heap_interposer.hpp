// SPDX-License-Identifier: Apache-2.0
// malloc and its relatives of a whole program, glibc's behind them. A program that is linked with heap_interposer.cpp
// has them interposed, those of every thread and library in it; whoever watches them defines the hook. The daemon
// counts (heap_count.hpp), tests and simulation name the caller (sim_stub/heap_trap.hpp).
#pragma once

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define POLYGMAP_HEAP_IS_SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define POLYGMAP_HEAP_IS_SANITIZED 1
#endif

#ifndef POLYGMAP_HEAP_IS_SANITIZED  // a sanitizer owns malloc
namespace polygmap::heap {

// Called by each of them before it does anything; not by a free of nothing, which touches no heap. function: a literal.
void on_heap_call(const char* function) noexcept;

}  // namespace polygmap::heap
#endif
