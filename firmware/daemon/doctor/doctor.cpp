// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/doctor/doctor.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <set>

#include "algorithms/core/capacities.hpp"
#include "firmware/daemon/system/lane_thread.hpp"
#include "firmware/pipeline.hpp"
#include "hal/linux/buffer_book.hpp"

extern "C" const char __executable_start, _end;  // the linker's: the program's image in memory

namespace polygmap::daemon {
namespace {

namespace fs = std::filesystem;

constexpr int kArphrdCan = 280;  // type of an interface
// A cycle's commands of all drives a bus can have, and the frames that enter motor mode.
constexpr long kLeastQueue_frames = 10;

// The first line, or nothing.
std::string line_of(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}
long number_of(const fs::path& path, long otherwise, int base = 10) {
  std::string text = line_of(path);
  if (text.starts_with("0x")) text.erase(0, 2), base = 16;
  long number = otherwise;
  std::from_chars(text.data(), text.data() + text.size(), number, base);
  return number;
}
// "0-3,6"
std::set<int> processors_in(const std::string& list) {
  std::set<int> all;
  for (const char *at = list.data(), *end = at + list.size(); at < end;) {
    int first = 0, last = 0;
    auto [after, error] = std::from_chars(at, end, first);
    if (error != std::errc{}) break;
    last = first;
    if (after < end && *after == '-') after = std::from_chars(after + 1, end, last).ptr;
    for (int cpu = first; cpu <= last && last < 4096; ++cpu) all.insert(cpu);
    at = after + 1;
  }
  return all;
}
std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all.append(all.empty() ? "" : ", ").append(word);
  return all;
}

Finding good(const char* name, std::string what) { return {name, Verdict::kGood, std::move(what), {}}; }

Finding kernel(const DoctorInput& in) {
  const std::string version = line_of(fs::path(in.proc) / "version");
  const std::string release = line_of(fs::path(in.proc) / "sys/kernel/osrelease");
  if (line_of(fs::path(in.sys) / "kernel/realtime") == "1" || version.find("PREEMPT_RT") != std::string::npos) {
    return good("kernel", "Linux " + release + " is preemptible throughout (PREEMPT_RT).");
  }
  return {"kernel", Verdict::kWarning,
          "Linux " + release + " has no PREEMPT_RT: the kernel may hold a lane for milliseconds.",
          "Boot a real-time kernel: on Debian install linux-image-rt-arm64; on JetPack the packages "
          "nvidia-l4t-rt-kernel*, and "
          "choose the entry \"real-time\" of the boot menu."};
}

Finding governor(const DoctorInput& in) {
  std::vector<std::string> others;
  bool any = false;
  for (const int cpu : processors_in(line_of(fs::path(in.sys) / "devices/system/cpu/online"))) {
    const std::string name =
        line_of(fs::path(in.sys) / "devices/system/cpu" / ("cpu" + std::to_string(cpu)) / "cpufreq/scaling_governor");
    any = any || !name.empty();
    if (!name.empty() && name != "performance") others.push_back("processor " + std::to_string(cpu) + ": " + name);
  }
  if (others.empty()) {
    return good("governor",
                any ? "All processors keep their highest frequency." : "No frequency of a processor is governed here.");
  }
  return {"governor", Verdict::kWarning, "Processors change their frequency (" + joined(others) + ").",
          "echo performance | tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor; on a Jetson: nvpmodel -m 0 && "
          "jetson_clocks."};
}

Finding isolated(const DoctorInput& in) {
  const fs::path cpus = fs::path(in.sys) / "devices/system/cpu";
  const std::set<int> online = processors_in(line_of(cpus / "online"));
  const std::set<int> apart = processors_in(line_of(cpus / "isolated"));
  std::vector<std::string> missing, shared;
  for (const int cpu : in.processors) {
    if (!online.contains(cpu)) missing.push_back(std::to_string(cpu));
    if (!apart.contains(cpu)) shared.push_back(std::to_string(cpu));
  }
  if (!missing.empty()) {
    return {"isolation", Verdict::kBad,
            "The machine has no processor " + joined(missing) + ", on which a lane is to run.",
            "Give control.cpu and perception.cpu of the daemon's file processors of /sys/devices/system/cpu/online."};
  }
  if (in.processors.empty()) shared.emplace_back("any");  // threads without a processor never run on an isolated one
  if (shared.empty()) return good("isolation", "The lanes' processors are kept free of other programs.");
  return {"isolation", Verdict::kWarning,
          "Processors are shared with other programs and interrupts (" + joined(shared) + ").",
          "Append isolcpus=managed_irq,domain,4-7 nohz_full=4-7 rcu_nocbs=4-7 irqaffinity=0-3, with the lanes' "
          "processors, to the kernel's command line, and name them in control.cpu and perception.cpu."};
}

Finding throttling(const DoctorInput& in) {
  const long runtime_us = number_of(fs::path(in.proc) / "sys/kernel/sched_rt_runtime_us", -1);
  if (runtime_us < 0) return good("throttling", "Real-time threads are never stopped by the kernel.");
  return {"throttling", Verdict::kWarning,
          "The kernel stops real-time threads that take more than " + std::to_string(runtime_us / 1000) +
              " ms of a second.",
          "sysctl kernel.sched_rt_runtime_us=-1, in /etc/sysctl.d to stay."};
}

Finding priority_limit(const DoctorInput& in) {
  const ProcessLimits& l = in.limits;
  if (l.may_have_any_priority || l.rt_priority >= in.priority) {
    return good("rtprio", "This user may have the lanes' real-time priority.");
  }
  return {"rtprio", Verdict::kBad,
          "This user may have real-time priorities up to " + std::to_string(l.rt_priority) + ", and the lanes need " +
              std::to_string(in.priority) + ".",
          "Run it as the shipped service, or set LimitRTPRIO= there, or rtprio in /etc/security/limits.conf."};
}
Finding memory_limit(const DoctorInput& in) {
  const ProcessLimits& l = in.limits;
  const std::string needed = std::to_string((in.needed_bytes + 1023) / 1024) + " KiB";
  if (l.may_lock_any_memory || l.locked_bytes >= in.needed_bytes) {
    return good("memlock", "This user may lock the memory that the daemon takes, " + needed + ".");
  }
  return {
      "memlock", Verdict::kBad,
      "This user may lock " + std::to_string(l.locked_bytes / 1024) + " KiB of memory, and the daemon needs " + needed +
          ".",
      "Run it as the shipped service, or set LimitMEMLOCK=infinity there, or memlock in /etc/security/limits.conf."};
}

Finding clock_source(const DoctorInput& in) {
  const std::string name = line_of(fs::path(in.sys) / "devices/system/clocksource/clocksource0/current_clocksource");
  constexpr std::array kFast{"arch_sys_counter", "tsc", "kvm-clock"};
  if (std::ranges::find(kFast, name) != kFast.end())
    return good("clock", "The clock is read without a system call (" + name + ").");
  return {"clock", Verdict::kWarning,
          "The clock source is \"" + name + "\", which takes a system call or a device to read.",
          "Boot with clocksource=arch_sys_counter (AArch64) or clocksource=tsc (x86), if the machine has it."};
}

Finding camera(const DoctorInput& in) {
  const fs::path all = fs::path(in.sys) / "class/video4linux";
  std::error_code none;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(all, none)) {
    names.push_back("/dev/" + entry.path().filename().string() + " " + line_of(entry.path() / "name"));
  }
  std::ranges::sort(names);
  const std::string there = names.empty() ? "The machine has no camera." : "The machine has " + joined(names) + ".";
  const std::string to_do =
      "Plug the depth camera in; lsusb shows whether the machine sees it, and the kernel needs uvcvideo. Then name its "
      "device in camera.device of the daemon's file.";
  if (in.camera.empty()) {
    return names.empty() ? Finding{"camera", Verdict::kWarning, there, to_do} : good("camera", there);
  }
  if (!fs::exists(in.camera, none)) return {"camera", Verdict::kBad, "There is no " + in.camera + ". " + there, to_do};
  if (::access(in.camera.c_str(), R_OK | W_OK) != 0) {
    return {"camera", Verdict::kBad, in.camera + " may not be read by this user.",
            "Add the user to the group video, or run the shipped service."};
  }
  return good("camera", in.camera + " is there.");
}

// Its counters of errors and its state; a virtual interface has none.
Finding controller(const DoctorInput& in, const std::string& bus, std::string so_far) {
  const std::string name = "can " + bus;
  const std::string again = "ip link set " + bus + " down && ip link set " + bus +
                            " up type can bitrate 1000000 restart-ms 100 berr-reporting on";
  const std::optional<CanLink> link = in.can_link(bus);
  if (!link) {
    return {name, Verdict::kWarning, so_far + "; the kernel did not say how its controller is.",
            "ip -details link show " + bus + " says it."};
  }
  if (!link->state) return {name, Verdict::kGood, so_far + ", without a controller.", {}};
  so_far += ", " + std::string(name_of(*link->state)) + ", " + std::to_string(link->bitrate_bps) + " bit/s";
  if (*link->state != CanLink::State::kActive) {
    return {name, Verdict::kBad, so_far + ".",
            "Check the cable, the terminating resistors (60 ohms between CAN_H and CAN_L), the bit rate, and that the "
            "drives have power; then " +
                again + "."};
  }
  if (in.bitrate_bps != 0 && link->bitrate_bps != in.bitrate_bps) {
    return {name, Verdict::kBad, so_far + "; the bus file says " + std::to_string(in.bitrate_bps) + ".", again + "."};
  }
  if (link->restart_ms == 0) return {name, Verdict::kWarning, so_far + "; after bus-off it stays off.", again + "."};
  return {name, Verdict::kGood, so_far + ".", {}};
}
Finding bus(const DoctorInput& in, const std::string& bus) {
  const fs::path folder = fs::path(in.sys) / "class/net" / bus;
  const std::string name = "can " + bus;
  std::error_code none;
  if (!fs::exists(folder, none) || number_of(folder / "type", 0) != kArphrdCan) {
    return {
        name, Verdict::kBad, "There is no CAN interface " + bus + ".",
        "On a Jetson: modprobe -a can can_raw mttcan, with the pins set to CAN (docs/deploy.md); elsewhere load the "
        "adapter's driver. ip -details link show type can lists what there is."};
  }
  if ((number_of(folder / "flags", 0) & 1) == 0) {
    return {name, Verdict::kBad, bus + " is down.",
            "ip link set " + bus + " up type can bitrate 1000000 restart-ms 100 berr-reporting on"};
  }
  const long queue = number_of(folder / "tx_queue_len", 0);
  std::string so_far = bus + " is up, its queue holds " + std::to_string(queue) + " frames";
  if (queue < kLeastQueue_frames) {
    return {name, Verdict::kWarning, so_far + ".", "ip link set " + bus + " txqueuelen 100"};
  }
  return controller(in, bus, std::move(so_far));
}
std::vector<std::string> buses_of(const DoctorInput& in) {
  if (!in.buses.empty()) return in.buses;
  std::vector<std::string> found;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(fs::path(in.sys) / "class/net", none)) {
    if (number_of(entry.path() / "type", 0) == kArphrdCan) found.push_back(entry.path().filename().string());
  }
  std::ranges::sort(found);
  return found;
}

}  // namespace

std::uint64_t needed_memory_bytes() {
  constexpr std::uint64_t kThreads = kLaneCount + 1;  // and the one that opens lost devices anew
  constexpr std::uint64_t kThreads_bytes = kThreads * (LaneThread::kStack_bytes + LaneThread::kGuard_bytes);
  constexpr std::uint64_t kPictures_bytes =
      std::uint64_t{hal::BufferBook::kMostBuffers} * kDepthWidth_px * kDepthHeight_px * sizeof(std::uint16_t);
  // The first thread's stack, the configuration, the drivers.
  constexpr std::uint64_t kRest_bytes = 4U * 1024U * 1024U;
  const auto image_bytes = static_cast<std::uint64_t>(&_end - &__executable_start);
  return image_bytes + sizeof(Pipeline) + kThreads_bytes + kPictures_bytes + kRest_bytes;
}

ProcessLimits limits_of_this_process(const std::string& proc) {
  ProcessLimits limits;
  const auto soft = [](auto resource) {
    rlimit limit{};
    if (::getrlimit(resource, &limit) != 0) return std::uint64_t{0};
    return limit.rlim_cur == RLIM_INFINITY ? ProcessLimits::kUnlimited : std::uint64_t{limit.rlim_cur};
  };
  limits.rt_priority = soft(RLIMIT_RTPRIO);
  limits.locked_bytes = soft(RLIMIT_MEMLOCK);
  std::ifstream status(fs::path(proc) / "self/status");
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with("CapEff:")) continue;
    std::uint64_t capabilities = 0;
    const std::size_t at = line.find_first_not_of(" \t", 7);
    if (at != std::string::npos) std::from_chars(line.data() + at, line.data() + line.size(), capabilities, 16);
    constexpr unsigned kIpcLock = 14, kSysNice = 23;  // <linux/capability.h>
    limits.may_lock_any_memory = (capabilities >> kIpcLock & 1U) != 0;
    limits.may_have_any_priority = (capabilities >> kSysNice & 1U) != 0;
  }
  return limits;
}

std::vector<Finding> examine(const DoctorInput& in) {
  std::vector<Finding> findings{kernel(in),         governor(in),     isolated(in),     throttling(in),
                                priority_limit(in), memory_limit(in), clock_source(in), camera(in)};
  const std::vector<std::string> buses = buses_of(in);
  for (const std::string& name : buses) findings.push_back(bus(in, name));
  if (buses.empty()) {
    findings.push_back({"can", Verdict::kWarning, "The machine has no CAN interface.",
                        "On a Jetson: modprobe -a can can_raw mttcan (docs/deploy.md)."});
  }
  for (const std::string& warning : in.warnings) {
    findings.push_back({"sender", Verdict::kWarning, warning, "Write sender = \"ADDRESS\" into that table."});
  }
  return findings;
}

}  // namespace polygmap::daemon
