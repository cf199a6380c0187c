// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/estimate/estimate_score.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "algorithms/geometry/so3.hpp"

namespace polygmap::sim {
namespace {

// Distances are gone along steps of this length at least: noise of the truth's digits walks nowhere.
constexpr double kStep_m = 0.005;

class PlantedFeet {
 public:
  // How far the estimate has let one of two standing feet go since both were planted; negative: not for kPlanted_s yet.
  double moved_m(const LogRow& row, const Transform& world_T_base) {
    if (!(row.contact[0] >= 0.5 && row.contact[1] >= 0.5)) {
      stand_ = false;
      return -1.0;
    }
    std::array<Vec3, kFootCount> world_p_foot_m;
    for (std::size_t f = 0; f < kFootCount; ++f) world_p_foot_m[f] = world_T_base * row.base_p_foot_m[f];
    if (!stand_) {
      *this = {};
      stand_ = true;
      since_ns_ = row.stamp_ns;
      planted_m_ = world_p_foot_m;
    }
    for (std::size_t f = 0; f < kFootCount; ++f) {
      farthest_m_ = std::max(farthest_m_, (world_p_foot_m[f] - planted_m_[f]).norm());
    }
    return seconds(row.stamp_ns - since_ns_) >= kPlanted_s ? farthest_m_ : -1.0;
  }

 private:
  bool stand_ = false;
  std::int64_t since_ns_ = 0;
  std::array<Vec3, kFootCount> planted_m_{Vec3::Zero(), Vec3::Zero()};
  double farthest_m_ = 0.0;
};

}  // namespace

Score score(const EstimateLog& log, const Replay& replay) {
  Score s;
  const auto rows = static_cast<double>(log.rows.size());
  Vec3 mark_m = log.rows.front().truth.true_T_base.p_m;
  PlantedFeet planted;
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    const LogTruth& truth = log.rows[i].truth;
    const ReplayTick& tick = replay.ticks[i];
    Eigen::Matrix<double, kNeesStates, 1> error;
    s.planted_foot_m = std::max(s.planted_foot_m, planted.moved_m(log.rows[i], tick.world_T_base));
    error << tick.world_T_base.p_m - truth.true_T_base.p_m, tick.world_v_base_mps - truth.true_v_base_mps;
    const Vec3 turn_rad = so3_log(tick.world_T_base.R * truth.true_T_base.R.transpose());  // world axes
    s.position_rmse_m += error.head<3>().squaredNorm() / rows;
    s.velocity_rmse_mps += error.tail<3>().squaredNorm() / rows;
    s.attitude_rmse_rad += turn_rad.squaredNorm() / rows;
    s.tilt_rmse_rad += turn_rad.head<2>().squaredNorm() / rows;
    s.yaw_rmse_rad += turn_rad.z() * turn_rad.z() / rows;
    s.odometry_rmse_m += (tick.odom_T_base.p_m - truth.true_T_base.p_m).squaredNorm() / rows;
    const Eigen::Matrix<double, kNeesStates, kNeesStates> P =
        tick.quality.covariance.topLeftCorner<kNeesStates, kNeesStates>();
    const double nees = error.dot(P.ldlt().solve(error));
    s.nees_mean += nees / rows;
    if (nees >= kNeesLow && nees <= kNeesHigh) s.nees_in_bounds += 1.0 / rows;
    const Vec3 gone_m = truth.true_T_base.p_m - mark_m;
    if (gone_m.norm() >= kStep_m || i + 1 == log.rows.size()) {
      s.distance_m += gone_m.norm();
      s.horizontal_distance_m += gone_m.head<2>().norm();
      mark_m = truth.true_T_base.p_m;
    }
    s.final_error_m = error.head<3>().norm();
    s.final_horizontal_error_m = error.head<2>().norm();
  }
  for (double* rmse : {&s.position_rmse_m, &s.velocity_rmse_mps, &s.attitude_rmse_rad, &s.tilt_rmse_rad,
                       &s.yaw_rmse_rad, &s.odometry_rmse_m}) {
    *rmse = std::sqrt(*rmse);
  }
  return s;
}

}  // namespace polygmap::sim
