// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/proprioceptive_odometry.hpp"

#include <algorithm>
#include <utility>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {
namespace {

constexpr int kVelocity = 3, kYaw = 8;  // in the covariance

// Of x, y, z besides what the heading does, and of yaw.
LioUncertainty::Quantities fusion_variances(const Eigen::Matrix<double, 9, 9>& P) noexcept {
  LioUncertainty::Quantities v;
  v.head<3>() = P.diagonal().head<3>() - P.col(kYaw).head<3>().cwiseAbs2() / P(kYaw, kYaw);
  v[3] = P(kYaw, kYaw);
  return v;
}

}  // namespace

void ProprioceptiveOdometry::reset(const Params& params, const Transform& base_T_lidar) noexcept {
  params_ = params;
  filter_.reset(params.filter);
  motion_.reset(params.motion);
  fusion_.reset(params.fusion, base_T_lidar);
  scale_.reset(params.published);
  contacts_ = {};
  filter_T_foot_ = {};
  history_.clear();
  since_legs_s_ = unrested_s_ = 0.0;
  feet_lost_ = false;
  base_w_base_radps_.setZero();
  covariance_.setZero();
  published_.setZero();
  growth_ = {};
  innovations_ = {};
  tie_.reset(params_.lidar_tie);
}

void ProprioceptiveOdometry::initialise(const ContactInEkf::Start& start, const Legs& legs, const Vec3& gyro_radps,
                                        const Vec3& accel_mps2) noexcept {
  filter_.initialise(start, legs, gyro_radps, accel_mps2);
  tie_.reset(params_.lidar_tie);
  covariance_ = published_ = filter_.covariance();
  growth_.odom_m2 = growth_.filter_m2 = covariance_.diagonal().head<3>().maxCoeff();
  scale_.reset(params_.published);
  growth_.filter = growth_.fusion = fusion_variances(covariance_);
  fusion_.begin(growth_.fusion);
  history_.clear();
  for (std::size_t foot = 0; foot < kFootCount; ++foot) filter_T_foot_[foot] = filter_T_base() * legs[foot].base_T_sole;
  motion_.reset(params_.motion);
  since_legs_s_ = unrested_s_ = 0.0;
  feet_lost_ = false;
  innovations_ = {};
}

bool ProprioceptiveOdometry::is_valid_imu(const Vec3& gyro_radps, const Vec3& accel_mps2) const noexcept {
  return math::all_finite(gyro_radps) && math::all_finite(accel_mps2) &&
         gyro_radps.cwiseAbs().maxCoeff() <= params_.max_rate_radps &&
         accel_mps2.cwiseAbs().maxCoeff() <= params_.max_accel_mps2;
}

void ProprioceptiveOdometry::bridge(double gap_s) noexcept {
  constexpr int kParts = 4;  // enough for position to gain from velocity's growing variance
  const double part_s = gap_s / kParts;
  const double slowing_ps = (1.0 - math::exp(-part_s / params_.coast_s)) / part_s;
  for (int i = 0; i < kParts; ++i) {
    const Vec3 odom_a_mps2 = -slowing_ps * filter_.odom_v_base_mps();
    const Vec3 felt_mps2 = filter_.odom_R_base().transpose() * (odom_a_mps2 + Vec3{0, 0, filter_.gravity_mps2()});
    filter_.predict(filter_.gyro_bias_radps(), filter_.accel_bias_mps2() + felt_mps2, part_s,
                    ContactInEkf::Motion::kUnfelt);
  }
  feet_lost_ = true;
}

void ProprioceptiveOdometry::step(const Step& whole, const Legs& legs, const Contacts& contacts,
                                  const Heights& heights) noexcept {
  const Vec3 before_m = odom_T_base().p_m;
  Step step = whole;
  if (whole.dt_s > params_.max_step_s) {  // the last of it is felt
    step.dt_s = params_.gap_end_s;
    bridge(std::min(whole.dt_s, params_.max_gap_s) - step.dt_s);
  }
  const Vec3 gyro_radps = step.felt ? step.gyro_radps : filter_.gyro_bias_radps();
  // A silent IMU: as if it felt no acceleration.
  const Vec3 rest_mps2 =
      filter_.accel_bias_mps2() + filter_.odom_R_base().transpose() * Vec3{0, 0, filter_.gravity_mps2()};
  const Vec3 accel_mps2 = step.felt ? step.accel_mps2 : rest_mps2;
  const auto motion = !step.felt                     ? ContactInEkf::Motion::kUnfelt
                      : unrested_s_ > params_.lost_s ? ContactInEkf::Motion::kVelocityLost
                                                     : ContactInEkf::Motion::kFelt;
  filter_.predict(gyro_radps, accel_mps2, step.dt_s, motion);
  since_legs_s_ += step.dt_s;
  contacts_ = contacts;
  if (step.new_legs) take_legs(step.stamp_ns, legs, heights);
  base_w_base_radps_ = gyro_radps - filter_.gyro_bias_radps();
  count_innovations(step);
  covariance_ = filter_.covariance();
  scale_.update(step.new_legs ? filter_.mean_innovation_ratio() : -1.0, filter_.accel_step_mps2(), step.dt_s);
  published_ = scale_.published(covariance_);
  const double filter_m2 = covariance_.diagonal().head<3>().maxCoeff();
  growth_.odom_m2 = std::max(growth_.odom_m2 + scale_.growth_share() * (filter_m2 - growth_.filter_m2), 0.0);
  growth_.filter_m2 = filter_m2;
  const LioUncertainty::Quantities variance = fusion_variances(covariance_);
  LioUncertainty::Quantities growth = variance - growth_.filter;
  growth.head<3>() *= scale_.growth_share();
  growth_.filter = variance;
  growth_.fusion = (growth_.fusion + growth).cwiseMax(0.0);
  fusion_.follow(growth_.fusion);
  const Transform now = odom_T_base();
  fusion_.tick(now, now.p_m - before_m, whole.dt_s);
}

void ProprioceptiveOdometry::take_legs(std::int64_t stamp_ns, const Legs& legs, const Heights& heights) noexcept {
  const bool feet_lost = std::exchange(feet_lost_, false);
  if (feet_lost) history_.clear();
  history_.push(stamp_ns, legs);
  const double delay_s = math::clamp(filter_.imu_delay_s(), 0.0, LegHistory::kMost_s);
  const LegHistory::Moment then = history_.before(delay_s);
  std::array<FootMotion::Step, kFootCount> steps;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    FootContact& contact = contacts_[foot];
    contact.landed = contact.landed || (feet_lost && contact.stands);
    const Transform now = filter_T_base() * then.legs[foot].base_T_sole;
    const Transform& before = filter_T_foot_[foot];
    steps[foot] = {contact.stands && !contact.landed, then.legs[foot].sole_known, now.p_m - before.p_m,
                   so3_log(now.R * before.R.transpose()), now.p_m - filter_.odom_p_base_m()};
  }
  motion_.update(steps, since_legs_s_);
  bool stands = false, rests = false;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    FootContact& contact = contacts_[foot];
    const double doubt = std::max(params_.sure_contact / std::max(contact.probability, 0.01) - 1.0, 0.0);
    contact.walk_m2ps = motion_.walk_m2ps(foot) + params_.doubtful_walk_m2ps * doubt;
    stands = stands || contact.stands;
    rests = rests || (contact.stands && motion_.walk_m2ps(foot) <= 0.0);
  }
  unrested_s_ = stands && !rests ? unrested_s_ + since_legs_s_ : 0.0;
  filter_.correct_by_feet(then, delay_s, contacts_, since_legs_s_);
  Heights for_filter = heights;
  for (KnownHeight& height : for_filter) height.odom_z_m += tie_.filter_T_odom().p_m.z();
  filter_.correct_by_heights(for_filter, contacts_, since_legs_s_);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    filter_T_foot_[foot] = filter_T_base() * then.legs[foot].base_T_sole;
  }
  since_legs_s_ = 0.0;
}

LioVerdict ProprioceptiveOdometry::add_lio(const LioSample& sample, const Transform& odom_T_base,
                                           std::int64_t now_ns) noexcept {
  const LioVerdict verdict = fusion_.fuse(sample, odom_T_base);
  if (!params_.lidar_tie.as_rows) return verdict;
  if (verdict == LioVerdict::kRealigned) tie_.untie();
  if (verdict == LioVerdict::kAccepted || verdict == LioVerdict::kRealigned)
    correct_by_lio(sample, odom_T_base, now_ns);
  return verdict;
}

void ProprioceptiveOdometry::correct_by_lio(const LioSample& sample, const Transform& odom_T_base,
                                            std::int64_t now_ns) noexcept {
  const Transform lidar_T_base = base_from_lidar(sample.lio_T_lidar, fusion_.base_T_lidar());
  const LioFusion::LioSigmas sigmas = fusion_.sigmas_of(sample);
  Transform moved;
  if (!tie_.try_correct(odom_T_base, lidar_T_base, sample.stamp_ns, seconds(now_ns - sample.stamp_ns),
                        sigmas.position_m, sigmas.rotation_rad, filter_, moved)) {
    return;
  }
  // What a pose makes surer is not taken from what the odometry has drifted.
  const Eigen::Matrix<double, 9, 9> after = filter_.covariance();
  growth_.filter_m2 = after.diagonal().head<3>().maxCoeff();
  growth_.filter = fusion_variances(after);
  for (Transform& foot : filter_T_foot_) foot = moved * foot;
}

void ProprioceptiveOdometry::count_innovations(const Step& step) noexcept {
  if (!step.new_legs) return;
  const auto take = [&](MeasurementGroup group, const NormalisedRows& rows) {
    innovations_[static_cast<std::size_t>(group)].take(rows, step.stamp_ns);
  };
  take(MeasurementGroup::kFootPosition, filter_.position_rows());
  take(MeasurementGroup::kSoleAttitude, filter_.sole_rows());
  take(MeasurementGroup::kTreadHeight, filter_.height_rows());
}

void ProprioceptiveOdometry::describe(std::int64_t now_ns, StateEstimate& state) const noexcept {
  state.odom_T_base = odom_T_base();
  state.odom_v_base_mps = tie_.filter_T_odom().R.transpose() * filter_v_base_now_mps();
  state.base_w_base_radps = base_w_base_radps_;
  state.world_T_odom = fusion_.world_T_odom();
  state.position_sigma_m = fusion_.position_sigma_m();
  state.odom_sigma_m = math::sqrt(growth_.odom_m2);
  state.velocity_sigma_mps = published_.diagonal().segment<3>(kVelocity).cwiseSqrt();
  state.yaw_sigma_rad = fusion_.yaw_sigma_rad();
  state.tilt_sigma_rad = filter_.tilt_sigma_rad();
  state.lio_age_ns = fusion_.last_accepted_ns() < 0 ? -1 : now_ns - fusion_.last_accepted_ns();
  for (std::size_t foot = 0; foot < kFootCount; ++foot) state.contact_probability[foot] = contacts_[foot].probability;
}

// Where the offset is the fusion's, so are the sigmas of what it corrects.
void ProprioceptiveOdometry::describe(std::int64_t now_ns, EstimateQuality& quality) const noexcept {
  quality.stamp_ns = now_ns;
  Eigen::Matrix<double, 9, 1> scale = Eigen::Matrix<double, 9, 1>::Ones();
  const Vec3& position_sigma_m = fusion_.position_sigma_m();
  for (int i = 0; i < 3; ++i) scale[i] = position_sigma_m[i] / math::sqrt(published_(i, i));
  scale[kYaw] = fusion_.yaw_sigma_rad() / math::sqrt(published_(kYaw, kYaw));
  for (int j = 0; j < 9; ++j) {
    for (int i = 0; i < 9; ++i) quality.covariance(i, j) = scale[i] * scale[j] * published_(i, j);
  }
  quality.innovations = innovations_;
  quality.innovations[static_cast<std::size_t>(MeasurementGroup::kLioPosition)] = fusion_.innovations().position;
  quality.innovations[static_cast<std::size_t>(MeasurementGroup::kLioYaw)] = fusion_.innovations().yaw;
  quality.outliers = filter_.outliers();
}

}  // namespace polygmap
