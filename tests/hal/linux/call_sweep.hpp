// SPDX-License-Identifier: Apache-2.0
// A device is opened, read and closed again and again; every system call that this makes fails once with every errno.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>

#include "tests/hal/linux/scripted_calls.hpp"

namespace polygmap::test {

struct SweepOutcome {
  bool opened = false;
  int read = 0;                // samples, of those that were sent
  std::uint32_t failures = 0;  // as the device counts them
};

// use(calls) -> SweepOutcome does all of it, and reads `sent` samples where nothing fails. Every fault is told by
// open(), counted, or harmless(call, errno); whatever failed, nothing stays open. least_read(call) -> of a device that
// was opened, the samples that come all the same.
template <class Use, class Harmless, class LeastRead>
void sweep_failing_calls(int sent, Use&& use, Harmless&& harmless, LeastRead&& least_read) {
  std::size_t calls_made = 0;
  {
    ScriptedCalls calls;
    const SweepOutcome o = use(calls);
    EXPECT_TRUE(o.opened);
    EXPECT_EQ(o.read, sent);
    EXPECT_EQ(o.failures, 0U);
    EXPECT_EQ(calls.open_descriptors(), 0);
    calls_made = calls.all_calls();
  }
  ASSERT_GT(calls_made, 10U);
  for (const int error_number : kErrors) {
    for (std::size_t nth = 0; nth < calls_made; ++nth) {
      ScriptedCalls calls;
      calls.fail_any(nth, error_number);
      const SweepOutcome o = use(calls);
      EXPECT_EQ(calls.open_descriptors(), 0) << nth << " " << error_number;
      if (!calls.failed_any()) {  // packets that come together take a read less
        EXPECT_LE(calls.all_calls(), nth);
        EXPECT_GE(nth + 3, calls_made);
        continue;
      }
      const Call hit = *calls.failed_any();
      EXPECT_TRUE(harmless(hit, error_number) || !o.opened || o.failures > 0) << nth << " " << error_number;
      if (o.opened) {
        EXPECT_GE(o.read, least_read(hit)) << nth << " " << error_number;
        EXPECT_LE(o.read, sent) << nth << " " << error_number;
      }
    }
  }
}

// Of a UDP device: without its options nothing is lost, and to have nothing to read is no failure.
[[nodiscard]] inline bool is_harmless_to_udp(Call hit, int error_number) {
  return hit == Call::kClose || hit == Call::kSetsockopt || (hit == Call::kRecvmmsg && error_number == EAGAIN);
}

}  // namespace polygmap::test
