// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/plant/mujoco_plant.hpp"

#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "algorithms/robot/leg_kinematics.hpp"
#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/plant/mujoco_model.hpp"
#include "sim_stub/world/clearance.hpp"

namespace polygmap::sim {
namespace {

constexpr int kPhysicsSteps = 2;  // per tick
constexpr double kPhysicsStep_s = 0.001;

mjModel* compile(const std::string& xml) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  constexpr const char* kName = "biped.xml";
  mj_makeEmptyFileVFS(files.get(), kName, static_cast<int>(xml.size()));
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), kName)], xml.data(), xml.size());
  std::array<char, 512> error{};
  mjModel* model = mj_loadXML(kName, files.get(), error.data(), static_cast<int>(error.size()));
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(std::string("MuJoCo does not take the model: ") + error.data());
  return model;
}

Transform pose(const mjData& data, int body) {
  const auto i = static_cast<std::ptrdiff_t>(body);
  const mjtNum* p = data.xpos + 3 * i;
  return {Mat3(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.xmat + 9 * i)),
          Vec3{p[0], p[1], p[2]}};
}

// A drive's frame has no more bits: what is beyond its range arrives as the range's end.
JointCommand within_limits(const MujocoPlant::Params& params, const JointCommand& command) {
  const auto within = [](double gain, double most) { return most > 0.0 && gain > most ? most : gain; };
  JointCommand taken = command;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    JointSetpoint& joint = taken.joints[n];
    joint.kp_nmprad = within(joint.kp_nmprad, params.kp_most_nmprad[n % kJointsPerLeg]);
    joint.kd_nmsprad = within(joint.kd_nmsprad, params.kd_most_nmsprad[n % kJointsPerLeg]);
  }
  return taken;
}

}  // namespace

void MujocoPlant::Delete::operator()(mjModel* model) const noexcept { mj_deleteModel(model); }
void MujocoPlant::Delete::operator()(mjData* data) const noexcept { mj_deleteData(data); }

MujocoPlant::MujocoPlant(const Params& params, const StairWorld& world, const RobotErrors& errors,
                         const Transform& true_T_start, const JointVector& q_rad, double ground_m)
    : params_(params), errors_(errors), model_(compile(mujoco_model(params, world, errors))) {
  data_.reset(mj_makeData(model_.get()));
  feet_[0].body = mj_name2id(model_.get(), mjOBJ_BODY, "left_6");
  feet_[1].body = mj_name2id(model_.get(), mjOBJ_BODY, "right_6");
  for (std::size_t j = 0; j < kJointCount; ++j) {
    const int joint = mj_name2id(model_.get(), mjOBJ_JOINT, ("drive_" + std::to_string(j)).c_str());
    q_at_[j] = model_->jnt_qposadr[joint];
    v_at_[j] = model_->jnt_dofadr[joint];
  }

  // Upright, the lower sole on what it starts on.
  const JointVector true_q = q_rad - errors.encoder_offset_rad;
  double drop_m = 0.0;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    drop_m = std::min(drop_m, base_T_sole(errors.legs[index_of(leg)], leg, leg_joints(true_q, leg)).p_m.z());
  }
  const double yaw = yaw_of(true_T_start.R);
  const Vec3 p_m{true_T_start.p_m.x(), true_T_start.p_m.y(), ground_m - drop_m};
  for (int a = 0; a < 3; ++a) data_->qpos[a] = p_m[a];
  data_->qpos[3] = std::cos(0.5 * yaw);
  data_->qpos[6] = std::sin(0.5 * yaw);
  for (std::size_t j = 0; j < kJointCount; ++j) data_->qpos[q_at_[j]] = true_q[static_cast<Eigen::Index>(j)];
  mj_forward(model_.get(), data_.get());
  read_state();
}

MujocoPlant::~MujocoPlant() = default;

// A motor's voltage has to make up for its speed and for its winding's resistance to the current: another supply shifts
// the line and leaves it as steep. Braking, speed helps. Written without the module's own function.
double MujocoPlant::saturated_nm(std::size_t joint, double asked_nm, double dq_radps) const noexcept {
  const JointLimits& sheet = nominal_robot().drives.limits[joint];
  const double per_speed_nms = sheet.torque_nm / std::max(sheet.no_load_radps - sheet.corner_radps, 1e-3);
  const double no_load_radps = params_.no_load_scale * sheet.no_load_radps;
  const double along_radps = asked_nm < 0.0 ? -dq_radps : dq_radps;
  const double most_nm = math::clamp(per_speed_nms * (no_load_radps - along_radps), 0.0, sheet.torque_nm);
  return math::clamp(asked_nm, -most_nm, most_nm);
}

void MujocoPlant::step(const JointCommand& newest) {
  commands_.push_overwrite(within_limits(params_, newest));
  const auto late = static_cast<std::size_t>(std::lround(params_.command_delay_s / kPlantTick_s));
  const JointCommand& command = commands_[commands_.size() - 1 - std::min(late, commands_.size() - 1)];
  const double follows = params_.torque_lag_s > 0.0 ? -std::expm1(-kPhysicsStep_s / params_.torque_lag_s) : 1.0;
  torque_limited_ = false;
  for (int k = 0; k < kPhysicsSteps; ++k) {
    for (std::size_t j = 0; j < kJointCount; ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      const JointSetpoint& set = command.joints[j];
      const double q = data_->qpos[q_at_[j]] + errors_.encoder_offset_rad[i];
      const double dq = data_->qvel[v_at_[j]];
      const double asked_nm = set.tau_ff_nm + set.kp_nmprad * (set.q_rad - q) + set.kd_nmsprad * (set.dq_radps - dq);
      if (!std::isfinite(asked_nm) && fall_reason_.empty()) {
        fall_reason_ = "The command of joint " + std::to_string(j) + " is not finite.";
      }
      const double given_nm = saturated_nm(j, asked_nm, dq);
      tau_[i] = follows == 1.0 ? given_nm : saturated_nm(j, tau_[i] + follows * (given_nm - tau_[i]), dq);
      // A drive that lags comes near its limit, never to it.
      constexpr double kAtLimit = 0.999;
      torque_limited_ = torque_limited_ || (given_nm != asked_nm && std::abs(tau_[i]) >= kAtLimit * std::abs(given_nm));
      data_->qfrc_applied[v_at_[j]] = params_.torque_scale * tau_[i];
    }
    mj_step(model_.get(), data_.get());
  }
  read_contacts();
  mj_kinematics(model_.get(), data_.get());  // mj_step leaves poses one step behind
  mj_comPos(model_.get(), data_.get());
  read_state();
  check_falls();
}

void MujocoPlant::push(const Vec3& force_n) noexcept {
  mjtNum* applied = data_->xfrc_applied + 6 * mj_name2id(model_.get(), mjOBJ_BODY, "base");
  for (int a = 0; a < 3; ++a) applied[a] = force_n[a];
}

void MujocoPlant::read_state() {
  true_T_base_ = pose(*data_, mj_name2id(model_.get(), mjOBJ_BODY, "base"));
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const Transform ankle_T_sole{Mat3::Identity(), Vec3{0, 0, -errors_.legs[f].ankle_to_sole_m}};
    feet_[f].true_T_sole = pose(*data_, feet_[f].body) * ankle_T_sole;
  }
  for (std::size_t j = 0; j < kJointCount; ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    q_[i] = data_->qpos[q_at_[j]] + errors_.encoder_offset_rad[i];
    dq_[i] = data_->qvel[v_at_[j]];
    link_q_[i] = q_[i] - errors_.encoder_offset_rad[i];
    if (params_.backlash_rad > 0.0) link_q_[i] += data_->qpos[q_at_[j] + 1];
  }
}

void MujocoPlant::read_contacts() {
  std::array<double, kFootCount> strongest_n{};
  for (FootState& foot : feet_) {
    foot.force_n = foot.carried_n = 0.0;
    foot.pressure_nm.setZero();
  }
  for (int c = 0; c < data_->ncon; ++c) {
    const mjContact& contact = data_->contact[c];
    if (model_->geom_bodyid[contact.geom1] != 0 && model_->geom_bodyid[contact.geom2] != 0) continue;  // leg on leg
    for (std::size_t f = 0; f < kFootCount; ++f) {
      const bool first = model_->geom_bodyid[contact.geom1] == feet_[f].body;
      if (!first && model_->geom_bodyid[contact.geom2] != feet_[f].body) continue;
      std::array<mjtNum, 6> wrench{};  // in the contact's axes, its first the normal from geom1 to geom2
      mj_contactForce(model_.get(), data_.get(), c, wrench.data());
      double up_n = 0.0;
      for (std::size_t a = 0; a < 3; ++a) up_n += contact.frame[3 * a + 2] * wrench[a];
      if (first) up_n = -up_n;
      feet_[f].force_n += up_n;
      feet_[f].pressure_nm += up_n * Vec3{contact.pos[0], contact.pos[1], contact.pos[2]};
      // A riser that a toe scrapes along is felt too, but nothing stands on it.
      constexpr double kLevel = 0.7;  // cosine
      if (std::abs(contact.frame[2]) < kLevel) continue;
      feet_[f].carried_n += up_n;
      if (up_n <= strongest_n[f]) continue;
      strongest_n[f] = up_n;
      const int ground = first ? contact.geom2 : contact.geom1;
      feet_[f].step = model_->geom_type[ground] == mjGEOM_PLANE
                          ? kFloorStep
                          : static_cast<int>(model_->geom_user[ground * model_->nuser_geom]);
    }
  }
}

void MujocoPlant::check_falls() {
  if (fell()) return;
  const double tilt_rad = std::acos(math::clamp(true_T_base_.R(2, 2), -1.0, 1.0));
  const double height_m = true_T_base_.p_m.z() - std::max(feet_[0].true_T_sole.p_m.z(), feet_[1].true_T_sole.p_m.z());
  std::array<char, 128> text{};
  if (!(tilt_rad <= params_.max_tilt_rad)) {
    std::snprintf(text.data(), text.size(), "The base tilted by %.0f degrees.", tilt_rad * 180.0 / kPi);
  } else if (!(height_m >= params_.min_base_height_m)) {
    std::snprintf(text.data(), text.size(), "The base sank to %.3f m above the feet.", height_m);
  }
  fall_reason_ = text.data();
}

double MujocoPlant::load_share(std::size_t foot) const noexcept {
  const double both_n = feet_[0].force_n + feet_[1].force_n;
  return both_n > 0.0 ? feet_[foot].force_n / both_n : 0.5;
}

double MujocoPlant::zmp_margin_m() const noexcept {
  if (in_contact(0) == in_contact(1)) return Plant::zmp_margin_m();
  const FootState& foot = feet_[in_contact(0) ? 0 : 1];
  const Vec3 local_m = foot.true_T_sole.inverse() * Vec3(foot.pressure_nm / foot.force_n);
  const SoleRectangle& sole = errors_.sole.contact;
  return std::min({local_m.x() - sole.heel_x_m, sole.toe_x_m - local_m.x(), sole.half_width_m - std::abs(local_m.y())});
}

double MujocoPlant::total_mass_kg() const noexcept { return mj_getTotalmass(model_.get()); }

Vec3 MujocoPlant::true_p_com_m() const noexcept {
  const mjtNum* p = data_->subtree_com;  // of the world: everything that moves
  return {p[0], p[1], p[2]};
}

std::unique_ptr<Plant> make_mujoco_plant(const MujocoPlant::Params& params, const StairWorld& world,
                                         const RobotErrors& errors, const Transform& true_T_start,
                                         const JointVector& q_rad, double ground_m) {
  return std::make_unique<MujocoPlant>(params, world, errors, true_T_start, q_rad, ground_m);
}

}  // namespace polygmap::sim
