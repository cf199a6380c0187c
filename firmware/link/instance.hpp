// SPDX-License-Identifier: Apache-2.0
// What lies in the memory that a caller of the C interface gives: the module with its executive, in one lane, and the
// ports between.
#pragma once

#include <cstdint>
#include <optional>
#include <type_traits>

#include "firmware/link/abi.hpp"
#include "firmware/link/config/config_text.hpp"
#include "firmware/link/pushed_ports.hpp"
#include "firmware/schedule.hpp"

namespace polygmap::link {

// By which memory is told from an instance: of none, of one whose configuration failed, and of one.
enum class Mark : std::uint64_t { kNone = 0, kFailed = 0x6c696166706d6770, kAlive = 0x6576696c706d6770 };

struct alignas(POLYGMAP_ALIGNMENT) Instance {
  Mark mark = Mark::kNone;
  Sentence wrong;  // of the configuration
  InstanceClock clock;
  PushedImu imu{clock};
  PushedJoints joints{clock};
  PushedLio lio{clock};
  PushedDepth depth{clock};
  PushedOperator operations;
  Params params;
  PerceptionTelemetry watched;
  std::optional<Pipeline> pipeline;
  std::optional<OneLaneExecutive<>> executive;

  Instance() noexcept = default;
  Instance(const Instance&) = delete;  // its parts refer to each other
  Instance& operator=(const Instance&) = delete;

  // False: `wrong` says why.
  [[nodiscard]] bool try_begin(const char* config) noexcept;
  // False: the stamp is out of order.
  [[nodiscard]] bool try_step(std::int64_t now_ns) noexcept;
};
static_assert(std::is_trivially_destructible_v<Instance>, "its memory may be used otherwise at any time");
static_assert(sizeof(Instance) <= POLYGMAP_MEMORY_BYTES);

}  // namespace polygmap::link
