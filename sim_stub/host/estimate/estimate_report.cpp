// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/estimate/estimate_report.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "firmware/config/file_error.hpp"
#include "sim_stub/host/output_file.hpp"

namespace polygmap::sim {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kDegrees = 180.0 / kPi;

Json vector(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json lio_counts(const std::vector<LioRow>& lio, const Replay& replay) {
  constexpr std::array<const char*, kLioVerdictCount> kNames{"accepted", "non_finite", "not_rotation", "covariance",
                                                             "order",    "future",     "too_old",      "no_odometry",
                                                             "jump",     "realigned",  "out_of_range"};
  Json counts{{"poses", lio.size()}};
  for (std::size_t v = 0; v < kLioVerdictCount; ++v) counts[kNames[v]] = replay.lio[v];
  counts["not_arrived"] = replay.lio_not_arrived;
  return counts;
}

// Squared over their variances, per row: 1 in the mean where noise is what it is thought to be.
Json innovations(const EstimateQuality& quality) {
  Json groups = Json::object();
  for (const auto& [group, name] :
       {std::pair{MeasurementGroup::kFootPosition, "foot_position"},
        std::pair{MeasurementGroup::kLioPosition, "lio_position"}, std::pair{MeasurementGroup::kLioYaw, "lio_yaw"}}) {
    const InnovationStatistics& of = quality.innovations_of(group);
    groups[name] = {{"updates", of.count}, {"mean", of.mean}, {"last_second", of.recent}};
  }
  return groups;
}

Json scores(const EstimateLog& log, const Replay& replay) {
  const Score s = score(log, replay);
  return {{"position_rmse_mm", 1e3 * s.position_rmse_m},
          {"velocity_rmse_mmps", 1e3 * s.velocity_rmse_mps},
          {"attitude_rmse_deg", kDegrees * s.attitude_rmse_rad},
          {"tilt_rmse_deg", kDegrees * s.tilt_rmse_rad},
          {"yaw_rmse_deg", kDegrees * s.yaw_rmse_rad},
          {"odometry_position_rmse_mm", 1e3 * s.odometry_rmse_m},
          {"drift_percent", drift_percent(s)},
          {"horizontal_drift_percent", horizontal_drift_percent(s)},
          {"distance_m", s.distance_m},
          {"final_error_mm", 1e3 * s.final_error_m},
          {"planted_foot_mm", s.planted_foot_m < 0.0 ? Json(nullptr) : Json(1e3 * s.planted_foot_m)},
          {"nees_in_bounds_percent", 100.0 * s.nees_in_bounds},
          {"nees_mean", s.nees_mean},
          {"nees_states", "position and velocity, 6"}};
}

}  // namespace

const char* name_of(StartSource source) {
  switch (source) {
    case StartSource::kTruth:
      return "first row of the truth";
    case StartSource::kStandstill:
      return "standstill";
    case StartSource::kFirstAcceleration:
      return "level by the first acceleration";
  }
  return "?";
}

double drift_percent(const Score& score) {
  return score.distance_m > 0.0 ? 100.0 * score.final_error_m / score.distance_m : 0.0;
}

double horizontal_drift_percent(const Score& score) {
  return score.horizontal_distance_m > 0.0 ? 100.0 * score.final_horizontal_error_m / score.horizontal_distance_m : 0.0;
}

Json estimate_json(const EstimateLog& log, const std::vector<LioRow>& lio, const Replay& replay,
                   const std::string& params_hash, const std::vector<std::string>& warnings) {
  Json json{{"params_hash", params_hash},
            {"rows", log.rows.size()},
            {"duration_s", seconds(log.rows.back().stamp_ns)},
            {"start", name_of(replay.start)},
            {"warnings", warnings}};
  if (log.has_truth) json.update(scores(log, replay));
  const ReplayTick& last = replay.ticks.back();
  json["gyro_bias_radps"] = vector(replay.gyro_bias_radps);
  json["accel_bias_mps2"] = vector(replay.accel_bias_mps2);
  json["innovations"] = innovations(last.quality);
  json["innovation_outliers"] = last.quality.outliers;
  json["moving_contact_rows"] = replay.slipping_rows;
  json["rows_without_contact_percent"] =
      100.0 * static_cast<double>(replay.rows_without_contact) / static_cast<double>(log.rows.size());
  json["gaps"] = replay.gaps;
  json["imu_invalid"] = replay.imu_invalid;
  json["final_position_sigma_mm"] = vector(1e3 * last.quality.covariance.diagonal().head<3>().cwiseSqrt());
  json["final_yaw_sigma_deg"] = kDegrees * std::sqrt(last.quality.covariance(8, 8));
  json["lio"] = lio_counts(lio, replay);
  json["lio"]["age_at_end_s"] = last.lio_age_ns < 0 ? Json(nullptr) : Json(seconds(last.lio_age_ns));
  json["slew_max_mm_per_tick"] = 1e3 * replay.largest_slew_m;
  return json;
}

void write_estimate_json(const std::string& path, const EstimateLog& log, const std::vector<LioRow>& lio,
                         const Replay& replay, const std::string& params_hash,
                         const std::vector<std::string>& warnings) {
  const Json json = estimate_json(log, lio, replay, params_hash, warnings);
  write_output(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

void write_estimate_csv(const std::string& path, const EstimateLog& log, const Replay& replay) {
  std::ostringstream file;
  file << "t_s,px_m,py_m,pz_m,qw,qx,qy,qz,vx_mps,vy_mps,vz_mps,wx_radps,wy_radps,wz_radps,"
          "sigma_px_m,sigma_py_m,sigma_pz_m,sigma_vx_mps,sigma_vy_mps,sigma_vz_mps,sigma_roll_rad,sigma_pitch_rad,"
          "sigma_yaw_rad,left_contact,right_contact,lio_age_s,"
          "innovation_foot_position,innovation_lio_position,innovation_lio_yaw\n";
  for (const ReplayTick& tick : replay.ticks) {
    const Eigen::Quaterniond q(tick.world_T_base.R);
    const double sign = q.w() < 0.0 ? -1.0 : 1.0;
    char text[48];
    std::snprintf(text, sizeof text, "%.9f", log.start_s + seconds(tick.stamp_ns));
    file << text;
    const auto put = [&](double value) {
      std::snprintf(text, sizeof text, ",%.9g", value);
      file << text;
    };
    const auto put3 = [&](const Vec3& v) {
      for (int i = 0; i < 3; ++i) put(v[i]);
    };
    put3(tick.world_T_base.p_m);
    for (const double c : {q.w(), q.x(), q.y(), q.z()}) put(sign * c);
    put3(tick.world_v_base_mps);
    put3(tick.base_w_base_radps);
    for (int i = 0; i < 9; ++i) put(std::sqrt(std::max(tick.quality.covariance(i, i), 0.0)));
    for (const double p : tick.contact_probability) put(p);
    put(tick.lio_age_ns < 0 ? -1.0 : seconds(tick.lio_age_ns));
    for (const MeasurementGroup group :
         {MeasurementGroup::kFootPosition, MeasurementGroup::kLioPosition, MeasurementGroup::kLioYaw}) {
      put(tick.quality.innovations_of(group).last);
    }
    file << "\n";
  }
  write_output(path, file.str());
}

}  // namespace polygmap::sim
