// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/device_counts.hpp"

#include <cinttypes>
#include <utility>

namespace polygmap::daemon {

void DeviceCounts::add(std::string device, std::size_t lane, std::vector<Counter> counters) {
  const std::size_t count = counters.size();
  devices_.push_back(std::make_unique<Device>(Device{std::move(device), lane, std::move(counters),
                                                     std::vector<std::atomic<std::uint32_t>>(count),
                                                     std::vector<std::uint32_t>(count)}));
}

void DeviceCounts::publish(std::size_t lane) noexcept {
  for (const auto& device : devices_) {
    if (device->lane != lane) continue;
    for (std::size_t i = 0; i < device->counters.size(); ++i) {
      device->published[i].store(device->counters[i].read(), std::memory_order_relaxed);
    }
  }
}

void DeviceCounts::write_trouble(StatusText& out) noexcept {
  const char* before_device = "";
  for (const auto& device : devices_) {
    const char* before = "";
    for (std::size_t i = 0; i < device->counters.size(); ++i) {
      if (device->counters[i].means != CounterMeans::kTrouble) continue;
      const std::uint32_t count = device->published[i].load(std::memory_order_relaxed);
      const std::uint32_t more = count - device->told[i];
      if (more == 0) continue;
      device->told[i] = count;
      if (*before == '\0') out.add("%s%s: ", before_device, device->name.c_str());
      out.add("%s%s %" PRIu32 " (+%" PRIu32 ")", before, device->counters[i].name, count, more);
      before = ", ";
      before_device = "; ";
    }
  }
}

std::string DeviceCounts::text() const {
  std::string all;
  for (const auto& device : devices_) {
    all.append("device ").append(device->name);
    for (std::size_t i = 0; i < device->counters.size(); ++i) {
      const std::uint32_t count = device->published[i].load(std::memory_order_relaxed);
      all.append(" ").append(device->counters[i].name).append("=").append(std::to_string(count));
    }
    all += "\n";
  }
  return all;
}

}  // namespace polygmap::daemon
