// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/estimate_command.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <set>
#include <utility>

#include "firmware/config/param_file.hpp"
#include "firmware/params.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/cli/command_words.hpp"
#include "sim_stub/host/cli/paths.hpp"
#include "sim_stub/host/estimate/estimate_report.hpp"
#include "sim_stub/host/estimate/log_contradiction.hpp"
#include "sim_stub/host/estimate/log_page.hpp"
#include "sim_stub/host/estimate/log_plausibility.hpp"
#include "sim_stub/host/output_file.hpp"

namespace polygmap::sim {
namespace {

constexpr double kMaxMount_m = 10.0, kMaxAngle_deg = 360.0, kMaxTau_s = 1000.0;

std::string complaint(const EstimateArguments& a) {
  std::set<std::string> taken;  // nothing that is read, and nothing written for another option, is overwritten
  for (const std::string& file : {a.log, a.lio, a.params, a.json, a.csv, a.html}) {
    if (file.empty()) continue;
    const bool fresh = taken.insert(one_name(file)).second;
    if (!fresh && (file == a.json || file == a.csv || file == a.html)) return "\"" + file + "\" would be overwritten.";
  }
  for (std::size_t i = 0; i < a.lidar_mount.size(); ++i) {
    const double limit = i < 3 ? kMaxMount_m : kMaxAngle_deg;
    if (!(std::abs(a.lidar_mount[i]) <= limit)) {
      return "--lidar-mount must be three lengths from -" + number(kMaxMount_m) + " to " + number(kMaxMount_m) +
             " m and three angles from -" + number(kMaxAngle_deg) + " to " + number(kMaxAngle_deg) + " degrees, not " +
             number(a.lidar_mount[i]) + ".";
    }
  }
  if (!a.lidar_mount.empty() && a.lio.empty()) return "--lidar-mount is of no use without --lio.";
  if (a.lio_tau_s != 0.0 && a.lio.empty()) return "--lio-tau is of no use without --lio.";
  return {};
}

// A file made by `params list` says every default of the module, and a log wants others of some. Empty when it undoes
// none.
std::string doubt_about_params(const std::string& file, Params for_logs, Params read) {
  Params defaults;
  const config::ParamTable wanted = config::param_table(for_logs), now = config::param_table(read),
                           usual = config::param_table(defaults);
  std::string undone;
  for (std::size_t i = 0; i < wanted.params.size(); ++i) {
    if (same_value(wanted.params[i], usual.params[i]) || !same_value(now.params[i], usual.params[i])) continue;
    undone += (undone.empty() ? "" : ", ") + wanted.params[i].name + " (" + text_of(wanted.params[i]) + ")";
  }
  if (undone.empty()) return {};
  return "\"" + file + "\" has the module's default where a log wants another value (in brackets): " + undone +
         "; leave out what is not meant.";
}

void set_by_options(const EstimateArguments& a, Params& params) {
  if (a.lio_tau_s > 0.0) {
    params.estimator.fusion.tau_s = a.lio_tau_s;
    params.estimator.fusion.tau_spm = 0.0;
  }
  if (!a.lidar_mount.empty()) {
    const auto rad = [&a](std::size_t i) { return a.lidar_mount[i] * kPi / 180.0; };
    params.robot.mounts.base_T_lidar = {rotation_zyx(rad(5), rad(4), rad(3)),
                                        Vec3{a.lidar_mount[0], a.lidar_mount[1], a.lidar_mount[2]}};
  }
}

ReplayOptions options_of(const EstimateArguments& a, std::vector<std::string>& warnings) {
  ReplayOptions options;
  Params params, for_logs;
  params.estimator = for_logs.estimator = options.estimator;
  params.robot = for_logs.robot = options.robot;
  if (!a.params.empty()) config::read_params(a.params, params);
  options.params_hash = config::hash_of(params);
  set_by_options(a, params);
  set_by_options(a, for_logs);
  if (std::string doubt = doubt_about_params(a.params, for_logs, params); !doubt.empty()) warnings.push_back(doubt);
  options.estimator = params.estimator;
  options.robot = params.robot;
  return options;
}

// What a user must know before trusting the rest.
void print_lio(const Replay& replay, std::size_t poses, std::ostream& out) {
  const auto count = [&replay](LioVerdict verdict) { return replay.lio[static_cast<std::size_t>(verdict)]; };
  const ReplayTick& last = replay.ticks.back();
  out << "LIO: " << count(LioVerdict::kAccepted) << " of " << poses << " poses accepted; " << count(LioVerdict::kJump)
      << " too far from the odometry, " << count(LioVerdict::kRealigned) << " taken as a new world, "
      << count(LioVerdict::kTooOld) << " too old, " << count(LioVerdict::kFuture) << " of the future, "
      << count(LioVerdict::kNoOdometry) << " from before the start, " << replay.lio_not_arrived << " not arrived";
  if (last.lio_age_ns >= 0) out << "; the last one is " << 1e-9 * static_cast<double>(last.lio_age_ns) << " s old";
  out << "\n";
}

void print(const EstimateLog& log, const Replay& replay, std::ostream& out) {
  char line[224];
  std::snprintf(line, sizeof line, "%zu rows, %.3f s; start: %s; feet as %s\n", log.rows.size(),
                seconds(log.rows.back().stamp_ns), name_of(replay.start), log.has_soles ? "soles" : "points");
  out << line;
  if (const LogGaps gaps = gaps_of(log); gaps.count > 0) {
    std::snprintf(line, sizeof line, "%zu gap%s of more than %.0f ms without rows, the longest %.3f s: bridged\n",
                  gaps.count, gaps.count == 1 ? "" : "s", 1e3 * log.gap_s(), gaps.longest_s);
    out << line;
  }
  if (replay.imu_invalid > 0) {
    out << replay.imu_invalid
        << " rows have an IMU beyond what can be true and were left out: are its units rad/s and m/s^2?\n";
  }
  if (!log.has_truth) {
    out << "No truth columns: nothing is scored.\n";
    return;
  }
  const Score s = score(log, replay);
  std::snprintf(
      line, sizeof line,
      "position %.2f mm, velocity %.2f mm/s, attitude %.3f deg RMSE; drift %.2f %% of %.2f m, horizontal %.2f %%; "
      "NEES in bounds in %.1f %% of the rows\n",
      1e3 * s.position_rmse_m, 1e3 * s.velocity_rmse_mps, s.attitude_rmse_rad * 180.0 / kPi, drift_percent(s),
      s.distance_m, horizontal_drift_percent(s), 100.0 * s.nees_in_bounds);
  out << line;
}

}  // namespace

CLI::App* declare_estimate(CLI::App& app, EstimateArguments& a) {
  CLI::App* estimate = app.add_subcommand("estimate", "Run the state estimation on a recorded log");
  estimate
      ->add_option("LOG.csv", a.log,
                   "t_s, gyro_{x,y,z}_radps, accel_{x,y,z}_mps2, {left,right}_contact (0 to 1), "
                   "{left,right}_foot_{x,y,z}_m (base frame); optional soles, without which feet are points: "
                   "{left,right}_foot_q{w,x,y,z}, {left,right}_foot_w{x,y,z}_radps; optional truth: "
                   "truth_p{x,y,z}_m, truth_v{x,y,z}_mps, truth_q{w,x,y,z}; the first row of it is the initial state, "
                   "the rest is scored only")
      ->required()
      ->type_name("");
  estimate
      ->add_option("--lio", a.lio,
                   "stamp_s, arrival_s, p{x,y,z}_m, q{w,x,y,z}: the base in the lidar odometry's own world, as it "
                   "arrived")
      ->type_name("LIO.csv");
  estimate
      ->add_option("--lidar-mount", a.lidar_mount,
                   "The poses are the lidar's, and this is its place in the base: m, each from -" +
                       number(kMaxMount_m) + " to " + number(kMaxMount_m) +
                       ", and degrees about x, y, z (R = Rz Ry Rx), each from -" + number(kMaxAngle_deg) + " to " +
                       number(kMaxAngle_deg))
      ->expected(6)
      ->type_name("X Y Z ROLL PITCH YAW");
  keep_within(
      *estimate->add_option(
          "--lio-tau", a.lio_tau_s,
          "Time constant of the offset's low-pass, s; 0: 0.3 s per mm of LIO's noise as measured, 1 s at least"),
      0.0, kMaxTau_s, "s");
  estimate->add_option("--params", a.params, "Parameters of the module; of the estimator and of the robot")
      ->type_name("PARAMS.toml");
  estimate->add_option("--json", a.json, "Scores, biases, innovations, rejections")->type_name("OUT.json");
  estimate->add_option("--csv", a.csv, "Pose, twist, sigmas, contact probabilities, LIO's age, row by row")
      ->type_name("OUT.csv");
  estimate->add_option("--html", a.html, "One page with the curves, what was refused, and the scores")
      ->type_name("OUT.html");
  return estimate;
}

int run_estimate(const EstimateArguments& a, std::ostream& out, std::ostream& err, const std::atomic<int>* interrupt) {
  if (const std::string sentence = complaint(a); !sentence.empty()) {
    err << "polygmap: " << sentence << "\n";
    return kExitUsage;
  }
  try {
    for (const std::string& file : {a.json, a.csv, a.html}) {
      if (!file.empty()) remove_output(file);  // a former run's is none of this one
    }
    throw_if_interrupted(interrupt);
    const EstimateLog log = read_estimate_log(a.log);
    const std::vector<LioRow> lio = a.lio.empty() ? std::vector<LioRow>{} : read_lio_log(a.lio, log.start_s);
    std::vector<std::string> warnings = doubts_about(log, a.log);
    ReplayOptions options = options_of(a, warnings);
    options.interrupt = interrupt;
    std::size_t told = 0;
    const auto tell = [&] {
      for (; told < warnings.size(); ++told) err << "polygmap: warning: " << warnings[told] << "\n";
    };
    tell();
    const Replay result = replay(log, lio, options);
    if (!is_finite(result))
      throw config::FileError("\"" + a.log + "\": the estimate is not finite, so nothing is written.");
    for (std::string& doubt :
         std::array{doubt_about_contacts(log, result, options), doubt_about_lio(a.lio, lio.size(), result)}) {
      if (!doubt.empty()) warnings.push_back(std::move(doubt));
    }
    tell();
    if (!a.json.empty()) write_estimate_json(a.json, log, lio, result, options.params_hash, warnings);
    if (!a.csv.empty()) write_estimate_csv(a.csv, log, result);
    if (!a.html.empty()) write_log_page(a.html, a.log, log, lio, result, options, warnings);
    print(log, result, out);
    if (!a.lio.empty()) print_lio(result, lio.size(), out);
  } catch (const Interrupted& by) {
    err << "polygmap: interrupted: nothing is written.\n";
    return kExitSignal + by.signal;
  } catch (const std::exception& error) {
    err << "polygmap: " << error.what() << "\n";
    return kExitUsage;
  }
  return written(out, err);
}

}  // namespace polygmap::sim
