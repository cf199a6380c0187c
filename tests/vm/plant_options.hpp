// SPDX-License-Identifier: Apache-2.0
// What guest_plant is told, and what goes wrong on its buses.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "algorithms/core/time.hpp"

namespace polygmap::vm {

[[noreturn]] inline void refuse(const std::string& why) {
  std::fprintf(stderr, "guest_plant: %s\n", why.c_str());
  std::exit(2);
}

// From at_ns on, counted from the first command with gains; for so long.
struct PlantInjection {
  enum class What { kNothing, kUnplug, kBusOff, kGarbage, kDuplicate, kGap } what = What::kNothing;
  std::size_t number = 0;  // drive or bus
  std::int64_t at_ns = 0, lasts_ns = INT64_MAX / 4;

  [[nodiscard]] bool has_begun(What asked, std::int64_t since_ns) const noexcept {
    return what == asked && since_ns >= at_ns;
  }
  [[nodiscard]] bool is_on(What asked, std::int64_t since_ns) const noexcept {
    return has_begun(asked, since_ns) && since_ns - at_ns < lasts_ns;
  }
};

struct PlantOptions {
  std::string bus_file, requests, pictures, witness, notify;
  std::uint64_t seed = 1;
  int steps = 4;
  int imu_port = 56401, lio_port = 5601;
  std::int64_t latency_ns = 0;  // from the middle of an exposure to its picture's stamp
  PlantInjection injection;
};

// unplug=DRIVE[+MS], busoff=BUS[+MS], garbage=BUS[+MS], duplicate=DRIVE[+MS] or gap=MS, each with @SECONDS.
inline PlantInjection parse_injection(const std::string& text) {
  using What = PlantInjection::What;
  constexpr std::array<std::pair<std::string_view, What>, 5> kKinds{{{"unplug=", What::kUnplug},
                                                                     {"busoff=", What::kBusOff},
                                                                     {"garbage=", What::kGarbage},
                                                                     {"duplicate=", What::kDuplicate},
                                                                     {"gap=", What::kGap}}};
  PlantInjection injection;
  for (const auto& [name, what] : kKinds) {
    if (!text.starts_with(name)) continue;
    char* end = nullptr;
    const unsigned long number = std::strtoul(text.c_str() + name.size(), &end, 10);
    injection.what = what;
    if (what == What::kGap) injection.lasts_ns = static_cast<std::int64_t>(number) * kNsPerMs;
    if (what != What::kGap) injection.number = number;
    if (*end == '+' && what != What::kGap) {
      injection.lasts_ns = static_cast<std::int64_t>(std::strtoul(end + 1, &end, 10)) * kNsPerMs;
    }
    if (*end != '@') break;
    const double seconds = std::strtod(end + 1, &end);
    if (*end != '\0' || !(seconds >= 0.0 && seconds < 1e4)) break;
    injection.at_ns = static_cast<std::int64_t>(seconds * 1e9);
    return injection;
  }
  refuse(
      "--inject takes unplug=DRIVE[+MS], busoff=BUS[+MS], garbage=BUS[+MS], duplicate=DRIVE[+MS] or gap=MS, @ and "
      "seconds: " +
      text);
}

inline PlantOptions parse_options(int argc, char** argv) {
  PlantOptions options;
  if (argc < 4 || argc % 2 != 0) {
    refuse(
        "usage: BUS_FILE REQUESTS PICTURES [--seed N] [--steps N] [--latency MS] [--witness FILE] [--notify NAME] "
        "[--inject "
        "WHAT@S]");
  }
  options.bus_file = argv[1];
  options.requests = argv[2];
  options.pictures = argv[3];
  for (int i = 4; i + 1 < argc; i += 2) {
    const std::string_view key = argv[i];
    const char* value = argv[i + 1];
    if (key == "--seed") {
      options.seed = std::strtoull(value, nullptr, 10);
    } else if (key == "--steps") {
      options.steps = std::atoi(value);
    } else if (key == "--latency") {
      options.latency_ns = std::atoi(value) * kNsPerMs;
    } else if (key == "--witness") {
      options.witness = value;
    } else if (key == "--notify") {
      options.notify = value;
    } else if (key == "--inject") {
      options.injection = parse_injection(value);
    } else {
      refuse("unknown option " + std::string(key));
    }
  }
  return options;
}

}  // namespace polygmap::vm
