// SPDX-License-Identifier: Apache-2.0
// Eqs (5)-(10): lidar-inertial odometry (LIO) corrects the drift of the odometry, without ever making it jump.
//
// Printed, eq. (6) has no memory: with dt = 2 ms and tau = 4 s LIO would weigh 0.05 % and drift would stay. Read
// recursively it low-passes the offset between the two; done at the stamp of the LIO pose. Done at its arrival, 100 ms
// later, the world of a climb with perfect sensors was 5.8 mm off at worst instead of 0.3 mm (the test of a late LIO in
// lio_fusion_test.cpp).
#pragma once

#include <cstdint>
#include <limits>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/estimation/calibration/noise_level.hpp"
#include "algorithms/estimation/lidar/lio_uncertainty.hpp"
#include "algorithms/estimation/lidar/mount_heading.hpp"
#include "algorithms/estimation/quality/innovation.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

// Where LIO's world lies in ours, from one body's pose in both. Both know which way is up, LIO by an IMU of its own:
// the tie is a heading and a place. A tie that took over what the odometry's tilt was off by, 10 to 20 mrad where a
// robot sways at the start, would tilt the world that LIO is there to keep level (40 mm on ten stairs, 2026-11).
[[nodiscard]] Transform tied_level(const Transform& world_T_body, const Transform& lio_T_body) noexcept;
// Eq. (5): the base in LIO's world, through the lidar's mount.
[[nodiscard]] Transform base_from_lidar(const Transform& lio_T_lidar, const Transform& base_T_lidar) noexcept;
// Eq. (9): 1 - alpha.
[[nodiscard]] double complementary_gain(double dt_s, double tau_s) noexcept;
// Eqs (6)-(8), (10): from the odometry's pose a share `gain` of the way to LIO's.
[[nodiscard]] Transform fuse_pose(const Transform& world_T_base, const Transform& lio_world_T_base,
                                  double gain) noexcept;

enum class LioVerdict : std::uint8_t {
  kAccepted,
  kNonFinite,
  kNotRotation,
  kCovariance,  // a stated sigma is negative, not finite or absurd
  kOrder,       // not newer than the last one
  kFuture,      // stamped later than now
  kTooOld,      // older than max_age_s
  kNoOdometry,  // none known at its stamp: earlier than the standstill at the start, or a sensor was silent
  kJump,        // too far from the prediction
  kRealigned,   // moved nothing: a first pose that its successor contradicts, or a lasting jump, made LIO's world anew
  kOutOfRange,  // finite, but farther off than any LIO goes
};
inline constexpr std::size_t kLioVerdictCount = 11;

// How far accepted LIO poses lay from their predictions, once aligned.
struct LioInnovations {
  LioUncertainty::Quantities last = LioUncertainty::Quantities::Zero();  // x, y, z in m, yaw in rad, world axes
  InnovationStatistics position, yaw;
};

class LioFusion {
 public:
  // Whose drift an offset between the odometry and LIO is.
  struct Drift {
    double most_ratio = 7.0;
    double trusted_ratio = 0.5;
    double way_share = 0.0075;

    static void visit(auto& p, auto& field) {
      field("most_ratio", p.most_ratio, 0.0, 1e6,
            "Where the squares of the offset, of place and heading, over their variances add up to more, it is lidar "
            "odometry that drifts: honest ones have part of the error in common, and stay below.");
      field("trusted_ratio", p.trusted_ratio, 0.0, 1e6,
            "Then, until the sum is below this, the odometry is moved by this over the sum of the offset.");
      field("way_share", p.way_share, 0.0, 0.1,
            "Of its way by which the odometry may be off along it, in that variance: legs are longer than thought.");
      field.ordered("trusted_ratio", "most_ratio");
    }
  };
  // How fast the published pose moves towards the fused one.
  struct Slew {
    double speed_mps = 0.1;
    double turn_radps = 0.175;
    double most_s = 0.01;

    static void visit(auto& p, auto& field) {
      field("speed_mps", p.speed_mps, 0.001, 10.0, "The fused pose moves no faster: 0.2 mm in a tick of 2 ms.");
      field("turn_radps", p.turn_radps, 0.001, 10.0, "The fused pose turns no faster: 0.02 degrees in a tick.");
      field("most_s", p.most_s, 0.001, 1.0, "A longer tick moves it no farther than one of these: 1 mm.");
    }
  };
  struct Params {
    double max_age_s = 0.4;
    double tau_s = 4.0;
    double tau_spm = 0.0;
    double max_gap_s = 1.0;
    // Where samples state 0: measured from one pose to the next, and until then these.
    NoiseLevel::Params unstated_position_m{0.01, 0.5, 10.0, 1e-3, 0.3};
    NoiseLevel::Params unstated_rotation_rad{0.0035, 0.5, 10.0, 2e-4, 0.2};
    double max_position_sigma_m = 0.3;
    double max_rotation_sigma_rad = 0.2;
    double jump_m = 0.08;
    double jump_growth_mps = 0.02;
    double jump_rad = 0.06;
    double jump_growth_radps = 0.004;
    double max_jump_m = 0.5;
    double max_jump_rad = 0.3;
    Drift drift;
    MountHeading::Params mount;
    std::uint32_t realign_count = 20;
    Slew slew;
    LioUncertainty::Params uncertainty;

    static void visit(auto& p, auto& field) {
      field("max_age_s", p.max_age_s, 0.0, 0.5, "A pose is no older on arrival; the history of states holds 0.5 s.");
      field("tau_s", p.tau_s, 0.0, 1000.0,
            "Time constant of the offset's low-pass at least: of a LIO of 10 mm at 10 Hz, 2.2 mm come through 4 s.");
      field("tau_spm", p.tau_spm, 0.0, 1e5,
            "Time constant of the low-pass for each metre of LIO's sigma, where that is more than tau_s.");
      field("max_gap_s", p.max_gap_s, 0.002, 100.0,
            "Longest time that one pose stands for, so that after a silence no single one decides.");
      field("unstated_position_m", p.unstated_position_m);
      field("unstated_rotation_rad", p.unstated_rotation_rad);
      field("max_position_sigma_m", p.max_position_sigma_m, 1e-4, 100.0, "A pose that states more is refused.");
      field("max_rotation_sigma_rad", p.max_rotation_sigma_rad, 1e-4, 3.2, "A pose that states more is refused.");
      field("jump_m", p.jump_m, 0.001, 10.0, "A pose farther from its prediction is a jump, at full rate.");
      field("jump_growth_mps", p.jump_growth_mps, 0.0, 10.0,
            "The bound grows by this for each second of silence, as odometry drifts.");
      field("jump_rad", p.jump_rad, 0.001, 3.2, "A pose turned farther from its prediction is a jump, at full rate.");
      field("jump_growth_radps", p.jump_growth_radps, 0.0, 3.2,
            "The bound of turns grows by this for each second of silence.");
      field("max_jump_m", p.max_jump_m, 0.001, 100.0, "A pose farther off is a jump however long the silence.");
      field("max_jump_rad", p.max_jump_rad, 0.001, 3.2, "A pose turned farther is a jump however long the silence.");
      field("drift", p.drift);
      field("mount", p.mount);
      field("realign_count", p.realign_count, 1, 1000000,
            "Jumped poses in a row that agree among themselves are LIO's new world after as many.");
      field("slew", p.slew);
      field("uncertainty", p.uncertainty);
    }
  };
  void reset(const Params& params, const Transform& base_T_lidar) noexcept;

  // What can be said of a pose by itself: kAccepted or the reason against it.
  [[nodiscard]] LioVerdict check(const LioSample& sample, std::int64_t now_ns) const noexcept;
  // odom_T_base: at the sample's stamp. Call only after check.
  [[nodiscard]] LioVerdict fuse(const LioSample& sample, const Transform& odom_T_base) noexcept;
  // The odometry chooses its origin: what was old_p is now new_T_old * old_p. The world follows.
  void rebase(const Transform& new_T_old) noexcept;

  // Variances that the odometry's own filter has of x, y, z besides what the heading does, and of yaw: at its start,
  // and before every tick.
  void begin(const LioUncertainty::Quantities& odometry) noexcept {
    uncertainty_.begin(odometry);
    untied_.begin(odometry);
  }
  void follow(const LioUncertainty::Quantities& odometry) noexcept {
    uncertainty_.follow(odometry);
    untied_.follow(odometry);
  }
  // Once per tick: moves the published offset towards the fused one within the slew limits, which hold at the base,
  // wherever odom's origin is; lets the sigmas grow. odom_step: by which the odometry moved the base since the last.
  void tick(const Transform& odom_T_base, const Vec3& odom_step_m, double dt_s) noexcept;
  [[nodiscard]] const Transform& world_T_odom() const noexcept { return world_T_odom_; }
  // Of the published pose, world axes; what the slew limit still holds back counts as error.
  [[nodiscard]] const Vec3& position_sigma_m() const noexcept { return sigmas_.position_m; }
  [[nodiscard]] double yaw_sigma_rad() const noexcept { return sigmas_.yaw_rad; }
  struct LioSigmas {
    double position_m, rotation_rad;  // of the base
  };
  [[nodiscard]] LioSigmas sigmas_of(const LioSample& sample) const noexcept;
  [[nodiscard]] const Transform& base_T_lidar() const noexcept { return base_T_lidar_; }
  [[nodiscard]] bool aligned() const noexcept { return aligned_; }  // until then the fused pose is the odometry's
  [[nodiscard]] const LioInnovations& innovations() const noexcept { return innovations_; }
  [[nodiscard]] std::int64_t last_accepted_ns() const noexcept { return last_accepted_ns_; }  // -1: none

 private:
  [[nodiscard]] bool is_jump(const Transform& predicted, const Transform& measured, double silence_s) const noexcept;
  [[nodiscard]] bool try_realign(const Transform& lio_T_base, const Transform& odom_T_base,
                                 const LioSigmas& sigmas) noexcept;
  // A pose whose tilt is not the odometry's cannot be tied to it by any heading and place.
  [[nodiscard]] bool is_tilted(const Transform& world_T_base, const Transform& lio_T_base) const noexcept;
  // A pose of the base, and variances of its place and heading.
  struct PoseBelief {
    Transform world_T_odom, world_T_base;
    LioUncertainty::Quantities variance;
  };
  [[nodiscard]] PoseBelief by_legs(const Transform& odom_T_base) const noexcept;
  // By LIO, without what the heading of its mount bends.
  [[nodiscard]] PoseBelief by_lidar(const Transform& odom_T_base) const noexcept;
  // Of both: says whose drift the offset between them is, once per tick.
  [[nodiscard]] PoseBelief believed(const Transform& odom_T_base) noexcept;
  // Of the published pose: a tie that was contradicted, and that no second pose confirmed, says nothing.
  [[nodiscard]] const LioUncertainty& known() const noexcept {
    return !aligned_ && first_contradicted_ && count_ <= 1 ? untied_ : uncertainty_;
  }
  // The odometry moves by next to nothing against LIO from one pose to the next: what is left is LIO's noise, twice.
  void measure_noise(const Transform& lio_T_base, const Transform& odom_T_base, double silence_s) noexcept;
  void observe(const Transform& predicted, const Transform& measured, const LioSigmas& sigmas,
               std::int64_t stamp_ns) noexcept;
  void align(const Transform& predicted, const Transform& lio_T_base, const LioSigmas& sigmas, double gain) noexcept;
  void tie(const PoseBelief& now, const LioSigmas& sigmas, std::uint32_t poses) noexcept;

  Params params_;
  Transform base_T_lidar_;
  // LIO's world is not ours. The first poses say where it lies, while world is odom: each by its weight against the
  // drift since the first. Once that is no more than eq. (9)'s gain the tie stays and odom moves as it drifts.
  Transform world_T_lio_;
  bool aligned_ = false;
  bool first_contradicted_ = false;  // the first pose was before a second one agreed: that happens once
  std::uint32_t count_ = 0;          // poses averaged into the alignment
  Transform fused_world_T_odom_;     // towards which the published one moves
  Transform world_T_odom_;           // published
  Transform last_lio_T_odom_;        // by the last accepted pose alone
  struct {
    NoiseLevel position_m, rotation_rad;
  } noise_;  // as it is measured
  struct {
    Transform lio_T_odom;
    std::uint32_t count = 0;
  } jumped_;  // the mean of poses that agree among themselves
  std::int64_t last_stamp_ns_ = std::numeric_limits<std::int64_t>::min();  // of any pose that was in order
  std::int64_t last_accepted_ns_ = -1;
  std::int64_t last_used_ns_ = -1;  // accepted or realigned: since then LIO was silent
  LioUncertainty uncertainty_;
  LioUncertainty untied_;  // as if there were no LIO
  MountHeading mount_;
  struct {
    Vec3 odom_p_first_m = Vec3::Zero();  // of the base, at the first pose
    bool lio_drifts = false;             // it is LIO that is off
  } offset_;
  struct {
    Vec3 position_m = Vec3::Zero();
    double yaw_rad = 0.0;
  } sigmas_;  // of the published pose
  LioInnovations innovations_;
};

}  // namespace polygmap
