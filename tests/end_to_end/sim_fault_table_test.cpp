// SPDX-License-Identifier: Apache-2.0
// Every fault in every phase of the gait, under physics and with perception in the loop: in which state it ends, and
// within what time; both feet on the ground, the robot upright, and no command beyond a drive's limits; and
// some of them on drives that take less stiffness. Where the robot falls is written down, too.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <tuple>

#include "algorithms/robot/drive_torque.hpp"
#include "tests/support/physical_climb.hpp"

namespace polygmap::sim {
namespace {

struct FaultRow {
  const char* name;
  void (*begins)(PhysicalClimb&);
  ModuleState ends_as;
  double within_s;
};
// A swing takes 0.94 s at most on these stairs, so a step that has to be finished ends within that.
constexpr double kStep_s = 1.0;
constexpr std::array kFaults{
    FaultRow{"joints_silent", [](PhysicalClimb& c) { c.joints.silent = true; }, ModuleState::kSafeStop, 0.1 + kStep_s},
    FaultRow{"imu_silent", [](PhysicalClimb& c) { c.imu.silent = true; }, ModuleState::kSafeStop, 0.1 + kStep_s},
    FaultRow{"commands_refused", [](PhysicalClimb& c) { c.joints.refuses = true; }, ModuleState::kSafeStop,
             0.05 + kStep_s},
    FaultRow{"drive_error", [](PhysicalClimb& c) { c.joints.in_error.insert(4); }, ModuleState::kSafeStop, kStep_s},
    FaultRow{"drive_hot", [](PhysicalClimb& c) { c.joints.hottest_degc = 90; }, ModuleState::kSafeStop, kStep_s},
    // Twice the time that a cycle has, in every cycle.
    FaultRow{"time_short", [](PhysicalClimb& c) { c.row_share = [](std::size_t) { return 3.0; }; },
             ModuleState::kSafeStop, 0.3 + kStep_s},
    FaultRow{"camera_silent", [](PhysicalClimb& c) { c.camera.silent = true; }, ModuleState::kSafeStop, 3.0 + kStep_s},
    FaultRow{"camera_blank", [](PhysicalClimb& c) { c.camera.blank = true; }, ModuleState::kSafeStop, 3.0 + kStep_s},
    FaultRow{"asked_to_stop", [](PhysicalClimb& c) { c.operator_input.ask(OperatorCommand::kStop); },
             ModuleState::kSafeStop, kStep_s},
    FaultRow{"asked_to_pause", [](PhysicalClimb& c) { c.operator_input.ask(OperatorCommand::kPause); },
             ModuleState::kHolding, kStep_s},
};

// From the climb's beginning until it is there.
struct Moment {
  const char* name;
  std::uint32_t nth;  // swing onto a tread
  double after_s;     // its lift-off
};
constexpr std::array kMoments{Moment{"standing", 0, 0.0},      Moment{"shift", 1, 1.0},
                              Moment{"swing1_early", 1, 0.05}, Moment{"swing1_high", 1, 0.4},
                              Moment{"swing1_late", 1, 0.8},   Moment{"swing2_early", 2, 0.05},
                              Moment{"swing2_high", 2, 0.4},   Moment{"swing2_late", 2, 0.8}};

// The most that the drives take of either leg's stiffness and damping.
struct MostGains {
  const char* name;
  std::array<double, kJointsPerLeg> kp_nmprad, kd_nmsprad;
};
constexpr MostGains kUsualGains{"", DriveModel{}.kp_most_nmprad, DriveModel{}.kd_most_nmsprad};
// As toolchain/campaigns/gains/kuavo.toml has it, and no more damping than standing.
constexpr MostGains kKuavoGains{"_kuavo_gains", {220, 100, 224, 224, 58, 58}, DriveModel{}.kd_nmsprad};

using FaultCase = std::tuple<bool, FaultRow, Moment, MostGains>;
std::string fault_name(const testing::TestParamInfo<FaultCase>& info) {
  const auto& [single_step, fault, moment, gains] = info.param;
  return std::string(single_step ? "ss_" : "ds_") + fault.name + "_" + moment.name + gains.name;
}

bool is_blind(std::string_view fault) { return fault == "joints_silent" || fault == "imu_silent"; }

// Known to fall, as of 2026-11-27. Drives that are sent nothing go on with the law of their last command, stiffness,
// damping and torque, and that stiffness does not hold up a body that nobody balances. Nor does any that a KUAVO's
// drives take, when it is blind. All are climbs of one seed: which of the blind ones fall changes with the code.
bool falls(std::string_view fault, std::string_view moment, bool soft) {
  if (fault == "commands_refused" || (soft && is_blind(fault))) return true;
  return fault == "imu_silent" && moment == "swing2_early";
}

class FaultTable : public testing::TestWithParam<FaultCase> {};

// Its stiffness and damping included, where the joint is when the command is taken; 0 where that is not known.
double asked_of_heard_drive_nm(const DriveModel& drives, const LegSensing& sensing, const JointCommand& command,
                               std::size_t n) {
  const JointFeedback& joints = sensing.joints();
  const auto i = static_cast<Eigen::Index>(n);
  const std::int64_t age_ns = command.stamp_ns - joints.stamp_ns;
  if (!sensing.any() || age_ns > 6'000'000 || joints.is_mute(n)) return 0.0;
  const double later_s = seconds(age_ns) + drives.delay_s;
  return torque_asked_nm(command.joints[n], joints.q_rad[i] + sensing.offset_rad()[i] + later_s * joints.dq_radps[i],
                         joints.dq_radps[i]);
}

// Empty, or the first joint that is asked for more than its drive takes, and of what.
std::string beyond_limits(const DriveModel& drives, const LegSensing& sensing, const JointCommand& command) {
  constexpr double kRounding = 1e-9;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const JointSetpoint& joint = command.joints[n];
    const JointLimits& limits = drives.limits[n];
    const double kp_most_nmprad = drives.kp_most_nmprad[n % kJointsPerLeg];
    const double kd_most_nmsprad = drives.kd_most_nmsprad[n % kJointsPerLeg];
    const auto says = [n](const char* what, double value) {
      return std::string(kJointNames[n]) + " " + what + " " + std::to_string(value);
    };
    const bool placed = joint.q_rad >= limits.min_rad - kRounding && joint.q_rad <= limits.max_rad + kRounding;
    if (!placed) return says("q_rad", joint.q_rad);
    if (!(std::abs(joint.dq_radps) <= limits.speed_radps + kRounding)) return says("dq_radps", joint.dq_radps);
    if (!(std::abs(joint.tau_ff_nm) <= limits.torque_nm)) return says("tau_ff_nm", joint.tau_ff_nm);
    if (!(joint.kp_nmprad >= 0.0 && joint.kp_nmprad <= kp_most_nmprad)) return says("kp_nmprad", joint.kp_nmprad);
    if (!(joint.kd_nmsprad >= 0.0 && joint.kd_nmsprad <= kd_most_nmsprad)) return says("kd_nmsprad", joint.kd_nmsprad);
    const double asked_nm = asked_of_heard_drive_nm(drives, sensing, command, n);
    const double dq_radps = sensing.joints().dq_radps[static_cast<Eigen::Index>(n)];
    if (std::abs(dq_radps) <= limits.corner_radps) continue;  // the drive cuts its own stiffness
    const TorqueRange range = torque_range_nm(limits, dq_radps);
    const bool there = asked_nm >= range.least_nm - kRounding && asked_nm <= range.most_nm + kRounding;
    if (!there) return says("torque_nm", asked_nm);
  }
  return {};
}

TEST_P(FaultTable, EndsInItsStateWithinItsTime_OnBothFeet) {
  const auto& [single_step, fault, moment, gains] = GetParam();
  Params params;
  params.gait.planner.pattern = single_step ? GaitPattern::kSingleStep : GaitPattern::kDoubleStep;
  params.robot.drives.kp_most_nmprad = gains.kp_nmprad;
  params.robot.drives.kd_most_nmsprad = gains.kd_nmsprad;
  SimOptions options = stairs_of(single_step ? 4 : 2, 2);
  options.mujoco.kp_most_nmprad = gains.kp_nmprad;
  options.mujoco.kd_most_nmsprad = gains.kd_nmsprad;
  PhysicalClimb climb(options, params);
  if (moment.nth == 0) {
    climb.run(2.5);
  } else {
    ASSERT_TRUE(run_to_swing_onto(climb, moment.nth));
    climb.run(moment.after_s);
  }
  fault.begins(climb);
  const double begun_s = climb.time_s();
  const auto is_over = [&] {
    return climb.state() == fault.ends_as && climb.status().stands[0] && climb.status().stands[1];
  };
  std::string beyond;
  do {
    (void)climb.tick();
    if (beyond.empty()) beyond = beyond_limits(params.robot.drives, climb.leg_sensing(), climb.command());
  } while (!is_over() && !climb.truth().fell && climb.time_s() - begun_s < 10.0);
  const bool may_fall = falls(fault.name, moment.name, gains.name[0] != '\0');
  // One that leans so far sinks on its damped joints, and the plant may call that a fall seconds later.
  const auto fell = [&] { return climb.truth().fell || climb.state() == ModuleState::kFallen; };
  if (!fell()) {
    EXPECT_EQ(name_of(climb.state()), name_of(fault.ends_as));
    EXPECT_LE(climb.time_s() - begun_s, fault.within_s);
  }
  climb.run_on(is_blind(fault.name) ? 6.0 : 2.0);  // what nobody balances topples slowly at first
  if (beyond.empty()) beyond = beyond_limits(params.robot.drives, climb.leg_sensing(), climb.command());
  EXPECT_EQ(beyond, "");
  EXPECT_EQ(fell(), may_fall) << climb.truth().fall_reason;
  if (may_fall) return;
  EXPECT_TRUE(climb.truth().in_contact[0] && climb.truth().in_contact[1]);
  EXPECT_EQ(name_of(climb.state()), name_of(fault.ends_as));
}
INSTANTIATE_TEST_SUITE_P(Long, FaultTable,
                         testing::Combine(testing::Bool(), testing::ValuesIn(kFaults), testing::ValuesIn(kMoments),
                                          testing::Values(kUsualGains)),
                         fault_name);
INSTANTIATE_TEST_SUITE_P(LongSoft, FaultTable,
                         testing::Combine(testing::Bool(), testing::ValuesIn(kFaults),
                                          testing::Values(kMoments[0], kMoments[3], kMoments[5]),
                                          testing::Values(kKuavoGains)),
                         fault_name);

}  // namespace
}  // namespace polygmap::sim
