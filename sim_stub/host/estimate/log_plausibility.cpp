// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/estimate/log_plausibility.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "algorithms/geometry/so3.hpp"
#include "firmware/config/file_error.hpp"

namespace polygmap::sim {
namespace {

constexpr double kGravityWindow_s = 2.0, kTruthWindow_s = 0.1;
// Rates that the estimator was tried at on logs (tests, docs/measured/estimation.md), with some room.
constexpr double kLeastTried_hz = 95.0, kMostTried_hz = 1050.0;

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool is_gap(const EstimateLog& log, const LogRow& from, const LogRow& to) {
  return seconds(to.stamp_ns - from.stamp_ns) > log.gap_s();
}

// By the gyro, from one row to the next.
Mat3 turn_between(const LogRow& from, const LogRow& to, double gyro_scale) {
  return so3_exp(0.5 * gyro_scale * seconds(to.stamp_ns - from.stamp_ns) * (from.gyro_radps + to.gyro_radps));
}

// Accelerations turned into one frame by the gyro add up to gravity; by a gyro of wrong units they cancel each other.
double gravity_kept(const EstimateLog& log, double gyro_scale) {
  double least = 1.0;
  Mat3 R = Mat3::Identity();
  Vec3 turned = Vec3::Zero(), plain = Vec3::Zero();
  std::int64_t begin_ns = 0;
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    const LogRow& row = log.rows[i];
    if (i > 0 && is_gap(log, log.rows[i - 1], row)) {  // how it turned meanwhile nobody knows
      R.setIdentity();
      turned.setZero();
      plain.setZero();
      begin_ns = row.stamp_ns;
    } else if (i > 0) {
      R = R * turn_between(log.rows[i - 1], row, gyro_scale);
    }
    turned += R * row.accel_mps2;
    plain += row.accel_mps2;
    if (seconds(row.stamp_ns - begin_ns) < kGravityWindow_s) continue;
    least = std::min(least, turned.norm() / std::max(plain.norm(), 1e-9));
    R.setIdentity();
    turned.setZero();
    plain.setZero();
    begin_ns = row.stamp_ns;
  }
  return least;
}

void hold_against_truth(const EstimateLog& log, double gyro_scale, LogFigures& figures) {
  Vec3 squares = Vec3::Zero(), error = Vec3::Zero();  // of each axis
  double time_s = 0.0;
  Mat3 R = Mat3::Identity();
  std::size_t begin = 0;
  for (std::size_t i = 1; i < log.rows.size(); ++i) {
    if (is_gap(log, log.rows[i - 1], log.rows[i])) {
      R.setIdentity();
      begin = i;
      continue;
    }
    R = R * turn_between(log.rows[i - 1], log.rows[i], gyro_scale);
    const double window_s = seconds(log.rows[i].stamp_ns - log.rows[begin].stamp_ns);
    if (window_s < kTruthWindow_s) continue;
    const Vec3 felt_rad = so3_log(R);
    const Vec3 true_rad = so3_log(log.rows[begin].truth.true_T_base.R.transpose() * log.rows[i].truth.true_T_base.R);
    squares += true_rad.cwiseAbs2();
    error += (felt_rad - true_rad).cwiseAbs2();
    time_s += window_s;
    R.setIdentity();
    begin = i;
  }
  if (!(squares.sum() > 0.0)) return;
  figures.true_turn_radps = std::sqrt(squares.sum() * kTruthWindow_s / time_s) / kTruthWindow_s;
  figures.gyro_error_share = error.sum() / squares.sum();
  for (int axis = 0; axis < 3; ++axis) {
    figures.true_axis_turn_radps[axis] = std::sqrt(squares[axis] * kTruthWindow_s / time_s) / kTruthWindow_s;
    figures.gyro_axis_error_share[axis] = squares[axis] > 0.0 ? error[axis] / squares[axis] : 0.0;
  }
}

// A sole that stands turns in the base as the base turns by the gyro, the other way round.
void hold_soles_against_gyro(const EstimateLog& log, double gyro_scale, LogFigures& figures) {
  constexpr double kWindow_s = 0.2;
  using Reading = Mat3 (*)(const Mat3&);
  constexpr std::array<Reading, 3> kReadings{[](const Mat3& R) { return R; },
                                             [](const Mat3& R) {
                                               const Eigen::Quaterniond q(R);
                                               return Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).matrix();
                                             },
                                             [](const Mat3& R) { return Mat3(R.transpose()); }};
  std::array<double, kReadings.size()> squares{};
  int windows = 0;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    Mat3 R = Mat3::Identity();
    std::size_t begin = 0;
    for (std::size_t i = 1; i < log.rows.size(); ++i) {
      const LogRow &from = log.rows[i - 1], &to = log.rows[i];
      if (is_gap(log, from, to) || from.contact[f] < 0.5 || to.contact[f] < 0.5) {
        R.setIdentity();
        begin = i;
        continue;
      }
      R = R * turn_between(from, to, gyro_scale);
      if (seconds(to.stamp_ns - log.rows[begin].stamp_ns) < kWindow_s) continue;
      for (std::size_t r = 0; r < kReadings.size(); ++r) {
        const Mat3 before = kReadings[r](log.rows[begin].base_R_foot[f]), after = kReadings[r](to.base_R_foot[f]);
        squares[r] += so3_log((R.transpose() * before).transpose() * after).squaredNorm();
      }
      ++windows;
      R.setIdentity();
      begin = i;
    }
  }
  if (windows == 0) return;
  figures.sole_turn_rad = std::sqrt(squares[0] / windows);
  figures.reordered_sole_turn_rad = std::sqrt(squares[1] / windows);
  figures.inverted_sole_turn_rad = std::sqrt(squares[2] / windows);
}

LogFigures::Frozen longest_frozen(const EstimateLog& log) {
  struct Signal {
    const char* what;
    bool (*same)(const LogRow& a, const LogRow& b);
  };
  constexpr std::array<Signal, 3> kSignals{
      {{"gyro_*", [](const LogRow& a, const LogRow& b) { return a.gyro_radps == b.gyro_radps; }},
       {"accel_*", [](const LogRow& a, const LogRow& b) { return a.accel_mps2 == b.accel_mps2; }},
       {"the places of both feet", [](const LogRow& a, const LogRow& b) {
          return a.base_p_foot_m[0] == b.base_p_foot_m[0] && a.base_p_foot_m[1] == b.base_p_foot_m[1];
        }}}};
  LogFigures::Frozen longest;
  for (const Signal& signal : kSignals) {
    std::size_t begin = 0;
    for (std::size_t i = 1; i < log.rows.size(); ++i) {
      if (!signal.same(log.rows[begin], log.rows[i])) begin = i;
      const double for_s = seconds(log.rows[i].stamp_ns - log.rows[begin].stamp_ns);
      if (for_s > longest.for_s) longest = {signal.what, seconds(log.rows[begin].stamp_ns), for_s};
    }
  }
  return longest;
}

// Over a second each.
void hold_velocity_against_place(const EstimateLog& log, LogFigures& figures) {
  Vec3 added_m = Vec3::Zero();
  double error_m = 0.0, way_m = 0.0;
  std::size_t begin = 0;
  for (std::size_t i = 1; i < log.rows.size(); ++i) {
    const LogRow &from = log.rows[i - 1], &to = log.rows[i];
    if (is_gap(log, from, to)) {
      added_m.setZero();
      begin = i;
      continue;
    }
    added_m += 0.5 * seconds(to.stamp_ns - from.stamp_ns) * (from.truth.true_v_base_mps + to.truth.true_v_base_mps);
    if (to.stamp_ns - log.rows[begin].stamp_ns < kNsPerS) continue;
    const Vec3 moved_m = to.truth.true_T_base.p_m - log.rows[begin].truth.true_T_base.p_m;
    error_m += (added_m - moved_m).norm();
    way_m += std::max(added_m.norm(), moved_m.norm());
    added_m.setZero();
    begin = i;
  }
  constexpr double kLeastWay_m = 0.2;
  if (way_m > kLeastWay_m) figures.true_velocity_error_share = error_m / way_m;
}

struct Doubt {
  std::string sentence;  // empty: none
  bool impossible = false;
};

template <class... Values>
std::string text(const char* format, Values... values) {
  char line[256];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

// Walking jerks a base about, but half of the time it feels less than gravity and half of the time more.
Doubt doubt_of_acceleration(const LogFigures& figures) {
  const double felt_mps2 = figures.accel_mps2;
  if (felt_mps2 > 0.8 && felt_mps2 < 1.25) {
    return {text("The median acceleration is %.2f: that is in g, or gravity is taken off, but accel_* are "
                 "in m/s^2 and feel it.",
                 felt_mps2),
            true};
  }
  const bool impossible = felt_mps2 < 3.0 || felt_mps2 > 30.0;
  if (!impossible && felt_mps2 > 7.0 && felt_mps2 < 13.0) return {};
  return {text("The median acceleration is %.3g m/s^2, but a robot on its feet feels gravity's 9.81 (other units, or "
               "gravity taken off?).",
               felt_mps2),
          impossible};
}

Doubt doubt_of_feet(const LogFigures& figures) {
  const bool impossible = figures.leg_m > 3.0;
  if (!impossible && figures.leg_m > 0.03) return {};
  return {text("The feet are %.3g m from the base, in the median: are they in metres, and in the base's frame?",
               figures.leg_m),
          impossible};
}

Doubt doubt_of_up(const LogFigures& figures) {
  const Vec3& felt = figures.base_up_felt;
  const double cosine = felt.normalized().dot(figures.base_up_by_feet.normalized());
  const double apart_deg = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / kPi;
  if (!(apart_deg > 25.0)) return {};
  return {
      text("The mean acceleration, (%.1f, %.1f, %.1f) m/s^2, points %.0f degrees away from where the base lies above "
           "its feet: an axis of the accelerometer or of the feet is swapped or flipped.",
           felt.x(), felt.y(), felt.z(), apart_deg),
      apart_deg > 60.0};
}

Doubt doubt_of_gyro(const EstimateLog& log, const LogFigures& figures) {
  const bool loses_gravity = figures.gravity_kept < 0.9;
  const bool denies_truth = figures.true_turn_radps > 0.03 && figures.gyro_error_share > 0.8;
  if (!loses_gravity && !denies_truth) return {};
  const LogFigures in_degrees = figures_of(log, kPi / 180.0);
  if ((!loses_gravity || in_degrees.gravity_kept > 0.95) && (!denies_truth || in_degrees.gyro_error_share < 0.8)) {
    return {
        "The gyro turns many times as fast as the rest of the log: it is in degrees per second, but gyro_* are in "
        "rad/s, or t_s is not in seconds.",
        true};
  }
  if (denies_truth) {
    return {
        "The gyro turns otherwise than the truth's quaternion: an axis is swapped or flipped, or the quaternion is "
        "not that of the base in the world."};
  }
  return {
      "Turned by the gyro, the acceleration does not keep to one direction: other units, or an axis that is swapped "
      "or flipped?"};
}

// One axis alone: flipped, its error is four times what it turned. Noise adds less where it turns fast enough.
Doubt doubt_of_gyro_axes(const LogFigures& figures) {
  if (figures.true_turn_radps > 0.03 && figures.gyro_error_share > 0.8) return {};  // told of the whole gyro
  for (int axis = 0; axis < 3; ++axis) {
    if (!(figures.true_axis_turn_radps[axis] > 0.02 && figures.gyro_axis_error_share[axis] > 2.0)) continue;
    return {
        text("gyro_%c_radps contradicts the truth's quaternion, which turns about that axis otherwise: it is flipped "
             "or swapped.",
             "xyz"[axis])};
  }
  return {};
}

// Only which way is up can be told: ahead is wherever a robot's maker has its base's x axis.
Doubt doubt_of_soles(const LogFigures& figures) {
  const Vec3 up = figures.base_up_by_feet.normalized();
  if (figures.base_sole_up.dot(up) >= 0.7 * figures.base_sole_up.norm()) return {};
  return {"The standing soles' z axes do not point up: is the order of *_foot_q* w, x, y, z, of the sole in the base?"};
}

Doubt doubt_of_sole_turns(const LogFigures& figures) {
  constexpr double kLeast_rad = 0.004;  // of six logs as they should be, the other readings turn twice as far and more
  const double other_rad = std::min(figures.reordered_sole_turn_rad, figures.inverted_sole_turn_rad);
  if (figures.sole_turn_rad < kLeast_rad || 1.5 * other_rad > figures.sole_turn_rad) return {};
  return {
      text("Standing soles turn otherwise than the gyro says, and with %s they would not: *_foot_q* are the sole in "
           "the base, w, x, y, z.",
           figures.reordered_sole_turn_rad < figures.inverted_sole_turn_rad ? "quaternions in the order x, y, z, w"
                                                                            : "their quaternions inverted")};
}

Doubt doubt_of_freezing(const LogFigures& figures) {
  if (figures.frozen.for_s < 0.5) return {};
  return {text("From %.3f s after the first row on %s stay the same to the last digit for %.3f s: did a sensor freeze?",
               figures.frozen.from_s, figures.frozen.what, figures.frozen.for_s)};
}

Doubt doubt_of_true_velocity(const LogFigures& figures) {
  if (figures.true_velocity_error_share < 0.3) return {};
  return {
      text("The truth's velocities do not add up to its places, by %.0f %% of "
           "the way: are both in the world\'s axes, and truth_v*_mps in m/s?",
           100.0 * figures.true_velocity_error_share)};
}

Doubt doubt_of_true_place(const LogFigures& figures) {
  if (figures.true_speed_mps < 5.0) return {};
  return {text("The truth moves at %.3g m/s, in the mean: are truth_p*_m in metres?", figures.true_speed_mps), true};
}

Doubt doubt_of_rate(const LogFigures& figures) {
  const double rate_hz = 1.0 / std::max(figures.period_s, 1e-9);
  if (rate_hz >= kLeastTried_hz && rate_hz <= kMostTried_hz) return {};
  return {
      text("The rows come at %.3g Hz: the estimator was tried on logs of 100 to 1000 Hz, and nothing is known of its "
           "errors and sigmas elsewhere.",
           rate_hz)};
}

Doubt doubt_of_truth(const LogFigures& figures, double duration_s) {
  const double most_mps2 = 0.35 + 0.5 / std::max(duration_s, 0.1);  // a bias, and what the base gained in speed
  if (!(figures.felt_lean_mps2 > most_mps2)) return {};
  return {
      text("By the truth's attitude the mean acceleration leans out of the vertical by %.2f m/s^2: an axis is "
           "swapped or flipped, or the accelerometer has a large bias.",
           figures.felt_lean_mps2)};
}

}  // namespace

LogGaps gaps_of(const EstimateLog& log) {
  LogGaps gaps;
  for (std::size_t i = 1; i < log.rows.size(); ++i) {
    if (!is_gap(log, log.rows[i - 1], log.rows[i])) continue;
    ++gaps.count;
    gaps.longest_s = std::max(gaps.longest_s, seconds(log.rows[i].stamp_ns - log.rows[i - 1].stamp_ns));
  }
  return gaps;
}

LogFigures figures_of(const EstimateLog& log, double gyro_scale) {
  LogFigures figures;
  Vec3 true_felt_mps2 = Vec3::Zero();
  std::vector<double> accels_mps2, legs_m, periods_s;
  std::size_t second_ago = 0;
  double way_m = 0.0;  // of places a second apart: noise is none
  const double share = 1.0 / static_cast<double>(log.rows.size());
  for (std::size_t i = 1; i < log.rows.size(); ++i) {
    periods_s.push_back(seconds(log.rows[i].stamp_ns - log.rows[i - 1].stamp_ns));
    if (log.rows[i].stamp_ns - log.rows[second_ago].stamp_ns < kNsPerS && i + 1 < log.rows.size()) continue;
    way_m += (log.rows[i].truth.true_T_base.p_m - log.rows[second_ago].truth.true_T_base.p_m).norm();
    second_ago = i;
  }
  figures.period_s = median(std::move(periods_s));
  if (log.has_truth) figures.true_speed_mps = way_m / std::max(seconds(log.rows.back().stamp_ns), 1e-9);
  for (const LogRow& row : log.rows) {
    accels_mps2.push_back(row.accel_mps2.norm());
    figures.base_up_felt += share * row.accel_mps2;
    true_felt_mps2 += share * (row.truth.true_T_base.R * row.accel_mps2);
    for (const Vec3& foot_m : row.base_p_foot_m) {
      legs_m.push_back(foot_m.norm());
      figures.base_up_by_feet -= share / kFootCount * foot_m;
    }
    for (std::size_t f = 0; log.has_soles && f < kFootCount; ++f) {
      if (row.contact[f] < 0.5) continue;
      figures.base_sole_up += share * row.base_R_foot[f].col(2);
    }
  }
  figures.accel_mps2 = median(std::move(accels_mps2));
  figures.leg_m = median(std::move(legs_m));
  figures.gravity_kept = gravity_kept(log, gyro_scale);
  if (log.has_soles) hold_soles_against_gyro(log, gyro_scale, figures);
  figures.frozen = longest_frozen(log);
  if (log.has_truth) {
    hold_against_truth(log, gyro_scale, figures);
    hold_velocity_against_place(log, figures);
    figures.felt_lean_mps2 = true_felt_mps2.head<2>().norm();
  }
  return figures;
}

std::vector<std::string> doubts_about(const EstimateLog& log, const std::string& path) {
  const LogFigures figures = figures_of(log);
  std::vector<std::string> doubts;
  for (const Doubt& doubt :
       {doubt_of_acceleration(figures), doubt_of_feet(figures), doubt_of_up(figures), doubt_of_soles(figures),
        doubt_of_sole_turns(figures), doubt_of_freezing(figures), doubt_of_true_velocity(figures),
        doubt_of_true_place(figures), doubt_of_gyro(log, figures), doubt_of_gyro_axes(figures), doubt_of_rate(figures),
        doubt_of_truth(figures, seconds(log.rows.back().stamp_ns))}) {
    if (doubt.impossible) throw config::FileError("\"" + path + "\": " + doubt.sentence);
    if (!doubt.sentence.empty()) doubts.push_back(doubt.sentence);
  }
  return doubts;
}

}  // namespace polygmap::sim
