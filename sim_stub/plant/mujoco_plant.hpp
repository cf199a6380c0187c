// SPDX-License-Identifier: Apache-2.0
// The robot under physics (MuJoCo): it balances or falls. Links and masses are the nominal robot's, box soles, drives
// with a PD law and torque limits at 1 kHz, stairs as boxes.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "sim_stub/plant/plant.hpp"
#include "sim_stub/sensors/robot_errors.hpp"
#include "sim_stub/world/stair_world.hpp"

struct mjModel_;
struct mjData_;

namespace polygmap::sim {

class MujocoPlant final : public Plant {
 public:
  struct Params {
    double friction = 0.8;
    double ground_s = 0.008;         // time constant of a contact: the longer, the softer
    double armature_kgm2 = 0.05;     // of every drive, seen at the joint
    double joint_friction_nm = 0.0;  // Coulomb, that the leg feels
    double joint_damping_nmsprad = 0.0;
    double backlash_rad = 0.0;     // play between drive and link, from end to end
    double torque_scale = 1.0;     // what a drive gives of what it is asked
    double no_load_scale = 1.0;    // speed without a load over the data sheet's, as its supply's voltage is
    double torque_lag_s = 0.0;     // time constant
    double command_delay_s = 0.0;  // beyond the bus
    // Of either leg's drives, what a command's encoding ends at; 0: nowhere.
    std::array<double, kJointsPerLeg> kp_most_nmprad{}, kd_most_nmsprad{};
    double torso_mass_scale = 1.0;  // against the mass that the module believes
    double torso_offset_x_m = 0.0, torso_offset_y_m = 0.0, torso_offset_z_m = 0.0;  // of its centre, likewise
    double leg_mass_scale = 1.0;     // of every link of the legs, likewise
    double inertia_scale = 1.0;      // of every link about its centre, likewise
    double holder_kp_nmprad = 2000;  // of the drives of whoever holds the robot before the module and after it
    double contact_force_n = 10.0;   // a sole pressed less than this hangs in the air
    double max_tilt_rad = 0.8;       // of the base; beyond it the robot falls,
    double min_base_height_m = 0.3;  // or below this above its higher sole

    static void visit(auto& p, auto& field) {
      field("friction", p.friction, 0.05, 2.0, "Of the soles on the ground.");
      field("ground_s", p.ground_s, 0.002, 0.1, "Time constant of a contact: the longer, the softer.");
      field("armature_kgm2", p.armature_kgm2, 0.001, 1.0, "Of every drive, seen at the joint.");
      field("joint_friction_nm", p.joint_friction_nm, 0.0, 30.0, "Coulomb friction of a joint, which the leg feels.");
      field("joint_damping_nmsprad", p.joint_damping_nmsprad, 0.0, 20.0, "Viscous friction of a joint.");
      field("backlash_rad", p.backlash_rad, 0.0, 0.05, "Play between drive and link, from end to end.");
      field("torque_scale", p.torque_scale, 0.3, 2.0, "What a drive gives of what it is asked.");
      field("no_load_scale", p.no_load_scale, 0.3, 3.0,
            "Speed of the drives without a load over the data sheet's; the torque that is left falls as steeply.");
      field("torque_lag_s", p.torque_lag_s, 0.0, 0.05, "Time constant of a drive's torque.");
      field("command_delay_s", p.command_delay_s, 0.0, 0.05, "Of a command beyond the bus, in whole ticks of 2 ms.");
      field("kp_most_nmprad", p.kp_most_nmprad, 0.0, 10000.0,
            "A drive takes no more stiffness, from hip roll to ankle roll; 0: as much as it is told.");
      field("kd_most_nmsprad", p.kd_most_nmsprad, 0.0, 1000.0,
            "A drive takes no more damping, from hip roll to ankle roll; 0: as much as it is told.");
      field("torso_mass_scale", p.torso_mass_scale, 0.3, 3.0, "True mass of the torso over the believed one.");
      field("torso_offset_x_m", p.torso_offset_x_m, -0.2, 0.2, "By which the torso's centre lies ahead.");
      field("torso_offset_y_m", p.torso_offset_y_m, -0.2, 0.2, "By which the torso's centre lies to the left.");
      field("torso_offset_z_m", p.torso_offset_z_m, -0.2, 0.2, "By which the torso's centre lies higher.");
      field("inertia_scale", p.inertia_scale, 0.3, 3.0, "True inertias of the links about their centres.");
      field("holder_kp_nmprad", p.holder_kp_nmprad, 150.0, 10000.0,
            "Stiffness with which the robot is held before the module speaks and after it is silent.");
      field("leg_mass_scale", p.leg_mass_scale, 0.3, 3.0, "True masses of the legs' links over the believed ones.");
    }
  };

  // Stands with the middle of the soles below true_T_start (x, y and yaw are used), at the height of the
  // ground there, and the drives at q_rad.
  MujocoPlant(const Params& params, const StairWorld& world, const RobotErrors& errors, const Transform& true_T_start,
              const JointVector& q_rad, double ground_m = 0.0);
  ~MujocoPlant() override;

  // Two steps of 1 ms. It goes on after a fall: what falls, falls.
  void step(const JointCommand& command) override;
  // A force on the torso's centre, true axes, until it is changed.
  void push(const Vec3& force_n) noexcept override;

  [[nodiscard]] const Transform& true_T_base() const noexcept override { return true_T_base_; }
  [[nodiscard]] const Transform& true_T_sole(std::size_t f) const noexcept override { return feet_[f].true_T_sole; }
  [[nodiscard]] bool in_contact(std::size_t f) const noexcept override {
    return feet_[f].carried_n > params_.contact_force_n;
  }
  [[nodiscard]] int step_index(std::size_t f) const noexcept override { return feet_[f].step; }
  [[nodiscard]] double foot_force_n(std::size_t f) const noexcept override { return feet_[f].force_n; }
  [[nodiscard]] double load_share(std::size_t foot) const noexcept override;
  [[nodiscard]] double closure_error_m() const noexcept override { return 0.0; }
  [[nodiscard]] const JointVector& drive_q_rad() const noexcept override { return q_; }
  [[nodiscard]] const JointVector& drive_dq_radps() const noexcept override { return dq_; }
  [[nodiscard]] const JointVector& drive_tau_nm() const noexcept override { return tau_; }
  [[nodiscard]] bool torque_limited() const noexcept override { return torque_limited_; }
  [[nodiscard]] JointVector true_q_rad() const noexcept override { return link_q_; }
  [[nodiscard]] const std::string& fall_reason() const noexcept override { return fall_reason_; }

  [[nodiscard]] double total_mass_kg() const noexcept;
  [[nodiscard]] Vec3 true_p_com_m() const noexcept override;
  [[nodiscard]] double zmp_margin_m() const noexcept override;

 private:
  struct Delete {
    void operator()(mjModel_* model) const noexcept;
    void operator()(mjData_* data) const noexcept;
  };
  struct FootState {
    Transform true_T_sole;
    double force_n = 0.0;             // vertical, as a sensor feels it; what of it
    double carried_n = 0.0;           // presses on something level
    Vec3 pressure_nm = Vec3::Zero();  // places of contacts times their forces, true axes
    int step = -1;
    int body = -1;
  };
  [[nodiscard]] double saturated_nm(std::size_t joint, double asked_nm, double dq_radps) const noexcept;
  void read_state();
  void read_contacts();
  void check_falls();

  Params params_;
  const RobotErrors& errors_;
  std::unique_ptr<mjModel_, Delete> model_;
  std::unique_ptr<mjData_, Delete> data_;
  std::array<FootState, kFootCount> feet_;
  Transform true_T_base_;
  std::array<int, kJointCount> q_at_{}, v_at_{};  // of the drives, among the physics' coordinates and rates
  JointVector q_ = JointVector::Zero(), dq_ = JointVector::Zero(), tau_ = JointVector::Zero();
  JointVector link_q_ = JointVector::Zero();  // with the play
  RingBuffer<JointCommand, 32> commands_;     // newest last
  bool torque_limited_ = false;
  std::string fall_reason_;
};

// As its constructor. A program without the physics library has one that refuses.
[[nodiscard]] std::unique_ptr<Plant> make_mujoco_plant(const MujocoPlant::Params& params, const StairWorld& world,
                                                       const RobotErrors& errors, const Transform& true_T_start,
                                                       const JointVector& q_rad, double ground_m = 0.0);

}  // namespace polygmap::sim
