// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/stream/recording_header.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "firmware/recording/stream/format.hpp"
#include "firmware/recording/stream/outputs.hpp"

namespace polygmap::recording {
namespace {

// Collects what the hash of the fields is made of.
struct Names {
  std::vector<std::string> leaves, structs;
  void leaf(std::string_view name, int, const auto&) { leaves.emplace_back(name); }
  void enter(std::string_view name, int) { structs.emplace_back(name); }
  void leave() {}
  void names_only() const {}
  [[nodiscard]] bool have(std::string_view name) const {
    return std::ranges::count(leaves, name) + std::ranges::count(structs, name) > 0;
  }
};

TEST(HashOfFields, EveryKindOfRecordedField_IsInIt) {
  Names names;
  walk_recorded(names);
  for (const char* name :
       {"gyro_radps", "silent_cycles", "position_sigma_m", "tau_ff_nm",  // samples and commands
        "drive_errors", "bus_offs", "stale", "kd_nmsprad", "taken", "depth_unit_m", "oldest_input_ns", "outliers",
        "module_state", "treads_climbed", "p_star", "dropped", "height_m", "drift_m", "count"}) {
    EXPECT_TRUE(names.have(name)) << name;
  }
  EXPECT_EQ(std::ranges::count(names.leaves, "kp_nmprad"), static_cast<std::ptrdiff_t>(kJointCount) + 1)
      << "a command's and the limits'";
}

}  // namespace
}  // namespace polygmap::recording
