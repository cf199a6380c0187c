// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/estimation_stages.hpp"

#include "tests/support/nominal_robot.hpp"
#include "tests/support/synthetic_walk.hpp"

namespace polygmap::bench {
namespace {

using test::SyntheticWalk;
using test::WalkSpec;

constexpr std::int64_t kLioDelay_ns = 100 * kNsPerMs;
constexpr std::int64_t kWarm_ns = 6 * kNsPerS;  // standing: calibrated and aligned, the ring is full
constexpr std::int64_t kEnd_ns = kWarm_ns + 1500 * kNsPerMs;

// What the stages do, and the warm-up, which is not counted, too.
void align(EstimationBench& bench, const EstimationTick& tick) {
  StateEstimate state;
  state.stamp_ns = tick.now_ns;
  state.odom_T_base = tick.odom_T_base;
  bench.ring.push(state);
  if (bench.fusion.check(tick.lio, tick.now_ns) != LioVerdict::kAccepted) return;
  if (bench.ring.try_at(tick.lio.stamp_ns, state)) static_cast<void>(bench.fusion.fuse(tick.lio, state.odom_T_base));
}
void run_all(EstimationBench& bench, const EstimationTick& tick) {
  bench.estimator.add_imu(tick.imu, tick.now_ns);
  bench.estimator.add_joints(tick.joints, tick.now_ns);
  bench.estimator.tick(tick.stance);
  bench.estimator.add_lio(tick.lio, tick.now_ns);
}

}  // namespace

EstimationWalk::EstimationWalk() {
  WalkSpec spec;
  spec.stand_s = seconds(kWarm_ns);
  spec.steps = 1;
  SyntheticWalk walk(spec);
  start.estimator.reset({}, nominal_robot());
  start.fusion.reset({}, base_T_lidar());
  for (std::int64_t t_ns = kLioDelay_ns; t_ns < kEnd_ns; t_ns += SyntheticWalk::kTick_ns) {
    EstimationTick tick;
    tick.now_ns = t_ns;
    tick.imu = walk.imu(t_ns);
    tick.joints = walk.joints(t_ns);
    tick.stance = walk.truth(t_ns).stance;
    tick.lio = walk.lio(t_ns - kLioDelay_ns);
    tick.odom_T_base = walk.truth(t_ns).true_T_base;
    if (t_ns >= kWarm_ns) {
      ticks.push_back(tick);
    } else {
      run_all(start, tick);
      align(start, tick);
    }
  }
}

std::string_view complaint(const EstimationBench& end, const EstimationWalk& walk) {
  const auto grown = [&](LioVerdict verdict) {
    return end.estimator.counters().lio_of(verdict) - walk.start.estimator.counters().lio_of(verdict);
  };
  if (grown(LioVerdict::kAccepted) != walk.ticks.size()) return "LIO poses were rejected";
  if (end.estimator.odometry().fusion().innovations().position.count == 0 ||
      end.fusion.innovations().position.count == 0)
    return "LIO is not aligned";
  if (!end.estimator.state().initialised) return "the estimator is not initialised";
  if (walk.ticks.front().stance[0] == walk.ticks[walk.ticks.size() / 2].stance[0]) return "no foot swings";
  return {};
}

void stage_lio_alignment(EstimationBench& bench, const EstimationTick& tick) { align(bench, tick); }
void stage_fused_tick(EstimationBench& bench, const EstimationTick& tick) { run_all(bench, tick); }

}  // namespace polygmap::bench
