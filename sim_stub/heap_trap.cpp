// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/heap_trap.hpp"

#include "firmware/daemon/system/heap_interposer.hpp"

#ifdef POLYGMAP_HEAP_IS_SANITIZED

namespace polygmap::heap {

void set_on_call(OnCall) noexcept {}
ModuleCall::ModuleCall(const char* name) noexcept : outer_(name) {}
ModuleCall::~ModuleCall() { static_cast<void>(outer_); }
HostCall::HostCall() noexcept : outer_(nullptr) {}
HostCall::~HostCall() { static_cast<void>(outer_); }
Report report() { return {}; }
void reset() noexcept {}
bool is_watching() noexcept { return false; }

}  // namespace polygmap::heap

#else

#include <cxxabi.h>
#include <dlfcn.h>
#include <elf.h>
#include <execinfo.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

namespace polygmap::heap {
namespace {

constexpr int kMaxFrames = 24;

// Initial-exec: reading it must not allocate either.
__attribute__((tls_model("initial-exec"))) constinit thread_local const char* armed = nullptr;

constinit std::atomic<OnCall> action{OnCall::kAbort};
constinit std::atomic<std::uint64_t> calls{0};
constinit std::atomic<bool> first_is_taken{false};
constinit std::atomic<bool> first_is_complete{false};

struct CallSite {
  const char* module_call = nullptr;
  std::array<void*, kMaxFrames> frames{};
  int frame_count = 0;
};
constinit CallSite first{};

// The program's own symbol table, static functions included. Opened only when there is something to name.
class ProgramSymbols {
 public:
  ProgramSymbols() {
    dl_iterate_phdr(
        [](dl_phdr_info* info, std::size_t, void* base) {
          *static_cast<ElfW(Addr)*>(base) = info->dlpi_addr;
          return 1;  // the first object is the program
        },
        &base_);
    std::ifstream file("/proc/self/exe", std::ios::binary);
    image_.assign(std::istreambuf_iterator<char>(file), {});
  }

  // Empty when no function of the program covers the address.
  [[nodiscard]] std::string mangled_name_at(const void* address) const {
    ElfW(Ehdr) header{};
    if (!read(0, header) || std::memcmp(static_cast<const void*>(header.e_ident), ELFMAG, SELFMAG) != 0) return {};
    const ElfW(Addr) wanted = reinterpret_cast<ElfW(Addr)>(address) - base_;
    for (std::size_t i = 0; i < header.e_shnum; ++i) {
      ElfW(Shdr) table{};
      ElfW(Shdr) strings{};
      if (!read(header.e_shoff + i * sizeof(table), table) || table.sh_type != SHT_SYMTAB) continue;
      if (!read(header.e_shoff + table.sh_link * sizeof(strings), strings)) continue;
      for (std::size_t offset = 0; offset + sizeof(ElfW(Sym)) <= table.sh_size; offset += sizeof(ElfW(Sym))) {
        ElfW(Sym) symbol{};
        if (!read(table.sh_offset + offset, symbol) || (symbol.st_info & 0xf) != STT_FUNC) continue;
        const std::size_t name_at = strings.sh_offset + symbol.st_name;
        if (wanted - symbol.st_value < symbol.st_size && name_at < image_.size()) return image_.data() + name_at;
      }
    }
    return {};
  }

 private:
  template <typename T>
  bool read(std::size_t offset, T& out) const {
    if (offset > image_.size() || image_.size() - offset < sizeof(T)) return false;
    std::memcpy(&out, image_.data() + offset, sizeof(T));
    return true;
  }
  ElfW(Addr) base_ = 0;
  std::string image_;
};

struct Frame {
  std::string function;
  bool is_program = false;  // not of a shared library
};

Frame frame_at(const ProgramSymbols& symbols, void* return_address) {
  void* const call = static_cast<char*>(return_address) - 1;  // a call that never returns may end its function
  Frame frame{symbols.mangled_name_at(call), true};
  if (frame.function.empty()) {
    Dl_info info{};
    if (dladdr(call, &info) != 0 && info.dli_sname != nullptr) frame.function = info.dli_sname;
    frame.is_program = false;
  }
  int status = 0;
  char* const demangled = abi::__cxa_demangle(frame.function.c_str(), nullptr, nullptr, &status);
  if (status == 0) frame.function = demangled;
  std::free(demangled);
  return frame;
}

bool is_in(const char* scope, const std::string& function) {
  const std::size_t at = function.find(scope);
  return at != std::string::npos && at < function.find('(');
}
bool is_interposer(const std::string& function) {
  constexpr std::array kNames{"malloc",   "calloc",        "realloc",        "reallocarray",
                              "memalign", "aligned_alloc", "posix_memalign", "free"};
  return std::find(kNames.begin(), kNames.end(), function) != kNames.end() || is_in("polygmap::heap::", function);
}

// The functions on the stack, innermost first, without the trap's own.
std::vector<Frame> frames_of(const CallSite& site) {
  const ProgramSymbols symbols;
  std::vector<Frame> frames;
  for (int i = 0; i < site.frame_count; ++i) {
    Frame frame = frame_at(symbols, site.frames[static_cast<std::size_t>(i)]);
    if (!is_interposer(frame.function)) frames.push_back(std::move(frame));
  }
  return frames;
}

// The innermost function of namespace polygmap; where none is on the stack, the innermost of the program itself.
std::string caller_among(const std::vector<Frame>& frames) {
  const auto ours =
      std::find_if(frames.begin(), frames.end(), [](const Frame& f) { return is_in("polygmap::", f.function); });
  if (ours != frames.end()) return ours->function;
  const auto program = std::find_if(frames.begin(), frames.end(), [](const Frame& f) { return f.is_program; });
  return program != frames.end() ? program->function : "unknown";
}

__attribute__((noinline)) void note_call(const char* function, const char* module_call) {
  calls.fetch_add(1, std::memory_order_relaxed);
  const bool aborts = action.load(std::memory_order_relaxed) == OnCall::kAbort;
  if (!aborts && first_is_taken.exchange(true)) return;
  CallSite site{module_call, {}, 0};
  site.frame_count = backtrace(site.frames.data(), kMaxFrames);
  if (aborts) {
    const std::vector<Frame> frames = frames_of(site);
    std::fprintf(stderr, "heap trap: %s called inside module call \"%s\" by %s\n", function, module_call,
                 caller_among(frames).c_str());
    for (const Frame& frame : frames)
      std::fprintf(stderr, "  in %s\n", frame.function.empty() ? "?" : frame.function.c_str());
    std::fflush(stderr);
    std::abort();
  }
  first = site;
  first_is_complete.store(true, std::memory_order_release);
}

}  // namespace

// Disarmed meanwhile: naming the caller uses the heap itself.
void on_heap_call(const char* function) noexcept {
  if (armed == nullptr) [[likely]] {
    return;
  }
  const char* const module_call = armed;
  armed = nullptr;
  note_call(function, module_call);
  armed = module_call;
}

void set_on_call(OnCall on_call) noexcept { action.store(on_call, std::memory_order_relaxed); }

ModuleCall::ModuleCall(const char* name) noexcept : outer_(armed) { armed = name; }
ModuleCall::~ModuleCall() { armed = outer_; }
HostCall::HostCall() noexcept : outer_(armed) { armed = nullptr; }
HostCall::~HostCall() { armed = outer_; }

Report report() {
  const HostCall host;
  Report result;
  result.calls = calls.load(std::memory_order_relaxed);
  if (first_is_complete.load(std::memory_order_acquire)) {
    result.first_module_call = first.module_call;
    result.first_caller = caller_among(frames_of(first));
  }
  return result;
}

void reset() noexcept {
  calls.store(0, std::memory_order_relaxed);
  first_is_complete.store(false, std::memory_order_relaxed);
  first_is_taken.store(false, std::memory_order_release);
}

bool is_watching() noexcept { return true; }

}  // namespace polygmap::heap

#endif
