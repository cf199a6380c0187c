// SPDX-License-Identifier: Apache-2.0
// How much a foot that stands moves all the same: it settles when it has landed, creeps and rolls while the body moves
// over it, and gives way when it is unloaded. As densities, so that the rate of samples does not matter.
//
// The constants were chosen on the three logs of docs/measured/estimation.md, the bedding on a log of iCub that sways
// on two planted feet (com-sinusoid of ami-iit's base estimation). The rocking of a sole that rests was chosen on the
// logs of simulated climbs with play in the joints (--reality 1, seeds 201 to 208) and on those of iCub; over soft
// ground, with about a twentieth of it, the robot of seed 32, twice as bad as real ones, lost its tilt and fell.
#pragma once

#include <algorithm>

#include "algorithms/core/math/math.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

class StanceWalk {
 public:
  struct Params {
    double contact_mprs = 6e-3;
    double contact_rs = 4e-3;
    double full_mps = 0.1;
    double bedding_s = 2.0;
    double bedded_share = 0.5;
    double least_mprs = 3e-4;
    double point_mprs = 0.015;
    double point_rs = 0.018;
    double landing_mprs = 6e-3;
    double landing_s = 0.05;
    double unloading_mprs = 7e-3;
    double unloading_s = 0.3;
    double vertical_share = 0.4;
    double sole_radprs = 2.4e-3;
    double sole_radpmrs = 2e-3;
    double sole_yaw_radprs = 3e-4;
    double sole_yaw_radpmrs = 16e-3;

    static void visit(auto& p, auto& field) {
      field("contact_mprs", p.contact_mprs, 1e-6, 1.0, "The place of a sole that stands creeps like this.");
      field("contact_rs", p.contact_rs, 0.0, 1.0, "And so much more for each m/s of the base's.");
      field("full_mps", p.full_mps, 0.001, 2.0,
            "A foot creeps less where the base moves more slowly, turning included.");
      field("bedding_s", p.bedding_s, 0.01, 1e6,
            "And less once it has stood for this time, in inverse proportion: it has bedded in.");
      field("bedded_share", p.bedded_share, 0.0, 1.0, "Bedded in, it creeps by this share of that, at least.");
      field("least_mprs", p.least_mprs, 1e-6, 0.1, "But it creeps like this at least.");
      field("point_mprs", p.point_mprs, 1e-6, 1.0,
            "A foot that is known as a point rolls: its place creeps like this.");
      field("point_rs", p.point_rs, 0.0, 1.0, "And so much more for each m/s of the base's.");
      field("landing_mprs", p.landing_mprs, 0.0, 1.0, "A foot that has just landed settles like this.");
      field("landing_s", p.landing_s, 1e-3, 10.0, "That fades away in this time.");
      field("unloading_mprs", p.unloading_mprs, 0.0, 1.0,
            "A foot gives way like this while the weight goes over to the other one, which has landed.");
      field("unloading_s", p.unloading_s, 0.0, 10.0, "That takes so long.");
      field("vertical_share", p.vertical_share, 0.01, 1.0, "Up and down a contact walks by this share of it.");
      field("sole_radprs", p.sole_radprs, 1e-7, 1.0, "A sole that stands rocks like this where the base is at rest.");
      field("sole_radpmrs", p.sole_radpmrs, 0.0, 1.0, "And so much more for each m/s of the base's.");
      field("sole_yaw_radprs", p.sole_yaw_radprs, 1e-7, 1.0, "About the vertical it turns like this.");
      field("sole_yaw_radpmrs", p.sole_yaw_radpmrs, 0.0, 1.0, "And so much more for each m/s of the base's.");
    }
  };
  void reset(const Params& params) noexcept {
    *this = StanceWalk{};
    params_ = params;
    age_s_.fill(params.unloading_s);
  }
  // One step. stands: since the step before.
  void update(const std::array<bool, kFootCount>& stands, double dt_s) noexcept {
    stands_ = stands;
    for (std::size_t foot = 0; foot < kFootCount; ++foot) age_s_[foot] = stands[foot] ? age_s_[foot] + dt_s : 0.0;
  }
  [[nodiscard]] bool stands(std::size_t foot) const noexcept { return stands_[foot]; }
  [[nodiscard]] double age_s(std::size_t foot) const noexcept { return age_s_[foot]; }

  // Variances of a second, of a contact that stands and of its sole's rotation. speed: of the base, turning included.
  [[nodiscard]] Vec3 contact_m2ps(std::size_t foot, bool sole_known, double speed_m2ps2) const noexcept {
    const double at_rest_mprs = sole_known ? params_.contact_mprs : params_.point_mprs;
    const double moving_rs = sole_known ? params_.contact_rs : params_.point_rs;
    const double bedded = std::max(params_.bedding_s / std::max(age_s_[foot], params_.bedding_s), params_.bedded_share);
    const double pace = bedded * std::min(math::sqrt(speed_m2ps2) / params_.full_mps, 1.0);
    const double creep_mprs = std::max(pace * at_rest_mprs, params_.least_mprs);
    double walk_m2ps = math::square(creep_mprs) + math::square(bedded * moving_rs) * speed_m2ps2 +
                       math::square(params_.landing_mprs) * math::exp(-age_s_[foot] / params_.landing_s);
    const std::size_t witness = 1 - foot;
    const bool unloads = stands_[witness] && age_s_[witness] < std::min(params_.unloading_s, age_s_[foot]);
    if (unloads) walk_m2ps += math::square(params_.unloading_mprs);
    return {walk_m2ps, walk_m2ps, walk_m2ps * math::square(params_.vertical_share)};
  }
  [[nodiscard]] Vec3 sole_rad2ps(double speed_m2ps2) const noexcept {
    const double rock_rad2ps = math::square(params_.sole_radprs) + math::square(params_.sole_radpmrs) * speed_m2ps2;
    const double turn_rad2ps =
        math::square(params_.sole_yaw_radprs) + math::square(params_.sole_yaw_radpmrs) * speed_m2ps2;
    return {rock_rad2ps, rock_rad2ps, turn_rad2ps};
  }

 private:
  Params params_;
  std::array<double, kFootCount> age_s_{};
  std::array<bool, kFootCount> stands_{};
};

}  // namespace polygmap
