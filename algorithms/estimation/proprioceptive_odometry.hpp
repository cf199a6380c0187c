// SPDX-License-Identifier: Apache-2.0
// From IMU, legs and contacts to a pose: the filter and the fusion with lidar odometry, in their order. Whoever has
// measurements, the module from its joints or a replay from a log, runs this.
#pragma once

#include "algorithms/core/messages/state.hpp"
#include "algorithms/estimation/contact/foot_motion.hpp"
#include "algorithms/estimation/filters/contact_inekf.hpp"
#include "algorithms/estimation/lidar/lidar_tie.hpp"
#include "algorithms/estimation/lidar/lio_fusion.hpp"
#include "algorithms/estimation/quality/covariance_scale.hpp"
#include "algorithms/estimation/quality/estimate_quality.hpp"
#include "algorithms/estimation/state_history.hpp"
#include "algorithms/geometry/so3.hpp"

namespace polygmap {

class ProprioceptiveOdometry {
 public:
  struct Params {
    FootMotion::Params motion;
    ContactInEkf::Params filter;
    LioFusion::Params fusion;
    LidarTie::Params lidar_tie;
    CovarianceScale::Params published;
    double max_rate_radps = 20.0;
    double max_accel_mps2 = 100.0;
    double max_step_s = 0.05;
    double max_gap_s = 5.0;
    double coast_s = 1.0;
    double lost_s = 0.25;
    double sure_contact = 0.8;
    double doubtful_walk_m2ps = 1e-3;
    double gap_end_s = 0.002;

    static void visit(auto& p, auto& field) {
      field("motion", p.motion);
      field("filter", p.filter);
      field("fusion", p.fusion);
      field("lidar_tie", p.lidar_tie);
      field("published", p.published);
      field("max_rate_radps", p.max_rate_radps, 0.1, 1000.0, "An IMU sample that turns faster is invalid.");
      field("max_accel_mps2", p.max_accel_mps2, 15.0, 10000.0, "An IMU sample that accelerates harder is invalid.");
      field("max_step_s", p.max_step_s, 0.004, 0.5,
            "A longer gap is bridged without feeling, and older rates are not believed.");
      field("max_gap_s", p.max_gap_s, 0.05, 60.0, "A gap is bridged by no more than this.");
      field("coast_s", p.coast_s, 0.01, 10.0,
            "The base is thought to stop within about this time when nothing is felt for long.");
      field("lost_s", p.lost_s, 0.01, 10.0,
            "A standing robot none of whose feet rest for so long has lost its velocity.");
      field("sure_contact", p.sure_contact, 0.01, 1.0, "A contact as probable is as good as certain.");
      field("doubtful_walk_m2ps", p.doubtful_walk_m2ps, 0.0, 1.0,
            "Random walk of a contact half as likely: 1 mm in 1 ms.");
      field("gap_end_s", p.gap_end_s, 0.0001, 0.004, "The rates of the sample that ends a gap hold for so long.");
    }
  };
  // What is new since the last step. Rates hold over dt.
  struct Step {
    std::int64_t stamp_ns = 0;
    double dt_s = 0.0;
    Vec3 gyro_radps = Vec3::Zero();
    Vec3 accel_mps2 = Vec3::Zero();
    bool felt = true;      // false: the IMU is silent, and the feet alone say how the base moves
    bool new_legs = true;  // false: the legs are silent
  };
  using Legs = std::array<LegMeasurement, kFootCount>;
  using Contacts = std::array<FootContact, kFootCount>;
  using Heights = std::array<KnownHeight, kFootCount>;  // of the ground under the feet

  void reset(const Params& params, const Transform& base_T_lidar) noexcept;
  // Finite and in range.
  [[nodiscard]] bool is_valid_imu(const Vec3& gyro_radps, const Vec3& accel_mps2) const noexcept;
  // gyro_radps, accel_mps2: of the IMU then.
  void initialise(const ContactInEkf::Start& start, const Legs& legs, const Vec3& gyro_radps,
                  const Vec3& accel_mps2) noexcept;
  // A step longer than max_step_s is a gap: the base coasts through it, its sigmas grow, and the feet are new contacts.
  void step(const Step& step, const Legs& legs, const Contacts& contacts, const Heights& heights) noexcept;
  // Fills in pose, twist, sigmas and LIO's share, as of now_ns.
  void describe(std::int64_t now_ns, StateEstimate& state) const noexcept;
  void describe(std::int64_t now_ns, EstimateQuality& quality) const noexcept;

  [[nodiscard]] const ContactInEkf& filter() const noexcept { return filter_; }
  [[nodiscard]] const FootMotion& motion() const noexcept { return motion_; }
  // A pose that has passed the fusion's check; the base was at odom_T_base at its stamp.
  [[nodiscard]] LioVerdict add_lio(const LioSample& sample, const Transform& odom_T_base, std::int64_t now_ns) noexcept;
  [[nodiscard]] const LioFusion& fusion() const noexcept { return fusion_; }
  [[nodiscard]] LioFusion& fusion() noexcept { return fusion_; }

 private:
  void bridge(double gap_s) noexcept;
  void correct_by_lio(const LioSample& sample, const Transform& odom_T_base, std::int64_t now_ns) noexcept;
  [[nodiscard]] Transform filter_T_base() const noexcept { return {filter_.odom_R_base(), filter_.odom_p_base_m()}; }
  [[nodiscard]] Transform odom_T_base() const noexcept { return tie_.filter_T_odom().inverse() * filter_T_base_now(); }
  // The filter's state is as old as the IMU is late.
  [[nodiscard]] Transform filter_T_base_now() const noexcept {
    return {filter_.odom_R_base() * so3_exp(filter_.imu_delay_s() * base_w_base_radps_),
            filter_.odom_p_base_m() + filter_.imu_delay_s() * filter_.odom_v_base_mps()};
  }
  [[nodiscard]] Vec3 filter_v_base_now_mps() const noexcept {
    return filter_.odom_v_base_mps() + filter_.imu_delay_s() * filter_.odom_a_base_mps2();
  }
  void take_legs(std::int64_t stamp_ns, const Legs& legs, const Heights& heights) noexcept;
  void count_innovations(const Step& step) noexcept;

  Params params_;
  ContactInEkf filter_;
  FootMotion motion_;
  LioFusion fusion_;
  LidarTie tie_;
  Contacts contacts_{};
  LegHistory history_;
  std::array<Transform, kFootCount> filter_T_foot_;  // as of the last corrected state
  double since_legs_s_ = 0.0;
  double unrested_s_ = 0.0;
  bool feet_lost_ = false;  // by a gap, until the next legs
  Vec3 base_w_base_radps_ = Vec3::Zero();
  CovarianceScale scale_;
  Eigen::Matrix<double, 9, 9> published_ = Eigen::Matrix<double, 9, 9>::Zero();
  // Variances of the odometry, which grow as the filter's do, by the share of the published covariance.
  struct Growth {
    double odom_m2 = 0.0;    // of its place along its worst axis: lidar odometry does not shrink it
    double filter_m2 = 0.0;  // the filter's own, of the last step
    LioUncertainty::Quantities fusion = LioUncertainty::Quantities::Zero();  // as the fusion counts
    LioUncertainty::Quantities filter = LioUncertainty::Quantities::Zero();  // the filter's own, of the last step
  };
  Growth growth_;
  Eigen::Matrix<double, 9, 9> covariance_ = Eigen::Matrix<double, 9, 9>::Zero();  // the filter's
  std::array<InnovationStatistics, kMeasurementGroupCount> innovations_{};        // LIO's: the fusion has them
};

}  // namespace polygmap
