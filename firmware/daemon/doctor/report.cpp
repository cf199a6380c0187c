// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>

#include "firmware/daemon/config/daemon_config.hpp"
#include "firmware/daemon/doctor/doctor.hpp"

namespace polygmap::daemon {
namespace {

constexpr std::uint32_t kCycles = 1000;  // two seconds

std::string_view name_of(Verdict verdict) {
  constexpr std::array<std::string_view, 3> kNames{"good", "warning", "bad"};
  return kNames[static_cast<std::size_t>(verdict)];
}
std::string in_quotes(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (static_cast<unsigned char>(c) >= 0x20) quoted += c;
  }
  return quoted + "\"";
}
DoctorInput input_of(const DaemonConfig& config) {
  DoctorInput input;
  input.buses = config.bus.buses;
  input.bitrate_bps = config.bus.table.bitrate_bps;
  input.camera = config.camera.device.view();
  input.priority = 1;
  input.lanes = config.lanes;
  input.warnings = config.warnings;
  for (std::size_t lane = 0; lane < config.lanes; ++lane) {
    const LaneThread::Placement& placement = config.placement[lane];
    const bool is_known = std::ranges::find(input.processors, placement.processor) != input.processors.end();
    if (placement.processor >= 0 && !is_known) input.processors.push_back(placement.processor);
    input.priority = std::max(input.priority, static_cast<std::uint64_t>(placement.priority));
  }
  return input;
}

}  // namespace

std::vector<LaneWakeUps> lanes_of(const DaemonConfig& config) {
  constexpr std::array kNames{"control", "perception"};
  std::vector<LaneWakeUps> lanes;
  for (std::size_t n = 0; n < config.lanes; ++n) {
    lanes.push_back({config.lanes == 1 ? "all" : kNames[n], config.placement[n], {}});
  }
  return lanes;
}

std::string text_of(const std::vector<Finding>& findings, const std::vector<LaneWakeUps>& lanes) {
  std::string text;
  for (const Finding& finding : findings) {
    std::string head(name_of(finding.verdict));
    head.resize(9, ' ');
    text += head + finding.name + ": " + finding.what + "\n";
    if (!finding.to_do.empty()) text += "         Do: " + finding.to_do + "\n";
  }
  for (const LaneWakeUps& lane : lanes) {
    text.append("wake-ups")
        .append(lane.lane.empty() ? "" : " of ")
        .append(lane.lane)
        .append(" by how late they came:\n");
    for (std::size_t bucket = 0; bucket < WakeUps::kBuckets; ++bucket) {
      const bool is_last = bucket + 1 == WakeUps::kBuckets;
      std::array<char, 64> line{};
      std::snprintf(line.data(), line.size(), "  %s %5u us %6u\n", is_last ? "from " : "below",
                    WakeUps::below_us(is_last ? bucket - 1 : bucket), lane.wake_ups.counts[bucket]);
      text += line.data();
    }
  }
  return text;
}

std::string json_of(const std::vector<Finding>& findings, const std::vector<LaneWakeUps>& lanes) {
  std::string json = "{\"findings\": [";
  for (std::size_t i = 0; i < findings.size(); ++i) {
    const Finding& finding = findings[i];
    json.append(i == 0 ? "\n" : ",\n").append("  {\"name\": ").append(in_quotes(finding.name));
    json.append(", \"verdict\": ").append(in_quotes(name_of(finding.verdict)));
    json.append(", \"what\": ").append(in_quotes(finding.what)).append(", \"do\": ").append(in_quotes(finding.to_do));
    json += "}";
  }
  json += "],\n \"wake_ups\": [";
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const WakeUps& wake_ups = lanes[i].wake_ups;
    json.append(i == 0 ? "\n" : ",\n").append("  {\"lane\": ").append(in_quotes(lanes[i].lane));
    json += ", \"processor\": " + std::to_string(lanes[i].placement.processor) +
            ", \"priority\": " + std::to_string(lanes[i].placement.priority) +
            ", \"count\": " + std::to_string(wake_ups.woken) + ", \"max_ns\": " + std::to_string(wake_ups.max_ns) +
            ", \"real_time\": " + (wake_ups.was_real_time ? "true" : "false") + ", \"histogram\": [";
    for (std::size_t bucket = 0; bucket < WakeUps::kBuckets; ++bucket) {
      const bool is_last = bucket + 1 == WakeUps::kBuckets;
      json.append(bucket == 0 ? "" : ", ").append("{\"below_us\": ");
      json.append(is_last ? "null" : std::to_string(WakeUps::below_us(bucket)));
      json.append(", \"count\": ").append(std::to_string(wake_ups.counts[bucket])).append("}");
    }
    json += "]}";
  }
  return json + "]}\n";
}

int run_doctor(const std::string& config_path, bool json, bool strict) {
  DoctorInput input;
  std::vector<LaneWakeUps> lanes(1);
  lanes[0].placement.priority = static_cast<int>(input.priority);
  if (!config_path.empty()) {
    try {
      const DaemonConfig config = read_daemon_config(config_path);
      input = input_of(config);
      lanes = lanes_of(config);
    } catch (const config::FileError& error) {
      std::fprintf(stderr, "polygmapd: %s\n", error.what());
      return 2;
    }
  }
  input.limits = limits_of_this_process(input.proc);
  std::vector<Finding> findings = examine(input);
  measure_wake_ups(lanes, kCycles);
  for (const LaneWakeUps& lane : lanes) findings.push_back(finding_of(lane, slack_ns(input.lanes)));
  std::fputs((json ? json_of(findings, lanes) : text_of(findings, lanes)).c_str(), stdout);
  const Verdict least = strict ? Verdict::kWarning : Verdict::kBad;
  return std::ranges::any_of(findings, [least](const Finding& f) { return f.verdict >= least; }) ? 1 : 0;
}

}  // namespace polygmap::daemon
