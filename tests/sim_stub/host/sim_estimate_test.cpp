// SPDX-License-Identifier: Apache-2.0
// `polygmap estimate`: what it makes of logs, and what it says about files that are none.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>
#include <sstream>

#include "algorithms/geometry/so3.hpp"
#include "firmware/config/file_error.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/cli/params_command.hpp"
#include "sim_stub/host/estimate/estimate_report.hpp"
#include "sim_stub/host/estimate/log_contradiction.hpp"
#include "sim_stub/host/estimate/log_plausibility.hpp"
#include "tests/support/slow_machine.hpp"
#include "tests/support/synthetic_walk.hpp"

namespace polygmap::sim {
namespace {

using test::SyntheticWalk;
using test::WalkSpec;

constexpr double kFootNoise_m = 1e-3;

// A climb as a log: feet by the data sheet's kinematics, with noise; contacts are the plan's.
EstimateLog climb_log(const WalkSpec& spec) {
  SyntheticWalk walk(spec);
  std::mt19937 random(spec.seed + 100);
  std::normal_distribution<double> noise(0.0, spec.noise_scale * kFootNoise_m);
  EstimateLog log;
  log.has_truth = true;
  for (std::int64_t t_ns = SyntheticWalk::kTick_ns; t_ns < walk.end_ns(); t_ns += SyntheticWalk::kTick_ns) {
    const ImuSample imu = walk.imu(t_ns);
    const JointFeedback joints = walk.joints(t_ns);
    const test::WalkTruth truth = walk.truth(t_ns);
    LogRow row;
    row.stamp_ns = t_ns - SyntheticWalk::kTick_ns;
    row.gyro_radps = imu.gyro_radps;
    row.accel_mps2 = imu.accel_mps2;
    for (std::size_t f = 0; f < kFootCount; ++f) {
      const auto leg = static_cast<Foot>(f);
      row.contact[f] = truth.stance[f] ? 1.0 : 0.0;
      row.base_p_foot_m[f] =
          base_T_sole({}, leg, leg_joints(joints.q_rad, leg)).p_m + Vec3{noise(random), noise(random), noise(random)};
    }
    const Vec3 after_m = walk.truth(t_ns + kNsPerMs).true_T_base.p_m,
               before_m = walk.truth(t_ns - kNsPerMs).true_T_base.p_m;
    row.truth = {truth.true_T_base, (after_m - before_m) / 2e-3};
    log.rows.push_back(row);
  }
  return log;
}

// The left foot slips forwards from at_ns on while it stands, and stays there until it lifts.
void add_slip(EstimateLog& log, std::int64_t at_ns, double speed_mps, double duration_s) {
  bool lifted = false;
  for (LogRow& row : log.rows) {
    if (row.stamp_ns < at_ns) continue;
    lifted = lifted || row.contact[0] < 0.5;
    if (lifted) break;
    const double slid_m = speed_mps * std::min(seconds(row.stamp_ns - at_ns), duration_s);
    row.base_p_foot_m[0] += row.truth.true_T_base.R.transpose() * Vec3{slid_m, 0, 0};
  }
}

double worst_error_m(const EstimateLog& log, const Replay& result) {
  double worst_m = 0.0;
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    worst_m = std::max(worst_m, (result.ticks[i].world_T_base.p_m - log.rows[i].truth.true_T_base.p_m).norm());
  }
  return worst_m;
}

double end_error_over_variance(const EstimateLog& log, const Replay& result) {
  const Vec3 error_m = result.ticks.back().world_T_base.p_m - log.rows.back().truth.true_T_base.p_m;
  const Mat3 P = result.ticks.back().quality.covariance.topLeftCorner<3, 3>();
  return error_m.dot(P.inverse() * error_m);
}

std::vector<LioRow> lio_of(const EstimateLog& log, std::uint32_t seed, double sigma_m = 0.005) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, sigma_m);
  const Transform lio_T_true{rotation_z(1.2), Vec3{3.0, -2.0, 0.5}};
  std::vector<LioRow> lio;
  for (std::size_t i = 0; i < log.rows.size(); i += 50) {
    LioRow row;
    row.stamp_ns = log.rows[i].stamp_ns;
    row.arrival_ns = row.stamp_ns + 100 * kNsPerMs;
    row.pose = lio_T_true * log.rows[i].truth.true_T_base;
    row.pose.p_m += Vec3{noise(random), noise(random), noise(random)};
    lio.push_back(row);
  }
  return lio;
}

// --- Climbs ----------------------------------------------------------------------------------------------------------

TEST(EstimateReplay, ClimbWithBiasedNoisySensors_DriftsByLittle_AndKnowsHowFar) {
  constexpr std::uint32_t kSeeds = test::kSlowMachine ? 1 : 4;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 6;
    spec.gyro_bias_radps = 5e-3;
    const EstimateLog log = climb_log(spec);
    const Replay result = replay(log, {}, {});
    const Score s = score(log, result);
    EXPECT_LT(drift_percent(s), 1.5) << seed;
    EXPECT_LT(s.velocity_rmse_mps, 0.010) << seed;
    EXPECT_LT(s.attitude_rmse_rad, 0.03) << seed;  // yaw, which nothing observes
    EXPECT_LT(end_error_over_variance(log, result), 25.0) << seed;
    EXPECT_GT(result.ticks.back().quality.covariance(8, 8), result.ticks[10].quality.covariance(8, 8))
        << "yaw gets no surer";
  }
}

TEST(EstimateReplay, FootSlipsThreeTenthsForAFifthOfASecond_PositionStaysWithinTwentyMillimetres) {
  ReplayOptions careless;
  careless.estimator.motion.gain = 0.0;
  constexpr std::uint32_t kSeeds = test::kSlowMachine ? 1 : 6;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 2;
    EstimateLog log = climb_log(spec);
    const Replay firm = replay(log, {}, {});
    add_slip(log, (2200 + 50 * seed) * kNsPerMs, 0.3, 0.2);
    const Replay slipped = replay(log, {}, {});
    EXPECT_LT(worst_error_m(log, slipped), 0.020) << seed;
    EXPECT_GT(slipped.slipping_rows, firm.slipping_rows + 50) << seed;
    EXPECT_GT(worst_error_m(log, replay(log, {}, careless)), 1.5 * worst_error_m(log, slipped)) << seed;
  }
}

TEST(EstimateReplay, NoSlip_VelocityIsAsGoodAsThatOfAFilterThatLetsNothingGo) {
  ReplayOptions careless;
  careless.estimator.motion.gain = 0.0;
  constexpr std::uint32_t kSeeds = test::kSlowMachine ? 1 : 6;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 4;
    const EstimateLog log = climb_log(spec);
    const double with_mps = score(log, replay(log, {}, {})).velocity_rmse_mps;
    const double without_mps = score(log, replay(log, {}, careless)).velocity_rmse_mps;
    EXPECT_LT(with_mps, 1.05 * without_mps) << seed;
  }
}

// Ten times a good IMU's biases: the standstill at the start tells them.
TEST(EstimateReplay, ImuOfLargeBiasesAndNoise_StandingAtTheStart_IsAsGoodAsAnother) {
  constexpr std::uint32_t kSeeds = test::kSlowMachine ? 1 : 4;
  for (std::uint32_t seed = 21; seed < 21 + kSeeds; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 6;
    const Score good = score(climb_log(spec), replay(climb_log(spec), {}, {}));
    spec.gyro_bias_radps = 0.02;
    spec.accel_bias_mps2 = 0.3;
    const Score biased = score(climb_log(spec), replay(climb_log(spec), {}, {}));
    EXPECT_LT(biased.position_rmse_m, good.position_rmse_m + 2e-3) << seed;
    spec.gyro_noise_radps = 0.01;
    spec.accel_noise_mps2 = 0.3;
    const EstimateLog log = climb_log(spec);
    const Score noisy = score(log, replay(log, {}, {}));
    EXPECT_LT(noisy.position_rmse_m, 0.02) << seed;
    EXPECT_LT(drift_percent(noisy), 1.0) << seed;
    EXPECT_LT(noisy.nees_mean, 9.0) << seed;
  }
}

TEST(EstimateReplay, LioOfTwentyMillimetres_CountsForWhatItsNoiseIsMeasuredToBe) {
  WalkSpec spec;
  spec.seed = 31;
  spec.steps = 6;
  spec.gyro_bias_radps = 5e-3;
  const EstimateLog log = climb_log(spec);
  const Score with = score(log, replay(log, lio_of(log, 31, 0.02), {}));
  EXPECT_LT(with.position_rmse_m, 0.012);
  EXPECT_LT(with.nees_mean, 9.0);
  EXPECT_GT(with.nees_mean, 0.3);
  EXPECT_LT(with.tilt_rmse_rad, 1.1 * score(log, replay(log, {}, {})).tilt_rmse_rad)
      << "its noise tells next to no tilt";
}

TEST(EstimateReplay, NoTruth_StartsLevelAtStandstill_OrByTheFirstAcceleration) {
  WalkSpec spec;
  spec.steps = 1;
  EstimateLog log = climb_log(spec);
  const std::vector<LogRow> all = log.rows;
  const Mat3 true_R = all.front().truth.true_T_base.R;
  log.has_truth = false;
  const Replay stood = replay(log, {}, {});
  EXPECT_EQ(stood.start, StartSource::kStandstill);
  EXPECT_LT(so3_log(true_R.transpose() * stood.ticks.front().world_T_base.R).head<2>().norm(), 0.02);
  log.rows.assign(all.begin() + 1150, all.end());  // in the middle of a shift
  const Replay moved = replay(log, {}, {});
  EXPECT_EQ(moved.start, StartSource::kFirstAcceleration);
  for (const Replay* result : {&stood, &moved}) {
    const Vec3 went_m = result->ticks.back().world_T_base.p_m - result->ticks.front().world_T_base.p_m;
    const Vec3 true_m =
        log.rows.back().truth.true_T_base.p_m - (result == &stood ? all : log.rows).front().truth.true_T_base.p_m;
    EXPECT_NEAR(went_m.z(), true_m.z(), 0.02);
  }
}

TEST(EstimateReplay, LateLioWithOutliersAndFutureStamps_IsCountedAndNeverMakesAStep) {
  WalkSpec spec;
  spec.steps = 4;
  const EstimateLog log = climb_log(spec);
  std::vector<LioRow> lio = lio_of(log, 7);
  lio[60].pose.p_m.x() += 0.5;
  lio[70].stamp_ns += kNsPerS;
  LioRow early = lio.front(), old = lio.front();  // both of before the log, where no odometry is known
  early.stamp_ns = -50 * kNsPerMs;
  old.stamp_ns = -kNsPerS;
  early.arrival_ns = old.arrival_ns = 0;
  lio.insert(lio.begin(), {early, old});
  const ReplayOptions options;
  const Replay result = replay(log, lio, options);
  const auto count = [&result](LioVerdict verdict) { return result.lio[static_cast<std::size_t>(verdict)]; };
  EXPECT_EQ(count(LioVerdict::kJump), 1U);
  EXPECT_EQ(count(LioVerdict::kFuture), 1U);
  EXPECT_EQ(count(LioVerdict::kNoOdometry), 1U);
  EXPECT_EQ(count(LioVerdict::kTooOld), 1U);
  EXPECT_GT(count(LioVerdict::kAccepted), lio.size() - 8);
  EXPECT_GT(result.lio_not_arrived, 0U);
  EXPECT_EQ(std::accumulate(result.lio.begin(), result.lio.end(), result.lio_not_arrived), lio.size());
  EXPECT_LE(result.largest_slew_m, options.estimator.fusion.slew.speed_mps * seconds(SyntheticWalk::kTick_ns) + 1e-9);
  EXPECT_EQ(result.ticks[10].lio_age_ns, -1);
  EXPECT_LT(result.ticks.back().lio_age_ns, 210 * kNsPerMs);
}

TEST(EstimateReplay, TruthCountsFromFarAway_ScoresAreThoseOfAStartAtTheOrigin) {
  WalkSpec spec;
  spec.steps = 2;
  EstimateLog log = climb_log(spec);
  const Score near = score(log, replay(log, {}, {}));
  const Vec3 away_m{5e5, -5e5, 1e3};
  for (LogRow& row : log.rows) row.truth.true_T_base.p_m += away_m;
  const Replay result = replay(log, lio_of(log, 7), {});
  EXPECT_LT((result.ticks.back().world_T_base.p_m - log.rows.back().truth.true_T_base.p_m).norm(), 0.05);
  const Score far = score(log, replay(log, {}, {}));
  EXPECT_NEAR(far.position_rmse_m, near.position_rmse_m, 1e-6);
  EXPECT_NEAR(far.velocity_rmse_mps, near.velocity_rmse_mps, 1e-6);
  EXPECT_NEAR(far.nees_mean, near.nees_mean, 1e-3);
}

TEST(EstimateReplay, RowsMissingInTheMiddleOfAStep_AreBridged_AndTheSigmasSayHowWell) {
  WalkSpec spec;
  spec.steps = 3;
  const EstimateLog whole = climb_log(spec);
  for (const auto& [gap_ns, bound_m] : {std::pair{200 * kNsPerMs, 0.1}, {1000 * kNsPerMs, 0.6}}) {
    for (const std::int64_t from_ns : {2700 * kNsPerMs, 3400 * kNsPerMs}) {
      EstimateLog log = whole;
      std::erase_if(log.rows, [&, until_ns = from_ns + gap_ns](const LogRow& row) {
        return row.stamp_ns > from_ns && row.stamp_ns < until_ns;
      });
      const Replay result = replay(log, {}, {});
      EXPECT_EQ(result.gaps, 1U);
      EXPECT_LT(worst_error_m(log, result), bound_m) << gap_ns << " " << from_ns;
      EXPECT_LT(score(log, result).velocity_rmse_mps, 0.05) << gap_ns << " " << from_ns;
      EXPECT_LT(end_error_over_variance(log, result), 16.0) << gap_ns << " " << from_ns;
    }
  }
}

TEST(EstimateReplay, ImuBeyondTheModulesRange_IsCountedAndNotFelt) {
  WalkSpec spec;
  spec.steps = 2;
  EstimateLog log = climb_log(spec);
  const Score clean = score(log, replay(log, {}, {}));
  for (std::size_t i = 700; i < 1700; i += 100) {
    log.rows[i].accel_mps2.x() = 500.0;
    log.rows[i + 1].gyro_radps.z() = -50.0;
  }
  const Replay result = replay(log, {}, {});
  EXPECT_EQ(result.imu_invalid, 20U);
  EXPECT_LT(score(log, result).position_rmse_m, clean.position_rmse_m + 2e-3);
}

TEST(EstimateReplay, ContactsNoSurerThanAsLikelyAsNot_StillHoldTheRobot) {
  WalkSpec spec;
  spec.steps = 2;
  EstimateLog log = climb_log(spec);
  for (LogRow& row : log.rows) {
    for (double& contact : row.contact) contact *= 0.6;
  }
  const Replay result = replay(log, {}, {});
  EXPECT_EQ(result.rows_without_contact, 0U);
  const double certain_m = worst_error_m(climb_log(spec), replay(climb_log(spec), {}, {}));
  EstimateLog likely = climb_log(spec);
  for (LogRow& row : likely.rows) {
    for (double& contact : row.contact) contact *= 0.85;
  }
  EXPECT_NEAR(worst_error_m(likely, replay(likely, {}, {})), certain_m, 2e-3);
  EXPECT_LT(worst_error_m(log, result), 0.05);
  for (LogRow& row : log.rows) row.contact.fill(0.1);
  EXPECT_EQ(replay(log, {}, {}).rows_without_contact, log.rows.size());
}

TEST(EstimateReplay, LioWithoutDelay_IsAccepted_AtAnyRateOfRows) {
  WalkSpec spec;
  spec.steps = 1;
  EstimateLog log = climb_log(spec);
  for (LogRow& row : log.rows) row.stamp_ns /= 2;  // 1 kHz
  std::vector<LioRow> lio = lio_of(log, 7);
  for (std::size_t i = 0; i < lio.size(); ++i) {
    lio[i].stamp_ns = lio[i].arrival_ns = log.rows[50 * i + i % 2].stamp_ns;
  }
  const Replay result = replay(log, lio, {});
  EXPECT_EQ(result.lio[static_cast<std::size_t>(LioVerdict::kNoOdometry)], 0U);
}

// The biases are unknown at the start, and half of the robots set out after 0.2 s. Where the odometry is better than
// LIO (5 mm) some of LIO's noise comes through: 3.3 mm at tau 1 s; and of what legs drift to the side most could be the
// heading of the lidar's mount, and stays: 7 mm.
TEST(EstimateReplay, BiasedLogWithLateLio_IsNoWorseThanWithoutOrLiosNoiseAndMountAndKnowsHowGoodItIs) {
  constexpr std::uint32_t kSeeds = test::kSlowMachine ? 1 : 6;
  for (std::uint32_t seed = 11; seed < 11 + kSeeds; ++seed) {
    WalkSpec spec;
    spec.seed = seed;
    spec.steps = 6;
    spec.stand_s = seed % 2 == 0 ? 0.2 : 2.0;
    spec.gyro_bias_radps = 5e-3;
    const EstimateLog log = climb_log(spec);
    const std::vector<LioRow> lio = lio_of(log, seed);
    const Score without = score(log, replay(log, {}, {}));
    for (const double tau_s : {0.0, 1.0, 4.0}) {  // 0: by LIO's noise
      ReplayOptions options;
      if (tau_s > 0.0) options.estimator.fusion.tau_s = tau_s;
      if (tau_s > 0.0) options.estimator.fusion.tau_spm = 0.0;
      const Score with = score(log, replay(log, lio, options));
      EXPECT_LT(with.position_rmse_m, std::max(without.position_rmse_m, 0.0075)) << seed << ", tau " << tau_s;
      EXPECT_LT(with.nees_mean, 7.5) << seed << ", tau " << tau_s;  // 6: honest; more: too sure of itself
      EXPECT_GT(with.nees_mean, 0.3) << seed << ", tau " << tau_s;  // no foot creeps and no leg is too long here
    }
    const Score single = score(log, replay(log, {lio.front()}, {}));  // says where LIO's world is, and nothing else
    EXPECT_EQ(single.position_rmse_m, without.position_rmse_m) << seed;
    EXPECT_NEAR(single.nees_in_bounds, without.nees_in_bounds, 0.02) << seed;
  }
}

TEST(EstimateReplay, LidarMount_PosesOfTheLidar_AreThoseOfTheBase) {
  WalkSpec spec;
  spec.steps = 1;
  spec.noise_scale = 0.0;
  const EstimateLog log = climb_log(spec);
  std::vector<LioRow> lio = lio_of(log, 7);
  const Transform mount{rotation_y(0.3), Vec3{0.1, 0.0, 0.6}};
  ReplayOptions options;
  const Replay plain = replay(log, lio, options);
  for (LioRow& row : lio) row.pose = row.pose * mount;
  options.robot.mounts.base_T_lidar = mount;
  const Replay mounted = replay(log, lio, options);
  EXPECT_LT((plain.ticks.back().world_T_base.p_m - mounted.ticks.back().world_T_base.p_m).norm(), 1e-6);
}

// A log of rows at 100 Hz whose feet stand, but for one row of the right one's; the estimate goes off by 10 mm/s.
Score score_of_creep(int rows, int lifted_row) {
  EstimateLog log;
  Replay replay;
  for (int i = 0; i < rows; ++i) {
    LogRow row;
    row.stamp_ns = i * 10 * kNsPerMs;
    row.contact = {1.0, i == lifted_row ? 0.0 : 1.0};
    row.base_p_foot_m = {Vec3{0.0, 0.1, -0.8}, Vec3{0.0, -0.1, -0.8}};
    log.rows.push_back(row);
    ReplayTick tick;
    tick.world_T_base.p_m.x() = 1e-4 * i;
    tick.quality.covariance.setIdentity();
    replay.ticks.push_back(tick);
  }
  return score(log, replay);
}

TEST(EstimateScore, PlantedFeet_TheFarthestThatTheyGoCountsOfStancesOfASecondAtLeast) {
  EXPECT_NEAR(score_of_creep(151, -1).planted_foot_m, 0.015, 1e-9);
  EXPECT_NEAR(score_of_creep(151, 120).planted_foot_m, 0.0119, 1e-9);  // anew from there, and not for long enough
  EXPECT_LT(score_of_creep(151, 60).planted_foot_m, 0.0);
}

// --- Logs that are not of our simulation -----------------------------------------------------------------------------

struct KnownLog {
  std::string path;
  double position_mm, velocity_mmps, drift_percent;  // at most: as asked, or 1.3 of what is measured
};
const std::array<KnownLog, 3> kKnownLogs{{{"/cassie/cassie_walk_open.csv", 5.0, 8.5, 0.7},
                                          {"/icub/walk.csv", 13.0, 88.0, 3.0},
                                          {"/icub/gazebo_0_35.csv", 10.0, 37.0, 1.2}}};

std::string shared_data() {
  const char* folder = std::getenv("POLYGMAP_SHARED_DATA");
  return folder != nullptr ? folder : POLYGMAP_SHARED_DATA_DEFAULT;
}

TEST(EstimateReplay, LogsOfOtherRobots_StayAsNearAsAsked) {
  int read = 0;
  for (const KnownLog& known : kKnownLogs) {
    if (!std::filesystem::exists(shared_data() + known.path)) continue;
    ++read;
    const EstimateLog log = read_estimate_log(shared_data() + known.path);
    const Score s = score(log, replay(log, {}, {}));
    EXPECT_LT(1e3 * s.position_rmse_m, known.position_mm) << known.path;
    EXPECT_LT(1e3 * s.velocity_rmse_mps, known.velocity_mmps) << known.path;
    EXPECT_LT(drift_percent(s), known.drift_percent) << known.path;
  }
  if (read == 0) GTEST_SKIP() << "No logs in " << shared_data() << ": set POLYGMAP_SHARED_DATA.";
}

// The peer's figures there, invariant-ekf with its example's noise: 4, 22 and 24 mm.
TEST(EstimateReplay, LogsThatBeginOnOneFoot_StayNearerThanThePeer) {
  constexpr std::array<double, 3> kMost_mm{4.0, 22.0, 24.0};
  int read = 0;
  for (std::size_t i = 0; i < kKnownLogs.size(); ++i) {
    if (!std::filesystem::exists(shared_data() + kKnownLogs[i].path)) continue;
    ++read;
    EstimateLog log = read_estimate_log(shared_data() + kKnownLogs[i].path);
    const auto half = log.rows.begin() + static_cast<std::ptrdiff_t>(log.rows.size() / 2);
    const auto on_one_foot = std::find_if(
        half, log.rows.end(), [](const LogRow& row) { return (row.contact[0] >= 0.5) != (row.contact[1] >= 0.5); });
    log.rows.erase(log.rows.begin(), on_one_foot);
    const Score s = score(log, replay(log, {}, {}));
    EXPECT_LT(1e3 * s.position_rmse_m, kMost_mm[i]) << kKnownLogs[i].path;
  }
  if (read == 0) GTEST_SKIP() << "No logs in " << shared_data() << ": set POLYGMAP_SHARED_DATA.";
}

// --- Units and axes --------------------------------------------------------------------------------------------------

class LogDoubts : public testing::Test {
 protected:
  LogDoubts() {
    WalkSpec spec;
    spec.steps = 3;
    log_ = climb_log(spec);
  }
  // What is said of the log when every row is changed so; "refused: " in front where it is refused.
  template <typename Change>
  std::string said(const Change& change, bool with_truth = true) const {
    EstimateLog changed = log_;
    changed.has_truth = with_truth;
    for (LogRow& row : changed.rows) change(row);
    try {
      std::string all;
      for (const std::string& doubt : doubts_about(changed, "log.csv")) all += doubt;
      return all;
    } catch (const config::FileError& error) {
      return std::string("refused: ") + error.what();
    }
  }
  static void expect(const std::string& said, const std::string& wanted, bool refused) {
    EXPECT_EQ(said.starts_with("refused: "), refused) << said;
    EXPECT_NE(said.find(wanted), std::string::npos) << said;
  }
  EstimateLog log_;
};

TEST_F(LogDoubts, LogAsItShouldBe_HasNone) {
  for (const bool with_truth : {true, false}) EXPECT_EQ(said([](LogRow&) {}, with_truth), "");
}

TEST_F(LogDoubts, WrongUnits_AreRefused) {
  for (const bool with_truth : {true, false}) {
    expect(said([](LogRow& row) { row.accel_mps2 /= kGravity_mps2; }, with_truth), "is in g, or gravity is taken off",
           true);
    expect(said([](LogRow& row) { row.gyro_radps *= 180.0 / kPi; }, with_truth), "degrees per second", true);
    expect(said([](LogRow& row) { row.accel_mps2 *= 100.0; }, with_truth), "other units", true);
    const auto in_decimetres = [](LogRow& row) {
      for (Vec3& foot_m : row.base_p_foot_m) foot_m *= 10.0;
    };
    expect(said(in_decimetres, with_truth), "are they in metres", true);
  }
}

TEST_F(LogDoubts, UpOfTheAccelerometerIsNotThatOfTheFeet_IsRefused) {
  expect(said([](LogRow& row) { row.accel_mps2.z() *= -1.0; }), "swapped or flipped", true);
  expect(said([](LogRow& row) { std::swap(row.accel_mps2.x(), row.accel_mps2.z()); }), "swapped or flipped", true);
}

TEST_F(LogDoubts, SolesUpsideDownAndTruthInMillimetres_AreNamed) {
  log_.has_soles = true;
  EXPECT_EQ(said([](LogRow&) {}), "");
  const auto upside_down = [](LogRow& row) {
    for (Mat3& R : row.base_R_foot) R = R * rotation_x(kPi);
  };
  expect(said(upside_down), "z axes do not point up", false);
  expect(said([](LogRow& row) { row.truth.true_T_base.p_m *= 1000.0; }), "in metres?", true);
}

// A base that nods above its soles.
TEST_F(LogDoubts, SoleQuaternionsInAnotherOrderOrInverted_AreNamed) {
  log_.has_soles = true;
  const auto nodding = [](LogRow& row) {
    const auto world_R_base = [](double t_s) -> Mat3 {
      return rotation_y(0.1 * std::sin(2.0 * t_s)) * rotation_x(0.07 * std::cos(3.0 * t_s));
    };
    constexpr double kStep_s = 1e-4;
    const double t_s = seconds(row.stamp_ns);
    row.gyro_radps = so3_log(world_R_base(t_s).transpose() * world_R_base(t_s + kStep_s)) / kStep_s;
    row.base_R_foot.fill(world_R_base(t_s).transpose() * rotation_z(0.05));
  };
  const auto reordered = [&](LogRow& row) {
    nodding(row);
    for (Mat3& R : row.base_R_foot) {
      const Eigen::Quaterniond q(R);
      R = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).matrix();
    }
  };
  const auto inverted = [&](LogRow& row) {
    nodding(row);
    for (Mat3& R : row.base_R_foot) R.transposeInPlace();
  };
  EXPECT_EQ(said(nodding).find("soles"), std::string::npos) << said(nodding);
  expect(said(reordered), "order x, y, z, w", false);
  expect(said(inverted), "quaternions inverted", false);
}

TEST_F(LogDoubts, SignalThatStaysTheSame_IsNamed) {
  const auto from_2_s_on = [](auto freeze) {
    return [freeze](LogRow& row) {
      if (row.stamp_ns > 2 * kNsPerS) freeze(row);
    };
  };
  expect(said(from_2_s_on([](LogRow& row) {
                row.gyro_radps = {0.1, 0.0, 0.0};
              }),
              false),
         "gyro_* stay the same", false);
  expect(said(from_2_s_on([](LogRow& row) { row.accel_mps2 = {0.0, 0.1, 9.8}; })), "accel_* stay the same", false);
  expect(said(from_2_s_on([](LogRow& row) {
           row.base_p_foot_m = {Vec3{0.0, 0.1, -0.8}, Vec3{0.0, -0.1, -0.8}};
         })),
         "places of both feet stay the same", false);
}

TEST_F(LogDoubts, TrueVelocityThatIsNotThePlaces_IsNamed) {
  const std::string wanted = "do not add up to its places";
  expect(said([](LogRow& row) { row.truth.true_v_base_mps *= 1000.0; }), wanted, false);
  expect(said([](LogRow& row) { row.truth.true_T_base.p_m.setZero(); }), wanted, false);
  EXPECT_EQ(said([](LogRow& row) { row.truth.true_v_base_mps *= 1000.0; }, false), "");
}

TEST_F(LogDoubts, OddNumbersThatMayBeRight_AreTold) {
  expect(said([](LogRow& row) { row.accel_mps2 *= 1.5; }), "gravity's 9.81", false);
  expect(said([](LogRow& row) { row.gyro_radps = -row.gyro_radps; }), "truth's quaternion", false);
  expect(said([](LogRow& row) { row.accel_mps2.x() += 2.0; }), "leans out of the vertical", false);
}

TEST_F(LogDoubts, OneAxisOfTheGyroFlipped_ContradictsTheTruth) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name = std::string("gyro_") + "xyz"[axis];
    const std::string doubt = said([axis](LogRow& row) { row.gyro_radps[axis] *= -1.0; });
    EXPECT_TRUE(doubt.find(name) != std::string::npos || doubt.find("gyro turns otherwise") != std::string::npos)
        << name << ": " << doubt;
  }
}

TEST_F(LogDoubts, NothingIsComparedAcrossAGap) {
  EstimateLog gapped = log_;
  for (LogRow& row : gapped.rows) {  // as if it had turned round while nothing was recorded
    if (row.stamp_ns < 3 * kNsPerS) continue;
    row.stamp_ns += 2 * kNsPerS;
    row.truth.true_T_base.R = rotation_z(2.5) * row.truth.true_T_base.R;
  }
  EXPECT_TRUE(doubts_about(gapped, "log.csv").empty()) << doubts_about(gapped, "log.csv").front();
  const LogGaps gaps = gaps_of(gapped);
  EXPECT_EQ(gaps.count, 1U);
  EXPECT_NEAR(gaps.longest_s, 2.002, 1e-9);
  EXPECT_EQ(gaps_of(log_).count, 0U);
}

TEST_F(LogDoubts, RateThatWasNotTried_IsTold) {
  EstimateLog slow = log_;
  slow.rows.clear();
  for (std::size_t i = 0; i < log_.rows.size(); i += 15) slow.rows.push_back(log_.rows[i]);  // 33 Hz
  std::string all;
  for (const std::string& doubt : doubts_about(slow, "log.csv")) all += doubt;
  EXPECT_NE(all.find("at 33.3 Hz: the estimator was tried on logs of 100 to 1000 Hz"), std::string::npos) << all;
}

// What is no truth's to say: a standing foot that moves.
class Contradictions : public LogDoubts {
 protected:
  template <typename Change>
  std::string contradiction(const Change& change) const {
    EstimateLog changed = log_;
    changed.has_truth = false;
    for (LogRow& row : changed.rows) change(row);
    return doubt_about_contacts(changed, replay(changed, {}, {}), {});
  }
};

TEST_F(Contradictions, SignalsThatAgree_GetNoSentence) {
  EXPECT_EQ(contradiction([](LogRow&) {}), "");
}

TEST_F(Contradictions, FlippedAxesAndWrongFeet_AreNamed) {
  const auto expect_named = [](const std::string& said, const std::string& wanted) {
    EXPECT_NE(said.find("they contradict each other"), std::string::npos) << wanted;
    EXPECT_NE(said.find(wanted), std::string::npos) << said;
  };
  expect_named(contradiction([](LogRow& row) { row.gyro_radps.y() *= -1.0; }), "gyro_y_radps negated");
  expect_named(contradiction([](LogRow& row) { row.accel_mps2.x() *= -1.0; }), "accel_x_mps2 negated");
  expect_named(contradiction([](LogRow& row) { row.gyro_radps *= -1.0; }), "gyro_");
  expect_named(contradiction([](LogRow& row) { std::swap(row.base_p_foot_m[0], row.base_p_foot_m[1]); }), "exchanged");
  expect_named(contradiction([](LogRow& row) {
                 for (Vec3& foot_m : row.base_p_foot_m) foot_m.x() *= -1.0;
               }),
               "x axes of both feet's places negated");
  expect_named(contradiction([](LogRow& row) {
                 for (double& contact : row.contact) contact = 1.0 - contact;
               }),
               "contacts");
}

TEST_F(Contradictions, NoContacts_AreTold) {
  EXPECT_NE(contradiction([](LogRow& row) { row.contact.fill(0.0); }).find("No foot ever stands"), std::string::npos);
}

TEST(LioDoubt, PosesThatAllComeTooLate_AreTold) {
  WalkSpec spec;
  spec.steps = 2;
  const EstimateLog log = climb_log(spec);
  std::vector<LioRow> late = lio_of(log, 4);
  for (LioRow& row : late) row.arrival_ns += kNsPerS;
  EXPECT_NE(doubt_about_lio("lio.csv", late.size(), replay(log, late, {})).find("arrived too late"), std::string::npos);
}

TEST(LioDoubt, PosesThatComeBeforeTheirStamp_AreTold) {
  WalkSpec spec;
  spec.steps = 2;
  const EstimateLog log = climb_log(spec);
  std::vector<LioRow> early = lio_of(log, 4);
  for (LioRow& row : early) row.arrival_ns = row.stamp_ns - 50 * kNsPerMs;
  EXPECT_NE(doubt_about_lio("lio.csv", early.size(), replay(log, early, {})).find("before their stamp"),
            std::string::npos);
}

TEST(LioDoubt, PosesWithZFlipped_AreTold) {
  WalkSpec spec;
  spec.steps = 6;
  const EstimateLog log = climb_log(spec);
  std::vector<LioRow> flipped = lio_of(log, 4);
  for (LioRow& row : flipped) row.pose.p_m.z() *= -1.0;
  EXPECT_NE(doubt_about_lio("lio.csv", flipped.size(), replay(log, flipped, {})).find("contradict the odometry"),
            std::string::npos);
}

TEST(LioDoubt, PosesInMillimetresOrOfAnotherOrder_AreRefusedAndTold_AndMoveNoSigma) {
  WalkSpec spec;
  spec.steps = 3;
  const EstimateLog log = climb_log(spec);
  const std::vector<LioRow> good = lio_of(log, 4);
  const Replay without = replay(log, {}, {}), with = replay(log, good, {});
  EXPECT_EQ(doubt_about_lio("lio.csv", good.size(), with), "");
  const auto in_millimetres = [](LioRow& row) { row.pose.p_m *= 1000.0; };
  const auto in_another_order = [](LioRow& row) {
    const Eigen::Quaterniond q(row.pose.R);
    row.pose.R = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
  };
  for (const auto& spoil : {std::function<void(LioRow&)>(in_millimetres), {in_another_order}}) {
    std::vector<LioRow> bad = good;
    for (LioRow& row : bad) spoil(row);
    const Replay result = replay(log, bad, {});
    EXPECT_LE(result.lio[static_cast<std::size_t>(LioVerdict::kAccepted)], 1U);
    EXPECT_LE(result.lio[static_cast<std::size_t>(LioVerdict::kRealigned)], 1U);
    EXPECT_NE(doubt_about_lio("lio.csv", bad.size(), result).find("w, x, y, z"), std::string::npos);
    EXPECT_EQ(score(log, result).nees_in_bounds, score(log, without).nees_in_bounds);
    EXPECT_EQ(result.ticks.back().quality.covariance, without.ticks.back().quality.covariance);
  }
}

TEST(EstimateLogs, RecordedOnRobots_AreInTheRightUnitsAndAxes) {
  int read = 0;
  for (const KnownLog& known : kKnownLogs) {
    const std::string& path = known.path;
    if (!std::filesystem::exists(shared_data() + path)) continue;
    ++read;
    const EstimateLog log = read_estimate_log(shared_data() + path);
    EXPECT_TRUE(doubts_about(log, path).empty()) << path;
    EXPECT_EQ(doubt_about_contacts(log, replay(log, {}, {}), {}), "") << path;
  }
  if (read == 0) GTEST_SKIP() << "No logs in " << shared_data() << ": set POLYGMAP_SHARED_DATA.";
}

// --- The command -----------------------------------------------------------------------------------------------------

class EstimateCommand : public testing::Test {
 protected:
  EstimateCommand() { std::filesystem::create_directories(folder_); }
  [[nodiscard]] std::string at(const std::string& name) const { return folder_ + "/" + name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(at(name), std::ios::binary) << text;
    return at(name);
  }
  int call(const std::vector<std::string>& arguments) {
    std::ostringstream out, err;
    const int code = polygmap_main(
        arguments, [](const ClimbOptions&, const ClimbProgressFunction&) { return ClimbSummary{}; }, out, err, false);
    out_ = out.str();
    err_ = err.str();
    return code;
  }
  void expect_refused(const std::vector<std::string>& arguments, const std::string& culprit) {
    EXPECT_EQ(call(arguments), kExitUsage) << culprit;
    EXPECT_NE(err_.find(culprit), std::string::npos) << culprit << " is not in: " << err_;
    EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 1) << err_;
    EXPECT_EQ(out_, "") << culprit;
  }
  // No sensor says the same twice.
  static std::string row_of(int i) {
    return i % 2 == 0 ? kRow : ",1e-7,0,0,1e-6,0,9.81,1,1,1e-7,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,1,0,0,0";
  }
  // Standing still on two feet, a row every 2 ms.
  static std::string log_text(int rows) {
    std::string text = std::string(kHeader) + "\n";
    for (int i = 0; i < rows; ++i) text += std::to_string(100.0 + 0.002 * i) + row_of(i) + "\n";
    return text;
  }
  static constexpr const char* kHeader =
      "t_s,gyro_x_radps,gyro_y_radps,gyro_z_radps,accel_x_mps2,accel_y_mps2,accel_z_mps2,left_contact,right_contact,"
      "left_foot_x_m,left_foot_y_m,left_foot_z_m,right_foot_x_m,right_foot_y_m,right_foot_z_m,truth_px_m,truth_py_m,"
      "truth_pz_m,truth_vx_mps,truth_vy_mps,truth_vz_mps,truth_qw,truth_qx,truth_qy,truth_qz";
  static constexpr const char* kRow = ",0,0,0,0,0,9.81,1,1,0,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,1,0,0,0";
  static constexpr const char* kLioHeader = "stamp_s,arrival_s,px_m,py_m,pz_m,qw,qx,qy,qz\n";
  std::string folder_ = testing::TempDir() + "polygmap_estimate_test";
  std::string out_, err_;
};

TEST_F(EstimateCommand, StandingLog_WritesScoresAndOneRowPerRow) {
  const std::string lio = write("lio.csv", std::string(kLioHeader) + "100.1,100.15,5,5,1,1,0,0,0\n");
  ASSERT_EQ(call({"estimate", write("log.csv", log_text(500)), "--lio", lio, "--json", at("out.json"), "--csv",
                  at("out.csv")}),
            kExitPass)
      << err_;
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(at("out.json")));
  for (const char* key :
       {"position_rmse_mm", "velocity_rmse_mmps", "attitude_rmse_deg", "drift_percent", "horizontal_drift_percent"}) {
    EXPECT_LT(json.at(key).get<double>(), 0.1) << key;
  }
  EXPECT_TRUE(json.contains("nees_in_bounds_percent"));
  EXPECT_TRUE(json["planted_foot_mm"].is_null());  // it stands for less than a second
  EXPECT_EQ(json["lio"]["accepted"], 1);
  EXPECT_EQ(json["innovations"]["foot_position"]["updates"], 499);
  EXPECT_EQ(json["innovations"]["lio_position"]["updates"], 0);
  std::ifstream csv(at("out.csv"));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line.rfind("t_s,px_m,py_m,pz_m,qw", 0), 0U) << line;
  const auto columns = std::count(line.begin(), line.end(), ',');
  int rows = 0;
  for (; std::getline(csv, line); ++rows) EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns);
  EXPECT_EQ(rows, 500);
  EXPECT_EQ(line.empty(), true);
}

TEST_F(EstimateCommand, LogThatIsOdd_IsEstimatedWithAWarning) {
  std::string text = log_text(500);
  for (std::size_t at = 0; (at = text.find("9.81", at)) != std::string::npos; at += 4) text.replace(at, 4, "6.50");
  ASSERT_EQ(call({"estimate", write("odd.csv", text), "--json", at("out.json")}), kExitPass) << err_;
  EXPECT_EQ(err_.rfind("polygmap: warning: The median acceleration is 6.5", 0), 0U) << err_;
  const nlohmann::json warnings = nlohmann::json::parse(std::ifstream(at("out.json"))).at("warnings");
  ASSERT_EQ(warnings.size(), 2U) << warnings;  // feet that stand move under such an acceleration
  EXPECT_NE(warnings[0].get<std::string>().find("The median acceleration is 6.5"), std::string::npos);
}

TEST_F(EstimateCommand, ParamsOfAllDefaults_AreTakenWithAWarning) {
  const std::string log = write("log.csv", log_text(500));
  ASSERT_EQ(call({"estimate", log, "--params", write("all.toml", params_toml({})), "--json", at("out.json")}),
            kExitPass);
  EXPECT_NE(err_.find("all.toml\" has the module's default where a log wants another value (in brackets): "),
            std::string::npos)
      << err_;
  EXPECT_NE(err_.find("estimator.fusion.tau_s (1)"), std::string::npos) << err_;
  EXPECT_EQ(nlohmann::json::parse(std::ifstream(at("out.json"))).at("warnings").size(), 1U);
  const std::string one = write("one.toml", "[estimator.fusion]\ntau_s = 2.0\n");
  ASSERT_EQ(call({"estimate", log, "--params", one}), kExitPass);
  EXPECT_EQ(err_, "");
}

TEST_F(EstimateCommand, GapsAreCountedAndTheLongestIsTold) {
  std::string text = log_text(300);
  for (int i = 0; i < 300; ++i) text += std::to_string(102.6 + 0.002 * i) + row_of(i) + "\n";
  ASSERT_EQ(call({"estimate", write("gap.csv", text)}), kExitPass) << err_;
  EXPECT_EQ(err_, "");
  EXPECT_NE(out_.find("1 gap of more than 50 ms without rows, the longest 2.002 s"), std::string::npos) << out_;
}

TEST_F(EstimateCommand, TwentyRowsASecond_AreNoGapsAndGetAWarning) {
  std::string text = std::string(kHeader) + "\n";
  for (int i = 0; i < 50; ++i) text += std::to_string(100.0 + 0.0505 * i) + row_of(i) + "\n";
  ASSERT_EQ(call({"estimate", write("slow.csv", text), "--json", at("out.json")}), kExitPass) << err_;
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(at("out.json")));
  EXPECT_EQ(json["gaps"], 0);
  EXPECT_EQ(json["warnings"].size(), 1U);
  EXPECT_LT(json["planted_foot_mm"].get<double>(), 0.1);
}

TEST_F(EstimateCommand, TenRowsASecond_AreRefusedWithTheRatesThatWereTried) {
  std::string text = std::string(kHeader) + "\n";
  for (int i = 0; i < 50; ++i) text += std::to_string(100.0 + 0.1 * i) + row_of(i) + "\n";
  expect_refused({"estimate", write("slow.csv", text)}, "tried on 100 to 1000 Hz");
}

TEST_F(EstimateCommand, Interrupted_WritesNothingAndSaysSo) {
  write("out.json", "old");
  const std::atomic<int> signal{SIGINT};
  std::ostringstream out, err;
  const std::string log = write("log.csv", log_text(500));
  EXPECT_EQ(
      polygmap_main({"estimate", log, "--json", at("out.json"), "--csv", at("out.csv")}, {}, out, err, false, &signal),
      kExitSignal + SIGINT);
  EXPECT_EQ(err.str(), "polygmap: interrupted: nothing is written.\n");
  EXPECT_FALSE(std::filesystem::exists(at("out.json")));
  EXPECT_FALSE(std::filesystem::exists(at("out.csv")));
}

TEST_F(EstimateCommand, LogThatIsRefused_LeavesNoFormerOutput) {
  write("out.json", "{}");
  write("out.csv", "old");
  std::string text = log_text(50);
  for (std::size_t at = 0; (at = text.find("9.81", at)) != std::string::npos; at += 4) text.replace(at, 4, "1.00");
  expect_refused({"estimate", write("g.csv", text), "--json", at("out.json"), "--csv", at("out.csv")}, "is in g, or");
  EXPECT_FALSE(std::filesystem::exists(at("out.json")));
  EXPECT_FALSE(std::filesystem::exists(at("out.csv")));
}

TEST_F(EstimateCommand, StampsInMilliseconds_OrFeetInMillimetres_AreNamed) {
  std::string stamps = std::string(kHeader) + "\n", feet = log_text(5);
  for (int i = 0; i < 50; ++i) stamps += std::to_string(100000 + 2 * i) + kRow + "\n";
  expect_refused({"estimate", write("ms.csv", stamps)}, "are the stamps in seconds?");
  for (std::size_t at = 0; (at = feet.find("-0.8", at)) != std::string::npos; at += 4) feet.replace(at, 4, "-800");
  expect_refused({"estimate", write("mm.csv", feet)}, "left_foot_z_m is -800, beyond what can be true (20)");
  EXPECT_TRUE(err_.ends_with("named after?\n")) << err_;
}

TEST_F(EstimateCommand, BlankLinesAtTheEnd_AreNoRows) {
  EXPECT_EQ(call({"estimate", write("log.csv", log_text(20) + "\n  \n\r\n\n")}), kExitPass) << err_;
}

TEST_F(EstimateCommand, BadLogs_AreNamedInOneSentenceWithTheirLine) {
  const std::string good = log_text(5);
  const auto spoilt = [&good](int line, const std::string& text) {
    std::istringstream in(good);
    std::string out, one;
    for (int n = 1; std::getline(in, one); ++n) out += (n == line ? text : one) + "\n";
    return out;
  };
  const auto swapped = [](const std::string& column, const std::string& by) {
    const std::string header = kHeader;
    const std::size_t where = header.find(column);
    std::string changed = header.substr(0, where);
    changed += by;
    changed += header.substr(where + column.size());
    return changed;
  };
  const std::string row = std::string("100.004") + kRow;
  const struct {
    std::string text, culprit;
  } kCases[] = {
      {"", "is empty"},
      {"t_s;gyro_x_radps;gyro_y_radps\n1;2;3\n", "line 1: the columns are separated by semicolons"},
      {"t_s\tgyro_x_radps\n1\t2\n", "line 1: the columns are separated by tabs"},
      {"\"t_s\",\"gyro_x_radps\"\n1,2\n", "line 1: the columns' names stand in quotes"},
      {"t_s,gyro_x_radps\r1,2\r3,4\r", "end in CR alone"},
      {std::string(kHeader) + "\n", "no rows"},
      {"\x89PNG\r\n\x1a\n,,\n", "is no log: line 1 must name the columns, with commas between them, but in \"?PNG\""},
      {std::string("\x7f"
                   "ELF;\t\0\r,",
                   10),
       "is no log"},
      {"# A page of text\n\nwith commas, and lines.\n", "is no log"},
      {"0.0,0.1,0.2\n0.1,0.1,0.2\n", "but in \"0.0,0.1,0.2\" the column \"t_s\" is missing"},
      {"{\n  \"t_s\": 1\n}\n", "is no log"},
      {spoilt(1, "t_s,gyro_x_radps"), "line 2"},
      {spoilt(1, swapped("t_s", "t_x")), "\"t_s\" is missing"},
      {spoilt(1, swapped("gyro_x_radps", "gyro_x")), "is missing"},
      {spoilt(1, swapped("truth_px_m,", "px_m,")), "\"truth_px_m\" is missing"},
      {spoilt(1, swapped("truth_qz", "qz")), "\"truth_qz\" is missing"},
      {spoilt(1, swapped("gyro_y_radps", "gyro_x_radps")), "twice"},
      {spoilt(4, "100.004,0,0"), "line 4: has 3 values"},
      {spoilt(4, row + ",1"), "line 4: has 26 values"},
      {spoilt(4, std::string("100.000") + kRow), "line 4: t_s"},
      {spoilt(4, std::string("nan") + kRow), "line 4: t_s is \"nan\", not a finite"},
      {spoilt(4, "100.004,inf,0,0,0,0,9.81,1,1,0,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,1,0,0,0"), "line 4: gyro_x_radps"},
      {spoilt(4, "100.004,1e-400,0,0,0,0,9.81,1,1,0,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,1,0,0,0"), "no double can hold"},
      {spoilt(4, "100.004,one,0,0,0,0,9.81,1,1,0,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,1,0,0,0"), "not a number"},
      {spoilt(4, "100.004,0x,0,0,0,0,9.81,1,1,0,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,1,0,0,0"), "not a number"},
      {spoilt(4, "100.004,,0,0,0,0,9.81,1,1,0,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,1,0,0,0"), "empty"},
      {spoilt(4, "100.004,0,0,0,0,0,1e9,1,1,0,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,1,0,0,0"), "beyond"},
      {spoilt(4, "100.004,0,0,0,0,0,9.81,2,1,0,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,1,0,0,0"), "left_contact"},
      {spoilt(4, "100.004,0,0,0,0,0,9.81,1,1,0,0.1,-0.8,0,-0.1,-0.8,0,0,0.8,0,0,0,0,0,0,0"), "quaternion"},
      {spoilt(4, ""), "line 4"},
      {std::string(kHeader) + "\n100.0" + kRow + "\n", "line 2: is the only row"},
      {spoilt(4, std::string("106.1") + kRow), "line 4: t_s is 6.098 s after"},
      {std::string(kHeader) + "\n100" + kRow + "\n102" + kRow + "\n104" + kRow + "\n", "line 4: the rows"},
  };
  for (const auto& c : kCases) expect_refused({"estimate", write("bad.csv", c.text)}, c.culprit);
  expect_refused({"estimate", at("absent.csv")}, "There is no file");
  expect_refused({"estimate", folder_}, "is a folder");
  expect_refused({"estimate", write("log.csv", good), "--json", folder_}, folder_);
  expect_refused({"estimate", at("log.csv"), "--csv", at("no/such/folder.csv")}, "folder.csv");
  expect_refused({"estimate", at("log.csv"), "--lio", write("lio.csv", "stamp_s\n1\n")}, "\"arrival_s\" is missing");
  const std::string backwards = std::string(kLioHeader) + "100.1,100.2,0,0,0,1,0,0,0\n100.2,100.1,0,0,0,1,0,0,0\n";
  expect_refused({"estimate", at("log.csv"), "--lio", write("lio.csv", backwards)}, "line 3: arrival_s");
  expect_refused({"estimate", at("log.csv"), "--lidar-mount", "0", "0", "0", "0", "0", "0"}, "--lio");
  expect_refused({"estimate", at("log.csv"), "--csv", at("log.csv")}, "would be overwritten");
  expect_refused({"estimate", at("log.csv"), "--lio", at("lio.csv"), "--json", folder_ + "/./lio.csv"}, "overwritten");
  expect_refused({"estimate", at("log.csv"), "--csv", at("one.out"), "--json", at("one.out")}, "overwritten");
  expect_refused({"estimate", at("log.csv"), "--lio-tau", "2"}, "--lio-tau is of no use");
}

TEST_F(EstimateCommand, Garbage_OfEveryKind_IsReadOrRefusedButNeverACrash) {
  const std::string good = log_text(20);
  std::mt19937 random(1);
  const auto below = [&random](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  constexpr std::string_view kSpice = "0123456789.,,,-+eEnaif\n\r\t \"#\0\xff";
  for (int i = 0; i < (test::kSlowMachine ? 100 : 1000); ++i) {
    std::string text = good;
    for (std::size_t k = 1 + below(8); k > 0; --k) {
      const std::size_t where = below(text.size());
      switch (below(4)) {
        case 0:
          text[where] = kSpice[below(kSpice.size())];
          break;
        case 1:
          text.insert(where, 1, kSpice[below(kSpice.size())]);
          break;
        case 2:
          text.erase(where, 1 + below(30));
          break;
        default:
          text.resize(std::max<std::size_t>(where, 1));
      }
      if (text.empty()) text.assign(1, 'x');
    }
    const int code = call({"estimate", write("fuzz.csv", text)});
    ASSERT_TRUE(code == kExitPass || code == kExitUsage) << text;
    ASSERT_EQ(std::count(err_.begin(), err_.end(), '\n'), code == kExitPass ? 0 : 1) << err_;
  }
}

}  // namespace
}  // namespace polygmap::sim
