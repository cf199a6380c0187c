// SPDX-License-Identifier: Apache-2.0
// The robot's body and what it stands on, as the simulation sees it. Two of them: kinematic_plant.hpp, without
// dynamics, and mujoco_plant.hpp, under physics. The module cannot tell them apart.
#pragma once

#include <limits>
#include <string>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap::sim {

enum class PlantKind : std::uint8_t { kKinematic, kMujoco };
[[nodiscard]] inline std::string name_of(PlantKind kind) { return kind == PlantKind::kMujoco ? "mujoco" : "kinematic"; }

inline constexpr double kPlantTick_s = 0.002;

// Of the torso's centre, evenly over its duration, true axes.
struct Push {
  static constexpr double kDuration_s = 0.1;
  double at_s = 0.0;
  int axis = 0;  // 0: x, 1: y
  double impulse_ns = 0.0;
};

// Angles of the drives are as their encoders read them; the true angle is that minus the encoder's offset.
class Plant {
 public:
  Plant() = default;
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;
  virtual ~Plant() = default;

  // One tick under the drives' command.
  virtual void step(const JointCommand& command) = 0;

  [[nodiscard]] virtual const Transform& true_T_base() const noexcept = 0;
  [[nodiscard]] virtual const Transform& true_T_sole(std::size_t foot) const noexcept = 0;
  [[nodiscard]] virtual bool in_contact(std::size_t foot) const noexcept = 0;
  [[nodiscard]] virtual int step_index(std::size_t foot) const noexcept = 0;       // under a standing sole; -1: floor
  [[nodiscard]] virtual double foot_force_n(std::size_t foot) const noexcept = 0;  // vertical
  [[nodiscard]] virtual double load_share(std::size_t foot) const noexcept = 0;    // of the weight, sums to 1
  [[nodiscard]] virtual double closure_error_m() const noexcept = 0;  // the two standing legs disagree about the base
  [[nodiscard]] virtual const JointVector& drive_q_rad() const noexcept = 0;
  [[nodiscard]] virtual const JointVector& drive_dq_radps() const noexcept = 0;
  [[nodiscard]] virtual const JointVector& drive_tau_nm() const noexcept = 0;
  // A drive gives all that it has at its speed, and is asked for more.
  [[nodiscard]] virtual bool torque_limited() const noexcept { return false; }
  [[nodiscard]] virtual JointVector true_q_rad() const noexcept = 0;
  // Under physics only: NaN without, and no push moves it. The margin: centre of pressure to the edge of the contact
  // rectangle of a sole that stands alone, NaN on two.
  [[nodiscard]] virtual Vec3 true_p_com_m() const noexcept { return Vec3::Constant(kNoPhysics); }
  [[nodiscard]] virtual double zmp_margin_m() const noexcept { return kNoPhysics; }
  virtual void push(const Vec3& /*force_n*/) noexcept {}
  [[nodiscard]] virtual const std::string& fall_reason() const noexcept = 0;  // empty while it stands
  [[nodiscard]] bool fell() const noexcept { return !fall_reason().empty(); }

 private:
  static constexpr double kNoPhysics = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace polygmap::sim
