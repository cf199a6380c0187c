// SPDX-License-Identifier: Apache-2.0
// Pushes under physics, perception in the loop; and what becomes of them without feedback of the divergent component.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <ostream>
#include <vector>

#include "tests/support/physical_climb.hpp"

namespace polygmap::sim {
namespace {

constexpr std::array<Push, 4> kWays{{{.axis = 0, .impulse_ns = 10.0},
                                     {.axis = 0, .impulse_ns = -10.0},
                                     {.axis = 1, .impulse_ns = 10.0},
                                     {.axis = 1, .impulse_ns = -10.0}}};

struct PushCase {
  std::uint64_t seed;
  GaitPattern pattern;
  int moment;  // of eight, 0.32 s apart
  [[nodiscard]] std::size_t way() const { return (seed + static_cast<std::size_t>(moment)) % kWays.size(); }
};
std::string name_of(const testing::TestParamInfo<PushCase>& info) {
  constexpr std::array kNames{"forward", "back", "left", "right"};
  const PushCase& c = info.param;
  return std::string(c.pattern == GaitPattern::kSingleStep ? "ss" : "ds") + "_seed" + std::to_string(c.seed) +
         "_moment" + std::to_string(c.moment) + "_" + kNames[c.way()];
}
void PrintTo(const PushCase& c, std::ostream* out) { *out << "seed " << c.seed; }
// Of both steps onto a tread, from the first lift-off on: the module is still climbing when the push comes.
struct Outcome {
  std::string fall;  // why, empty where it stands
  double sole_margin_m = 0.0;
};
void climb_pushed(const PushCase& c, Outcome& out) {
  Params params;
  params.gait.planner.pattern = c.pattern;
  PhysicalClimb climb(stairs_of(2, c.seed), params);
  ASSERT_TRUE(run_to_swing_onto(climb, 1));
  climb.run(0.32 * c.moment);
  EXPECT_LT(climb.status().treads_climbed, 2U);
  climb.push(kWays[c.way()]);
  climb.run_on(5.0);  // where it stopped, it stands
  out = {climb.truth().fell ? climb.truth().fall_reason : "", climb.sole_margin_min_m()};
}

std::vector<PushCase> every_moment(std::uint64_t seed, GaitPattern pattern) {
  std::vector<PushCase> cases;
  for (int moment = 0; moment < 8; ++moment) cases.push_back({seed, pattern, moment});
  return cases;
}

constexpr double kMostOver_m = 0.005;

class Pushed : public testing::TestWithParam<PushCase> {};
TEST_P(Pushed, AnyWayAtAnyMomentOfAStair_DoesNotFall) {
  Outcome out;
  climb_pushed(GetParam(), out);
  EXPECT_EQ(out.fall, "");
  EXPECT_GE(out.sole_margin_m, -kMostOver_m);
}
INSTANTIATE_TEST_SUITE_P(DoubleStep, Pushed, testing::ValuesIn(every_moment(1, GaitPattern::kDoubleStep)), name_of);
INSTANTIATE_TEST_SUITE_P(SingleStep, Pushed, testing::ValuesIn(every_moment(1, GaitPattern::kSingleStep)), name_of);

// Over four seeds every way at every moment; toolchain/campaign pushes counts more of them.
class LongPushed : public testing::TestWithParam<GaitPattern> {};
TEST_P(LongPushed, FourSeedsEveryWayAtEveryMoment_NoneFalls) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const PushCase& c : every_moment(seed, GetParam())) {
      Outcome out;
      climb_pushed(c, out);
      EXPECT_EQ(out.fall, "") << "seed " << c.seed << ", moment " << c.moment;
      EXPECT_GE(out.sole_margin_m, -kMostOver_m) << "seed " << c.seed << ", moment " << c.moment;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Long, LongPushed, testing::Values(GaitPattern::kDoubleStep, GaitPattern::kSingleStep));

// Two modules that differ in nothing but the feedback, on two robots of one seed, under the first one's commands: both
// are in one state, to the bit, until the push. 2026-11-23, pushed in each of the four ways: of 12 with feedback none
// fell, of 12 without all did.
class NegativeControl : public testing::TestWithParam<std::uint64_t> {};

TEST_P(NegativeControl, PushedAtALiftOffWithoutFeedbackOfTheDcm_Falls) {
  const std::uint64_t seed = GetParam();
  Params params;
  params.gait.balance.dcm.gain = params.gait.balance.dcm.integral_per_s = 0.0;
  PhysicalClimb with(stairs_of(2, seed)), without(stairs_of(2, seed), params);
  without.joints.instead = &with.command();
  while (with.time_s() < 40.0 && !with.status().step.onto_tread) {
    (void)with.tick();
    (void)without.tick();
  }
  ASSERT_EQ(with.truth().true_T_base.p_m, without.truth().true_T_base.p_m);
  ASSERT_FALSE(with.truth().fell);
  without.joints.instead = nullptr;
  for (PhysicalClimb* climb : {&with, &without}) {
    climb->push(kWays[seed % kWays.size()]);
    climb->run_on(5.0);
  }
  EXPECT_FALSE(with.truth().fell) << with.truth().fall_reason;
  EXPECT_TRUE(without.truth().fell);
}
INSTANTIATE_TEST_SUITE_P(Seeds, NegativeControl, testing::Range<std::uint64_t>(1, 5));  // one of each way
INSTANTIATE_TEST_SUITE_P(LongSeeds, NegativeControl, testing::Range<std::uint64_t>(5, 13));

}  // namespace
}  // namespace polygmap::sim
