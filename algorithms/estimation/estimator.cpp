// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/estimator.hpp"

#include <utility>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {

void Estimator::reset(const Params& params, const RobotModel& robot) noexcept {
  params_ = params;
  robot_ = &robot;
  counters_ = {};
  standstill_.reset(params.standstill);
  contacts_.reset(params.contacts);
  leg_sensing_.reset(params.legs, robot);
  odometry_.reset(params, robot.mounts.base_T_lidar);
  ring_.clear();
  state_ = {};
  quality_ = {};
  imu_ = {};
  imu_.resting.reset(params.rest_ns);
  imu_.mount.reset(params.imu_mount);
  imu_.base_R_imu = robot.mounts.base_R_imu;
  legs_ = {};
  known_ = {};
  heights_ = {};
  stood_ = {};
  was_measured_ = {true, true};
  alone_ = false;
  stood_ns_ = 0;
  origin_ = {};
}

void Estimator::tick(const std::array<bool, kFootCount>& planned_stance) noexcept {
  ++counters_.ticks;
  state_.odom_turned_rad.setZero();
  const bool new_imu = std::exchange(imu_.new_count, 0U) > 0;
  const bool new_legs = std::exchange(legs_.fresh, false);
  if (!state_.initialised && (!imu_.any || !legs_.any)) return;
  const std::int64_t now_ns = newest_input_ns();
  if (known_.ticked && now_ns <= state_.stamp_ns) return;
  known_.ticked = true;

  if (new_legs) take_legs(planned_stance);
  const bool begun = !state_.initialised && new_imu && new_legs && try_begin();
  if (begun || !(state_.initialised || known_.runs)) {
    publish(now_ns);
    return;
  }

  const double dt_s = seconds(now_ns - state_.stamp_ns);
  if (dt_s > params_.max_step_s) ++counters_.gaps;
  // The last rates bridge a short silence of the IMU; beyond it the feet alone say how the base moves.
  const bool felt = imu_.any && seconds(now_ns - imu_.newest.stamp_ns) <= params_.max_step_s;
  const std::array<FootContact, kFootCount> contacts = measured_contacts(now_ns, new_legs);
  odometry_.step({now_ns, dt_s, imu_.mean.gyro_radps, imu_.mean.accel_mps2, felt, new_legs}, legs_.sample.legs,
                 contacts, heights_);
  publish(now_ns);
  const bool fresh = seconds(now_ns - state_.oldest_input_ns) <= params_.max_step_s;
  if (state_.initialised && fresh) ring_.push(state_);
}

void Estimator::add_lio(const LioSample& sample, std::int64_t now_ns) noexcept {
  LioVerdict verdict = odometry_.fusion().check(sample, now_ns);
  if (verdict == LioVerdict::kAccepted) {
    // Until initialised the base has swayed by millimetres only; where it stood in odom is known from then on (rebase).
    StateEstimate then;
    bool known = standstill_.collecting() && sample.stamp_ns >= standstill_.start_ns();
    if (state_.initialised) {
      if (known && sample.stamp_ns < origin_.initialised_ns) {
        then.odom_T_base = origin_.odom_T_base;
      } else {
        known = ring_.try_at(sample.stamp_ns, then);
      }
    }
    if (!known) {
      verdict = LioVerdict::kNoOdometry;
    } else if (state_.initialised) {
      verdict = odometry_.add_lio(sample, then.odom_T_base, newest_input_ns());
    } else {  // the filter that balances until then does not stand in odom yet
      verdict = odometry_.fusion().fuse(sample, then.odom_T_base);
    }
  }
  ++counters_.lio[static_cast<std::size_t>(verdict)];
}

void Estimator::set_tread_height(Foot foot, double odom_z_m, double sigma_m) noexcept {
  KnownHeight& height = heights_[index_of(foot)];
  height = {};
  if (!state_.initialised || !std::isfinite(odom_z_m) || !(sigma_m > 0.0 && sigma_m < 1.0)) {
    ++counters_.height_invalid;
  } else if (std::abs(odom_z_m - state_.odom_T_sole[index_of(foot)].p_m.z()) > params_.max_height_error_m) {
    ++counters_.height_rejected;
  } else {
    ++counters_.height_taken;
    height = {odom_z_m, sigma_m};
  }
}

void Estimator::add_imu(const ImuSample& imu, std::int64_t now_ns) noexcept {
  if (!odometry_.is_valid_imu(imu.gyro_radps, imu.accel_mps2)) {
    ++counters_.imu_invalid;
    return;
  }
  if (imu.stamp_ns > now_ns + params_.max_lead_ns) {  // taken, it would make every later sample a stale one
    ++counters_.imu_future;
    return;
  }
  if (imu_.any && imu.stamp_ns <= imu_.newest.stamp_ns) {
    ++counters_.imu_stale;
    return;
  }
  const ImuSample before = imu_.newest;
  imu_.newest = {imu.stamp_ns, imu_.base_R_imu * imu.gyro_radps, imu_.base_R_imu * imu.accel_mps2};
  if (!known_.has_run) imu_.resting.add(imu_.newest.stamp_ns, imu_.newest.accel_mps2);
  ImuSample since = imu_.newest;
  if (params_.imu_of_moments && imu_.any) {
    since.gyro_radps = 0.5 * (before.gyro_radps + since.gyro_radps);
    since.accel_mps2 = 0.5 * (before.accel_mps2 + since.accel_mps2);
  }
  if (++imu_.new_count > 1) {  // samples come evenly
    const double share = 1.0 / imu_.new_count;
    since.gyro_radps = imu_.mean.gyro_radps + share * (since.gyro_radps - imu_.mean.gyro_radps);
    since.accel_mps2 = imu_.mean.accel_mps2 + share * (since.accel_mps2 - imu_.mean.accel_mps2);
  }
  imu_.mean = since;
  imu_.any = true;
}

void Estimator::add_joints(const JointFeedback& joints, std::int64_t now_ns) noexcept {
  // Until there is an attitude the base counts as upright.
  const Vec3 base_up = state_.odom_T_base.R.row(2).transpose();
  const ImuSample base = imu_.any ? imu_.mean : ImuSample{.accel_mps2 = kGravity_mps2 * base_up};
  if (leg_sensing_.try_take(joints, now_ns + params_.max_lead_ns, base, base_up, stood_)) {
    add_legs(leg_sensing_.legs());
  }
}

void Estimator::add_legs(const LegSample& legs) noexcept { legs_ = {true, true, legs}; }

void Estimator::start(const ContactInEkf::Start& start) noexcept {
  imu_.new_count = 0;
  legs_.fresh = false;
  take_legs({true, true});
  origin_.odom_T_base = {start.odom_R_base, start.odom_p_base_m};
  begin(start);
  publish(newest_input_ns());
  ring_.push(state_);
}

void Estimator::take_legs(const std::array<bool, kFootCount>& planned_stance) noexcept {
  LegSample& sample = legs_.sample;
  if (sample.stated_contact) {
    contacts_.update_stated(*sample.stated_contact, sample.stamp_ns);
  } else {
    contacts_.update(sample.foot_force_n, planned_stance, sample.stamp_ns);
  }
  for (std::size_t i = 0; i < kFootCount; ++i) {
    const FootContact& contact = contacts_.feet()[i];
    if (stood_[i] && !contact.stands) heights_[i] = {};  // lifted: its tread's height is history
    stood_[i] = contact.stands;
  }
  // A robot that is being put down rocks on its soles.
  const bool measured = sample.measured[0] && sample.measured[1];
  if (measured && (state_.initialised || standstill_.collecting())) {
    leg_sensing_.learn_offsets(sample.legs, contacts_.feet(), params_.max_step_s);
  }
}

std::array<FootContact, kFootCount> Estimator::measured_contacts(std::int64_t now_ns, bool new_legs) noexcept {
  alone_ = alone_ || now_ns - stood_ns_ > kAlone_ns;
  std::array<FootContact, kFootCount> known = contacts_.feet();
  const std::array<bool, kFootCount>& heard = legs_.sample.measured;
  for (std::size_t i = 0; i < kFootCount; ++i) alone_ = alone_ && !(heard[i] && known[i].stands);
  for (std::size_t i = 0; i < kFootCount; ++i) {
    FootContact& contact = known[i];
    const bool measured = heard[i] || alone_;
    if (!measured) contact.stands = contact.landed = false;
    if (contact.stands) stood_ns_ = now_ns;
    if (new_legs && measured && !was_measured_[i]) contact.landed = contact.stands;
    if (new_legs) was_measured_[i] = measured;
  }
  return known;
}

bool Estimator::try_begin() noexcept {
  const ProprioceptiveOdometry::Legs& legs = legs_.sample.legs;
  const bool still = standstill_.try_finish(imu_.mean, leg_sensing_.joints(), legs);
  if (counters_.standstill_restarts != standstill_.restarts()) {
    counters_.standstill_restarts = standstill_.restarts();
    odometry_.fusion().reset(params_.fusion, robot_->mounts.base_T_lidar);  // what it averaged was another place
    leg_sensing_.forget_offsets();
  }
  const bool collecting = standstill_.collecting();
  if (collecting) {
    imu_.mount.add(imu_.mean.accel_mps2, leg_sensing_.joints());
  } else {
    imu_.mount.forget();
  }
  known_.runs = known_.runs && (stood_[0] || stood_[1]);
  if (!still && known_.runs && !collecting) return false;

  // Origin: the floor under the base as it stood first, the soles at z = 0 in the mean.
  Transform& odom_T_base = origin_.odom_T_base;
  odom_T_base.p_m.setZero();
  if (!still && !known_.has_run) {
    odom_T_base.R = level_attitude(imu_.resting.mean_mps2());
  } else {
    odom_T_base.R = collecting ? standstill_.odom_R_base() : level_attitude(imu_.mean.accel_mps2);
  }
  const Mat3 base_R_felt = still ? imu_.mount.base_R_felt(*robot_) : Mat3::Identity();
  if (!base_R_felt.isIdentity(0.0)) turn_imu(base_R_felt, odom_T_base.R);
  if (known_.runs) {
    odom_T_base.R = rotation_z(yaw_of(state_.odom_T_base.R)) * odom_T_base.R;
    odom_T_base.p_m.head<2>() = state_.odom_T_base.p_m.head<2>();
  }
  for (const LegMeasurement& leg : legs) {
    odom_T_base.p_m.z() -= (odom_T_base.R * leg.base_T_sole.p_m).z() / kFootCount;
  }
  if (!still && known_.runs) return false;

  heights_.fill({0.0, params_.floor_sigma_m});
  ContactInEkf::Start start;
  start.odom_R_base = odom_T_base.R;
  start.odom_p_base_m = odom_T_base.p_m;
  if (still) {
    start.odom_v_base_mps = rotation_z(yaw_of(odom_T_base.R)) * standstill_.odom_v_base_mps();
    start.gyro_bias_radps = base_R_felt * standstill_.gyro_bias_radps();
    start.gyro_bias_sigma_radps = standstill_.gyro_bias_sigma_radps();
    start.gravity_mps2 = standstill_.gravity_mps2();
    begin(start);
    return true;
  }
  // To balance by, until it has stood still for long enough.
  const bool rested = !known_.has_run && imu_.resting.is_settled();
  if (!rested) start.odom_v_base_mps = odom_T_base.R * base_v_base_mps(legs);
  start.tilt_sigma_rad = rested ? params_.rested_tilt_sigma_rad : params_.first_tilt_sigma_rad;
  start.velocity_sigma_mps = params_.first_velocity_sigma_mps;
  start.gyro_bias_sigma_radps = params_.first_gyro_bias_sigma_radps;
  odometry_.initialise(start, legs, imu_.mean.gyro_radps, imu_.mean.accel_mps2);
  stood_ns_ = newest_input_ns();
  known_.begun = true;
  known_.runs = stood_[0] && stood_[1];
  known_.has_run = known_.has_run || known_.runs;
  return true;
}

// The standstill's attitude, and all samples from this tick's on, as the IMU is found to be mounted.
void Estimator::turn_imu(const Mat3& base_R_felt, Mat3& odom_R_base) noexcept {
  const Mat3 odom_R_felt = odom_R_base;
  odom_R_base = level_attitude(base_R_felt * odom_R_felt.row(2).transpose());
  state_.odom_turned_rad = so3_log(odom_R_base * odom_R_felt.transpose());
  imu_.base_R_imu = base_R_felt * imu_.base_R_imu;
  for (ImuSample* imu : {&imu_.newest, &imu_.mean}) {
    imu->gyro_radps = base_R_felt * imu->gyro_radps;
    imu->accel_mps2 = base_R_felt * imu->accel_mps2;
  }
}

void Estimator::begin(const ContactInEkf::Start& start) noexcept {
  odometry_.initialise(start, legs_.sample.legs, imu_.mean.gyro_radps, imu_.mean.accel_mps2);
  odometry_.fusion().rebase(origin_.odom_T_base);
  origin_.initialised_ns = stood_ns_ = newest_input_ns();
  state_.initialised = known_.ticked = known_.begun = true;
}

void Estimator::publish(std::int64_t now_ns) noexcept {
  state_.stamp_ns = counters_.stamp_ns = quality_.stamp_ns = now_ns;
  state_.oldest_input_ns = std::min(imu_.newest.stamp_ns, legs_.sample.stamp_ns - legs_.sample.silent_ns);
  state_.heard_ns = std::min(imu_.newest.stamp_ns, legs_.sample.stamp_ns);
  if (known_.begun) {
    if (now_ns - stood_ns_ > kAlone_ns) state_.heard_ns = std::min(state_.heard_ns, stood_ns_);
    odometry_.describe(now_ns, state_);
    odometry_.describe(now_ns, quality_);
  } else {
    state_.odom_T_base = origin_.odom_T_base;
  }
  state_.q_rad = leg_sensing_.joints().q_rad;
  for (std::size_t i = 0; i < kFootCount; ++i) {
    state_.odom_T_sole[i] = state_.odom_T_base * legs_.sample.legs[i].base_T_sole;
    state_.contact_probability[i] = contacts_.feet()[i].probability;
    state_.foot_force_sigma_n[i] = legs_.sample.foot_force_sigma_n[i];
  }
}

}  // namespace polygmap
