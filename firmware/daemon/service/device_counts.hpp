// SPDX-License-Identifier: Apache-2.0
// What the drivers count, on its way from the lanes, which own the counters, to the daemon's own thread, which says in
// the journal what means trouble, and all of it at the end.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "firmware/daemon/service/status_text.hpp"

namespace polygmap::daemon {

enum class CounterMeans : std::uint8_t { kWork, kTrouble };

class DeviceCounts {
 public:
  struct Counter {
    const char* name;
    CounterMeans means;
    std::function<std::uint32_t()> read;
  };

  // Before the lanes start. lane: whose rows call the driver.
  void add(std::string device, std::size_t lane, std::vector<Counter> counters);

  // On that lane's thread: reads the counters of its devices. Allocates nothing, waits for nobody.
  void publish(std::size_t lane) noexcept;

  // On the daemon's own thread. Appends "can0: refused 12 (+3), lost 4 (+4); imu: corrupted 1 (+1)": what means trouble
  // and rose since this was called last. Nothing when nothing rose.
  void write_trouble(StatusText& out) noexcept;
  // "device can0 received=12 ...": a line for each device with all its counters.
  [[nodiscard]] std::string text() const;

 private:
  struct Device {
    std::string name;
    std::size_t lane;
    std::vector<Counter> counters;
    std::vector<std::atomic<std::uint32_t>> published;
    std::vector<std::uint32_t> told;
  };
  std::vector<std::unique_ptr<Device>> devices_;
};

}  // namespace polygmap::daemon
