// SPDX-License-Identifier: Apache-2.0
// What only the simulation knows, as topics of a recording: truth, stairs, small pictures, the verdict.
#pragma once

#include <string_view>
#include <vector>

#include "firmware/recording/recorder.hpp"
#include "sim_stub/host/record/preview_camera.hpp"
#include "sim_stub/world/stair_world.hpp"
#include "sim_stub/world/truth.hpp"

namespace polygmap::sim {

class TruthTopics {
 public:
  // Both outlive this.
  TruthTopics(recording::Recorder& recorder, const StairWorld& stairs)
      : recorder_(recorder), stairs_(stairs), memory_(kMemory_bytes) {}

  // Between ticks; with the first truth the stairs.
  void write(const Truth& truth);
  void write(const Preview& preview);
  void write_verdict(std::string_view json, std::int64_t now_ns);

 private:
  static constexpr std::size_t kMemory_bytes = 192U * 1024U;
  [[nodiscard]] mcap::CdrWriter message() noexcept { return mcap::CdrWriter(memory_); }
  void send(recording::Topic topic, std::int64_t stamp_ns, const mcap::CdrWriter& message);

  void write_stairs(std::int64_t now_ns);

  recording::Recorder& recorder_;
  const StairWorld& stairs_;
  std::vector<std::byte> memory_;
  Truth last_;
};

}  // namespace polygmap::sim
