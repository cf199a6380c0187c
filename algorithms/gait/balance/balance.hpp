// SPDX-License-Identifier: Apache-2.0
// From where the centre of mass should be and where it is to torques of the drives: feedback of the divergent component
// of motion, a ground force through the centre of mass, its split over the standing soles, the legs' statics.
#pragma once

#include "algorithms/gait/balance/dcm_bias.hpp"
#include "algorithms/gait/balance/dcm_stabiliser.hpp"
#include "algorithms/gait/balance/link_motion.hpp"
#include "algorithms/gait/balance/wrench_distribution.hpp"
#include "algorithms/gait/balance/zmp_measurement.hpp"

namespace polygmap {

class Balance {
 public:
  struct Params {
    DcmStabiliser::Params dcm;
    DcmBias::Params bias;
    PressureLimits pressure;
    ZmpMeasurementParams zmp;
    double pressed_n = 60.0;
    std::int32_t bias_ticks = 4;
    double soft_ground_gain = 2.0;

    static void visit(auto& p, auto& field) {
      field("dcm", p.dcm);
      field("bias", p.bias);
      field("pressure", p.pressure);
      field("zmp", p.zmp);
      field("pressed_n", p.pressed_n, 1.0, 500.0,
            "A standing foot that is pressed less says the less of where the plan lies: it hangs and moves.");
      field("bias_ticks", p.bias_ticks, 1, 20, "The bias is observed once in as many ticks, since it is slow.");
      field("soft_ground_gain", p.soft_ground_gain, 1.01, 20.0,
            "`dcm.gain` at most on ground that gives way: it answers late, and at 3 a robot sways that stands there.");
    }
  };
  struct Reference {  // plan frame
    HorizontalMotion com;
    LinkMotion::Acceleration links;
    std::array<Transform, kFootCount> plan_T_sole;
    std::array<bool, kFootCount> stands{true, true};
    std::array<bool, kFootCount> on_toe{};
    bool soft_ground = false;
  };
  struct Body {  // as estimated
    Transform odom_T_base;
    Vec3 odom_v_base_mps = Vec3::Zero();
    Vec3 base_w_base_radps = Vec3::Zero();
    JointVector q_rad = JointVector::Zero();
  };

  void reset() noexcept;
  // Once, before the tick: the body's attitude was corrected by odom_turned_rad since the last one, and what is wrong
  // of the centre of mass has changed with it. Returns by how much, odometry.
  Vec2 turn(const RobotModel& robot, const Body& body, const Vec3& odom_turned_rad) noexcept;
  // One tick. feedback: rates, torques and forces on the feet, as measured. The plan frame is laid on the estimate by
  // the standing soles: an error of the base is what is fed back.
  [[nodiscard]] JointVector torques_nm(const Params& params, const RobotModel& robot, const Reference& reference,
                                       const Body& body, const JointFeedback& feedback, double tick_s) noexcept;
  // Of the last tick, horizontal: the planned centre of mass, and how far ahead of the estimated one, without its bias,
  // it is.
  [[nodiscard]] const Vec2& odom_p_com_planned_m() const noexcept { return odom_p_com_planned_m_; }
  [[nodiscard]] const Vec2& com_error_m() const noexcept { return com_error_m_; }
  // Likewise, how far the divergent component is ahead of its plan.
  [[nodiscard]] const Vec2& dcm_error_m() const noexcept { return stabiliser_.error_m(); }
  // How far the centre of mass is from where body and masses have it: theirs minus the true one.
  [[nodiscard]] const Vec2& odom_com_bias_m() const noexcept { return bias_.odom_bias_m(); }

 private:
  // The body as a pendulum under the reference's motion.
  struct Pendulum {
    Vec3 odom_p_com_m = Vec3::Zero();
    Vec3 odom_v_com_mps = Vec3::Zero();
    double height_m = 1.0;
    double omega_radps = 1.0;
    double vertical_n = 0.0;       // of the ground's force
    Vec2 beside_m = Vec2::Zero();  // by which the ground's force passes beside the centre of mass
  };
  // Frames of both legs, as the body has them.
  [[nodiscard]] static Pendulum pendulum_of(const MassModel& masses, const BodyFrames& frames, const Body& body,
                                            const JointVector& dq_radps, const PerLink& links_mps2,
                                            double ground_m) noexcept;
  void observe_bias(const Params& params, const RobotModel& robot, const Body& body, const JointFeedback& feedback,
                    const Support& support, const Pendulum& pendulum, double tick_s) noexcept;
  // Of both legs, when the ground gives that force where it is pressed.
  [[nodiscard]] static JointVector leg_torques(const MassModel& masses, const BodyFrames& frames,
                                               const PerLink& links_mps2, const Mat3& odom_R_base,
                                               const Support& support, const Pressure& pressure,
                                               const Vec3& force_n) noexcept;

  DcmStabiliser stabiliser_;
  DcmBias bias_;
  int bias_tick_ = 0;
  std::array<double, kFootCount> share_{0.5, 0.5};
  Vec2 odom_p_com_planned_m_ = Vec2::Zero();
  Vec2 com_error_m_ = Vec2::Zero();
  Vec2 slope_ = Vec2::Zero();  // of the ground's force asked for
};

}  // namespace polygmap
