// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/lidar/lio_fusion.hpp"

#include <algorithm>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {
namespace {

// A pose beyond these is none: it is rejected as input.
constexpr double kMaxCoordinate_m = 1e5;
constexpr double kOrthonormalTolerance = 1e-3;

bool plausible_sigma(const Vec3& sigma, double max) noexcept {
  return math::all_finite(sigma) && sigma.minCoeff() >= 0.0 && sigma.maxCoeff() <= max;
}
double stated_or(double stated, double otherwise) noexcept { return stated > 0.0 ? stated : otherwise; }

// Gravity tells the odometry its tilt, for good, better than a pose of LIO can: of its rotation yaw alone is news.
Transform turned_by_yaw(const Transform& predicted, const Transform& measured) noexcept {
  const double yaw_rad = so3_log(measured.R * predicted.R.transpose()).z();
  return {rotation_z(yaw_rad) * predicted.R, measured.p_m};
}

double share_within(double length, double limit) noexcept { return length > limit ? limit / length : 1.0; }

}  // namespace

Transform tied_level(const Transform& world_T_body, const Transform& lio_T_body) noexcept {
  const Mat3 R = rotation_z(so3_log(world_T_body.R * lio_T_body.R.transpose()).z());
  return {R, world_T_body.p_m - R * lio_T_body.p_m};
}

Transform base_from_lidar(const Transform& lio_T_lidar, const Transform& base_T_lidar) noexcept {
  return lio_T_lidar * base_T_lidar.inverse();
}

double complementary_gain(double dt_s, double tau_s) noexcept { return dt_s / (tau_s + dt_s); }

Transform fuse_pose(const Transform& world_T_base, const Transform& lio_world_T_base, double gain) noexcept {
  const Vec3 turn_rad = so3_log(world_T_base.R.transpose() * lio_world_T_base.R);  // eq. (7)
  return {world_T_base.R * so3_exp(gain * turn_rad),                               // eq. (8)
          (1.0 - gain) * world_T_base.p_m + gain * lio_world_T_base.p_m};          // eq. (6)
}

void LioFusion::reset(const Params& params, const Transform& base_T_lidar) noexcept {
  *this = LioFusion{};
  params_ = params;
  base_T_lidar_ = base_T_lidar;
  mount_.reset(params.mount);
  uncertainty_.reset(params.uncertainty);
  untied_.reset(params.uncertainty);
  noise_.position_m.reset(params.unstated_position_m);
  noise_.rotation_rad.reset(params.unstated_rotation_rad);
  sigmas_.position_m = uncertainty_.position_sigma_m(Vec3::Zero());
  sigmas_.yaw_rad = uncertainty_.yaw_sigma_rad();
}

LioVerdict LioFusion::check(const LioSample& sample, std::int64_t now_ns) const noexcept {
  if (!math::all_finite(sample.lio_T_lidar.R) || !math::all_finite(sample.lio_T_lidar.p_m)) {
    return LioVerdict::kNonFinite;
  }
  if (sample.lio_T_lidar.p_m.cwiseAbs().maxCoeff() > kMaxCoordinate_m) return LioVerdict::kOutOfRange;
  if (!is_rotation(sample.lio_T_lidar.R, kOrthonormalTolerance)) return LioVerdict::kNotRotation;
  if (!plausible_sigma(sample.position_sigma_m, params_.max_position_sigma_m) ||
      !plausible_sigma(sample.rotation_sigma_rad, params_.max_rotation_sigma_rad)) {
    return LioVerdict::kCovariance;
  }
  if (sample.stamp_ns > now_ns) return LioVerdict::kFuture;
  if (seconds(now_ns - sample.stamp_ns) > params_.max_age_s) return LioVerdict::kTooOld;
  if (sample.stamp_ns <= last_stamp_ns_) return LioVerdict::kOrder;
  return LioVerdict::kAccepted;
}

LioVerdict LioFusion::fuse(const LioSample& sample, const Transform& odom_T_base) noexcept {
  last_stamp_ns_ = sample.stamp_ns;
  const Transform lidar{so3_renormalised(sample.lio_T_lidar.R), sample.lio_T_lidar.p_m};
  const Transform lio_T_base = base_from_lidar(lidar, base_T_lidar_);
  const LioSigmas sigmas = sigmas_of(sample);
  if (count_ == 0) {
    if (is_tilted(odom_T_base, lio_T_base)) return LioVerdict::kJump;
    world_T_lio_ = tied_level(odom_T_base, lio_T_base);
    count_ = 1;
    last_accepted_ns_ = last_used_ns_ = sample.stamp_ns;
    last_lio_T_odom_ = world_T_lio_.inverse();
    tie(by_lidar(odom_T_base), sigmas, count_);
    offset_.odom_p_first_m = odom_T_base.p_m;
    return LioVerdict::kAccepted;
  }

  const double silence_s = seconds(sample.stamp_ns - last_used_ns_);
  const Transform predicted = fused_world_T_odom_ * odom_T_base;
  const Transform measured = world_T_lio_ * lio_T_base;
  if (is_jump(predicted, measured, silence_s)) {
    if (!try_realign(lio_T_base, odom_T_base, sigmas)) return LioVerdict::kJump;
    last_used_ns_ = sample.stamp_ns;
    last_lio_T_odom_ = lio_T_base * odom_T_base.inverse();
    return LioVerdict::kRealigned;
  }
  jumped_.count = 0;
  last_accepted_ns_ = last_used_ns_ = sample.stamp_ns;
  const bool stated = sample.position_sigma_m.maxCoeff() > 0.0 && sample.rotation_sigma_rad.maxCoeff() > 0.0;
  if (!stated) measure_noise(lio_T_base, odom_T_base, silence_s);

  const double gain = complementary_gain(std::min(silence_s, params_.max_gap_s),
                                         std::max(params_.tau_s, params_.tau_spm * sigmas.position_m));
  if (aligned_) {
    observe(predicted, measured, sigmas, sample.stamp_ns);
    const Transform fused = fuse_pose(predicted, turned_by_yaw(predicted, measured), gain);
    fused_world_T_odom_ = fused * odom_T_base.inverse();
    fused_world_T_odom_.R = so3_renormalised(fused_world_T_odom_.R);
    uncertainty_.blend(gain, sigmas.position_m, sigmas.rotation_rad);
    mount_.see({fused.p_m, so3_log(fused.R * predicted.R.transpose()).z(), gain,
                (uncertainty_.offset_variance() + uncertainty_.tie_variance()).head<2>().mean()});
  } else {
    align(predicted, lio_T_base, sigmas, gain);
  }
  return LioVerdict::kAccepted;
}

void LioFusion::rebase(const Transform& new_T_old) noexcept {
  world_T_lio_ = new_T_old * fused_world_T_odom_.inverse() * world_T_lio_;
  mount_.tie();
  fused_world_T_odom_ = {};
  last_lio_T_odom_ = last_lio_T_odom_ * new_T_old.inverse();
  uncertainty_.rebase(new_T_old);
  untied_.rebase(new_T_old);
  offset_.odom_p_first_m = new_T_old * offset_.odom_p_first_m;
  jumped_.count = 0;
}

void LioFusion::tick(const Transform& odom_T_base, const Vec3& odom_step_m, double dt_s) noexcept {
  uncertainty_.move(world_T_odom_.R * odom_step_m);
  untied_.move(odom_step_m);
  mount_.move(fused_world_T_odom_ * odom_T_base.p_m, fused_world_T_odom_.R * odom_step_m);
  const PoseBelief best = believed(odom_T_base);
  const Transform& wanted = best.world_T_base;
  const Transform now = world_T_odom_ * odom_T_base;
  const Vec3 move_m = wanted.p_m - now.p_m;
  const Vec3 turn_rad = so3_log(wanted.R * now.R.transpose());
  const double slew_s = std::min(dt_s, params_.slew.most_s);
  const double move_share = share_within(move_m.norm(), params_.slew.speed_mps * slew_s);
  const double turn_share = share_within(turn_rad.norm(), params_.slew.turn_radps * slew_s);
  if (move_share >= 1.0 && turn_share >= 1.0) {
    world_T_odom_ = best.world_T_odom;
  } else {
    const Transform next{so3_renormalised(so3_exp(turn_share * turn_rad) * now.R), now.p_m + move_share * move_m};
    world_T_odom_ = next * odom_T_base.inverse();
  }
  const Vec3 held_back_m = (1.0 - move_share) * move_m;
  sigmas_.position_m = (best.variance.head<3>() + held_back_m.cwiseAbs2()).cwiseSqrt();
  sigmas_.yaw_rad = math::sqrt(best.variance[3]);
}

LioFusion::PoseBelief LioFusion::by_legs(const Transform& odom_T_base) const noexcept {
  const Vec3 way_m = odom_T_base.p_m - offset_.odom_p_first_m;
  PoseBelief legs{{}, odom_T_base, {}};
  legs.variance.head<3>() =
      untied_.position_sigma_m(odom_T_base.p_m).cwiseAbs2() + math::square(params_.drift.way_share) * way_m.cwiseAbs2();
  legs.variance[3] = math::square(untied_.yaw_sigma_rad());
  return legs;
}

LioFusion::PoseBelief LioFusion::by_lidar(const Transform& odom_T_base) const noexcept {
  const Vec3 p_m = fused_world_T_odom_ * odom_T_base.p_m;
  const MountHeading::Bend& bend = mount_.bend();
  PoseBelief lidar{fused_world_T_odom_, {}, {}};
  lidar.world_T_odom.p_m -= bend.way_m;
  lidar.world_T_base = lidar.world_T_odom * odom_T_base;
  lidar.variance.head<3>() = known().position_sigma_m(p_m).cwiseAbs2() + bend.variance_m2;
  lidar.variance[3] = math::square(known().yaw_sigma_rad());
  return lidar;
}

// The squared offset over its variance, four rows of it: 4 in the mean where sigmas are honest
// and LIO does not drift, and less, since both have part of the error.
LioFusion::PoseBelief LioFusion::believed(const Transform& odom_T_base) noexcept {
  const PoseBelief lidar = by_lidar(odom_T_base), legs = by_legs(odom_T_base);
  LioUncertainty::Quantities offset;
  offset.head<3>() = lidar.world_T_base.p_m - odom_T_base.p_m;
  offset[3] = so3_log(lidar.world_T_odom.R).z();
  const double ratio = offset.cwiseAbs2().cwiseQuotient(lidar.variance + legs.variance).sum();
  offset_.lio_drifts = ratio > (offset_.lio_drifts ? params_.drift.trusted_ratio : params_.drift.most_ratio);
  if (!offset_.lio_drifts) return lidar;
  const double share = params_.drift.trusted_ratio / ratio;
  const Transform shared = fuse_pose(odom_T_base, lidar.world_T_base, share);
  return {shared * odom_T_base.inverse(), shared, share * lidar.variance + (1.0 - share) * legs.variance};
}

bool LioFusion::is_jump(const Transform& predicted, const Transform& measured, double silence_s) const noexcept {
  const double bound_m = std::min(params_.jump_m + params_.jump_growth_mps * silence_s, params_.max_jump_m);
  const double bound_rad = std::min(params_.jump_rad + params_.jump_growth_radps * silence_s, params_.max_jump_rad);
  return (measured.p_m - predicted.p_m).norm() > bound_m ||
         so3_log(predicted.R.transpose() * measured.R).norm() > bound_rad;
}

bool LioFusion::try_realign(const Transform& lio_T_base, const Transform& odom_T_base,
                            const LioSigmas& sigmas) noexcept {
  const bool agrees = jumped_.count > 0 && !is_jump(jumped_.lio_T_odom * odom_T_base, lio_T_base, 0.0);
  jumped_.count = agrees ? jumped_.count + 1 : 1;
  const Transform before = agrees ? jumped_.lio_T_odom * odom_T_base : lio_T_base;
  jumped_.lio_T_odom = fuse_pose(before, lio_T_base, 1.0 / static_cast<double>(jumped_.count)) * odom_T_base.inverse();
  jumped_.lio_T_odom.R = so3_renormalised(jumped_.lio_T_odom.R);
  // Which of the first two poses is wrong nobody knows: the later one is tried, once. If a third contradicts it, too,
  // it takes as many poses that agree as after any other jump.
  const bool first_pose_contradicted = !aligned_ && count_ == 1 && !first_contradicted_;
  first_contradicted_ = first_contradicted_ || first_pose_contradicted;
  if (jumped_.count < params_.realign_count && !first_pose_contradicted) return false;
  // Our world stays where it is by LIO. Where LIO was found to drift that is not what is published: it has to come
  // back.
  const PoseBelief before_jump = by_lidar(odom_T_base);
  const Transform mean_T_base = jumped_.lio_T_odom * odom_T_base;
  if (is_tilted(before_jump.world_T_base, mean_T_base)) return false;
  if (!aligned_) uncertainty_ = untied_;  // the former tie was none
  fused_world_T_odom_ = before_jump.world_T_odom;
  world_T_lio_ = tied_level(before_jump.world_T_base, mean_T_base);
  tie(before_jump, sigmas, jumped_.count);
  count_ = jumped_.count;
  jumped_.count = 0;
  return true;
}

bool LioFusion::is_tilted(const Transform& world_T_base, const Transform& lio_T_base) const noexcept {
  return is_jump(world_T_base, tied_level(world_T_base, lio_T_base) * lio_T_base, 0.0);
}

LioFusion::LioSigmas LioFusion::sigmas_of(const LioSample& sample) const noexcept {
  const double rotation_rad = stated_or(sample.rotation_sigma_rad.maxCoeff(), noise_.rotation_rad.sigma());
  const bool stated = sample.position_sigma_m.maxCoeff() > 0.0;  // of the lidar; what is measured is the base's
  const double lidar_m = stated_or(sample.position_sigma_m.maxCoeff(), noise_.position_m.sigma());
  const double lever_m = stated ? base_T_lidar_.p_m.norm() * rotation_rad : 0.0;
  return {math::sqrt(math::square(lidar_m) + math::square(lever_m)), rotation_rad};
}

void LioFusion::measure_noise(const Transform& lio_T_base, const Transform& odom_T_base, double silence_s) noexcept {
  const Transform expected = last_lio_T_odom_ * odom_T_base;
  last_lio_T_odom_ = lio_T_base * odom_T_base.inverse();
  if (silence_s > params_.max_gap_s) return;
  constexpr double kRows = 2.0 * 3.0;
  noise_.position_m.take((lio_T_base.p_m - expected.p_m).squaredNorm() / kRows, silence_s);
  noise_.rotation_rad.take(so3_log(lio_T_base.R * expected.R.transpose()).squaredNorm() / kRows, silence_s);
}

void LioFusion::observe(const Transform& predicted, const Transform& measured, const LioSigmas& sigmas,
                        std::int64_t stamp_ns) noexcept {
  LioInnovations& i = innovations_;
  i.last.head<3>() = measured.p_m - predicted.p_m;
  i.last[3] = so3_log(measured.R * predicted.R.transpose()).z();
  LioUncertainty::Quantities variance = uncertainty_.offset_variance();
  variance.head<3>().array() += math::square(sigmas.position_m);
  variance[3] += math::square(sigmas.rotation_rad);
  const LioUncertainty::Quantities normalised = i.last.cwiseAbs2().cwiseQuotient(variance);
  i.position.take({normalised.head<3>().sum(), 3}, stamp_ns);
  i.yaw.take({normalised[3], 1}, stamp_ns);
}

// Moves LIO's world against ours, so that its pose comes nearer to the odometry's by the tie's share of the innovation.
void LioFusion::align(const Transform& predicted, const Transform& lio_T_base, const LioSigmas& sigmas,
                      double gain) noexcept {
  const LioUncertainty::TieGains gains = uncertainty_.tie_gains(sigmas.position_m, sigmas.rotation_rad);
  const Transform measured = world_T_lio_ * lio_T_base;
  const Transform nearer{fuse_pose(measured, predicted, gains.rotation).R,
                         fuse_pose(measured, predicted, gains.position).p_m};
  world_T_lio_ = tied_level(nearer, lio_T_base);
  uncertainty_.average(gains, sigmas.position_m, sigmas.rotation_rad);
  ++count_;
  aligned_ = gains.position <= gain * (1.0 + 1e-9);
  mount_.tie();
}

// LIO's world, as the mean of so many poses has it, is where ours is now.
void LioFusion::tie(const PoseBelief& now, const LioSigmas& sigmas, std::uint32_t poses) noexcept {
  const double share = 1.0 / math::sqrt(static_cast<double>(poses));
  uncertainty_.tie(now.world_T_base.p_m, share * sigmas.position_m, share * sigmas.rotation_rad, now.variance);
  mount_.tie();
}

}  // namespace polygmap
