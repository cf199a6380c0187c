// SPDX-License-Identifier: Apache-2.0
// A log through RossHartley/invariant-ekf (BSD-3, no part of this project) as `polygmap estimate` takes it through the
// module: the same rows, the same start, the same scores and files. toolchain/campaign compiles it.
#include <InEKF.h>

#include <array>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "algorithms/geometry/so3.hpp"
#include "firmware/config/file_error.hpp"
#include "sim_stub/host/estimate/estimate_report.hpp"

namespace polygmap::sim {
namespace {

constexpr const char* kUsage =
    "inekf_replay LOG.csv [--json OUT.json] [--csv OUT.csv] [NAME=VALUE...]\n"
    "The filter's noise: gyro, accel, gyro_bias, accel_bias, contact, in its own units, and foot, of the feet's "
    "positions, m.\nWhat is not given is as in the filter's own example.\n"
    "still: the gyro's bias begins as its mean over so many seconds, where it begins at 0 otherwise.";

// Of the start, one sigma: attitude (rad), velocity (m/s) and position (m) as the module's; biases of gyro (rad/s) and
// accelerometer (m/s^2) as the filter's authors have them for Cassie.
constexpr std::array<double, 5> kStartSigmas{1e-4, 1e-3, 1e-4, 0.01, 0.1};

struct Request {
  std::string log, json, csv;
  std::map<std::string, double> noise{{"gyro", 0.01},    {"accel", 0.1},  {"gyro_bias", 1e-5}, {"accel_bias", 1e-4},
                                      {"contact", 0.01}, {"foot", 0.003}, {"still", 0.0}};
};

void take_noise(const std::string& word, Request& request) {
  const std::size_t equals = word.find('=');
  const auto noise = request.noise.find(word.substr(0, equals));
  char* end = nullptr;
  if (noise != request.noise.end()) noise->second = std::strtod(word.c_str() + equals + 1, &end);
  if (end == nullptr || *end != '\0' || !(noise->second > 0.0))
    throw config::FileError("\"" + word + "\" is none of those, or not above 0");
}

Request request_of(const std::vector<std::string>& words) {
  Request request;
  std::string* next = &request.log;
  for (const std::string& word : words) {
    if (word.find('=') != std::string::npos) {
      take_noise(word, request);
    } else if (word == "--json" || word == "--csv") {
      next = word == "--json" ? &request.json : &request.csv;
    } else {
      *next = word;
      next = &request.log;
    }
  }
  if (request.log.empty()) throw config::FileError("no log is named");
  return request;
}

Vec3 mean_gyro_radps(const EstimateLog& log, double still_s) {
  Vec3 sum_radps = Vec3::Zero();
  double count = 0.0;
  for (const LogRow& row : log.rows) {
    if (seconds(row.stamp_ns) >= still_s) break;
    sum_radps += row.gyro_radps;
    count += 1.0;
  }
  return sum_radps / std::max(count, 1.0);
}

inekf::InEKF filter_at(const EstimateLog& log, const Request& request) {
  const LogTruth& start = log.rows.front().truth;
  inekf::NoiseParams noise;
  noise.setGyroscopeNoise(request.noise.at("gyro"));
  noise.setAccelerometerNoise(request.noise.at("accel"));
  noise.setGyroscopeBiasNoise(request.noise.at("gyro_bias"));
  noise.setAccelerometerBiasNoise(request.noise.at("accel_bias"));
  noise.setContactNoise(request.noise.at("contact"));
  inekf::RobotState state;
  state.setRotation(start.true_T_base.R);
  state.setVelocity(start.true_v_base_mps);
  state.setPosition(start.true_T_base.p_m);
  state.setGyroscopeBias(mean_gyro_radps(log, request.noise.at("still")));
  Eigen::VectorXd variances(15);
  for (int i = 0; i < 5; ++i) variances.segment<3>(3 * i).setConstant(math::square(kStartSigmas[i]));
  state.setP(variances.asDiagonal());
  return {state, noise};
}

void propagate(inekf::InEKF& filter, const LogRow& from, const LogRow& to) {
  Eigen::Matrix<double, 6, 1> imu;
  imu << 0.5 * (from.gyro_radps + to.gyro_radps), 0.5 * (from.accel_mps2 + to.accel_mps2);
  filter.Propagate(imu, seconds(to.stamp_ns - from.stamp_ns));
}

// Feet are points.
void correct(inekf::InEKF& filter, const LogRow& row, double foot_sigma_m) {
  const Eigen::Matrix<double, 6, 6> covariance = math::square(foot_sigma_m) * Eigen::Matrix<double, 6, 6>::Identity();
  std::vector<std::pair<int, bool>> contacts;
  inekf::vectorKinematics feet;
  for (int f = 0; f < static_cast<int>(kFootCount); ++f) {
    contacts.emplace_back(f, row.contact[f] >= 0.5);
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
    pose.topRightCorner<3, 1>() = row.base_p_foot_m[f];
    feet.emplace_back(f, pose, covariance);
  }
  filter.setContacts(contacts);
  filter.CorrectKinematics(feet);
}

// The filter's errors are attitude's, velocity's and position's, right-invariant: d_p = e_p - p x e, and so for
// velocity.
ReplayTick tick_of(inekf::InEKF& filter, const LogRow& row) {
  inekf::RobotState state = filter.getState();
  ReplayTick tick;
  tick.stamp_ns = row.stamp_ns;
  tick.world_T_base = tick.odom_T_base = {state.getRotation(), state.getPosition()};
  tick.world_v_base_mps = state.getVelocity();
  using Square = Eigen::Matrix<double, 9, 9>;
  Square J = Square::Zero();
  J.block<3, 3>(0, 0) = -skew(tick.world_T_base.p_m);
  J.block<3, 3>(0, 6).setIdentity();
  J.block<3, 3>(3, 0) = -skew(tick.world_v_base_mps);
  J.block<3, 3>(3, 3).setIdentity();
  J.block<3, 3>(6, 0).setIdentity();
  tick.quality.covariance = J * state.getP().topLeftCorner<9, 9>() * J.transpose();
  return tick;
}

Replay replay_peer(const EstimateLog& log, const Request& request) {
  Replay replay;
  inekf::InEKF filter = filter_at(log, request);
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    if (i > 0) propagate(filter, log.rows[i - 1], log.rows[i]);
    correct(filter, log.rows[i], request.noise.at("foot"));
    replay.ticks.push_back(tick_of(filter, log.rows[i]));
  }
  return replay;
}

void run(const Request& request) {
  const EstimateLog log = read_estimate_log(request.log);
  if (!log.has_truth) throw config::FileError("\"" + request.log + "\" has no truth, whose first row is the start.");
  const Replay replay = replay_peer(log, request);
  if (!request.json.empty()) write_estimate_json(request.json, log, {}, replay, "", {});
  if (!request.csv.empty()) write_estimate_csv(request.csv, log, replay);
}

}  // namespace
}  // namespace polygmap::sim

int main(int count, char** words) {
  using namespace polygmap::sim;
  try {
    run(request_of({words + 1, words + count}));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    if (count < 2) std::fprintf(stderr, "%s\n", kUsage);
    return 2;
  }
}
