// SPDX-License-Identifier: Apache-2.0
// The robot under physics (MuJoCo): it balances or falls. Links and masses are the nominal robot's, box soles, drives
// with a PD law and torque limits at 1 kHz, stairs as boxes.
#pragma once

#include <array>
#include <memory>
#include <string>

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
    double armature_kgm2 = 0.05;     // of every drive, seen at the joint
    double torso_mass_scale = 1.0;   // against the mass that the module believes
    double torso_offset_x_m = 0.0;   // of its centre, likewise
    double contact_force_n = 10.0;   // a sole pressed less than this hangs in the air
    double max_tilt_rad = 0.8;       // of the base; beyond it the robot falls,
    double min_base_height_m = 0.3;  // or below this above its higher sole
  };

  // Stands with the middle of the soles below true_T_start (x, y and yaw are used) and the drives at q_rad.
  MujocoPlant(const Params& params, const StairWorld& world, const RobotErrors& errors, const Transform& true_T_start,
              const JointVector& q_rad);
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
  [[nodiscard]] JointVector true_q_rad() const noexcept override { return q_ - errors_.encoder_offset_rad; }
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
  void read_state();
  void read_contacts();
  void check_falls();

  Params params_;
  const RobotErrors& errors_;
  std::unique_ptr<mjModel_, Delete> model_;
  std::unique_ptr<mjData_, Delete> data_;
  std::array<FootState, kFootCount> feet_;
  Transform true_T_base_;
  JointVector q_ = JointVector::Zero(), dq_ = JointVector::Zero(), tau_ = JointVector::Zero();
  std::string fall_reason_;
};

// As its constructor. A program without the physics library has one that refuses.
[[nodiscard]] std::unique_ptr<Plant> make_mujoco_plant(const MujocoPlant::Params& params, const StairWorld& world,
                                                       const RobotErrors& errors, const Transform& true_T_start,
                                                       const JointVector& q_rad);

}  // namespace polygmap::sim
