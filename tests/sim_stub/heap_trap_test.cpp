// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/heap_trap.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

namespace polygmap {

namespace {

// Volatile: the compiler may not drop the pair of malloc and free.
__attribute__((noinline)) int allocate_like_a_careless_stage(std::size_t count) {
  std::vector<int> values(count, 1);
  int* volatile kept = values.data();
  return kept[count - 1];
}
__attribute__((noinline)) void* allocate_outside() { return std::malloc(16); }

class HeapTrap : public testing::Test {
 protected:
  void SetUp() override {
    if (!heap::is_watching()) GTEST_SKIP() << "a sanitizer owns malloc in this build";
    heap::set_on_call(heap::OnCall::kAbort);
    heap::reset();
  }
  void TearDown() override { heap::set_on_call(heap::OnCall::kAbort); }
};
using HeapTrapDeathTest = HeapTrap;

TEST_F(HeapTrapDeathTest, Allocation_InsideModuleCall_AbortsAndNamesCallerAndScope) {
  EXPECT_DEATH(
      {
        const heap::ModuleCall call("perception");
        static_cast<void>(allocate_like_a_careless_stage(100));
      },
      "malloc called inside module call \"perception\" by polygmap::.*allocate_like_a_careless_stage");
}

TEST_F(HeapTrapDeathTest, EveryHeapFunction_InsideModuleCall_Aborts) {
  void* const block = std::malloc(8);
  const auto inside = [](auto&& function) {
    const heap::ModuleCall call("stage");
    function();
  };
  void* volatile out = nullptr;
  EXPECT_DEATH(inside([&] { out = std::malloc(8); }), "malloc called");
  EXPECT_DEATH(inside([&] { out = std::calloc(2, 8); }), "calloc called");
  EXPECT_DEATH(inside([&] { out = std::realloc(block, 64); }), "realloc called");
  EXPECT_DEATH(inside([&] { out = std::aligned_alloc(64, 64); }), "aligned_alloc called");
  EXPECT_DEATH(inside([&] {
                 void* p = nullptr;
                 EXPECT_EQ(posix_memalign(&p, 64, 64), 0);
                 out = p;
               }),
               "posix_memalign called");
  EXPECT_DEATH(inside([&] { out = ::operator new(8); }), "malloc called");
  EXPECT_DEATH(inside([&] { out = ::operator new (64, std::align_val_t{64}); }), "heap trap: .*alloc called");
  EXPECT_DEATH(inside([&] { std::free(block); }), "free called");
  std::free(block);
}

TEST_F(HeapTrapDeathTest, CallInsideSharedLibrary_InsideModuleCall_Aborts) {
  EXPECT_DEATH(
      {
        const heap::ModuleCall call("stage");
        static_cast<void>(::strdup("libc allocates this copy"));
      },
      "malloc called inside module call \"stage\"");
}

TEST_F(HeapTrap, Allocation_OutsideModuleCall_IsNotCounted) {
  { const heap::ModuleCall call("empty"); }
  const std::unique_ptr<void, void (*)(void*)> block(allocate_outside(), std::free);
  EXPECT_NE(block, nullptr);
  EXPECT_EQ(heap::report().calls, 0U);
}

TEST_F(HeapTrap, Allocation_OnAnotherThread_IsNotCounted) {
  std::atomic<bool> go{false};
  int last = 0;
  std::thread other([&] {
    while (!go) std::this_thread::yield();
    last = allocate_like_a_careless_stage(1000);
    go = false;
  });
  {
    const heap::ModuleCall call("stage");
    go = true;
    while (go) {
    }
  }
  other.join();
  EXPECT_EQ(last, 1);
  EXPECT_EQ(heap::report().calls, 0U);
}

TEST_F(HeapTrap, Allocation_InCountMode_CountsAndNamesTheFirstCaller) {
  heap::set_on_call(heap::OnCall::kCount);
  {
    const heap::ModuleCall outer("gait");
    {
      const heap::ModuleCall inner("swing");
      static_cast<void>(allocate_like_a_careless_stage(10));
    }
    std::free(allocate_outside());
  }
  const heap::Report report = heap::report();
  EXPECT_EQ(report.calls, 4U);
  EXPECT_EQ(report.first_module_call, "swing");
  EXPECT_NE(report.first_caller.find("allocate_like_a_careless_stage"), std::string::npos) << report.first_caller;
  heap::reset();
  EXPECT_EQ(heap::report().calls, 0U);
  EXPECT_TRUE(heap::report().first_caller.empty());
}

TEST_F(HeapTrap, HostCall_InsideModuleCall_MayAllocateAndReArms) {
  heap::set_on_call(heap::OnCall::kCount);
  const heap::ModuleCall call("stage");
  {
    const heap::HostCall host;
    static_cast<void>(allocate_like_a_careless_stage(10));
  }
  EXPECT_EQ(heap::report().calls, 0U);
  std::free(allocate_outside());
  EXPECT_EQ(heap::report().calls, 2U);
}

TEST_F(HeapTrap, FreeOfNull_InsideModuleCall_IsNoHeapCall) {
  void* volatile nothing = nullptr;
  const heap::ModuleCall call("stage");
  std::free(nothing);
  EXPECT_EQ(heap::report().calls, 0U);
}

}  // namespace
}  // namespace polygmap
