// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/estimate/log_contradiction.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace polygmap::sim {
namespace {

// Counted foot by foot, which is at most twice what rows are: on logs as they should be, 0 to 0.9 % of the rows have a
// standing foot that moves; on one, simulated and slippery, 8.3 %. With a flipped axis or the wrong feet it is 7 % at
// least, mostly a third and more (2026-11).
constexpr double kSuspect = 0.02;    // share of the rows: worth a look
constexpr double kSure = 0.15;       // no walk slips so much
constexpr double kExplained = 0.25;  // what a change must leave of it, to be named
constexpr std::size_t kLeastRows = 20;
constexpr std::size_t kMostReplayed_rows = 20'000;  // that are replayed for each change

struct Change {
  const char* name;
  void (*apply)(LogRow& row);
};
constexpr std::array<Change, 11> kChanges{{
    {"gyro_x_radps negated", [](LogRow& row) { row.gyro_radps.x() *= -1.0; }},
    {"gyro_y_radps negated", [](LogRow& row) { row.gyro_radps.y() *= -1.0; }},
    {"all three of gyro_* negated", [](LogRow& row) { row.gyro_radps *= -1.0; }},
    {"gyro_x_radps and gyro_y_radps exchanged", [](LogRow& row) { std::swap(row.gyro_radps.x(), row.gyro_radps.y()); }},
    {"accel_x_mps2 negated", [](LogRow& row) { row.accel_mps2.x() *= -1.0; }},
    {"accel_y_mps2 negated", [](LogRow& row) { row.accel_mps2.y() *= -1.0; }},
    {"accel_x_mps2 and accel_y_mps2 exchanged", [](LogRow& row) { std::swap(row.accel_mps2.x(), row.accel_mps2.y()); }},
    {"the x axes of both feet's places negated",
     [](LogRow& row) {
       for (Vec3& foot_m : row.base_p_foot_m) foot_m.x() *= -1.0;
     }},
    {"the y axes of both feet's places negated",
     [](LogRow& row) {
       for (Vec3& foot_m : row.base_p_foot_m) foot_m.y() *= -1.0;
     }},
    {"the left and the right foot (or their contacts) exchanged",
     [](LogRow& row) {
       std::swap(row.base_p_foot_m[0], row.base_p_foot_m[1]);
       std::swap(row.base_R_foot[0], row.base_R_foot[1]);
     }},
    {"0 and 1 exchanged in both contacts",
     [](LogRow& row) {
       for (double& contact : row.contact) contact = 1.0 - contact;
     }},
}};

double share(std::uint32_t rows, const Replay& replay) {
  return static_cast<double>(rows) / static_cast<double>(replay.ticks.size());
}
double moving(const Replay& replay) { return share(replay.slipping_rows, replay); }

}  // namespace

std::string doubt_about_contacts(const EstimateLog& log, const Replay& whole, const ReplayOptions& options) {
  if (whole.rows_without_contact == whole.ticks.size()) {
    return "No foot ever stands (contact of 0.5 or more): this is dead reckoning by the IMU alone.";
  }
  if (whole.slipping_rows < kLeastRows || moving(whole) < kSuspect) return {};
  EstimateLog beginning = log;
  beginning.rows.resize(std::min(beginning.rows.size(), kMostReplayed_rows));
  const Replay as_it_is = replay(beginning, {}, options);
  const double in_the_air = share(as_it_is.rows_without_contact, as_it_is);
  double least = 1.0, moving_then = 0.0;
  const Change* best = nullptr;
  for (const Change& change : kChanges) {
    EstimateLog changed = beginning;
    for (LogRow& row : changed.rows) change.apply(row);
    const Replay by_change = replay(changed, {}, options);
    const double unheld = share(by_change.rows_without_contact, by_change), moves = moving(by_change);
    if (!is_finite(by_change) || unheld > in_the_air + 0.05 || moves > kExplained * moving(as_it_is)) continue;
    if (moves + unheld >= least) continue;  // of two that explain it, that with which the robot stands
    least = moves + unheld;
    moving_then = moves;
    best = &change;
  }
  if (best == nullptr && moving(whole) < kSure) return {};
  std::string sentence = "In " + std::to_string(whole.slipping_rows) + " of " + std::to_string(whole.ticks.size()) +
                         " rows a foot moves by gyro, accelerometer and feet while its contact says that it stands: "
                         "they contradict each other";
  if (best != nullptr) {
    std::array<char, 32> percent{};
    std::snprintf(percent.data(), percent.size(), "only %.1f %% of the rows", 100.0 * moving_then);
    sentence += "; with " + std::string(best->name) + " it does so in " +
                (moving_then < 0.0005 ? "no row" : std::string(percent.data()));
  }
  return sentence + ".";
}

std::string doubt_about_lio(const std::string& path, std::size_t poses, const Replay& whole) {
  const auto count = [&whole](LioVerdict verdict) { return whole.lio[static_cast<std::size_t>(verdict)]; };
  constexpr std::uint32_t kLeastPoses = 5;
  if (2 * (count(LioVerdict::kTooOld) + whole.lio_not_arrived) > poses) {
    return "\"" + path + "\": of " + std::to_string(poses) + " poses " + std::to_string(count(LioVerdict::kTooOld)) +
           " arrived too late to be of use and " + std::to_string(whole.lio_not_arrived) +
           " after the log's end: are stamp_s and arrival_s in seconds, and of the log's clock?";
  }
  if (2 * count(LioVerdict::kFuture) > poses) {
    return "\"" + path + "\": of " + std::to_string(poses) + " poses " + std::to_string(count(LioVerdict::kFuture)) +
           " arrived before their stamp: is stamp_s the moment of the scan?";
  }
  const std::uint32_t refused = count(LioVerdict::kJump) + count(LioVerdict::kRealigned);
  if (refused < kLeastPoses || 10 * refused <= poses) return {};  // right ones: 6 % at most, from a start on the move
  return "\"" + path + "\": " + std::to_string(refused) + " of " + std::to_string(poses) +
         " poses contradict the odometry, or are tilted against gravity, and were not used: are p*_m in metres, is the "
         "quaternion's order w, x, y, z, and is the pose the base's (or --lidar-mount given)?";
}

}  // namespace polygmap::sim
