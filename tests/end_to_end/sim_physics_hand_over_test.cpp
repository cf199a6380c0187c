// SPDX-License-Identifier: Apache-2.0
// After a climb the module lets go of the robot, and who held it before holds it again, at its own gains: the robot
// stands on. How long it stands on the module's last command alone is here, too.
#include <gtest/gtest.h>

#include <string>

#include "tests/support/physical_climb.hpp"

namespace polygmap::sim {
namespace {

using LegGains = std::array<double, kJointsPerLeg>;
struct Case {
  const char* name;
  LegGains kp_most_nmprad;
  bool single_step;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name << (c.single_step ? " ss" : " ds"); }
std::string case_name(const testing::TestParamInfo<Case>& info) {
  return std::string(info.param.name) + (info.param.single_step ? "_ss" : "_ds");
}
constexpr LegGains kUsual_nmprad = DriveModel{}.kp_most_nmprad, kKuavo_nmprad{220, 100, 224, 224, 58, 58};

class HandsOver : public testing::TestWithParam<Case> {
 protected:
  static SimOptions options() {
    SimOptions options = stairs_of(2, 2);
    options.mujoco.kp_most_nmprad = GetParam().kp_most_nmprad;
    return options;
  }
  static Params params() {
    Params params;
    params.robot.drives.kp_most_nmprad = GetParam().kp_most_nmprad;
    params.gait.planner.pattern = GetParam().single_step ? GaitPattern::kSingleStep : GaitPattern::kDoubleStep;
    return params;
  }
  // Until it has let go.
  void release() {
    climb_.operator_input.ask(OperatorCommand::kHandOver);
    const double asked_s = climb_.time_s();
    while (climb_.state() != ModuleState::kReleased && climb_.time_s() < asked_s + 5.0) climb_.run_on(0.002);
    ASSERT_EQ(climb_.state(), ModuleState::kReleased);
    EXPECT_GE(climb_.time_s() - asked_s, 0.5) << "it looks whether it rests";
    EXPECT_LE(climb_.time_s() - asked_s, 2.0);
  }
  // How far the centre of mass gets, on the way, from where it is now.
  double moved_m(double for_s) {
    const Vec3 com_m = climb_.truth().true_p_com_m;
    double most_m = 0.0;
    const double end_s = climb_.time_s() + for_s;
    while (climb_.time_s() < end_s && !climb_.truth().fell) {
      climb_.run_on(0.002);
      most_m = std::max(most_m, (climb_.truth().true_p_com_m - com_m).head<2>().norm());
    }
    return most_m;
  }
  void expect_stands_on_the_other(double after_s) {
    climb_.run_on(after_s);
    climb_.hold_again();
    const double way_m = moved_m(5.0);
    RecordProperty("moved_mm", std::to_string(1e3 * way_m));
    EXPECT_FALSE(climb_.truth().fell) << climb_.truth().fall_reason;
    EXPECT_TRUE(climb_.truth().in_contact[0] && climb_.truth().in_contact[1]);
    EXPECT_LT(way_m, 0.03);
    EXPECT_EQ(climb_.state(), ModuleState::kReleased);
  }

  PhysicalClimb climb_{options(), params()};
};

TEST_P(HandsOver, OnTop_StandsOnTheOtherController) {
  climb_.run(60.0);
  ASSERT_EQ(climb_.state(), ModuleState::kOnTop) << text_of(climb_.status().stop_reason);
  ASSERT_NO_FATAL_FAILURE(release());
  expect_stands_on_the_other(0.01);
}

// One foot a step above the other, and who is to take over is half a second late.
TEST_P(HandsOver, StoppedOnTheStairs_StandsOnTheOtherController) {
  ASSERT_TRUE(run_to_swing_onto(climb_, GetParam().single_step ? 2 : 1));
  climb_.run_on(0.3);  // it will not go back to where it stood
  climb_.operator_input.ask(OperatorCommand::kStop);
  climb_.run_on(2.0);
  ASSERT_EQ(climb_.state(), ModuleState::kSafeStop);
  ASSERT_NE(climb_.truth().step_index[0], climb_.truth().step_index[1]);
  ASSERT_NO_FATAL_FAILURE(release());
  expect_stands_on_the_other(0.5);
}

// Drives that are stiff enough hold the robot by themselves; a KUAVO's do not.
TEST_P(HandsOver, NobodyTakesOver_StandsAsLongAsTheDrivesStiffnessLets) {
  climb_.run(60.0);
  ASSERT_EQ(climb_.state(), ModuleState::kOnTop) << text_of(climb_.status().stop_reason);
  ASSERT_NO_FATAL_FAILURE(release());
  const bool stiff = GetParam().kp_most_nmprad == kUsual_nmprad;
  const double begun_s = climb_.time_s();
  const double way_m = moved_m(30.0);
  RecordProperty("moved_mm", std::to_string(1e3 * way_m));
  RecordProperty("stood_s", std::to_string(climb_.time_s() - begun_s));
  if (stiff) {
    EXPECT_FALSE(climb_.truth().fell) << climb_.truth().fall_reason;
    EXPECT_LT(way_m, 0.01);
  }
  EXPECT_GT(climb_.time_s() - begun_s, 2.0) << "2.4 s at least on 2026-11-27";
}

INSTANTIATE_TEST_SUITE_P(Gains, HandsOver,
                         testing::Values(Case{"usual", kUsual_nmprad, false}, Case{"usual", kUsual_nmprad, true},
                                         Case{"kuavo", kKuavo_nmprad, false}, Case{"kuavo", kKuavo_nmprad, true}),
                         case_name);

}  // namespace
}  // namespace polygmap::sim
