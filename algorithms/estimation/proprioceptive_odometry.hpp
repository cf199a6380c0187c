// SPDX-License-Identifier: Apache-2.0
// From IMU, legs and contacts to a pose: the filters in their order. Whoever has measurements, the module from its
// joints or a replay from a log, runs this.
//
// Position and velocity are those of eqs (1)-(4) where soles are known: eight contact points, tread heights, legs that
// disagree. Where feet are points there is none of that, and after a start that is a guess it does not help: there the
// attitude filter's own are published. They gain from what tilt and biases turn out to have been, which filters that
// take the attitude as given cannot. On the walks of estimation_quality_test the attitude filter's velocity errs by 1.8
// to 2.0 mm/s (RMS) and that of eqs (1)-(4) by 2.9 to 3.3 mm/s, but under physics, where soles roll and land hard,
// balance on it strays three times as far from its plan
// (`polygmap climb --plant mujoco`, seeds 1, 7, 10: 33, 47, 35 mm instead of 10, 15, 9).
#pragma once

#include "algorithms/core/messages/state.hpp"
#include "algorithms/estimation/contact/foot_motion.hpp"
#include "algorithms/estimation/filters/base_filter.hpp"
#include "algorithms/estimation/filters/contact_inekf.hpp"
#include "algorithms/estimation/lidar/lio_fusion.hpp"
#include "algorithms/estimation/quality/estimate_quality.hpp"
#include "algorithms/estimation/state_history.hpp"

namespace polygmap {

class ProprioceptiveOdometry {
 public:
  struct Params {
    FootMotion::Params motion;
    ContactInEkf::Params attitude;
    BaseFilter::Params base;
    LioFusion::Params fusion;
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
      field("attitude", p.attitude);
      field("base", p.base);
      field("fusion", p.fusion);
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
    ImuNoiseDensity imu_noise;
  };
  using Legs = std::array<LegMeasurement, kFootCount>;
  using Contacts = std::array<FootContact, kFootCount>;
  struct Ground {
    std::array<TouchDown, kFootCount> touch_downs{};
    std::array<KnownHeight, kFootCount> heights{};
  };

  void reset(const Params& params, const RobotModel& robot) noexcept;
  // Finite and in range.
  [[nodiscard]] bool is_valid_imu(const Vec3& gyro_radps, const Vec3& accel_mps2) const noexcept;
  // guess: the start is one, of which the filters are to find out by how much it is off.
  void initialise(const ContactInEkf::Start& start, bool guess, const Legs& legs, double dt_s) noexcept;
  // A step longer than max_step_s is a gap: the base coasts through it, its sigmas grow, and the feet are new contacts.
  void step(const Step& step, const Legs& legs, const Contacts& contacts, const Ground& ground) noexcept;
  // Fills in pose, twist, sigmas and LIO's share, as of now_ns.
  void describe(std::int64_t now_ns, StateEstimate& state) const noexcept;
  void describe(std::int64_t now_ns, EstimateQuality& quality) const noexcept;

  [[nodiscard]] const ContactInEkf& attitude() const noexcept { return attitude_; }
  [[nodiscard]] const BaseFilter& base() const noexcept { return base_; }
  [[nodiscard]] const FootMotion& motion() const noexcept { return motion_; }
  [[nodiscard]] const LioFusion& fusion() const noexcept { return fusion_; }
  [[nodiscard]] LioFusion& fusion() noexcept { return fusion_; }

 private:
  [[nodiscard]] Vec3 odom_p_foot_m(const LegMeasurement& leg) const noexcept {
    return attitude_.odom_p_base_m() + attitude_.odom_R_base() * leg.base_T_sole.p_m;
  }

  void bridge(double gap_s) noexcept;
  void take_legs(const Legs& legs) noexcept;
  void count_innovations(const Step& step) noexcept;
  [[nodiscard]] Vec3 velocity_sigma_mps() const noexcept;
  [[nodiscard]] Vec3 odom_p_base_m() const noexcept {
    return base_filtered_ ? base_.odom_p_base_m() : attitude_.odom_p_base_m();
  }

  Params params_;
  ContactInEkf attitude_;
  BaseFilter base_;
  FootMotion motion_;
  LioFusion fusion_;
  Contacts contacts_{};
  std::array<Vec3, kFootCount> odom_p_foot_m_{Vec3::Zero(), Vec3::Zero()};  // as of the last corrected state
  double since_legs_s_ = 0.0;
  double unrested_s_ = 0.0;
  bool feet_lost_ = false;  // by a gap, until the next legs
  bool base_filtered_ = true;
  Vec3 base_w_base_radps_ = Vec3::Zero();
  Eigen::Matrix<double, 9, 9> covariance_ = Eigen::Matrix<double, 9, 9>::Zero();  // of the attitude filter
  std::array<InnovationStatistics, kMeasurementGroupCount> innovations_{};        // LIO's: the fusion has them
};

}  // namespace polygmap
