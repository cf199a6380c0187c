// SPDX-License-Identifier: Apache-2.0
// What the encoders of one leg are off against the other's. Two soles that stand on one floor lie level
// alike, sloping or not; by how much the joints have them tilted against each other is the joints' own, and as likely
// any joint's of an axis as another's. A hip's 2 mrad put the foot 1.5 mm away. What both legs are off by alike is not
// seen here: the mount of the camera takes it up, since it is held against the same soles.
#pragma once

#include <array>

#include "algorithms/estimation/contact/contacts.hpp"
#include "algorithms/estimation/contact/leg_measurement.hpp"

namespace polygmap {

class EncoderOffsets {
 public:
  struct Params {
    double encoder_sigma_rad = 2e-3;
    double level_noise_radprs = 0.5e-3;
    // What ground and sole give way by under an ankle that leans on its sole's edge: known of the simulated floor only.
    // Two ankles that hold 5 Nm inwards each, as they do at the start, tilt the soles by 3 mrad against each other on
    // the simulated floor; on its treads by twice that, so no more is learnt once enough is known: half a second, while
    // the robot stands to be calibrated. Nothing is taken off before: it moves the legs, and what they stand on need
    // not press them flat again.
    double give_radpnm = 0.33e-3;
    double enough_sigma_rad = 0.75e-3;
    double settle_s = 0.1;
    double slew_radps = 5e-3;
    double most_sigmas = 3.0;

    static void visit(auto& p, auto& field) {
      field("encoder_sigma_rad", p.encoder_sigma_rad, 0.0, 0.05, "Offset of one joint's encoder, by its data sheet.");
      field("level_noise_radprs", p.level_noise_radprs, 1e-6, 0.1,
            "Noise of the soles' tilt against each other, after a second: feet rock and ground differs.");
      field("give_radpnm", p.give_radpnm, 0.0, 0.01,
            "Ground and sole give way by this under an ankle that leans on its sole's edge.");
      field("enough_sigma_rad", p.enough_sigma_rad, 1e-5, 0.05,
            "Learning ends when the tilt of the soles against each other is known as well.");
      field("settle_s", p.settle_s, 0.0, 2.0, "Both feet stand for so long before they count as flat.");
      field("slew_radps", p.slew_radps, 1e-4, 0.1, "An offset changes no faster, since it moves the legs.");
      field("most_sigmas", p.most_sigmas, 0.1, 10.0,
            "Soles farther apart than this many sigmas of both legs' joints stand on uneven ground.");
    }
  };
  void reset(const Params& params) noexcept;
  // The robot was moved: what was learnt of where it stood is forgotten, unless it is taken off already.
  void learn_anew() noexcept;
  // One tick. legs: by joints that offset_rad() was taken off, nothing in the beginning. torque_nm: of the joints; what
  // is not finite is taken for none.
  void update(const std::array<LegMeasurement, kFootCount>& legs, const std::array<FootContact, kFootCount>& contacts,
              const JointVector& torque_nm, double dt_s) noexcept;

  // Encoder's reading minus true angle. Changes only while both feet stand.
  [[nodiscard]] const JointVector& offset_rad() const noexcept { return offset_rad_; }
  // Of the left sole's roll and pitch less the right one's.
  [[nodiscard]] Vec2 apart_sigma_rad() const noexcept { return apart_variance_rad2_.cwiseSqrt(); }

 private:
  Params params_;
  JointVector offset_rad_ = JointVector::Zero();
  Vec2 apart_rad_ = Vec2::Zero();  // roll and pitch of the left sole less those of the right one, by the encoders
  Vec2 apart_variance_rad2_ = Vec2::Zero();
  double stood_s_ = 0.0;

  // Of one joint of an axis, left; nothing beyond most_sigmas.
  [[nodiscard]] double share_rad(double apart_rad, std::size_t joints) const noexcept;
};

}  // namespace polygmap
