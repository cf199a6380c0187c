// SPDX-License-Identifier: Apache-2.0
// How the camera really sits on the base: roll, pitch and height, found slowly from the ground that the robot stands
// on, and how far ahead, from the toes that it sees. A mount is known to a degree at best, and a degree is 13 mm at the
// camera's height. What one leg is off ahead of the other is found by their toes, too. Yaw and the place sideways stay
// as the data sheet says.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/perception/extrinsics/toe_detector.hpp"

namespace polygmap {

class CameraExtrinsicsEstimator {
 public:
  // What the data sheet says of the mount: one sigma each.
  struct PriorParams {
    double tilt_sigma_rad = 0.0175;
    double height_sigma_m = 0.005;
    double x_sigma_m = 0.003;
    double toe_sigma_m = 0.003;
    double legs_apart_sigma_m = 0.0025;  // 2 mrad of each encoder at hips and knees, 0.8 and 0.4 m above the sole

    static void visit(auto& p, auto& field) {
      field("tilt_sigma_rad", p.tilt_sigma_rad, 1e-5, 0.2, "Roll and pitch of the mount, by the data sheet.");
      field("height_sigma_m", p.height_sigma_m, 1e-5, 0.1, "Height of the mount, by the data sheet.");
      field("x_sigma_m", p.x_sigma_m, 1e-5, 0.1,
            "The mount's place ahead by the data sheet, and where encoders and leg lengths have both feet.");
      field("toe_sigma_m", p.toe_sigma_m, 1e-5, 0.1, "Length of both feet ahead of the ankle, by the data sheet.");
      field("legs_apart_sigma_m", p.legs_apart_sigma_m, 1e-5, 0.1,
            "Where encoders and leg lengths have one foot ahead of the other.");
    }
  };
  struct Params {
    // Of one frame. Far more than the pixels' noise: frames err alike, and one frame must not decide.
    double frame_tilt_sigma_rad = 0.03;
    double frame_height_sigma_m = 0.010;
    double frame_x_sigma_m = 0.003;
    // What all frames err by alike, which no number of them takes away: soles are as level as their encoders have it (2
    // mrad a joint), gravity as the IMU's mount and bias. With what the surfaces err by, in 24 climbs, from 1 to 10 s
    // after the first frame, 2.5 mrad with white noise and 3.0 with correlated, roll and pitch together.
    double soles_tilt_sigma_rad = 0.0023;
    double gravity_tilt_sigma_rad = 0.006;
    // Information fades to 1/e, slower under surfaces that see level worse; time without any does not count.
    double window_s = 6.0;
    double max_tilt_rad = 2.0 * kPi / 180.0;  // bounds of the estimate
    double max_height_m = 0.008;
    double max_x_m = 0.010;
    double half_scan_s = 0.008;
    double tilt_gate_rad = 3.0 * kPi / 180.0;  // from level, as the mount is believed: more is a ramp
    double height_gate_m = 0.020;
    double max_tilt_sigma_rad = 0.006;
    // Of a surface, added to its sigma. Those below 2 mrad err by 1.0 to 1.5, vaguer ones by what they say, and the
    // same in every frame: with 3 mrad three treads ahead, 8 mrad off, outvoted the floor (seed 64).
    double systematic_tilt_rad = 0.001;
    // Of a surface that no sole stands on, against the one that they do: every tread of a flight slopes by itself, and
    // those that vary evenly by 2 degrees have this sigma.
    double treads_tilt_rad = 0.02;
    double max_sole_tilt_rad = 5.0 * kPi / 180.0;  // from gravity: more, and the foot does not stand flat
    double longest_step_s = 0.1;
    double frames_alike = 20.0;
    ToeDetectorParams toe;
    PriorParams prior;

    static void visit(auto& p, auto& field) {
      field("frame_tilt_sigma_rad", p.frame_tilt_sigma_rad, 1e-4, 1.0, "Tilt that one frame sees.");
      field("frame_height_sigma_m", p.frame_height_sigma_m, 1e-4, 1.0, "Height that one frame sees.");
      field("frame_x_sigma_m", p.frame_x_sigma_m, 1e-4, 1.0, "Place ahead that one frame sees.");
      field("soles_tilt_sigma_rad", p.soles_tilt_sigma_rad, 1e-5, 0.1,
            "Tilt of the soles by their encoders, in all frames alike.");
      field("gravity_tilt_sigma_rad", p.gravity_tilt_sigma_rad, 1e-5, 0.1,
            "Tilt of gravity by the IMU's mount and bias, in all frames alike.");
      field("window_s", p.window_s, 0.1, 1000.0,
            "Information fades to 1/e in this time, more slowly under surfaces that see level worse; time without any "
            "does not count.");
      field("max_tilt_rad", p.max_tilt_rad, 0.0, 0.2, "Roll and pitch are believed up to this.");
      field("max_height_m", p.max_height_m, 0.0, 0.1, "Height is believed up to this far from the data sheet's.");
      field("max_x_m", p.max_x_m, 0.0, 0.1, "Place ahead is believed up to this far from the data sheet's.");
      field("half_scan_s", p.half_scan_s, 0.0, 0.1,
            "A row of the picture is older or newer than its stamp by up to this.");
      field("tilt_gate_rad", p.tilt_gate_rad, 0.001, 0.5,
            "A surface farther from level, as the mount is believed, is a ramp.");
      field("height_gate_m", p.height_gate_m, 0.001, 0.02,
            "A surface farther from the soles' height is another one: at most half of the least step, 40 mm.");
      field("max_tilt_sigma_rad", p.max_tilt_sigma_rad, 1e-4, 1.0,
            "Vaguer surfaces say only what gravity told the fit before.");
      field("systematic_tilt_rad", p.systematic_tilt_rad, 1e-5, 0.1,
            "A surface's tilt errs by this besides its sigma.");
      field("treads_tilt_rad", p.treads_tilt_rad, 1e-5, 0.2,
            "A surface that no sole stands on slopes by this against the one that they stand on.");
      field("max_sole_tilt_rad", p.max_sole_tilt_rad, 0.001, 0.5,
            "A foot tilted farther from gravity does not stand flat.");
      field("longest_step_s", p.longest_step_s, 0.001, 10.0, "What was learnt fades by no more from frame to frame.");
      field("frames_alike", p.frames_alike, 1.0, 1000.0,
            "As many frames in a row see a toe from a base that moves the same way, and err alike.");
      field("toe", p.toe);
      field("prior", p.prior);
    }
  };
  // The robot at the exposure, base frame.
  struct Stance {
    Vec3 base_up = Vec3::UnitZ();  // by gravity, unit
    std::array<Transform, kFootCount> base_T_sole;
    std::array<bool, kFootCount> stands{};
    // By how much a toe is seen ahead of where base_T_sole and base_T_camera() have it; of standing feet.
    std::array<std::optional<ToeSighting>, kFootCount> toes;
    double speed_mps = 0.0;  // of the base
  };
  struct Counters {
    std::uint32_t frames = 0;             // that said something about the tilt
    std::uint32_t heights = 0;            // ... about the height
    std::uint32_t toes = 0;               // ... about how far ahead it sits
    std::uint32_t rejected_frames = 0;    // stance not finite, or not newer than the last frame
    std::uint32_t rejected_surfaces = 0;  // level ones: not finite, or beyond the gate
  };

  CameraExtrinsicsEstimator() noexcept : CameraExtrinsicsEstimator(Params{}, Transform{}) {}
  CameraExtrinsicsEstimator(const Params& params, const Transform& nominal_base_T_camera) noexcept;

  // One finished frame, seen through the mount as believed when it was begun.
  void update(const SurfaceFrame& frame, const Stance& stance) noexcept;

  [[nodiscard]] const Transform& base_T_camera() const noexcept { return base_T_camera_; }
  // What was added to the data sheet's mount.
  [[nodiscard]] double roll_rad() const noexcept { return tilt_rad_.x(); }
  [[nodiscard]] double pitch_rad() const noexcept { return tilt_rad_.y(); }
  [[nodiscard]] double height_m() const noexcept { return height_m_; }
  // Along the ground. What both legs and their encoders are off goes into it, since a foot put down by them is to meet
  // what the camera saw; of what a foot is longer than its data sheet as little as the prior lets.
  [[nodiscard]] double x_m() const noexcept { return x_m_; }
  // By how much each foot truly stands ahead of where the encoders have it, beside what both do: as much the other way.
  [[nodiscard]] const std::array<double, kFootCount>& feet_ahead_m() const noexcept { return feet_ahead_m_; }
  // One sigma of roll and pitch: what of the data sheet's error is left, and what frames err by alike: the surfaces
  // that were seen, and what told which way is up.
  [[nodiscard]] double tilt_sigma_rad() const noexcept;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  // A mean whose information fades, drawn towards zero by the prior.
  template <typename T>
  struct FadingMean {
    double information = 0.0;
    T weighted;
  };
  // Puts one value of a frame into a mean; its variance, the prior's information included.
  template <typename T>
  [[nodiscard]] static double fuse(FadingMean<T>& mean, const T& value, double fade, double information,
                                   double prior_sigma) noexcept {
    mean.information = fade * mean.information + information;
    mean.weighted = fade * mean.weighted + information * value;
    return 1.0 / (mean.information + 1.0 / math::square(prior_sigma));
  }
  // Level as that frame had it, by standing soles or, flat being none, by gravity.
  struct Level {
    Vec3 up;                               // of them all
    std::array<Vec3, kFootCount> sole_up;  // of the flat ones
    std::array<bool, kFootCount> flat{};
    [[nodiscard]] bool by_soles() const noexcept { return flat[0] || flat[1]; }
  };
  [[nodiscard]] Level level_of(const Stance& stance) const noexcept;
  [[nodiscard]] static bool usable(const SurfacePatch& patch) noexcept;
  [[nodiscard]] bool says_level(const SurfacePatch& patch) const noexcept;
  [[nodiscard]] bool near_level(const SurfacePatch& patch, const Vec3& up) const noexcept;
  // False when no surface says anything.
  [[nodiscard]] bool try_learn_tilt(const SurfaceFrame& frame, const Stance& stance, const Level& level,
                                    double dt_s) noexcept;
  void learn_height(const SurfaceFrame& frame, const Stance& stance, const Level& level, double dt_s) noexcept;
  [[nodiscard]] Vec3 camera_p_sole(const Stance& stance, std::size_t foot) const noexcept;
  // What a surface is parallel to, and how far it may slope against that: the soles that stand on it, if any do.
  struct Parallel {
    Vec3 up;
    double sigma_rad;
  };
  [[nodiscard]] Parallel parallel_of(const SurfacePatch& patch, const Level& level,
                                     const std::array<Vec3, kFootCount>& camera_p_soles) const noexcept;
  // By how much a sole seems to lie above the surface, and whether that can be what it stands on.
  [[nodiscard]] bool stands_on(const SurfacePatch& patch, const Vec3& camera_p_sole, double& above_m) const noexcept;
  // How far a sole lies above the largest surface that can be what it stands on; false when there is none.
  [[nodiscard]] bool try_height(const SurfaceFrame& frame, const Vec3& camera_p_sole, const Vec3& up,
                                double& height_m) const noexcept;
  void learn_x(const Stance& stance, double dt_s) noexcept;
  void place_x() noexcept;
  void place(const Vec3& base_level) noexcept;

  Params params_;
  Transform nominal_;
  Transform base_T_camera_;
  Vec2 tilt_rad_ = Vec2::Zero();
  double height_m_ = 0.0;
  double x_m_ = 0.0;
  FadingMean<Vec2> tilt_{0.0, Vec2::Zero()};
  FadingMean<double> height_{0.0, 0.0};
  // By each foot's toe, the place ahead that a camera without any tilt of its own would have, and the height above the
  // toe, by which a tilt changes that place.
  struct ToeMean {
    double information = 0.0, weighted_m = 0.0, weighted_above_m = 0.0;
  };
  std::array<ToeMean, kFootCount> toes_{};
  double above_toes_m_ = 0.0;  // at the last sighting
  std::array<double, kFootCount> feet_ahead_m_{};
  double seen_as_well_ = 0.0;  // 1/rad^2, of level by its surfaces: mean of the frames that the tilt is made of
  double by_gravity_ = 0.0;    // share of that information whose level was gravity's
  std::int64_t last_ns_ = 0;
  Counters counters_;
};

}  // namespace polygmap
