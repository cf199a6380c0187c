// SPDX-License-Identifier: Apache-2.0
// mute_drives BUS_FILE ds|ss mujoco|kinematic SEED [FIRST LAST]: a table of what becomes of a climb of two steps when a
// drive, or a bus with its drives, falls silent for good, at moments of its phases (of the swings FIRST to LAST). The
// climb is run once; at each moment a copy of the process goes on with each fault.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/support/bus_climb.hpp"

namespace polygmap::sim {
namespace {

struct Moment {
  double at_s;
  std::string name;
  Foot swing;
};

std::vector<Moment> moments_of(const std::vector<SwingTimes>& swings, std::size_t first, std::size_t last) {
  std::vector<Moment> moments;
  for (std::size_t n = first; n <= last && n < swings.size(); ++n) {
    const SwingTimes& s = swings[n];
    const std::string what = std::to_string(n) + (s.onto_tread ? "t" : "f");
    const double swing_s = s.touch_down_s - s.lift_off_s;
    const double before_s = n == 0 ? s.lift_off_s - 1.0 : swings[n - 1].touch_down_s;
    const double both_s = s.lift_off_s - before_s;
    for (const double share : {0.1, 0.5, 0.95}) {
      moments.push_back({before_s + share * both_s, what + (n == 0 ? " stand " : " both ") + std::to_string(share).substr(0, 4), s.foot});
    }
    for (const double share : {0.05, 0.25, 0.5, 0.75, 0.95}) {
      moments.push_back({s.lift_off_s + share * swing_s, what + " swing " + std::to_string(share).substr(0, 4), s.foot});
    }
  }
  return moments;
}

MuteOutcome in_a_copy(BusClimb& climb, const Mute& mute, void* shared) {
  auto* outcome = static_cast<MuteOutcome*>(shared);
  *outcome = {};
  std::fflush(stdout);
  const pid_t pid = fork();
  if (pid == 0) {
    *outcome = outcome_of(climb, mute);
    _exit(0);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  return *outcome;
}

std::string text_of(const MuteOutcome& o) {
  char text[32];
  const char* what = o.fell ? "FELL" : !o.stopped ? "runs" : o.both ? "ok" : "1foot";
  std::snprintf(text, sizeof text, "%s%.2f", what, o.stop_s);
  return text;
}

int run(const BusClimb::Options& options, std::size_t first, std::size_t last) {
  std::vector<Moment> moments;
  {
    BusClimb reference(options);
    moments = moments_of(swings_of(reference), first, last);
  }
  void* shared = mmap(nullptr, sizeof(MuteOutcome), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  std::printf("%-16s foot", "moment");
  constexpr std::array<const char*, 6> kJoints{"hr", "hy", "hp", "kn", "ap", "ar"};
  for (const char* leg : {"stance ", "swing "}) {
    for (const char* joint : kJoints) std::printf("%9s", (std::string(leg).substr(0, 2) + "." + joint).c_str());
  }
  std::printf("%9s%9s%9s%9s\n", "st.upper", "st.lower", "sw.upper", "sw.lower");
  BusClimb climb(options);
  int all = 0, good = 0;
  for (const Moment& moment : moments) {
    climb.run_until(moment.at_s);
    std::printf("%-16s %-4s", moment.name.c_str(), moment.swing == Foot::kLeft ? "L" : "R");
    std::vector<Mute> mutes;
    for (const Foot leg : {other(moment.swing), moment.swing}) {
      for (std::size_t j = 0; j < kJointsPerLeg; ++j) mutes.push_back({false, joint_index(leg, j)});
    }
    for (const Foot leg : {other(moment.swing), moment.swing}) {
      for (std::size_t half = 0; half < 2; ++half) mutes.push_back({true, 2 * index_of(leg) + half});
    }
    for (const Mute& mute : mutes) {
      const MuteOutcome outcome = in_a_copy(climb, mute, shared);
      std::printf("%9s", text_of(outcome).c_str());
      ++all;
      good += outcome.stands() ? 1 : 0;
    }
    std::printf("\n");
  }
  std::printf("stand on both feet: %d of %d\n", good, all);
  return 0;
}

}  // namespace
}  // namespace polygmap::sim

int main(int argc, char** argv) {
  if (argc != 5 && argc != 7) {
    return std::puts("mute_drives BUS_FILE ds|ss mujoco|kinematic SEED [FIRST LAST]"), 2;
  }
  polygmap::sim::BusClimb::Options options;
  options.bus_file = argv[1];
  options.pattern = std::string_view(argv[2]) == "ss" ? polygmap::GaitPattern::kSingleStep : polygmap::GaitPattern::kDoubleStep;
  options.plant = std::string_view(argv[3]) == "mujoco" ? polygmap::sim::PlantKind::kMujoco : polygmap::sim::PlantKind::kKinematic;
  options.seed = std::strtoull(argv[4], nullptr, 10);
  const std::size_t first = argc == 7 ? std::strtoul(argv[5], nullptr, 10) : 0, last = argc == 7 ? std::strtoul(argv[6], nullptr, 10) : 99;
  return polygmap::sim::run(options, first, last);
}
