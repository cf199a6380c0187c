// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/sim_robot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim_stub/camera/counter_noise.hpp"
#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

// The data sheet's robot standing upright; the real one, with its offsets and lengths, stands almost so.
JointVector standing_q_rad() {
  JointVector q;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const NominalStance& stance = nominal_robot().stance;
    const Transform sole{Mat3::Identity(), Vec3{0, side_sign(foot) * stance.half_width_m, -stance.base_height_m}};
    q.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(foot, 0))) =
        solve_leg(nominal_robot().legs, foot, sole).q_rad;
  }
  return q;
}

// As stiff as its drives can be, up to what the robot is held with.
StandController stand_controller(const MujocoPlant::Params& params) {
  constexpr double kKdPerKp_s = 0.02;
  const auto within = [](double gain, double most) { return most > 0.0 ? std::min(gain, most) : gain; };
  StandController::Gains gains;
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    gains.kp_nmprad[j] = within(params.holder_kp_nmprad, params.kp_most_nmprad[j]);
    gains.kd_nmsprad[j] = within(kKdPerKp_s * gains.kp_nmprad[j], params.kd_most_nmsprad[j]);
  }
  return {standing_q_rad(), gains};
}

bool asks_something(const JointCommand& command) {
  return std::ranges::any_of(command.joints, [](const JointSetpoint& joint) {
    return joint.kp_nmprad != 0.0 || joint.kd_nmsprad != 0.0 || joint.tau_ff_nm != 0.0;
  });
}

LegShapes leg_shapes(const RobotErrors& errors, Foot leg, const JointVector& q_rad) {
  RobotModel robot = nominal_robot();
  robot.legs = errors.legs[index_of(leg)];
  robot.sole = errors.sole;
  return base_leg_shapes(robot, leg, leg_joints(q_rad, leg));
}

Transform start_transform(const StartPose& start) {
  return {rotation_z(start.yaw_rad), Vec3{-start.distance_m, start.lateral_m, nominal_robot().stance.base_height_m}};
}

std::unique_ptr<Plant> make_plant(const SimOptions& options, const StairWorld& stairs, const RobotErrors& errors,
                                  const StartPose& start, StandController& holder) {
  if (options.plant_kind == PlantKind::kMujoco) {
    auto plant =
        make_mujoco_plant(options.mujoco, stairs, errors, start_transform(start), standing_q_rad(), start.height_m);
    constexpr int kSettle_ticks = 1000;  // it has stood there for a while
    for (int i = 0; i < kSettle_ticks; ++i) plant->step(holder.command(*plant));
    return plant;
  }
  return std::make_unique<KinematicPlant>(options.plant, stairs, errors, start_transform(start), standing_q_rad());
}

}  // namespace

StartPose draw_start(std::uint64_t seed) {
  const CounterNoise noise(seed, Stream::kStart);
  constexpr double kYaw_rad = 10.0 * kPi / 180.0;
  return {noise.uniform(0, 0.35, 0.8), noise.uniform(1, -0.15, 0.15), noise.uniform(2, -kYaw_rad, kYaw_rad)};
}

SimRobot::SimRobot(const SimOptions& options)
    : stairs_(options.world ? *options.world : make_stairs(options.stairs, options.seed, options.stair_errors)),
      start_(options.start.value_or(draw_start(options.seed))),
      error_params_(options.errors),
      errors_(draw_errors(options.errors, options.seed)),
      pushes_(options.pushes),
      holder_(stand_controller(options.mujoco)),
      plant_(make_plant(options, stairs_, errors_, start_, holder_)),
      camera_(options.camera,
              {.kind = options.noise,
               .sigma = options.depth_sigma,
               .scale = errors_.depth_scale,
               .strength = options.errors.depth_noise},
              options.intrinsics, errors_.base_T_camera, stairs_, options.seed),
      imu_(error_params_, errors_, options.seed, plant_->true_T_base()),
      imu_interval_(options.imu_interval_ns, VirtualClock::kTick_ns),
      joints_(error_params_, options.seed),
      forces_(error_params_, options.seed),
      torques_(error_params_, options.seed),
      force_sensors_(options.force_sensors),
      lio_(error_params_, errors_, options.seed) {
  sense();
}

void SimRobot::advance() {
  clock_.advance();
  if (!pushes_.empty()) plant_->push(push_force_n());
  plant_->step(active_ ? *active_ : holder_.command(*plant_));
  if (command_ && (active_ || asks_something(*command_))) active_ = command_;
  sense();
}

void SimRobot::hold_again() {
  holder_.meet(feedback_.q_rad);
  active_.reset();
  command_.reset();
}

Vec3 SimRobot::push_force_n() const {
  Vec3 force_n = Vec3::Zero();
  for (const Push& push : pushes_) {
    const std::int64_t since_ns = clock_.now_ns() - std::llround(push.at_s * kNsPerS);
    if (since_ns < 0 || since_ns >= std::llround(Push::kDuration_s * kNsPerS)) continue;
    force_n[push.axis] += push.impulse_ns / Push::kDuration_s;
  }
  return force_n;
}

void SimRobot::sense() {
  update_truth();
  const std::int64_t now_ns = clock_.now_ns();
  ImuSample felt;
  if (imu_interval_.push(imu_.sample(plant_->true_T_base(), now_ns, kPlantTick_s), felt)) {
    imu_queue_.push_overwrite(felt);
  }
  feedback_ = joints_.sample(plant_->drive_q_rad(), plant_->drive_dq_radps(), now_ns, kPlantTick_s);
  feedback_.tau_nm = torques_.sample(plant_->drive_tau_nm(), plant_->drive_dq_radps());
  feedback_.foot_force_n = forces_.sample({plant_->foot_force_n(0), plant_->foot_force_n(1)},
                                          {truth_.true_T_sole[0].p_m.z(), truth_.true_T_sole[1].p_m.z()}, kPlantTick_s);
  if (!force_sensors_) feedback_.foot_force_n.fill(std::numeric_limits<double>::quiet_NaN());
  feedback_fresh_ = true;
  if (clock_.tick() % kLioPeriod_ticks == 0 && !lio_.is_out(now_ns)) {
    lio_queue_.push_overwrite(lio_.sample(plant_->true_T_base(), now_ns));
  }
  camera_.tick(clock_.tick(), truth_.true_T_base, truth_.base_legs);
}

void SimRobot::update_truth() {
  truth_.stamp_ns = clock_.now_ns();
  truth_.true_T_base = plant_->true_T_base();
  const JointVector q = plant_->true_q_rad();
  truth_.base_legs = {leg_shapes(errors_, Foot::kLeft, q), leg_shapes(errors_, Foot::kRight, q)};
  for (std::size_t f = 0; f < kFootCount; ++f) {
    truth_.true_T_sole[f] = plant_->true_T_sole(f);
    truth_.in_contact[f] = plant_->in_contact(f);
    truth_.load_share[f] = plant_->load_share(f);
    truth_.step_index[f] = plant_->step_index(f);
  }
  truth_.true_p_com_m = plant_->true_p_com_m();
  truth_.zmp_margin_m = plant_->zmp_margin_m();
  truth_.drive_tau_nm = plant_->drive_tau_nm();
  truth_.torque_limited = plant_->torque_limited();
  truth_.drive_dq_radps = plant_->drive_dq_radps();
  truth_.closure_error_m = plant_->closure_error_m();
  truth_.fell = plant_->fell();
  truth_.fall_reason = plant_->fall_reason();
}

bool SimRobot::try_read(JointFeedback& feedback) noexcept {
  if (!feedback_fresh_) return false;
  feedback = feedback_;
  feedback_fresh_ = false;
  return true;
}

JointSet SimRobot::try_write(const JointCommand& command) noexcept {
  command_ = command;
  return JointSet::all();
}

bool SimRobot::try_read(LioSample& sample) noexcept {
  const double taken_s = error_params_.lio_delay_s - error_params_.lio_stamp_s;  // by its stamp
  if (lio_queue_.empty() || clock_.now_ns() - lio_queue_.oldest().stamp_ns < std::llround(taken_s * kNsPerS))
    return false;
  return lio_queue_.try_pop(sample);
}

}  // namespace polygmap::sim
