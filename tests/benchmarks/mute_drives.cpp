// SPDX-License-Identifier: Apache-2.0
// mute_drives BUS_FILE ds|ss mujoco|kinematic SEED [FIRST LAST [WORLD.toml]]: a table of what becomes of a climb of two
// steps, or of the way to the goal of a world, when a drive, or a bus with its drives, falls silent for good, at
// moments of its phases (of the swings FIRST to LAST). The climb is run once; at each moment a copy of the process goes
// on with each fault. A cell: "ok" on both feet, "foot" on one, "FELL", or "runs" where it did not stop; and the
// seconds until safe_stop.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/support/bus_climb.hpp"

namespace polygmap::sim {
namespace {

void print_head() {
  std::printf("swing, moment   ");
  for (const char* leg : {"stand", "swing"}) {
    for (const char* joint : {"hr", "hy", "hp", "kn", "ap", "ar"}) std::printf(" %5s.%s", leg, joint);
  }
  std::printf("%9s%9s%9s%9s\n", "stand.hip", ".knee", "swing.hip", ".knee");
}

int run(const BusClimb::Options& options, std::size_t first, std::size_t last) {
  std::vector<SwingTimes> swings;
  {
    constexpr double kStairs_s = 60.0, kWorld_s = 300.0;
    BusClimb reference(options);
    swings = swings_of(reference, options.world ? kWorld_s : kStairs_s);
  }
  print_head();
  BusClimb climb(options);
  int all = 0, good = 0;
  for (const MuteMoment& moment : moments_of(swings, first, last)) {
    climb.run_until(moment.at_s);
    std::printf("%zu %s %s %.2f", moment.swing, swings[moment.swing].onto_tread ? "tread" : "floor",
                moment.in_the_air ? "air " : "both", moment.share);
    for (const Mute& mute : mutes_of(moment.foot)) {
      std::fflush(stdout);
      const std::optional<MuteOutcome> copy = outcome_in_a_copy(climb, mute);
      if (!copy) return std::fprintf(stderr, "mute_drives: error: a copy of the climb crashed\n"), 1;
      const MuteOutcome& o = *copy;
      std::printf("%5s%.2f", o.fell ? "FELL" : !o.stopped ? "runs" : o.both ? "ok" : "foot", o.stop_s);
      ++all;
      good += o.stands() ? 1 : 0;
    }
    std::printf("\n");
  }
  std::printf("on both feet: %d of %d\n", good, all);
  return 0;
}

}  // namespace
}  // namespace polygmap::sim

int main(int argc, char** argv) {
  const auto is_one_of = [](std::string_view word, std::string_view a, std::string_view b) {
    return word == a || word == b;
  };
  if ((argc != 5 && argc != 7 && argc != 8) || !is_one_of(argv[2], "ds", "ss") ||
      !is_one_of(argv[3], "mujoco", "kinematic")) {
    return std::puts("mute_drives BUS_FILE ds|ss mujoco|kinematic SEED [FIRST LAST [WORLD.toml]]"), 2;
  }
  using namespace polygmap;
  sim::BusClimb::Options options;
  options.bus_file = argv[1];
  if (std::string_view(argv[2]) == "ss") options.pattern = GaitPattern::kSingleStep;
  if (std::string_view(argv[3]) == "kinematic") options.plant = sim::PlantKind::kKinematic;
  options.seed = std::strtoull(argv[4], nullptr, 10);
  const std::size_t first = argc > 5 ? std::strtoul(argv[5], nullptr, 10) : 0;
  const std::size_t last = argc > 5 ? std::strtoul(argv[6], nullptr, 10) : 1000;
  try {
    if (argc == 8) options.world = sim::read_world(argv[7]);
  } catch (const config::FileError& error) {
    return std::fprintf(stderr, "mute_drives: error: %s\n", error.what()), 2;
  }
  if (options.world && !options.world->world.goal) {
    return std::fprintf(stderr, "mute_drives: error: %s has no goal\n", argv[7]), 2;
  }
  return sim::run(options, first, last);
}
